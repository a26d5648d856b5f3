//! The straight-line program: typed values, operations, functions and their outputs.
//!
//! A [`Program`] is the set of functions a compiled mechanism offers plus what a caller must know
//! of it ([`Interface`]). Each [`Function`] is a list of instructions in which every operand was
//! defined earlier.

use serde::{Deserialize, Serialize};

use super::Pwm;
use super::reduction::ReductionInfo;
use super::serial;
use super::signature::FunctionKind;
use super::{Fact, Section};
use crate::source::free::{
    COORDINATE_NAMES, COORDINATE_UNITS, COORDINATES, SPEED_NAMES, SPEED_UNITS, SPEEDS,
};
use crate::source::ids::index;
use crate::source::{CoordinateId, InputId, JointId, MemoryId, ParameterId, SpeedId};

index!(
    /// The result of an instruction of the same function.
    Value
);

/// An operation; operands are earlier values.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[allow(missing_docs, reason = "each is the operation of its name")]
pub enum Op {
    Const(f64),
    Load(Slot),
    Neg(Value),
    Add(Value, Value),
    Sub(Value, Value),
    Mul(Value, Value),
    Div(Value, Value),
    Sqrt(Value),
    Sin(Value),
    Cos(Value),
    Tan(Value),
    Exp(Value),
    Abs(Value),
    Tanh(Value),
    /// Natural logarithm.
    Ln(Value),
    /// 1 where the operand is not negative, else 0.
    Step(Value),
    Min(Value, Value),
    Max(Value, Value),
    Pow(Value, Value),
    /// The angle of the point (second, first), from -pi to pi.
    Atan2(Value, Value),
}

/// An argument of a function.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub enum Slot {
    /// t, s.
    Time,
    /// q: rad, of free bodies m and pure numbers.
    Position(CoordinateId),
    /// u: rad/s, of free bodies m/s too.
    Rate(SpeedId),
    /// A parameter.
    Parameter(ParameterId),
    /// An input.
    Input(InputId),
    /// A number that follows from the parameters alone.
    Drawn(usize),
    /// Given du/dt: rad/s^2, of free bodies m/s^2 too.
    Acceleration(SpeedId),
    /// Given closure force lambda of a row, N.
    Multiplier(usize),
    /// What a controller remembers.
    Memory(MemoryId),
    /// The direction of a derivative: the rate at which another slot changes.
    Change(Moving),
}

/// What a [`Slot::Change`] is the rate of. The change of q has an entry for each speed: q changes as at that
/// speed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "as in `Slot`")]
pub enum Moving {
    Time,
    Position(SpeedId),
    Rate(SpeedId),
    Parameter(ParameterId),
    Input(InputId),
}

/// One instruction; its index in [`Function::instructions`] is its [`Value`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Instruction {
    /// The operation.
    pub op: Op,
    /// The body or loop and the phase of the derivation that it belongs to.
    pub section: Section,
    /// Its name, if it is a named quantity: `omega_left_x`.
    pub name: Option<String>,
}

/// A straight-line function.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Function {
    /// Which.
    pub kind: FunctionKind,
    /// Operands always precede.
    pub instructions: Vec<Instruction>,
    /// Its outputs.
    pub outputs: Vec<Output>,
}

/// A named array a function writes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Output {
    /// The name in the function's signature.
    #[serde(deserialize_with = "serial::name_of_an_output")]
    pub name: OutputName,
    /// Number of rows.
    pub rows: usize,
    /// Number of columns.
    pub columns: usize,
    /// Row-major.
    pub entries: Vec<Value>,
}

/// The name of an output. (For a field of the type `&str`, serde would want the text to live as long as the
/// bytes that are read.)
pub type OutputName = &'static str;

/// Everything a backend needs.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Program {
    /// Names, sizes, defaults.
    pub interface: Interface,
    /// The numbers of the model, by name.
    pub facts: Vec<Fact>,
    /// One per [`FunctionKind`], in that order.
    pub functions: Vec<Function>,
}

