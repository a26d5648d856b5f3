//! Functions of long mechanisms as tables: a loop over the rows of a table computes the same as straight-line
//! code that would outgrow the caches of the processor, in a hundredth of its text.
//!
//! Nearly every row is a product and a sum, cells\[d\] = cells\[a\] cells\[b\] + cells\[c\]: a sum multiplies by 1, a
//! difference by -1, a product adds -0, so that the loop never branches and every result has the bits of the
//! operation itself. What is left, such as quotients, has runs of rows of its own.
//!
//! The compiler writes a table as text, which [`Table::new`] reads at compile time. In the text, operands are values
//! in the order in which they are computed; reading gives them cells, which are used again after a value's last use.
//!
//! ```text
//! text   = group*
//! group  = kind count row*      kind, count: numbers; a kind from OUTPUT on writes that output
//! row    = the fields of the kind, each as its change from the row above; a group's first row, from the
//!          number of values so far
//! change = 2 x if x >= 0, else -2 x - 1
//! number = one to four digits of base 92; the first says how many follow
//! ```

use crate::Arithmetic;

/// The kinds of rows, by their numbers in the text.
#[allow(missing_docs, reason = "each is the operation of its name")]
pub mod kind {
    /// Field: index of a number of the model.
    pub const NUMBER: usize = 0;
    /// Fields: index of an argument, index in it.
    pub const ARGUMENT: usize = 1;
    /// Two values: sine and cosine of one angle.
    pub const SINE_COSINE: usize = 2;
    pub const MUL: usize = 3;
    pub const ADD: usize = 4;
    pub const SUB: usize = 5;
    pub const NEG: usize = 6;
    /// Fields a, b, c: a b + c.
    pub const MUL_ADD: usize = 7;
    pub const DIV: usize = 8;
    pub const MIN: usize = 9;
    pub const MAX: usize = 10;
    pub const POW: usize = 11;
    pub const ATAN2: usize = 12;
    pub const SQRT: usize = 13;
    pub const TAN: usize = 14;
    pub const EXP: usize = 15;
    pub const ABS: usize = 16;
    pub const TANH: usize = 17;
    pub const LN: usize = 18;
    pub const STEP: usize = 19;
    /// Fields: a value, the index in the output at which it is written. The next kinds write the next outputs.
    pub const OUTPUT: usize = 20;
}

/// Values that every table computes first: 1, -1 and -0, by which sums, differences and products become rows.
pub const FIRST_NUMBERS: [f64; 3] = [1.0, -1.0, -0.0];

/// Base of the digits of a number: the printable characters of ASCII without blank, `"` and `\`.
pub const BASE: usize = 92;

/// By the number of digits that follow the first: the least first digit, and the least number.
pub const DIGITS: [(usize, usize); 4] = [(0, 0), (60, 60), (87, 2544), (91, 36_400)];

/// Numbers are below this bound.
pub const BOUND: usize = DIGITS[3].1 + BASE * BASE * BASE;

/// Bits of a field before cells are given, and after.
const VALUE: u32 = 21;
const CELL: u32 = 16;

/// Angles whose sines are computed together.
const ANGLES: usize = 8;

/// A function of a mechanism as a table of `WORDS` words.
#[derive(Debug)]
pub struct Table<const WORDS: usize> {
    words: [u64; WORDS],
}

/// Number of words and cells of a table.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TableSize {
    /// Words: one per run of rows, one per row, two per sine and cosine.
    pub words: usize,
    /// Cells that hold values at the same time.
    pub cells: usize,
}

impl<const WORDS: usize> Table<WORDS> {
    /// The table of a text.
    ///
    /// # Panics
    /// If the text has another number of words, at compile time.
    #[must_use]
    pub const fn new(text: &[u8]) -> Self {
        let mut words = [0; WORDS];
        let size = read_table(text, &mut words, &mut [[0; 3]; WORDS]);
        assert!(size.words == WORDS);
        Self { words }
    }

    /// Evaluates the function: entries of the outputs that no row writes are zero. `CELLS` is a power of two, not
    /// less than the table's cells.
    pub fn evaluate<S: Arithmetic, const CELLS: usize>(
        &self,
        numbers: &[f64],
        arguments: &[&[S]],
        outputs: &mut [&mut [S]],
    ) {
        evaluate::<S, CELLS>(&self.words, numbers, arguments, outputs);
    }
}

