//! The numbers that functions read.

use super::ir::{Moving, Slot};
use super::shape::{Array, Shape, Size, array, vector};

/// What a function may read.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[allow(missing_docs, reason = "`array` documents each")]
pub enum Argument {
    Time,
    Positions,
    Speeds,
    Parameters,
    Inputs,
    /// See [`FunctionKind::inputs`](super::FunctionKind::inputs).
    Drawing,
    Accelerations,
    Multipliers,
    Memory,
    TimeChange,
    PositionChange,
    SpeedChange,
    ParameterChange,
    InputChange,
}

impl Argument {
    /// Name, shape, unit and meaning.
    pub const fn array(self) -> Array {
        use Size::{Coordinates, Drawn, Inputs, Parameters, Rows, Speeds};
        match self {
            Self::Time => array("t", Shape::SCALAR, "s", "the time"),
            Self::Positions => vector("q", Coordinates, "rad", "the coordinates"),
            Self::Speeds => vector("u", Speeds, "rad/s", "the speeds"),
            Self::Parameters => vector("p", Parameters, "SI", "the parameters"),
            Self::Inputs => vector("in", Inputs, "SI", "the inputs"),
            Self::Drawing => {
                vector("drawing", Drawn, "SI", "the numbers that follow from the parameters alone")
            }
            Self::Accelerations => vector("a", Speeds, "rad/s^2", "du/dt"),
            Self::Multipliers => vector("lambda", Rows, "N", "the closure forces"),
            Self::Memory => vector("memory", Size::Memory, "SI", "what the controllers remember"),
            Self::TimeChange => array("dt", Shape::SCALAR, "s", "the change of t"),
            Self::PositionChange => vector("dq", Speeds, "rad", "the change of q"),
            Self::SpeedChange => vector("du", Speeds, "rad/s", "the change of u"),
            Self::ParameterChange => vector("dp", Parameters, "SI", "the change of the parameters"),
            Self::InputChange => vector("di", Inputs, "SI", "the change of the inputs"),
        }
    }

    /// The name in the program's text and in generated code.
    pub const fn name(self) -> &'static str {
        self.array().name
    }
}

impl Slot {
    /// The argument that a slot is read from, and its place in that array.
    pub fn place(self) -> (Argument, usize) {
        match self {
            Self::Time => (Argument::Time, 0),
            Self::Position(id) => (Argument::Positions, id.index()),
            Self::Rate(id) => (Argument::Speeds, id.index()),
            Self::Parameter(id) => (Argument::Parameters, id.index()),
            Self::Input(id) => (Argument::Inputs, id.index()),
            Self::Drawn(place) => (Argument::Drawing, place),
            Self::Acceleration(id) => (Argument::Accelerations, id.index()),
            Self::Multiplier(row) => (Argument::Multipliers, row),
            Self::Memory(id) => (Argument::Memory, id.index()),
            Self::Change(Moving::Time) => (Argument::TimeChange, 0),
            Self::Change(Moving::Position(id)) => (Argument::PositionChange, id.index()),
            Self::Change(Moving::Rate(id)) => (Argument::SpeedChange, id.index()),
            Self::Change(Moving::Parameter(id)) => (Argument::ParameterChange, id.index()),
            Self::Change(Moving::Input(id)) => (Argument::InputChange, id.index()),
        }
    }
}