impl Interface {
    /// NQ, the length of q.
    pub fn coordinates(&self) -> usize {
        self.joints.len() + COORDINATES * self.free.len()
    }

    /// NU, the length of u.
    pub fn speeds(&self) -> usize {
        self.joints.len() + SPEEDS * self.free.len()
    }

    /// The name of a coordinate: that of the joint, or one of `body.x` to `body.qz`.
    pub fn coordinate_name(&self, id: CoordinateId) -> String {
        self.name_of(id.index(), &COORDINATE_NAMES)
    }

    /// The name of a speed: that of the joint, or one of `body.vx` to `body.wz`.
    pub fn speed_name(&self, id: SpeedId) -> String {
        self.name_of(id.index(), &SPEED_NAMES)
    }

    /// The names of all coordinates, as [`coordinate_name`](Self::coordinate_name) gives them, with their units.
    pub fn coordinate_columns(&self) -> impl Iterator<Item = (String, &'static str)> {
        (0..self.coordinates()).map(|index| {
            let beyond = index.checked_sub(self.joints.len());
            let unit = beyond.map_or("rad", |beyond| COORDINATE_UNITS[beyond % COORDINATES]);
            (self.coordinate_name(CoordinateId(index)), unit)
        })
    }

    /// The names of all speeds, as [`speed_name`](Self::speed_name) gives them, with their units.
    pub fn speed_columns(&self) -> impl Iterator<Item = (String, &'static str)> {
        (0..self.speeds()).map(|index| {
            let beyond = index.checked_sub(self.joints.len());
            let unit = beyond.map_or("rad/s", |beyond| SPEED_UNITS[beyond % SPEEDS]);
            (self.speed_name(SpeedId(index)), unit)
        })
    }

    /// Refuses a mechanism with a free body for something, `what`, that handles none.
    ///
    /// # Errors
    /// A body is free; the text says so.
    pub fn without_free(&self, what: &str) -> Result<(), String> {
        match self.free.first() {
            None => Ok(()),
            Some(body) => Err(format!(
                "body `{}` is free, and {what} do not handle free bodies yet",
                body.name
            )),
        }
    }

    /// Refuses controllers for `what`, which needs constant inputs.
    ///
    /// # Errors
    /// Returns what to do instead if there is a controller.
    pub fn without_controllers(&self, what: &str) -> Result<(), String> {
        match self.controllers.first() {
            None => Ok(()),
            Some(controller) => Err(format!(
                "controller `{}` drives inputs in discrete time, and {what} need constant inputs: remove the controllers \
                 from the model",
                controller.name
            )),
        }
    }

    fn name_of(&self, index: usize, parts: &[&str]) -> String {
        match index.checked_sub(self.joints.len()) {
            None => self.joints[index].name.clone(),
            Some(beyond) => {
                let body = &self.free[beyond / parts.len()].name;
                format!("{body}.{}", parts[beyond % parts.len()])
            }
        }
    }

    /// Whether a joint has a limit.
    pub fn has_stops(&self) -> bool {
        self.joints.iter().flat_map(|joint| joint.limits).any(f64::is_finite)
    }

    /// The driven joints, in the order of the drives.
    pub fn driven(&self) -> Vec<JointId> {
        let joints = self.joints.iter().enumerate().filter(|(_, joint)| joint.driven);
        joints.map(|(index, _)| JointId(index)).collect()
    }
}

impl Interface {
    /// What all controllers remember: names and first values, in the order of the memory.
    pub fn memory(&self) -> impl Iterator<Item = &(String, f64)> {
        self.controllers.iter().flat_map(|controller| &controller.memory)
    }

    /// The inputs that controllers drive, in the order of the commands.
    pub fn commands(&self) -> impl Iterator<Item = InputId> + '_ {
        self.controllers.iter().flat_map(|controller| controller.inputs.iter().copied())
    }
}

impl Program {
    /// The function of this kind.
    pub fn function_of(&self, kind: FunctionKind) -> &Function {
        &self.functions[kind as usize]
    }

