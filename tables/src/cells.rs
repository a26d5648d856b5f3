//! The words of a table: rows in their order, whose values have cells, which are used again after a value's last use.

use crate::kind::{self, FIELD, operands};
use crate::order::{Group, groups};
use crate::rows::Rows;

/// What the runtime evaluates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words {
    /// One per run of rows, one per row, two per sine and cosine.
    pub list: Vec<u64>,
    /// Cells that hold values at the same time.
    pub cells: usize,
}

impl Words {
    /// The words as bytes, the least significant first.
    pub fn bytes(&self) -> Vec<u8> {
        self.list.iter().flat_map(|word| word.to_le_bytes()).collect()
    }
}

/// Returns the words of a function.
///
/// # Panics
/// If a function has more than 65,536 cells or numbers.
pub fn words(rows: &Rows) -> Words {
    let groups = groups(rows);
    let mut writing = Writing { words: Words::default(), free: Vec::new(), cells: Vec::new() };
    let last_uses = last_uses(&groups);
    let (mut run, mut run_kind, mut use_number) = (0, usize::MAX, 0);
    for group in &groups {
        let is_product = (kind::MUL..=kind::MUL_ADD).contains(&group.kind);
        let row_kind = if is_product { kind::MUL_ADD } else { group.kind };
        if row_kind != run_kind || !is_product {
            (run, run_kind) = (writing.words.list.len(), row_kind);
            writing.words.list.push(row_kind as u64);
        }
        for &row in &group.rows {
            let before = writing.words.list.len();
            writing.row(group.kind, row, &last_uses, &mut use_number);
            writing.words.list[run] += ((writing.words.list.len() - before) as u64) << 8;
        }
    }
    writing.words
}

/// The three values of a row of products and sums, or its fields. Sums multiply by 1, differences by -1, products add -0.
fn operands_of(group: usize, [x, y, z]: [usize; 3]) -> ([usize; 3], usize) {
    const ONE: usize = 0;
    const MINUS_ONE: usize = 1;
    const MINUS_ZERO: usize = 2;
    let product = match group {
        kind::MUL => [x, y, MINUS_ZERO],
        kind::ADD => [x, ONE, y],
        kind::SUB => [y, MINUS_ONE, x],
        kind::NEG => [x, MINUS_ONE, MINUS_ZERO],
        kind::MUL_ADD => [x, y, z],
        _ => return ([x, if kind::fields(group) == 1 { 0 } else { y }, 0], operands(group)),
    };
    (product, 3)
}

/// The number of the last row that uses each value.
fn last_uses(groups: &[Group]) -> Vec<usize> {
    let (mut uses, mut number) = (Vec::new(), 0);
    for group in groups {
        for &row in &group.rows {
            let (values, count) = operands_of(group.kind, row);
            values[..count].iter().for_each(|&value| uses[value] = number);
            let results = results(group.kind);
            uses.resize(uses.len() + results, usize::MAX);
            number += 1;
        }
    }
    uses
}

/// How many values a row of a kind computes.
fn results(kind: usize) -> usize {
    match kind {
        kind::SINE_COSINE => 2,
        kind if kind < kind::OUTPUT => 1,
        _ => 0,
    }
}

struct Writing {
    words: Words,
    /// Cells that hold nothing.
    free: Vec<usize>,
    /// The cell of each value.
    cells: Vec<usize>,
}

impl Writing {
    fn row(&mut self, kind: usize, row: [usize; 3], last_uses: &[usize], number: &mut usize) {
        let (mut content, count) = operands_of(kind, row);
        let values = content;
        for (at, (content, &value)) in content.iter_mut().zip(&values[..count]).enumerate() {
            // A value that is used twice gives its cell once.
            let is_used_before = values[..at].contains(&value);
            if last_uses[value] == *number && !is_used_before {
                self.free.push(self.cells[value]);
            }
            *content = self.cells[value];
        }
        *number += 1;
        let mut word = match kind < kind::OUTPUT {
            true => {
                let [a, b, c] = content.map(field);
                a | b << FIELD | c << (2 * FIELD)
            }
            false => field(content[0]) | (content[1] as u64) << FIELD,
        };
        for _ in 0..results(kind).max(1) {
            if kind < kind::OUTPUT {
                let cell = self.free.pop().unwrap_or_else(|| {
                    self.words.cells += 1;
                    self.words.cells - 1
                });
                self.cells.push(cell);
                word |= field(cell) << (3 * FIELD);
            }
            self.words.list.push(word);
            word = 0;
        }
    }
}

fn field(content: usize) -> u64 {
    assert!(content < 1 << FIELD, "a field of a word holds {content} at most");
    content as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rows::Row;

    /// x y + x with numbers x and y: a cell is used again as soon as its value is not needed.
    #[test]
    fn cells_are_used_again() {
        let row = |kind, fields| Row { kind, fields };
        let list = vec![
            row(kind::NUMBER, [5, 0, 0]),
            row(kind::NUMBER, [6, 0, 0]),
            row(kind::MUL_ADD, [1, 0, 0]),
        ];
        let found = words(&Rows { list, outputs: vec![vec![(2, 4)]] });
        let word = |a: u64, b: u64, c: u64, d: u64| a | b << 16 | c << 32 | d << 48;
        let run = |kind: usize, count: u64| kind as u64 | count << 8;
        let expected = [
            run(kind::NUMBER, 2),
            word(5, 0, 0, 0),
            word(6, 0, 0, 1),
            run(kind::MUL_ADD, 1),
            word(1, 0, 0, 0),
            run(kind::OUTPUT, 1),
            word(0, 4, 0, 0),
        ];
        assert_eq!((found.list.as_slice(), found.cells), (expected.as_slice(), 2));
        assert_eq!(found.bytes()[..8], expected[0].to_le_bytes());
    }
}
