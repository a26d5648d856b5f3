//! The order of the records: runs of one kernel, as long as possible.

use std::collections::{BTreeSet, HashMap};

use super::kernels::Kernel;
use crate::program::Value;

/// Records of one kernel, one after the other. Later ones may read what earlier ones write.
#[derive(Clone, Debug)]
pub struct Run {
    pub kernel: usize,
    /// By their places among the records of the kernel.
    pub records: Vec<usize>,
}

/// Returns runs in an order in which all that a record reads is computed before it. The next kernel is the one of which
/// the fewest records are left then: that makes few runs.
pub fn runs(kernels: &[Kernel]) -> Vec<Run> {
    let mut order = Order::of(kernels);
    let mut runs = Vec::new();
    while let Some(kernel) = order.next() {
        let records = order.follow(kernel);
        order.ready[kernel].clear();
        order.left[kernel] -= records.len();
        runs.push(Run { kernel, records });
    }
    debug_assert!(order.left.iter().all(|&left| left == 0), "a record waits for itself");
    runs
}

struct Order<'a> {
    kernels: &'a [Kernel],
    /// By kernel and record: the records that read what it writes, once for each read.
    users: HashMap<(usize, usize), Vec<(usize, usize)>>,
    /// By kernel and record: what it reads that is not computed.
    missing: Vec<Vec<usize>>,
    /// By kernel: the records that miss nothing.
    ready: Vec<BTreeSet<usize>>,
    /// By kernel: how many records are left.
    left: Vec<usize>,
}

impl<'a> Order<'a> {
    fn of(kernels: &'a [Kernel]) -> Self {
        let mut writers: HashMap<Value, (usize, usize)> = HashMap::new();
        for (kernel, Kernel { records, .. }) in kernels.iter().enumerate() {
            for (place, record) in records.iter().enumerate() {
                writers.extend(record.writes.iter().map(|&value| (value, (kernel, place))));
            }
        }
        let mut users: HashMap<_, Vec<_>> = HashMap::new();
        let (mut missing, mut ready, mut left) = (Vec::new(), Vec::new(), Vec::new());
        for (kernel, Kernel { records, .. }) in kernels.iter().enumerate() {
            let (mut of_kernel, mut first) = (Vec::new(), BTreeSet::new());
            for (place, record) in records.iter().enumerate() {
                let from: Vec<_> =
                    record.reads.iter().filter_map(|read| writers.get(read)).collect();
                for &&writer in &from {
                    users.entry(writer).or_default().push((kernel, place));
                }
                of_kernel.push(from.len());
                if from.is_empty() {
                    first.insert(place);
                }
            }
            missing.push(of_kernel);
            ready.push(first);
            left.push(records.len());
        }
        Self { kernels, users, missing, ready, left }
    }

    fn next(&self) -> Option<usize> {
        let open = (0..self.kernels.len()).filter(|&kernel| !self.ready[kernel].is_empty());
        // Of equal ones the longest run, then the first kernel.
        open.min_by_key(|&kernel| {
            let length = self.length(kernel);
            (self.left[kernel] - length, usize::MAX - length)
        })
    }

    /// Returns how many records of a kernel can follow one another now.
    fn length(&self, kernel: usize) -> usize {
        let mut given: HashMap<usize, usize> = HashMap::new();
        let mut waiting: Vec<usize> = self.ready[kernel].iter().copied().collect();
        let mut length = 0;
        while let Some(place) = waiting.pop() {
            length += 1;
            for &(other, user) in self.users.get(&(kernel, place)).into_iter().flatten() {
                if other == kernel {
                    let given = given.entry(user).or_insert(0);
                    *given += 1;
                    if *given == self.missing[kernel][user] {
                        waiting.push(user);
                    }
                }
            }
        }
        length
    }

    /// Takes all records of a kernel that can follow one another.
    fn follow(&mut self, kernel: usize) -> Vec<usize> {
        let mut records: Vec<usize> = self.ready[kernel].iter().copied().collect();
        let mut done = 0;
        while let Some(&place) = records.get(done) {
            done += 1;
            for (other, user) in self.users.remove(&(kernel, place)).into_iter().flatten() {
                self.missing[other][user] -= 1;
                if self.missing[other][user] > 0 {
                    continue;
                }
                if other == kernel {
                    records.push(user);
                } else {
                    self.ready[other].insert(user);
                }
            }
        }
        records
    }
}