/// Evaluates a table that was read before; as [`Table::evaluate`].
pub fn evaluate<S: Arithmetic, const CELLS: usize>(
    words: &[u64],
    numbers: &[f64],
    arguments: &[&[S]],
    outputs: &mut [&mut [S]],
) {
    const { assert!(CELLS.is_power_of_two()) };
    let cells = &mut Cells([S::ZERO; CELLS]);
    outputs.iter_mut().for_each(|output| output.fill(S::ZERO));
    let mut left = words;
    while let [header, rest @ ..] = left {
        let (kind, count) = ((header & 0xff) as usize, (header >> 8) as usize);
        let (rows, rest) = rest.split_at(count);
        match kind {
            kind::NUMBER => cells.set(rows, |a, _| S::from_f64(numbers[a])),
            kind::ARGUMENT => cells.set(rows, |a, b| arguments[a][b]),
            kind::SINE_COSINE => cells.sines(rows),
            kind::MUL_ADD => cells.products(rows),
            kind::DIV => cells.map(rows, |x, y| x / y),
            kind::MIN => cells.map(rows, S::min),
            kind::MAX => cells.map(rows, S::max),
            kind::POW => cells.map(rows, S::pow),
            kind::ATAN2 => cells.map(rows, S::atan2),
            kind::SQRT => cells.map(rows, |x, _| x.sqrt()),
            kind::TAN => cells.map(rows, |x, _| x.tan()),
            kind::EXP => cells.map(rows, |x, _| x.exp()),
            kind::ABS => cells.map(rows, |x, _| x.abs()),
            kind::TANH => cells.map(rows, |x, _| x.tanh()),
            kind::LN => cells.map(rows, |x, _| x.ln()),
            kind::STEP => cells.map(rows, |x, _| x.step()),
            _ => {
                let output = &mut outputs[kind - kind::OUTPUT];
                for &row in rows {
                    output[(row >> CELL) as usize] = cells.get(row);
                }
            }
        }
        left = rest;
    }
}

/// Values of a function in the making. Masks instead of checks keep the loops short.
struct Cells<S, const CELLS: usize>([S; CELLS]);

impl<S: Arithmetic, const CELLS: usize> Cells<S, CELLS> {
    const MASK: usize = CELLS - 1;

    fn get(&self, field: u64) -> S {
        self.0[field as usize & Self::MASK]
    }

    fn put(&mut self, row: u64, value: S) {
        self.0[(row >> (3 * CELL)) as usize & Self::MASK] = value;
    }

    fn products(&mut self, rows: &[u64]) {
        for &row in rows {
            let [a, b, c] = [row, row >> CELL, row >> (2 * CELL)].map(|field| self.get(field));
            self.put(row, a.mul_add(b, c));
        }
    }

    fn map(&mut self, rows: &[u64], f: impl Fn(S, S) -> S) {
        for &row in rows {
            self.put(row, f(self.get(row), self.get(row >> CELL)));
        }
    }

    /// Fields that are no cells.
    fn set(&mut self, rows: &[u64], f: impl Fn(usize, usize) -> S) {
        const FIELD: u64 = (1 << CELL) - 1;
        for &row in rows {
            self.put(row, f((row & FIELD) as usize, (row >> CELL & FIELD) as usize));
        }
    }

    fn sines(&mut self, rows: &[u64]) {
        for rows in rows.chunks(2 * ANGLES) {
            let angle = |k: usize| rows.get(2 * k).map_or(S::ZERO, |&row| self.get(row));
            let found = S::sin_cos_all::<ANGLES>(core::array::from_fn(angle));
            for (pair, (sine, cosine)) in rows.chunks_exact(2).zip(found) {
                self.put(pair[0], sine);
                self.put(pair[1], cosine);
            }
        }
    }
}

/// Reads a table into `words`; `scratch` is as long.
///
/// # Panics
/// If either is too short, or if the text is no table.
pub const fn read_table(text: &[u8], words: &mut [u64], scratch: &mut [[u32; 3]]) -> TableSize {
    let length = read_values(text, words);
    TableSize { words: length, cells: give_cells(words, length, scratch) }
}

/// How many fields the rows of a kind have.
pub const fn fields(kind: usize) -> usize {
    match kind {
        kind::MUL_ADD => 3,
        kind::NUMBER | kind::SINE_COSINE | kind::NEG | kind::SQRT..=kind::STEP => 1,
        _ => 2,
    }
}

/// Reads the rows, whose fields are values. Returns the number of words.
const fn read_values(text: &[u8], words: &mut [u64]) -> usize {
    let (mut at, mut length, mut values) = (0, 0, 0);
    let (mut run, mut run_kind) = (0, usize::MAX);
    while at < text.len() {
        let (group, count) = (number(text, &mut at), number(text, &mut at));
        let is_product = group >= kind::MUL && group <= kind::MUL_ADD;
        let row_kind = if is_product { kind::MUL_ADD } else { group };
        let rows = if group == kind::SINE_COSINE { 2 * count } else { count };
        if row_kind != run_kind || !is_product {
            (run, run_kind) = (length, row_kind);
            words[run] = row_kind as u64;
            length += 1;
        }
        words[run] += (rows as u64) << 8;
        let mut row = [values; 3];
        let mut index = 0;
        while index < count {
            let mut field = 0;
            while field < fields(group) {
                let change = number(text, &mut at);
                let size = change.div_ceil(2);
                row[field] =
                    if change.is_multiple_of(2) { row[field] + size } else { row[field] - size };
                field += 1;
            }
            words[length] = word(group, row);
            length += 1;
            if group == kind::SINE_COSINE {
                words[length] = 0;
                length += 1;
            }
            index += 1;
        }
        if group < kind::OUTPUT {
            values += rows;
        }
    }
    length
}

