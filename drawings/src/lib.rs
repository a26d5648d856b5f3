//! Reads crease patterns and cut drawings, and writes them again.
//!
//! ```text
//! file -> Drawing (strokes with roles) -> Pattern (planar graph: vertices, edges, facets)
//! ```
//!
//! A reader turns the text of one format into a [`Drawing`]: straight strokes, each with the role that
//! its colour, layer or assignment gives it. [`Pattern`] is the planar graph of these strokes after
//! small mistakes of the drawing are mended: near points are one vertex, every crossing is a vertex,
//! and each facet is known by its outline. [`fold::write`] and [`svg::write`] write a pattern, [`explain`]
//! draws what is wrong with it. This crate knows nothing of mechanisms and of equations.

mod affine;
mod colour;
mod curve;
mod drawing;
pub mod dxf;
mod explain;
mod fault;
pub mod fold;
mod limits;
mod pattern;
mod reading;
mod sketch;
pub mod svg;

pub use drawing::{Drawing, Ignored, Place, Role, Stroke};
pub use explain::{Mark, MarkKind, explain};
pub use fault::{Cause, Fault};
pub use pattern::{Edge, EdgeId, Facet, FacetId, LARGEST_COORDINATE, Mended, Pattern, VertexId};
pub use reading::{Format, Reading, read};
