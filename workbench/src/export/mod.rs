//! States of a mechanism for other programs: FOLD, OBJ and STL.

mod facets;
mod fold;
mod graph;
mod solids;
#[cfg(test)]
mod tests;

pub use fold::{Folded, fold};
pub use solids::{obj, stl};

/// Why a mechanism cannot be written as FOLD.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum FoldError {
    /// No body has plates.
    #[error("the model has no plates, which would be the faces of the FOLD file")]
    NoPlates,
    /// Plates of two bodies cover each other in the flat state.
    #[error(
        "the plates of `{0}` and `{1}` overlap in the flat state, but a crease pattern in FOLD is a single \
         sheet"
    )]
    Overlap(String, String),
    /// The file would be too large.
    #[error(
        "{frames} frames of {vertices} vertices are too many for one file: lower --rate or --duration"
    )]
    TooLarge {
        /// The number of frames.
        frames: usize,
        /// The number of vertices.
        vertices: usize,
    },
}
