//! The order of the records: runs of one kernel, as long as possible.

use std::collections::{BTreeSet, HashMap};

use super::kernels::Kernel;
use crate::program::Value;

/// How many ranks of the kernels are compared: twice as many find 2 per cent fewer runs of a sheet of 20 x 20 plates.
const TRIALS: usize = 4000;

/// Records of one kernel, one after the other. Later ones may read what earlier ones write.
#[derive(Clone, Debug)]
pub struct Run {
    pub kernel: usize,
    /// By their places among the records of the kernel.
    pub records: Vec<usize>,
}

/// Returns runs in an order in which all that a record reads is computed before it. Of the kernels with records that wait for
/// nothing, the first by rank is next, with all of them. The ranks are found by trial, one kernel moved at a time: those with the
/// fewest runs.
pub fn runs(kernels: &[Kernel]) -> Vec<Run> {
    let records = Records::of(kernels);
    let mut ranked: Vec<usize> = (0..kernels.len()).collect();
    let mut fewest = records.count(&ranked);
    for trial in 0..TRIALS {
        let [from, to] = shares(trial).map(|share| (share * ranked.len() as f64) as usize);
        if from == to {
            continue;
        }
        let mut moved = ranked.clone();
        let kernel = moved.remove(from);
        moved.insert(to, kernel);
        let count = records.count(&moved);
        if count <= fewest {
            (ranked, fewest) = (moved, count);
        }
    }
    let mut runs = Vec::with_capacity(fewest);
    records.follow(&ranked, |kernel, run| {
        let records = run.iter().map(|&record| records.list[record].1).collect();
        runs.push(Run { kernel, records });
    });
    runs
}

/// Pairs of numbers in 0..1 that fill the square evenly: additive recurrence of the plastic ratio, M. Roberts, "The unreasonable
/// effectiveness of quasirandom sequences", 2018.
fn shares(trial: usize) -> [f64; 2] {
    const PLASTIC: f64 = 1.324_717_957_244_746;
    [PLASTIC, PLASTIC * PLASTIC].map(|base| (trial as f64 / base).fract())
}

/// What the records of all kernels wait for.
struct Records {
    kernels: usize,
    /// The kernel of each record, and its place there.
    list: Vec<(usize, usize)>,
    /// By record: those that read what it writes, once for each read.
    users: Vec<Vec<usize>>,
    /// By record: how many reads others write.
    missing: Vec<usize>,
}

impl Records {
    fn of(kernels: &[Kernel]) -> Self {
        let all = || {
            kernels.iter().enumerate().flat_map(|(kernel, Kernel { records, .. })| {
                records.iter().enumerate().map(move |(place, record)| (kernel, place, record))
            })
        };
        let mut writers: HashMap<Value, usize> = HashMap::new();
        for (index, (_, _, record)) in all().enumerate() {
            writers.extend(record.writes.iter().map(|&value| (value, index)));
        }
        let list: Vec<_> = all().map(|(kernel, place, _)| (kernel, place)).collect();
        let (mut users, mut missing) = (vec![Vec::new(); list.len()], vec![0; list.len()]);
        for (index, (_, _, record)) in all().enumerate() {
            for &writer in record.reads.iter().filter_map(|read| writers.get(read)) {
                users[writer].push(index);
                missing[index] += 1;
            }
        }
        Self { kernels: kernels.len(), list, users, missing }
    }

    /// Returns how many runs there are if kernels come in this rank.
    fn count(&self, ranked: &[usize]) -> usize {
        let mut count = 0;
        self.follow(ranked, |_, _| count += 1);
        count
    }

    /// Shows the runs, kernel and records, if kernels come in this rank.
    fn follow(&self, ranked: &[usize], mut show: impl FnMut(usize, &[usize])) {
        let mut rank = vec![0; self.kernels];
        ranked.iter().enumerate().for_each(|(place, &kernel)| rank[kernel] = place);
        let mut missing = self.missing.clone();
        let mut ready: Vec<Vec<usize>> = vec![Vec::new(); self.kernels];
        // The ranks of the kernels with records that are ready.
        let mut open = BTreeSet::new();
        let mut left = self.list.len();
        for (record, &(kernel, _)) in self.list.iter().enumerate() {
            if missing[record] == 0 {
                ready[kernel].push(record);
                open.insert(rank[kernel]);
            }
        }
        while let Some(first) = open.pop_first() {
            let kernel = ranked[first];
            let mut run = std::mem::take(&mut ready[kernel]);
            let mut done = 0;
            while let Some(&record) = run.get(done) {
                done += 1;
                for &user in &self.users[record] {
                    missing[user] -= 1;
                    if missing[user] > 0 {
                        continue;
                    }
                    match self.list[user].0 {
                        same if same == kernel => run.push(user),
                        other => {
                            ready[other].push(user);
                            open.insert(rank[other]);
                        }
                    }
                }
            }
            left -= run.len();
            show(kernel, &run);
        }
        debug_assert_eq!(left, 0, "a record waits for itself");
    }
}
