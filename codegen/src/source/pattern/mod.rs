//! Drawings as mechanisms: the facets of a [`Pattern`](lamc_drawings::Pattern) become bodies, its
//! creases become joints.
//!
//! ```text
//! text -> Drawn (drawing, pattern) -> Sheet (parts and creases with names) -> bodies, joints
//! ```
//!
//! All findings point into the drawing. Coordinates are those of the drawing, in its units, with y
//! upwards, until `build` turns them into metres.
//!
//! **Names** are made from positions, so that they stay the same when other parts of the drawing are
//! edited: `facet_120_m30` has its centroid at (120, -30), and `crease_120_m30` its middle. The
//! numbers count steps of one unit of the drawing, or of 0.1, 0.01, .. units if the drawing is smaller
//! than 30, 3, .. units across. Of several with the same numbers, the lowest (then the leftmost) has this
//! name, and the others end with `_2`, `_3`, ... Bodies and joints come in the order of these numbers, from
//! the bottom to the top and from the left to the right.

mod bending;
mod build;
mod creases;
mod drawn;
mod faults;
mod gaps;
mod import;
mod names;
mod outlines;
mod sheet;
#[cfg(test)]
mod tests;

pub use drawn::{Drawn, MAX_DRAWING_BYTES};
pub use import::{Imported, Options, import};

pub(super) use build::Stack;
pub(super) use drawn::{Bytes, Lines};
pub(super) use import::FOLDED;
pub(super) use sheet::{Link, Sheet};

use super::diagnostic::Spanned;
use super::expression::Expression;

/// How a pattern becomes bodies and joints.
pub(super) struct Settings {
    /// Length of one unit of the drawing, m.
    pub scale: f64,
    /// Angles of the finished fold of mountains and valleys, rad.
    pub fold: [f64; 2],
    /// The hinges.
    pub crease: Crease,
    /// Whether the facet that is the ground is free instead of fixed.
    pub free: bool,
}

/// Which facet is fixed.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Ground {
    /// The largest facet of the piece with the most facets.
    #[default]
    Largest,
    /// The facet around this point, in units of the drawing.
    Around([f64; 2]),
    /// None: joints connect the facets with a fixed body.
    None,
}

/// The hinges of a pattern.
pub(super) struct Crease {
    /// Width of the gap between plates, m; 0 without a gap.
    pub width: f64,
    /// The spring.
    pub spring: CreaseSpring,
    /// The material of the layer that is not cut: an index into the materials.
    pub flexible: Option<usize>,
    /// Damping per length, N s/rad.
    pub damping: Spanned<Expression>,
}

/// The spring of a crease.
pub(super) enum CreaseSpring {
    /// Stiffness per length, N/rad.
    Stiffness(Spanned<Expression>),
    /// A strip of this material in bending.
    Beam(Spanned<usize>),
    /// The polynomials of DETC2018-86359.
    Sharifzadeh2018,
    /// One of the families of the file.
    Family(usize),
}

impl CreaseSpring {
    /// Whether it gives the damping too.
    pub fn damps(&self) -> bool {
        matches!(self, Self::Sharifzadeh2018 | Self::Family(_))
    }
}
