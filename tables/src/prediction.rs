//! What comes next in a text of rows: the rows that followed an earlier place like this one.
//!
//! The derivation treats all bodies and loops of a sheet alike. So rows are in the order of the derivation, and the row after
//! those that occurred before, with operands as far back, is predicted to be the row that came then. Only what is not as
//! predicted takes more than a fraction of a digit.

use crate::arithmetic_code::{Chance, Code};
use crate::kind::{NUMBER, OUTPUT, SINE_COSINE, fields, operands};
use crate::rows::Row;

/// Number of kinds, with the one that ends a function.
const KINDS: usize = 32;

/// The kind that ends a function.
pub const END: usize = KINDS - 1;

/// How many rows must be alike for a place to be alike, the most first.
const CONTEXTS: [usize; 5] = [24, 12, 6, 4, 2];

/// Operands farther back than this are alike.
const FAR: usize = 64;

/// Bits of an index of places.
const PLACES: u32 = 18;

/// Distances between an operand and the predicted one that were found last.
const SHIFTS: usize = 10;

/// Rows predicted one after the other count up to this.
const LONGEST: usize = 15;

/// Bits of a number whose chances are kept.
const LEADING: u32 = 4;

/// Bits of a number at most.
const BITS: usize = 32;

/// Chances of one context of numbers: its length, then its leading bits.
const NUMBER_CHANCES: usize = BITS + (BITS << LEADING);

/// Distances by which predicted fields were wrong, the last first.
type Shifts = [i64; SHIFTS];

/// What is known of the rows so far.
pub struct Prediction {
    rows: Vec<Row>,
    /// Values before each row.
    before: Vec<usize>,
    /// Of each row, what must be alike.
    traits: Vec<u64>,
    /// By context: rows by what precedes them.
    places: Vec<Vec<u32>>,
    /// The row that is predicted to come again.
    expected: Option<usize>,
    /// Rows that came as expected, one after the other.
    run: usize,
    /// Values so far, and those of the functions before.
    values: usize,
    first: usize,
    next_number: usize,
    operand_shifts: Shifts,
    other_shifts: Shifts,
    same: [Chance; LONGEST + 1],
    kinds: Vec<Chance>,
    hits: Vec<Chance>,
    numbers: Vec<Chance>,
}

impl Prediction {
    pub fn new() -> Self {
        let chances = |count| vec![Chance::default(); count];
        Self {
            rows: Vec::new(),
            before: Vec::new(),
            traits: Vec::new(),
            places: vec![vec![u32::MAX; 1 << PLACES]; CONTEXTS.len()],
            expected: None,
            run: 0,
            values: 0,
            first: 0,
            next_number: 0,
            operand_shifts: [0; SHIFTS],
            other_shifts: [0; SHIFTS],
            same: [Chance::default(); LONGEST + 1],
            kinds: chances(KINDS * KINDS),
            hits: chances(KINDS * (LONGEST + 1) * 4 * (SHIFTS + 1) * 3),
            numbers: chances(2 * KINDS * 3 * NUMBER_CHANCES),
        }
    }

    /// Writes a row, or reads it and ignores the argument. Values are numbered from the beginning of their function.
    pub fn row(&mut self, code: &mut impl Code, row: Row) -> Row {
        let expected = self.expected.map(|at| (self.rows[at], self.before[at]));
        let kind = self.kind(code, expected.map(|(row, _)| row.kind), row.kind);
        let like = expected.filter(|(row, _)| row.kind == kind);
        let mut found = Row { kind, fields: [0; 3] };
        let mut hits = 0;
        for field in 0..if kind == END { 0 } else { fields(kind) } {
            let is_operand = field < operands(kind);
            let given = row.fields[field] + if is_operand { self.first } else { 0 };
            let was = like.map(|(row, before)| (row.fields[field], before));
            let (value, hit) = self.field(code, (kind, field, hits), was, given);
            hits = 2 * hits + usize::from(!hit);
            found.fields[field] = value;
        }
        self.run = match like.is_some() && hits == 0 {
            true => self.run + 1,
            false => self.run / 4,
        };
        self.enter(found, like.is_some() && hits == 0);
        if kind == END {
            (self.first, self.next_number) = (self.values, 0);
            return found;
        }
        let mut row = found;
        let operands = &mut row.fields[..operands(kind)];
        operands.iter_mut().for_each(|value| *value = value.wrapping_sub(self.first));
        row
    }

    fn context(&self) -> usize {
        self.run.min(LONGEST)
    }

    fn kind(&mut self, code: &mut impl Code, expected: Option<usize>, kind: usize) -> usize {
        if let Some(expected) = expected {
            let context = self.context();
            if code.decide(&mut self.same[context], expected == kind) {
                return expected;
            }
        }
        let last = self.rows.last().map_or(0, |row| row.kind);
        let chances = &mut self.kinds[last * KINDS..][..KINDS];
        let mut node = 1;
        for bit in (0..KINDS.ilog2()).rev() {
            node = 2 * node + usize::from(code.decide(&mut chances[node], kind >> bit & 1 == 1));
        }
        node - KINDS
    }

