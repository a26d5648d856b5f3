//! The goals of an optimisation: text -> [`Goals`].

mod compound;
mod keys;
mod measures;
mod path_keys;
mod paths;
mod read;

pub use keys::MAPPINGS;

use lamc::pipeline::Compiled;
use lamc::source::{Diagnostics, SourceFile, Span};

use crate::sweep::plan::Varied;

/// Most starts of a search.
pub const MOST_STARTS: u64 = 100_000;
/// Most robots that stand for all in a search.
pub const MOST_ROBOTS: u64 = 10_000;
/// Most points of a path.
pub const MOST_POINTS: usize = 10_000;

/// What varies, and what is aimed at.
#[derive(Clone, Debug, PartialEq)]
pub struct Goals {
    /// The parameters that vary.
    pub variables: Vec<Variable>,
    /// What the design should come near to.
    pub goals: Vec<Goal>,
    /// What the design has to keep.
    pub constraints: Vec<Constraint>,
    /// How errors are put together.
    pub norm: Norm,
    /// How many designs the search starts from.
    pub starts: u64,
    /// Chooses them.
    pub seed: u64,
    /// By how much parameters of built robots differ from the design.
    pub tolerances: Vec<Varied>,
    /// How many standard deviations are added to the mean over built robots; `None`: the design itself counts.
    pub robust: Option<f64>,
    /// How many built robots stand for all in a search.
    pub robots: u64,
}

/// A parameter that varies.
#[derive(Clone, Debug, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Its place among the parameters of the program.
    pub parameter: usize,
    /// Least and greatest value, SI.
    pub bounds: [f64; 2],
    /// Where the goals name it.
    pub span: Span,
}

/// How the errors of goals are put together.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Norm {
    /// The sum over the goals of weight times mean square.
    Squares,
    /// The largest of all errors times their weights.
    Max,
}

/// What a design should come near to.
#[derive(Clone, Debug, PartialEq)]
pub struct Goal {
    /// Its name.
    pub name: String,
    /// How much its error counts.
    pub weight: f64,
    /// What it is.
    pub aim: Aim,
    /// How far a built robot may be from the target or from the path, SI; `None` where the goal has a limit, or is not judged.
    pub within: Option<f64>,
}

/// The aim of a goal.
#[derive(Clone, Debug, PartialEq)]
pub enum Aim {
    /// A point passes near given ones.
    Path(Path),
    /// A number comes near a value, or keeps a limit.
    Number(Measure, Wanted),
}

/// What a design has to keep.
#[derive(Clone, Debug, PartialEq)]
pub struct Constraint {
    /// Its name.
    pub name: String,
    /// The number.
    pub measure: Measure,
    /// Its limit; never a target.
    pub wanted: Wanted,
}

/// A number of a design.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Measure {
    /// The angle of a joint at rest, rad.
    Angle(usize),
    /// A coordinate (0: x, 1: y, 2: z) of a point at rest, m.
    Position {
        /// The point.
        point: usize,
        /// The coordinate.
        axis: usize,
    },
    /// The natural frequency of a mode, counted from 0, Hz.
    Frequency(usize),
    /// The mass of a body, or of all that move, kg.
    Mass(Option<usize>),
    /// The stiffness of a point along an axis (0: x, 1: y, 2: z) about the state of rest, N/m.
    Stiffness {
        /// The point.
        point: usize,
        /// The axis.
        axis: usize,
    },
    /// The torque that holds a joint whose angle is prescribed at rest, N m.
    Torque(usize),
    /// The force that a hinge transmits at rest, N.
    Force(usize),
    /// How far the flat drawing extends along x or y (0, 1), m.
    Extent(usize),
    /// How far plates are apart, m; negative where they pass through each other.
    Clearance(Clearance),
    /// The time until something stays near its state of rest, s.
    Settle(Settle),
    /// The potential energy at rest, J.
    Energy,
    /// How far something moves, m or rad.
    Stroke(Stroke),
    /// Something at a time of the motion from the initial state.
    Moving(Moving),
}

/// A number at a time of the motion from the initial state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Moving {
    /// What it is.
    pub of: OfState,
    /// The time, s.
    pub at: f64,
}

/// A number of a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OfState {
    /// The angle of a joint, rad.
    Angle(usize),
    /// A coordinate (0: x, 1: y, 2: z) of a point, m.
    Position {
        /// The point.
        point: usize,
        /// The coordinate.
        axis: usize,
    },
    /// The kinetic (0) or the potential (1) energy, J.
    Energy(usize),
}

/// How far plates are apart.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearance {
    /// Two bodies; `None`: any two that share no hinge.
    pub between: Option<[usize; 2]>,
    /// The joint that is turned, with its first and its last angle, rad: the least distance on the way counts. `None`: at rest.
    pub turned: Option<(usize, [f64; 2])>,
}

/// When something comes to rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settle {
    /// What it is: an angle or a position.
    pub of: OfState,
    /// How far from its value at rest it may stay, rad or m.
    pub within: f64,
    /// The motion is followed until this time, s.
    pub until: f64,
}

/// How far something moves while a joint is turned.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stroke {
    /// What moves.
    pub of: Moved,
    /// The joint that is turned.
    pub drive: usize,
    /// Its first and its last angle, rad.
    pub angles: [f64; 2],
}

/// What moves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Moved {
    /// A point.
    Point(usize),
    /// A joint.
    Joint(usize),
}

/// What a number should be, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Wanted {
    /// Near this.
    Target(f64),
    /// Not more than this.
    AtMost(f64),
    /// Not less than this.
    AtLeast(f64),
}

/// A path of a point while a joint is turned.
#[derive(Clone, Debug, PartialEq)]
pub struct Path {
    /// The point.
    pub point: usize,
    /// The joint.
    pub joint: usize,
    /// The first and the last angle of the joint, rad.
    pub angles: [f64; 2],
    /// Which coordinates count.
    pub axes: Vec<usize>,
    /// Whether each target belongs to an angle.
    pub timed: bool,
    /// Where the point should pass.
    pub targets: Vec<Target>,
}

/// Where a point should pass.
#[derive(Clone, Debug, PartialEq)]
pub struct Target {
    /// At this angle of the joint, rad, if the path is timed.
    pub angle: f64,
    /// By the axes of the path, m; NaN where it does not matter.
    pub at: Vec<f64>,
}

impl Goal {
    /// Whether it is a number with a limit.
    pub fn has_limit(&self) -> bool {
        matches!(self.aim, Aim::Number(_, Wanted::AtMost(_) | Wanted::AtLeast(_)))
    }
}

impl Wanted {
    /// The value of the target or of the limit.
    pub fn value(self) -> f64 {
        match self {
            Self::Target(value) | Self::AtMost(value) | Self::AtLeast(value) => value,
        }
    }
}

impl Goals {
    /// Reads the goals for a model.
    ///
    /// # Errors
    /// Returns all mistakes together.
    pub fn read(file: &SourceFile, compiled: &Compiled) -> Result<Self, Diagnostics> {
        read::goals(file, compiled)
    }
}