/// A row of values; sums, differences, products and negatives as a product and a sum.
const fn word(group: usize, [x, y, z]: [usize; 3]) -> u64 {
    const ONE: usize = 0;
    const MINUS_ONE: usize = 1;
    const MINUS_ZERO: usize = 2;
    let [a, b, c] = match group {
        kind::MUL => [x, y, MINUS_ZERO],
        kind::ADD => [x, ONE, y],
        kind::SUB => [y, MINUS_ONE, x],
        kind::NEG => [x, MINUS_ONE, MINUS_ZERO],
        kind::MUL_ADD => [x, y, z],
        _ if fields(group) == 1 => [x, 0, 0],
        _ => [x, y, 0],
    };
    a as u64 | (b as u64) << VALUE | (c as u64) << (2 * VALUE)
}

const fn number(text: &[u8], at: &mut usize) -> usize {
    let first = digit(text, at);
    let mut more = 3;
    while first < DIGITS[more].0 {
        more -= 1;
    }
    let (least_digit, least) = DIGITS[more];
    let mut number = first - least_digit;
    while more > 0 {
        number = number * BASE + digit(text, at);
        more -= 1;
    }
    number + least
}

const fn digit(text: &[u8], at: &mut usize) -> usize {
    let byte = text[*at];
    *at += 1;
    byte as usize - b'!' as usize - (byte > b'"') as usize - (byte > b'\\') as usize
}

/// Number of fields of a row that are values.
const fn operands(row_kind: usize, is_cosine: bool) -> usize {
    match row_kind {
        _ if is_cosine => 0,
        kind::NUMBER | kind::ARGUMENT => 0,
        _ if row_kind >= kind::OUTPUT => 1,
        _ => fields(row_kind),
    }
}

const VALUE_MASK: u64 = (1 << VALUE) - 1;

/// Columns of the scratch space: the word that uses a value last, the cell of a value, the free cells.
const LAST: usize = 0;
const CELL_OF: usize = 1;
const FREE: usize = 2;

const fn find_last_uses(words: &[u64], length: usize, scratch: &mut [[u32; 3]]) {
    let mut at = 0;
    while at < length {
        let (row_kind, end) = ((words[at] & 0xff) as usize, at + 1 + (words[at] >> 8) as usize);
        at += 1;
        while at < end {
            let is_cosine = row_kind == kind::SINE_COSINE && (end - at) % 2 == 1;
            let mut field = 0;
            while field < operands(row_kind, is_cosine) {
                let value = words[at] >> (VALUE * field as u32) & VALUE_MASK;
                scratch[value as usize][LAST] = at as u32;
                field += 1;
            }
            at += 1;
        }
    }
}

/// Replaces values by cells, of which that of a value is used again after its last use. Returns how many there are.
const fn give_cells(words: &mut [u64], length: usize, scratch: &mut [[u32; 3]]) -> usize {
    find_last_uses(words, length, scratch);
    let (mut free, mut cells, mut values, mut at) = (0, 0, 0, 0);
    while at < length {
        let (row_kind, end) = ((words[at] & 0xff) as usize, at + 1 + (words[at] >> 8) as usize);
        at += 1;
        while at < end {
            let is_cosine = row_kind == kind::SINE_COSINE && (end - at) % 2 == 1;
            let (mut word, mut field) = (0, 0);
            while field < 3 {
                let mut content = words[at] >> (VALUE * field as u32) & VALUE_MASK;
                if field < operands(row_kind, is_cosine) {
                    let value = content as usize;
                    if scratch[value][LAST] == at as u32 {
                        scratch[value][LAST] = u32::MAX;
                        scratch[free][FREE] = scratch[value][CELL_OF];
                        free += 1;
                    }
                    content = scratch[value][CELL_OF] as u64;
                }
                word |= content << (CELL * field as u32);
                field += 1;
            }
            if row_kind < kind::OUTPUT {
                if free == 0 {
                    scratch[0][FREE] = cells;
                    (cells, free) = (cells + 1, 1);
                }
                free -= 1;
                let cell = scratch[free][FREE];
                assert!(cell < 1 << CELL);
                word |= (cell as u64) << (3 * CELL);
                scratch[values][CELL_OF] = cell;
                values += 1;
            }
            words[at] = word;
            at += 1;
        }
    }
    cells as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The words of the text in their order, by length and then by letter, are 0, 1, 2 and so on.
    #[test]
    fn words_in_their_order_count_up() {
        let letters: Vec<u8> = (b'!'..=b'~').filter(|byte| !b"\"\\".contains(byte)).collect();
        let mut expected = 0;
        for (first, &letter) in letters.iter().enumerate() {
            let more = [60, 87, 91].iter().filter(|least| first >= **least).count() as u32;
            for rest in 0..letters.len().pow(more) {
                let mut word = vec![letter];
                word.extend((0..more).rev().map(|at| letters[rest / 92_usize.pow(at) % 92]));
                let mut at = 0;
                assert_eq!((number(&word, &mut at), at), (expected, word.len()), "{word:?}");
                expected += 1;
            }
        }
        assert_eq!(expected, BOUND);
    }
}
