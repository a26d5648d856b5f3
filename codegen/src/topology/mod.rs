//! Stage 3: [`Mechanism`] -> [`Topology`]: a spanning tree, the loops that close on it, and how
//! many ways the whole can move.

mod class;
mod graph;
mod kinematics;
mod mobility;
mod tree;

#[cfg(test)]
mod tests;

pub use graph::*;

use crate::laminate::Mechanism;
use crate::source::Diagnostics;

/// Finds the tree, the loops and their mobility.
///
/// # Errors
/// Bodies that no chain of joints connects to the ground.
pub fn build(mechanism: Mechanism) -> Result<Topology, Diagnostics> {
    let (nodes, closings) = tree::span(&mechanism)?;
    let mut topology = Topology {
        mobility: mechanism.joints.len(),
        mechanism,
        nodes,
        loops: Vec::new(),
        rank: 0,
        assembled: None,
        warnings: Diagnostics::default(),
    };
    class::classify(&mut topology, &closings);
    mobility::sample(&mut topology);
    Ok(topology)
}