    /// A field, where `was` is the same field of the expected row with the values before that; and whether it was
    /// predicted.
    fn field(
        &mut self,
        code: &mut impl Code,
        (kind, field, missed): (usize, usize, usize),
        was: Option<(usize, usize)>,
        given: usize,
    ) -> (usize, bool) {
        let is_operand = field < operands(kind);
        let context = self.context();
        let mut candidates = [0; SHIFTS + 1];
        let mut count = 0;
        if let Some((was, before)) = was {
            let moved = (self.values - before) as i64;
            let shifts = if is_operand { &self.operand_shifts } else { &self.other_shifts };
            for shift in is_operand.then_some(&moved).into_iter().chain(shifts) {
                let candidate = was as i64 + shift;
                let is_value = (self.first as i64..self.values as i64).contains(&candidate);
                let is_new = !candidates[..count].contains(&candidate);
                if is_new && candidate >= 0 && (is_value || !is_operand) {
                    candidates[count] = candidate;
                    count += 1;
                }
            }
        }
        let place = ((kind * (LONGEST + 1) + context) * 4 + missed) * (SHIFTS + 1);
        let hit = (0..count).find(|rank| {
            let chance = &mut self.hits[(place + rank) * 3 + field];
            code.decide(chance, candidates[*rank] == given as i64)
        });
        let value = match hit {
            Some(rank) => candidates[rank] as usize,
            None => self.unexpected(code, kind, field, given),
        };
        if let Some((was, before)) = was {
            let shift = value as i64 - was as i64;
            let moved = (self.values - before) as i64;
            let shifts = if is_operand { &mut self.operand_shifts } else { &mut self.other_shifts };
            if !is_operand || shift != moved {
                let at = shifts.iter().position(|&known| known == shift).unwrap_or(SHIFTS - 1);
                shifts[..=at].rotate_right(1);
                shifts[0] = shift;
            }
        }
        if kind == NUMBER {
            self.next_number = value + 1;
        }
        (value, hit.is_some())
    }

    /// A field that was not predicted: operands by their distance, numbers of the model by that from the one before.
    fn unexpected(
        &mut self,
        code: &mut impl Code,
        kind: usize,
        field: usize,
        given: usize,
    ) -> usize {
        let is_operand = field < operands(kind);
        let context = (kind * 3 + field) * 2 + usize::from(is_operand);
        if is_operand {
            let last = self.values.wrapping_sub(1);
            return last.wrapping_sub(self.number(code, context, last.wrapping_sub(given)));
        }
        if kind == NUMBER {
            let next = self.next_number;
            let change = if given >= next { 2 * (given - next) } else { 2 * (next - given) - 1 };
            let change = self.number(code, context, change);
            let size = change.div_ceil(2);
            return if change.is_multiple_of(2) { next + size } else { next.saturating_sub(size) };
        }
        self.number(code, context, given)
    }

    /// A number by its length and its bits (P. Elias, "Universal codeword sets and representations of the integers", 1975).
    fn number(&mut self, code: &mut impl Code, context: usize, number: usize) -> usize {
        let chances = &mut self.numbers[context * NUMBER_CHANCES..][..NUMBER_CHANCES];
        let length = (number.wrapping_add(1)).checked_ilog2().unwrap_or(0) as usize;
        let mut bits = 0;
        while bits < BITS - 1 && code.decide(&mut chances[bits], bits < length) {
            bits += 1;
        }
        let (mut read, mut node) = (1_usize, 1);
        for bit in (0..bits as u32).rev() {
            let yes = number.wrapping_add(1) >> bit & 1 == 1;
            let leading = bits as u32 - 1 - bit < LEADING;
            let mut even = Chance::default();
            let chance = match leading {
                true => &mut chances[BITS + (bits << LEADING) + node],
                false => &mut even,
            };
            let yes = code.decide(chance, yes);
            read = 2 * read + usize::from(yes);
            node = 2 * node + usize::from(yes);
        }
        read - 1
    }

    /// Notes a row, and looks for what comes after it.
    fn enter(&mut self, row: Row, as_expected: bool) {
        let mut alike = mix(row.kind as u64, 1);
        for &operand in &row.fields[..if row.kind == END { 0 } else { operands(row.kind) }] {
            alike = mix(alike, self.values.wrapping_sub(operand).min(FAR) as u64);
        }
        let at = self.rows.len();
        self.rows.push(row);
        self.before.push(self.values);
        self.traits.push(alike);
        self.values += match row.kind {
            SINE_COSINE => 2,
            kind if kind < OUTPUT => 1,
            _ => 0,
        };
        let mut next = self.expected.map(|at| at + 1);
        let (mut hash, mut rows, mut found) = (0, 0, None);
        let mut keys = [0; CONTEXTS.len()];
        for (key, &context) in keys.iter_mut().zip(&CONTEXTS).rev() {
            while rows < context {
                let past = at.checked_sub(rows).map_or(0, |at| self.traits[at]);
                hash = mix(hash, past);
                rows += 1;
            }
            *key = (hash >> (64 - PLACES)) as usize;
        }
        for (places, &key) in self.places.iter_mut().zip(&keys) {
            let place = std::mem::replace(&mut places[key], at as u32);
            found = found.or((place != u32::MAX).then_some(place as usize + 1));
        }
        if !as_expected {
            next = found.or(next);
        }
        self.expected = next.filter(|&next| next < self.rows.len());
    }
}

/// Mixes a number into a hash (the multiplier is 2^64 over the golden ratio: D. E. Knuth, "The Art of Computer Programming", 6.4).
fn mix(hash: u64, number: u64) -> u64 {
    let mixed = (hash ^ number).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    mixed ^ mixed >> 29
}
