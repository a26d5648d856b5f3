//! Which entries the rows of J, L and U have when the closure is eliminated with chosen pivots: known without any number.

use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

use crate::kane::closure::Closure;
use crate::source::JointId;
use crate::topology::{Pivot, Reduction};

/// The entries of each pivot's row, in the order of the elimination.
pub struct Sparsity(pub Vec<Row>);

/// The joints at which the row of a pivot has entries.
pub struct Row {
    pub pivot: Pivot,
    /// Of J.
    pub closure: Vec<JointId>,
    /// Of L, with the independent joints of J: first these, then those before it in the order of their elimination.
    pub lower: Vec<JointId>,
    /// Of U, without the pivot.
    pub upper: Vec<JointId>,
}

impl Sparsity {
    /// Finds the entries for `speeds` columns of J.
    pub fn new(closure: &Closure, reduction: &Reduction, speeds: usize) -> Self {
        let mut places = vec![None; speeds];
        for (place, pivot) in reduction.pivots.iter().enumerate() {
            places[pivot.joint.index()] = Some(place);
        }
        let mut rows: Vec<Row> = Vec::with_capacity(reduction.pivots.len());
        for (place, &pivot) in reduction.pivots.iter().enumerate() {
            let entries = closure.jacobian[pivot.row * speeds..][..speeds].iter().enumerate();
            let entries = entries.filter(|(_, entry)| !entry.is_zero());
            let of_closure: Vec<JointId> = entries.map(|(joint, _)| JointId(joint)).collect();
            let is_independent = |joint: &&JointId| places[joint.index()].is_none();
            let mut lower: Vec<JointId> =
                of_closure.iter().filter(is_independent).copied().collect();
            let pivots = of_closure.iter().filter_map(|joint| places[joint.index()]);
            let (mut before, mut after): (BTreeSet<usize>, BTreeSet<usize>) =
                pivots.filter(|&other| other != place).partition(|&other| other < place);
            while let Some(next) = before.pop_first() {
                lower.push(reduction.pivots[next].joint);
                let fill = rows[next].upper.iter().filter_map(|joint| places[joint.index()]);
                for other in fill {
                    match other.cmp(&place) {
                        Ordering::Less => before.insert(other),
                        Ordering::Equal => continue,
                        Ordering::Greater => after.insert(other),
                    };
                }
            }
            let upper = after.into_iter().map(|other| reduction.pivots[other].joint).collect();
            rows.push(Row { pivot, closure: of_closure, lower, upper });
        }
        Self(rows)
    }

    /// Returns the number of products of two entries of N for the same joint: what N^T M N costs, but for a factor.
    pub fn pairs(&self, reduction: &Reduction) -> usize {
        let mut movers: BTreeMap<JointId, BTreeSet<JointId>> =
            reduction.independent.iter().map(|&joint| (joint, BTreeSet::from([joint]))).collect();
        let mut add = |row: &Row, columns: &[JointId]| {
            let of = |joint: &JointId| movers.get(joint).into_iter().flatten().copied();
            let of_row: Vec<JointId> = columns.iter().flat_map(of).collect();
            movers.entry(row.pivot.joint).or_default().extend(of_row);
        };
        self.0.iter().for_each(|row| add(row, &row.lower));
        self.0.iter().rev().for_each(|row| add(row, &row.upper));
        movers.values().map(|movers| movers.len() * (movers.len() + 1) / 2).sum()
    }
}
