//! What is wrong with a drawing, and where.

use crate::drawing::Place;

/// The kind of a fault. Each has one explanation, which `lamc explain` prints.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Cause {
    /// The text does not follow the syntax of its format.
    Syntax,
    /// A coordinate or an angle is not a finite number, or too large.
    Number,
    /// The file is larger, or nested deeper, than lamc reads.
    Limit,
    /// The file has no lines of a pattern.
    Empty,
    /// The outline of the sheet is open.
    OpenOutline,
    /// Two lines, or two parts of the file, contradict each other.
    Contradiction,
    /// A line is no edge of a facet.
    Dangling,
    /// A crease is at the edge of the sheet: it has a facet on one side only.
    Rim,
    /// A facet is thinner than the tolerance.
    Thin,
    /// Layers are named where layers say nothing.
    Layers,
}

/// A fault of a drawing.
#[derive(Clone, Debug, PartialEq)]
pub struct Fault {
    /// Its kind.
    pub cause: Cause,
    /// Message of one line that says what is wrong.
    pub message: String,
    /// Position in the text; None for the file as a whole.
    pub place: Option<Place>,
    /// Points of the drawing at which it is, in units of the drawing.
    pub at: Vec<[f64; 2]>,
    /// How to correct it.
    pub hint: Option<String>,
}
