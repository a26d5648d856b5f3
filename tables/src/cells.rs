//! The words of a table: steps in their order, whose values have cells, which are used again after a value's last use.

use crate::kind::{FIELD, NUMBER, OUTPUT, SINE_COSINE, shift, sum};
use crate::order::{Step, groups};
use crate::rows::Rows;

/// Steps of one kind, one after the other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Run {
    /// Their kind.
    pub kind: usize,
    /// Each is two fields. With cells x, y and d:
    ///
    /// ```text
    /// number       (number, d)
    /// argument     (argument, index), (d, 0)
    /// sine_cosine  (x, d of the sine), (d of the cosine, 0)
    /// products     (c, d), then (a, b) for each product
    /// output       (x, 0), (index, index / 2^16)
    /// others       (x, y), (d, 0)
    /// ```
    pub words: Vec<[u16; 2]>,
}

/// What the runtime evaluates.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Words {
    /// In the order of evaluation.
    pub runs: Vec<Run>,
    /// Cells that hold values at the same time.
    pub cells: usize,
}

impl Words {
    /// Words of four bytes, the least significant first, for evaluation with so many cells, a power of two: for each run its
    /// kind + 2^8 the number of its words, then these.
    pub fn bytes(&self, cells: usize) -> Vec<u8> {
        let words = self.runs.iter().flat_map(|run| {
            let shift = if sum(run.kind).is_some() { shift(cells) } else { FIELD };
            let word = move |&[low, high]: &[u16; 2]| u32::from(low) | u32::from(high) << shift;
            let header = run.kind as u32 | (run.words.len() as u32) << 8;
            std::iter::once(header).chain(run.words.iter().map(word))
        });
        words.flat_map(u32::to_le_bytes).collect()
    }

    /// A number of cells with which the table can be evaluated, a power of two.
    pub fn power_of_two(&self) -> usize {
        self.cells.max(2).next_power_of_two()
    }
}

/// Returns the words of a function.
///
/// # Panics
/// If a function has more than 65,536 cells or numbers.
pub fn words(rows: &Rows) -> Words {
    let groups = groups(rows);
    let mut last_uses = vec![usize::MAX; rows.list.len()];
    for (number, step) in groups.iter().flatten().enumerate() {
        step.reads.iter().for_each(|&value| last_uses[value] = number);
    }
    let cells = vec![0; rows.list.len()];
    let mut writing = Writing { words: Words::default(), free: Vec::new(), cells, last_uses };
    let mut number = 0;
    for group in &groups {
        let kind = group.first().map_or(0, |step| step.kind);
        let continues = writing.words.runs.last().is_some_and(|run| run.kind == kind);
        if !continues || sum(kind).is_none() {
            writing.words.runs.push(Run { kind, words: Vec::new() });
        }
        for step in group {
            let words = writing.step(step, number);
            number += 1;
            if let Some(run) = writing.words.runs.last_mut() {
                run.words.extend(words);
            }
        }
    }
    writing.words
}

struct Writing {
    words: Words,
    /// Cells that hold nothing.
    free: Vec<usize>,
    /// The cell of each value.
    cells: Vec<usize>,
    /// The number of the last step that reads each value.
    last_uses: Vec<usize>,
}

impl Writing {
    /// The words of a step.
    fn step(&mut self, step: &Step, number: usize) -> Vec<[u16; 2]> {
        let reads: Vec<u16> = step.reads.iter().map(|&value| field(self.cells[value])).collect();
        for (at, &value) in step.reads.iter().enumerate() {
            // A value that is used twice gives its cell once.
            if self.last_uses[value] == number && !step.reads[..at].contains(&value) {
                self.free.push(self.cells[value]);
            }
        }
        for &value in &step.computes {
            self.cells[value] = self.free.pop().unwrap_or_else(|| {
                self.words.cells += 1;
                self.words.cells - 1
            });
        }
        let cell = |index: usize| field(step.computes.get(index).map_or(0, |&it| self.cells[it]));
        let read = |index: usize| reads.get(index).copied().unwrap_or(0);
        let [first, second] = step.fields;
        match step.kind {
            NUMBER => vec![[field(first), cell(0)]],
            SINE_COSINE => vec![[read(0), cell(0)], [cell(1), 0]],
            kind if sum(kind).is_some() => {
                let pairs = reads[1..].as_chunks().0.iter().copied();
                std::iter::once([read(0), cell(0)]).chain(pairs).collect()
            }
            kind if kind >= OUTPUT => {
                vec![[read(0), 0], [first as u16, field(first >> FIELD)]]
            }
            _ if step.reads.is_empty() => vec![[field(first), field(second)], [cell(0), 0]],
            _ => vec![[read(0), read(1)], [cell(0), 0]],
        }
    }
}

fn field(content: usize) -> u16 {
    match u16::try_from(content) {
        Ok(field) => field,
        Err(_) => panic!("a field of a word holds {content} at most"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::kind::{ADD, MUL, MUL_ADD, PRODUCTS};
    use crate::rows::Row;

    /// x y + x and x y + x + y y with numbers x and y: a cell is used again as soon as its value is not needed.
    #[test]
    fn cells_are_used_again() {
        let row = |kind, fields| Row { kind, fields };
        let list = vec![
            row(NUMBER, [5, 0, 0]),
            row(NUMBER, [6, 0, 0]),
            row(NUMBER, [7, 0, 0]),
            row(MUL_ADD, [1, 0, 0]),
        ];
        let found = words(&Rows { list, outputs: vec![vec![(3, 65_540)]] });
        let run = |kind, words: &[[u16; 2]]| Run { kind, words: words.to_vec() };
        let expected = [
            run(NUMBER, &[[5, 0], [6, 1], [7, 2]]),
            run(PRODUCTS, &[[0, 1], [1, 0]]),
            run(OUTPUT, &[[1, 0], [4, 1]]),
        ];
        assert_eq!((found.runs.as_slice(), found.cells), (expected.as_slice(), 3));
        let bytes = found.bytes(4);
        assert_eq!(bytes.len(), 4 * 10);
        assert_eq!(bytes[..8], [0, 3, 0, 0, 5, 0, 0, 0]);
        // Of four cells, the second field has the two highest bits.
        assert_eq!(bytes[16..28], [3, 2, 0, 0, 0, 0, 0, 1 << 6, 1, 0, 0, 0]);
    }

    /// Sums that nothing else uses become one step, up to four products; others stay.
    #[test]
    fn products_are_added_up_in_one_step() {
        let row = |kind, fields| Row { kind, fields };
        let mut list: Vec<Row> = (0..4).map(|number| row(NUMBER, [number, 0, 0])).collect();
        list.push(row(MUL, [3, 3, 0]));
        for last in 4..9 {
            list.push(row(MUL_ADD, [3, 3, last]));
        }
        // Used twice.
        list.push(row(ADD, [9, 9, 0]));
        let found = words(&Rows { list, outputs: vec![vec![(10, 0)]] });
        let products: Vec<_> =
            found.runs[1..found.runs.len() - 1].iter().map(|it| it.kind).collect();
        assert_eq!(products, [PRODUCTS + 3, PRODUCTS + 1, PRODUCTS]);
    }
}
