//! Stage 3: [`Mechanism`](crate::laminate::Mechanism) -> [`Topology`]: a spanning tree, the loops
//! that close on it, and how many ways the whole can move.

mod graph;

pub use graph::*;
