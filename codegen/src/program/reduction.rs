//! How the speeds of a mechanism follow from independent ones: what the runtime's reduction is told of it.

use lamc_runtime::plumbing::ROWS;
use serde::{Deserialize, Serialize};

/// A reduction to independent speeds. Joints are given by their place in `branches`.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct ReductionInfo {
    /// The joints of the tree, and the number of joints between each and the ground; each joint is followed by all joints
    /// beyond it.
    pub branches: Vec<(u16, u16)>,
    /// The joints whose speeds are independent.
    pub independent: Vec<u16>,
    /// The other joints, in the order in which their speeds are eliminated: those that rows of one loop determine make a step,
    /// at most [`ROWS`](lamc_runtime::plumbing::ROWS).
    pub steps: Vec<Vec<u16>>,
    /// In the same order, which of the rows of the equations it is that determines each of these joints.
    pub rows: Vec<u32>,
    /// By joint, the joints that move what closes a loop, for the row of J that determines this joint.
    pub closure: SparseRows,
    /// L by step: the joints before it, and the independent ones, that are eliminated from its rows of J.
    pub lower: SparseRows,
    /// U by step: the joints after it that are left in its rows of J.
    pub upper: SparseRows,
}

/// Where the rows of a matrix have entries.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct SparseRows {
    /// The end of each row in `columns`.
    pub ends: Vec<u32>,
    /// The joint of each entry.
    pub columns: Vec<u16>,
}

impl ReductionInfo {
    /// The joints whose speeds are not independent, in the order of the elimination.
    pub fn dependent(&self) -> impl Iterator<Item = u16> {
        self.steps.iter().flatten().copied()
    }

    /// Joints in L and U, and [`ROWS`] for each step.
    pub fn factors(&self) -> usize {
        self.lower.columns.len() + self.upper.columns.len() + ROWS * self.steps.len()
    }

    /// The steps, with `u16::MAX` where there are fewer than [`ROWS`].
    pub fn padded_steps(&self) -> Vec<[u16; ROWS]> {
        let padded =
            |step: &Vec<u16>| std::array::from_fn(|row| step.get(row).copied().unwrap_or(u16::MAX));
        self.steps.iter().map(padded).collect()
    }

    /// For each joint the place of its row among those of all steps, as if each step had all [`ROWS`]; `u16::MAX` for
    /// independent ones.
    pub fn places(&self) -> Vec<u16> {
        let mut places = vec![u16::MAX; self.branches.len()];
        for (step, joints) in self.steps.iter().enumerate() {
            for (row, &joint) in joints.iter().enumerate() {
                places[usize::from(joint)] = (ROWS * step + row) as u16;
            }
        }
        places
    }

    /// The greatest number of joints on the way from the ground.
    pub fn depth(&self) -> usize {
        self.branches.iter().map(|&(_, depth)| usize::from(depth) + 1).max().unwrap_or(0)
    }
}
