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

/// Gives the values of each record cells side by side, of which others get those whose values are not needed any more. `given` values
/// have the first cells, and `returned` ones keep theirs to the end.
pub fn cells(
    kernels: &[Kernel],
    runs: &[Run],
    given: HashMap<Value, usize>,
    first: usize,
    returned: &[Value],
) -> Cells {
    let records = || {
        runs.iter().flat_map(|&Run { kernel, ref records }| {
            records.iter().map(move |&place| (kernel, &kernels[kernel].records[place]))
        })
    };
    let mut last: HashMap<Value, usize> = HashMap::new();
    for (time, (_, record)) in records().enumerate() {
        last.extend(record.reads.iter().map(|&read| (read, time)));
        for &value in &record.writes {
            last.entry(value).or_insert(time);
        }
    }
    last.extend(returned.iter().map(|&value| (value, usize::MAX)));
    let places: Vec<Vec<usize>> = kernels.iter().map(|kernel| places(kernel, &last)).collect();
    let mut free = Free { gaps: BTreeMap::new(), count: first };
    // The cells whose values nothing reads after a record.
    let mut ends: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    let mut of = given;
    for (time, (kernel, record)) in records().enumerate() {
        let first = free.take(record.writes.len());
        for (place, value) in places[kernel].iter().zip(&record.writes) {
            let cell = first + place;
            of.insert(*value, cell);
            ends.entry(last[value]).or_default().push(cell);
        }
        for cell in ends.remove(&time).unwrap_or_default() {
            free.give(cell, 1);
        }
    }
    Cells { of, count: free.count }
}

/// Returns where among the values of a record each has its cell: in the order in which they are needed for the last time, so that cells
/// that are side by side are free at about the same time. A cosine follows its sine.
fn places(kernel: &Kernel, last: &HashMap<Value, usize>) -> Vec<usize> {
    let needed = |place: usize| -> f64 {
        kernel.records.iter().map(|record| last[&record.writes[place]] as f64).sum()
    };
    let count = kernel.records.first().map_or(0, |record| record.writes.len());
    let mut order: Vec<usize> = (0..count).collect();
    if !kernel.shape.is_sine() {
        order.sort_by(|&a, &b| needed(a).total_cmp(&needed(b)));
    }
    let mut places = vec![0; count];
    order.into_iter().enumerate().for_each(|(place, value)| places[value] = place);
    places
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
