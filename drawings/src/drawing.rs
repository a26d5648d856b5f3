//! What a file says before anything is mended: straight strokes with roles.

use crate::fault::Fault;

/// A half-open range of bytes in the text of a file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub struct Place {
    /// Index of the first byte.
    pub start: usize,
    /// Index after the last byte.
    pub end: usize,
}

/// What a line of a drawing means.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Role {
    /// The edge of the sheet.
    Border,
    /// A crease that folds away from the viewer: its angle is negative.
    Mountain,
    /// A crease that folds towards the viewer: its angle is positive.
    Valley,
    /// A line of a triangulation: the facets on both sides stay in one plane.
    Flat,
    /// A crease that nothing drives: its angle has no target.
    Hinge,
    /// A cut through the sheet.
    Cut,
}

/// A straight line of a drawing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// Its two ends, in units of the drawing; x to the right, y upwards, seen from above.
    pub ends: [[f64; 2]; 2],
    /// Its meaning.
    pub role: Role,
    /// The target angle, rad: from -pi (mountain) to pi (valley); 0 is flat. None if the file gives none.
    pub fold: Option<f64>,
    /// The angle in the folded state of the file, rad, with the sign of `fold`; None without such a state.
    pub angle: Option<f64>,
    /// Its position in the text.
    pub place: Place,
}

/// Something in a file that is not a line of the pattern, such as text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Ignored {
    /// What it is, in the words of the format: `text`, `image`, `HATCH`.
    pub what: String,
    /// How many of them the file has.
    pub count: usize,
    /// The position of the first one in the text.
    pub place: Place,
}

/// All lines of a file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Drawing {
    /// The lines, in the order of the file.
    pub strokes: Vec<Stroke>,
    /// The length of one unit of the drawing, m, if the file says it.
    pub unit: Option<f64>,
    /// The unit that the file names, if its format does not define how long it is.
    pub unknown_unit: Option<String>,
    /// The areas of the facets that the file lists, in square units of the drawing; empty if it lists
    /// none. They are compared with the facets that the strokes enclose.
    pub areas: Vec<f64>,
    /// What was not read.
    pub ignored: Vec<Ignored>,
    /// What is doubtful in the file itself.
    pub doubts: Vec<Fault>,
}

impl Drawing {
    /// Says why [`unit`](Self::unit) is None, in words that follow the name of the drawing.
    pub fn why_no_unit(&self) -> String {
        match &self.unknown_unit {
            Some(name) => format!("gives its unit as `{name}`, whose length is not defined"),
            None => "does not say how long its unit is".to_owned(),
        }
    }
}
