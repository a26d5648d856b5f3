//! Cells of an array for the values that records hand to each other.

use std::collections::{BTreeMap, HashMap};

use super::kernels::Kernel;
use super::order::Run;
use crate::program::Value;

/// The cells of all values.
#[derive(Clone, Debug)]
pub struct Cells {
    pub of: HashMap<Value, usize>,
    /// How many there are.
    pub count: usize,
}

/// Gives the values of each record cells side by side, which others get when none of them is needed any more. `given` values have
/// the first cells, and `returned` ones keep theirs to the end.
pub fn cells(
    kernels: &[Kernel],
    runs: &[Run],
    given: HashMap<Value, usize>,
    first: usize,
    returned: &[Value],
) -> Cells {
    let records = || {
        runs.iter()
            .flat_map(|run| run.records.iter().map(|&place| &kernels[run.kernel].records[place]))
    };
    let mut last: HashMap<Value, usize> = HashMap::new();
    for (time, record) in records().enumerate() {
        last.extend(record.reads.iter().map(|&read| (read, time)));
        for &value in &record.writes {
            last.entry(value).or_insert(time);
        }
    }
    last.extend(returned.iter().map(|&value| (value, usize::MAX)));
    let mut free = Free { gaps: BTreeMap::new(), count: first };
    // The cells whose values nothing reads after a record.
    let mut ends: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut of = given;
    for (time, record) in records().enumerate() {
        let length = record.writes.len();
        let cell = free.take(length);
        of.extend(record.writes.iter().copied().zip(cell..));
        for (cell, value) in (cell..).zip(&record.writes) {
            ends.entry(last[value]).or_default().push(cell);
        }
        for cell in ends.remove(&time).unwrap_or_default() {
            free.give(cell, 1);
        }
    }
    Cells { of, count: free.count }
}

/// Cells that are not in use.
struct Free {
    /// First cell and length of each gap.
    gaps: BTreeMap<usize, usize>,
    count: usize,
}

impl Free {
    fn take(&mut self, length: usize) -> usize {
        let Some((&cell, &gap)) = self.gaps.iter().find(|&(_, &gap)| gap >= length) else {
            self.count += length;
            return self.count - length;
        };
        self.gaps.remove(&cell);
        if gap > length {
            self.gaps.insert(cell + length, gap - length);
        }
        cell
    }

    fn give(&mut self, mut cell: usize, mut length: usize) {
        if let Some(after) = self.gaps.remove(&(cell + length)) {
            length += after;
        }
        if let Some((&before, &gap)) = self.gaps.range(..cell).next_back()
            && before + gap == cell
        {
            (cell, length) = (before, gap + length);
        }
        self.gaps.insert(cell, length);
    }
}
