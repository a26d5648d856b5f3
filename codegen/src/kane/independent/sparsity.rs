//! Which entries the rows of J, L and U have when the closure is eliminated with chosen pivots: known without any number.

use std::collections::{BTreeMap, BTreeSet};

use lamc_runtime::plumbing::ROWS;

use crate::kane::closure::Closure;
use crate::source::JointId;
use crate::topology::{Pivot, Reduction};

/// The steps of the elimination in order.
pub struct Sparsity(pub Vec<Step>);

/// Rows of one loop that are eliminated together: as if each had entries where one of them has.
pub struct Step {
    /// At most [`ROWS`].
    pub rows: Vec<Row>,
    /// Of L, with the independent joints of J: first these, then those before it in the order of their elimination.
    pub lower: Vec<JointId>,
    /// Of U, without the joints of the step.
    pub upper: Vec<JointId>,
}

/// The row of a pivot.
pub struct Row {
    pub pivot: Pivot,
    /// The joints at which it has entries of J.
    pub closure: Vec<JointId>,
}

impl Sparsity {
    /// Finds the entries for `speeds` columns of J.
    pub fn new(closure: &Closure, reduction: &Reduction, speeds: usize) -> Self {
        let loop_of = |pivot: &Pivot| closure.rows()[pivot.row].closed;
        let of_loops = reduction.pivots.chunk_by(|a, b| loop_of(a) == loop_of(b));
        let steps: Vec<&[Pivot]> = of_loops.flat_map(|of_loop| of_loop.chunks(ROWS)).collect();
        let joints = |step: usize| steps[step].iter().map(|pivot| pivot.joint);
        let mut step_of = vec![None; speeds];
        for step in 0..steps.len() {
            joints(step).for_each(|joint| step_of[joint.index()] = Some(step));
        }
        let mut found: Vec<Step> = Vec::with_capacity(steps.len());
        for (step, pivots) in steps.iter().enumerate() {
            let rows: Vec<Row> = pivots.iter().map(|&pivot| row(closure, pivot, speeds)).collect();
            let of_closure: BTreeSet<JointId> =
                rows.iter().flat_map(|row| row.closure.iter().copied()).collect();
            let is_independent = |joint: &JointId| step_of[joint.index()].is_none();
            let mut lower: Vec<JointId> =
                of_closure.iter().copied().filter(is_independent).collect();
            // By the step that determines it.
            let mut others: BTreeMap<usize, BTreeSet<JointId>> = BTreeMap::new();
            let add = |joint: JointId, others: &mut BTreeMap<usize, BTreeSet<JointId>>| {
                if let Some(of) = step_of[joint.index()].filter(|of| *of != step) {
                    others.entry(of).or_default().insert(joint);
                }
            };
            of_closure.iter().for_each(|&joint| add(joint, &mut others));
            while let Some(entry) = others.first_entry().filter(|entry| *entry.key() < step) {
                let (before, entries) = entry.remove_entry();
                // A joint fills in those that the same step determines after it.
                let of_step = joints(before).skip_while(|joint| !entries.contains(joint));
                lower.extend(of_step);
                found[before].upper.iter().for_each(|&joint| add(joint, &mut others));
            }
            let order = |of: usize, entries: BTreeSet<JointId>| {
                joints(of).filter(move |joint| entries.contains(joint))
            };
            let upper = others.into_iter().flat_map(|(of, entries)| order(of, entries)).collect();
            found.push(Step { rows, lower, upper });
        }
        Self(found)
    }

    /// The rows in the order of the elimination.
    pub fn rows(&self) -> impl Iterator<Item = &Row> {
        self.0.iter().flat_map(|step| &step.rows)
    }

    /// Returns the number of products of two entries of N for the same joint: what N^T M N costs, but for a factor.
    pub fn pairs(&self, reduction: &Reduction) -> usize {
        let mut movers: BTreeMap<JointId, BTreeSet<JointId>> =
            reduction.independent.iter().map(|&joint| (joint, BTreeSet::from([joint]))).collect();
        let mut add = |step: &Step, columns: &[JointId]| {
            let of = |joint: &JointId| movers.get(joint).into_iter().flatten().copied();
            let joints = step.rows.iter().map(|row| row.pivot.joint);
            let together: BTreeSet<JointId> =
                joints.clone().flat_map(|joint| of(&joint).collect::<Vec<_>>()).collect();
            let of_step: BTreeSet<JointId> = columns.iter().flat_map(of).chain(together).collect();
            joints.for_each(|joint| movers.entry(joint).or_default().extend(&of_step));
        };
        self.0.iter().for_each(|step| add(step, &step.lower));
        self.0.iter().rev().for_each(|step| add(step, &step.upper));
        movers.values().map(|movers| movers.len() * (movers.len() + 1) / 2).sum()
    }
}

fn row(closure: &Closure, pivot: Pivot, speeds: usize) -> Row {
    let entries = closure.jacobian[pivot.row * speeds..][..speeds].iter().enumerate();
    let entries = entries.filter(|(_, entry)| !entry.is_zero());
    Row { pivot, closure: entries.map(|(joint, _)| JointId(joint)).collect() }
}
