//! Arrays that functions read and write, and their sizes, which depend on the mechanism.

use super::ir::Interface;

/// A named array of numbers that a function reads or writes, row-major.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Array {
    /// Its name in the program's text and in generated code.
    pub name: &'static str,
    /// Its rows and columns.
    pub shape: Shape,
    /// The SI unit of its numbers; empty for pure numbers.
    pub unit: &'static str,
    /// What it holds, in a few words.
    pub doc: &'static str,
}

/// Rows and columns of an [`Array`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Shape(pub Size, pub Size);

impl Shape {
    /// One number.
    pub const SCALAR: Self = Self(Size::Fixed(1), Size::Fixed(1));

    /// A vector.
    pub const fn vector(length: Size) -> Self {
        Self(length, Size::Fixed(1))
    }

    /// Rows and columns for a mechanism.
    pub fn of(self, interface: &Interface) -> [usize; 2] {
        [self.0.of(interface), self.1.of(interface)]
    }

    /// The count of numbers for a mechanism.
    pub fn length(self, interface: &Interface) -> usize {
        self.of(interface).iter().product()
    }
}

impl std::fmt::Display for Shape {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self(rows, Size::Fixed(1)) => write!(f, "{rows}"),
            Self(rows, columns) => write!(f, "{rows} x {columns}"),
        }
    }
}

/// A size that depends on the mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Size {
    /// The same for every mechanism.
    Fixed(usize),
    /// NQ: the coordinates q.
    Coordinates,
    /// NU: the speeds u. Without free bodies there are as many as coordinates.
    Speeds,
    /// J: the joints.
    Joints,
    /// C: the closure rows of the acceleration.
    Rows,
    /// 9 L: nine closure residuals for each loop.
    Residuals,
    /// B: the bodies.
    Bodies,
    /// P: the output points.
    Points,
    /// K: the contact points.
    Contacts,
    /// 3 K: three rows for each contact point.
    ContactRows,
    /// D: the joints that follow a prescribed angle.
    Drives,
    /// The numbers that follow from the parameters alone.
    Drawn,
    /// The parameters.
    Parameters,
    /// The inputs.
    Inputs,
    /// What all controllers remember.
    Memory,
    /// The inputs that controllers drive.
    Commands,
    /// The joints in the order of the reduction to independent speeds; none without it.
    Branches,
    /// The joints whose speeds follow from independent ones; none without it.
    Dependent,
    /// The entries of the closure rows that determine these.
    ClosureEntries,
}

impl Size {
    /// The size for a mechanism.
    pub fn of(self, interface: &Interface) -> usize {
        match self {
            Self::Fixed(count) => count,
            Self::Coordinates => interface.coordinates(),
            Self::Speeds => interface.speeds(),
            Self::Joints => interface.joints.len(),
            Self::Rows => interface.rows,
            Self::Residuals => 9 * interface.loops.len(),
            Self::Bodies => interface.bodies.len(),
            Self::Points => interface.points.len(),
            Self::Contacts => interface.contacts.len(),
            Self::ContactRows => 3 * interface.contacts.len(),
            Self::Drives => interface.driven().len(),
            Self::Drawn => interface.drawn,
            Self::Parameters => interface.parameters.len(),
            Self::Inputs => interface.inputs.len(),
            Self::Memory => interface.memory().count(),
            Self::Commands => interface.commands().count(),
            Self::Branches => interface.reduction.as_ref().map_or(0, |it| it.branches.len()),
            Self::Dependent => interface.reduction.as_ref().map_or(0, |it| it.dependent().count()),
            Self::ClosureEntries => {
                interface.reduction.as_ref().map_or(0, |it| it.closure.columns.len())
            }
        }
    }
}

impl std::fmt::Display for Size {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let symbol = match self {
            Self::Fixed(count) => return write!(f, "{count}"),
            Self::Coordinates => "NQ",
            Self::Speeds => "NU",
            Self::Joints => "J",
            Self::Rows => "C",
            Self::Residuals => "9 L",
            Self::Bodies => "B",
            Self::Points => "P",
            Self::Contacts => "K",
            Self::ContactRows => "3 K",
            Self::Drives => "D",
            Self::Drawn => "drawn",
            Self::Parameters => "parameters",
            Self::Inputs => "inputs",
            Self::Memory => "memory",
            Self::Commands => "commands",
            Self::Branches => "branches",
            Self::Dependent => "dependent",
            Self::ClosureEntries => "entries",
        };
        f.write_str(symbol)
    }
}

/// An array of a shape.
pub const fn array(
    name: &'static str,
    shape: Shape,
    unit: &'static str,
    doc: &'static str,
) -> Array {
    Array { name, shape, unit, doc }
}

/// An array with one column.
pub const fn vector(
    name: &'static str,
    length: Size,
    unit: &'static str,
    doc: &'static str,
) -> Array {
    array(name, Shape::vector(length), unit, doc)
}
