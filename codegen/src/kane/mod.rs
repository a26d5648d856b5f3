//! Stage 4: [`Topology`](crate::topology::Topology) -> [`Equations`]: Kane's method and the
//! three-point closure.

mod equations;

pub use equations::*;