    /// Whether the program solves for accelerations itself, without the loops of the runtime.
    pub fn solves(&self) -> bool {
        !self.function_of(FunctionKind::Acceleration).outputs.is_empty()
    }

    /// The reduction to independent speeds, if the program has functions for it.
    pub fn reduction(&self) -> Option<&ReductionInfo> {
        let is_left_out = self.function_of(FunctionKind::Reduction).outputs.is_empty();
        self.interface.reduction.as_ref().filter(|_| !is_left_out)
    }
}

/// Interface of a mechanism for callers.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Interface {
    /// The model's name, an identifier in snake case.
    pub name: String,
    /// The input file's name without folders.
    pub source_name: String,
    /// SHA-256 of the input text, hexadecimal.
    pub source_hash: String,
    /// Joints, in the order of q and u.
    pub joints: Vec<JointInfo>,
    /// Free bodies, in file order: q and u go on with theirs.
    pub free: Vec<FreeBodyInfo>,
    /// Body names, in file order.
    pub bodies: Vec<BodyInfo>,
    /// Nodes of the tree: bodies by name, ghosts with the loop they close.
    pub nodes: Vec<String>,
    /// Point names, in file order.
    pub points: Vec<String>,
    /// Names of the contact points: the contact, then the point or the body and its corner, with dots between.
    pub contacts: Vec<String>,
    /// Parameters.
    pub parameters: Vec<ParameterInfo>,
    /// How many numbers follow from the parameters alone and are computed once: 0 if the drawing has no parameters.
    pub drawn: usize,
    /// Input names.
    pub inputs: Vec<String>,
    /// Controllers, in file order.
    pub controllers: Vec<ControllerInfo>,
    /// Rows of the acceleration's closure Jacobian.
    pub rows: usize,
    /// One line per loop: class, equations, rank, mobility.
    pub loops: Vec<String>,
    /// Generic rank over all loops.
    pub rank: usize,
    /// Degrees of freedom.
    pub mobility: usize,
    /// Joints at which loops were to be cut, by name.
    pub cuts: Vec<String>,
    /// Diagonal of the flat bounding box, m.
    pub size: f64,
    /// How the speeds follow from independent ones, if the runtime solves for those.
    pub reduction: Option<ReductionInfo>,
}

/// A joint, as a caller sees it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct JointInfo {
    /// Its name.
    pub name: String,
    /// Names of the two bodies.
    pub bodies: [String; 2],
    /// Allowed angles, rad.
    pub limits: [f64; 2],
    /// Rough guess of q, rad.
    pub initial_q: f64,
    /// Whether the guess was given by the user.
    pub initial_given: bool,
    /// Initial u, rad/s.
    pub initial_u: f64,
    /// Whether it follows a prescribed angle.
    pub driven: bool,
}

/// A free body, as a caller sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeBodyInfo {
    /// The body's name.
    pub name: String,
    /// Its coordinates at the start.
    pub q: [f64; COORDINATES],
    /// Its speeds at the start.
    pub u: [f64; SPEEDS],
}

/// A body, as a caller sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyInfo {
    /// Its name.
    pub name: String,
    /// Part of the ground.
    pub fixed: bool,
}

/// A controller, as a caller sees it. Its memory and its commands follow those of the controllers before it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ControllerInfo {
    /// Its name.
    pub name: String,
    /// Time between its samples, s.
    pub sample: f64,
    /// Time from a sample to the moment at which its commands act, s.
    pub delay: f64,
    /// Names and first values of what it remembers.
    pub memory: Vec<(String, f64)>,
    /// The inputs that it drives.
    pub inputs: Vec<InputId>,
    /// How its commands are switched, if they are.
    pub pwm: Option<Pwm>,
}

/// A parameter, as a caller sees it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ParameterInfo {
    /// Its name.
    pub name: String,
    /// Default, SI.
    pub value: f64,
    /// One line of documentation.
    pub doc: String,
}
