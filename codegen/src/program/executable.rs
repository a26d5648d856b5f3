//! A program with values for its parameters and inputs: a mechanism the runtime can integrate
//! without a Rust compiler, whatever runs the functions.

use lamc_runtime::{
    Balance, Change, Dimensions, Drive, Energy, EquationsMut, JacobianMut, Margin, ProjectionMut,
    StraightLine, System, workspace_len,
};

use super::ir::{Interface, Program, Slot};
use super::signature::{Argument, FunctionKind};

/// What evaluates the functions of a program.
pub trait Engine: Sized {
    /// An engine for the functions of a program.
    fn new(program: &Program) -> Self;

    /// Evaluates a function: `load` gives what it reads, `out` takes its outputs in order.
    fn run(&self, kind: FunctionKind, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]);
}

/// No parameter or input has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no parameter or input is called `{0}`")]
pub struct UnknownName(pub String);

/// A program ready to be evaluated, at settable parameters and inputs.
#[derive(Clone, Debug)]
pub struct Executable<E> {
    engine: E,
    interface: Interface,
    parameters: Vec<f64>,
    inputs: Vec<f64>,
}

/// What a function is evaluated at; what it does not read may be empty.
#[derive(Clone, Copy, Default)]
struct State<'a> {
    t: f64,
    q: &'a [f64],
    u: &'a [f64],
    acceleration: &'a [f64],
    multipliers: &'a [f64],
    change: Change<'a, f64>,
}

impl<E: Engine> Executable<E> {
    /// A program with its default parameters and all inputs zero.
    pub fn new(program: &Program) -> Self {
        let interface = program.interface.clone();
        Self {
            engine: E::new(program),
            parameters: interface.parameters.iter().map(|p| p.value).collect(),
            inputs: vec![0.0; interface.inputs.len()],
            interface,
        }
    }

    /// What runs the functions.
    pub fn engine(&self) -> &E {
        &self.engine
    }

    /// What is known of the mechanism.
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The parameters in their order, SI.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The inputs in their order, SI.
    pub fn inputs(&self) -> &[f64] {
        &self.inputs
    }

    /// Sets a parameter, SI.
    ///
    /// # Errors
    /// When there is none of this name.
    pub fn set_parameter(&mut self, name: &str, value: f64) -> Result<(), UnknownName> {
        let index = self.interface.parameters.iter().position(|p| p.name == name);
        let index = index.ok_or_else(|| UnknownName(name.to_owned()))?;
        self.parameters[index] = value;
        Ok(())
    }

    /// Sets an input, SI.
    ///
    /// # Errors
    /// When there is none of this name.
    pub fn set_input(&mut self, name: &str, value: f64) -> Result<(), UnknownName> {
        let index = self.interface.inputs.iter().position(|input| input == name);
        let index = index.ok_or_else(|| UnknownName(name.to_owned()))?;
        self.inputs[index] = value;
        Ok(())
    }

    /// Replaces the guess (rad) from which a joint starts.
    pub fn set_initial(&mut self, joint: usize, angle: f64) {
        let joint = &mut self.interface.joints[joint];
        (joint.initial_q, joint.initial_given) = (angle, true);
    }

    /// Parameters and inputs go back to their defaults.
    pub fn reset(&mut self) {
        self.parameters = self.interface.parameters.iter().map(|p| p.value).collect();
        self.inputs.fill(0.0);
    }

    /// Evaluates a function where everything that it reads and writes has the length of its
    /// signature, and does nothing elsewhere.
    fn evaluate(&self, kind: FunctionKind, at: State<'_>, out: &mut [&mut [f64]]) {
        let signature = kind.signature();
        let is_whole = |argument: &Argument| {
            self.read(*argument, &at).len() == argument.array().shape.length(&self.interface)
        };
        let lengths = out.iter().map(|out| out.len());
        if signature.inputs.iter().all(is_whole) && lengths.eq(signature.lengths(&self.interface)) {
            let load = |slot: Slot| {
                let (argument, index) = slot.place();
                self.read(argument, &at)[index]
            };
            self.engine.run(kind, load, out);
        }
    }

    /// The numbers of an argument.
    fn read<'a>(&'a self, argument: Argument, at: &'a State<'a>) -> &'a [f64] {
        match argument {
            Argument::Time => std::slice::from_ref(&at.t),
            Argument::Positions => at.q,
            Argument::Speeds => at.u,
            Argument::Parameters => &self.parameters,
            Argument::Inputs => &self.inputs,
            Argument::Accelerations => at.acceleration,
            Argument::Multipliers => at.multipliers,
            Argument::TimeChange => std::slice::from_ref(&at.change.t),
            Argument::PositionChange => at.change.q,
            Argument::SpeedChange => at.change.u,
            Argument::ParameterChange => at.change.parameters,
            Argument::InputChange => at.change.inputs,
        }
    }
}

impl<E: Engine> System for Executable<E> {
    type Scalar = f64;
    type Vector = Vec<f64>;
    type Matrix = Vec<f64>;
    type Workspace = Vec<f64>;

    fn dimensions(&self) -> Dimensions {
        let interface = &self.interface;
        Dimensions {
            coordinates: interface.joints.len(),
            rows: interface.rows,
            loops: interface.loops.len(),
            bodies: interface.bodies.len(),
            points: interface.points.len(),
            drives: interface.driven().len(),
            parameters: interface.parameters.len(),
            inputs: interface.inputs.len(),
        }
    }

    fn vector(&self) -> Vec<f64> {
        vec![0.0; self.interface.joints.len()]
    }

    fn matrix(&self) -> Vec<f64> {
        vec![0.0; self.interface.joints.len() * self.interface.joints.len()]
    }

    fn workspace(&self) -> Vec<f64> {
        vec![0.0; workspace_len(self.dimensions())]
    }

    fn size(&self) -> f64 {
        self.interface.size
    }

    fn limits(&self, joint: usize) -> [f64; 2] {
        let unlimited = [f64::NEG_INFINITY, f64::INFINITY];
        self.interface.joints.get(joint).map_or(unlimited, |joint| joint.limits)
    }

    fn initial_position(&self, joint: usize) -> f64 {
        self.interface.joints.get(joint).map_or(0.0, |joint| joint.initial_q)
    }

    fn initial_speed(&self, joint: usize) -> f64 {
        self.interface.joints.get(joint).map_or(0.0, |joint| joint.initial_u)
    }

    fn is_pinned(&self, joint: usize) -> bool {
        self.interface.joints.get(joint).is_some_and(|joint| joint.initial_given)
    }

    fn write_equations(&self, t: f64, q: &[f64], u: &[f64], out: EquationsMut<'_, f64>) {
        let out = &mut [out.mass, out.forcing, out.jacobian, out.gamma];
        self.evaluate(FunctionKind::Equations, State { t, q, u, ..State::default() }, out);
    }

    fn write_closure(&self, q: &[f64], residual: &mut [f64], jacobian: &mut [f64]) {
        let at = State { q, ..State::default() };
        self.evaluate(FunctionKind::Closure, at, &mut [residual, jacobian]);
    }

    fn write_poses(&self, q: &[f64], out: &mut [f64]) {
        self.evaluate(FunctionKind::Poses, State { q, ..State::default() }, &mut [out]);
    }

    fn write_points(&self, q: &[f64], out: &mut [f64]) {
        self.evaluate(FunctionKind::Points, State { q, ..State::default() }, &mut [out]);
    }

    fn energy(&self, t: f64, q: &[f64], u: &[f64]) -> Energy<f64> {
        let (mut kinetic, mut potential) = ([f64::NAN], [f64::NAN]);
        let out: &mut [&mut [f64]] = &mut [&mut kinetic, &mut potential];
        self.evaluate(FunctionKind::Energy, State { t, q, u, ..State::default() }, out);
        Energy { kinetic: kinetic[0], potential: potential[0] }
    }

    fn drives(&self, t: f64, mut visit: impl FnMut(Drive<f64>)) {
        let driven = self.interface.driven();
        let count = FunctionKind::Drives.signature().lengths(&self.interface).sum();
        let mut values = vec![0.0; count];
        let at = State { t, ..State::default() };
        self.evaluate(FunctionKind::Drives, at, &mut [&mut values]);
        for (joint, values) in driven.iter().zip(values.chunks_exact(4)) {
            let [position, speed, acceleration, jerk] =
                [values[0], values[1], values[2], values[3]];
            visit(Drive { joint: joint.index(), position, speed, acceleration, jerk });
        }
    }

    fn write_reactions(&self, at: Balance<'_, f64>, out: &mut [f64]) {
        let Balance { t, q, u, acceleration, multipliers } = at;
        let at = State { t, q, u, acceleration, multipliers, ..State::default() };
        self.evaluate(FunctionKind::Reactions, at, &mut [out]);
    }

    fn write_tangent(
        &self,
        at: Balance<'_, f64>,
        change: Change<'_, f64>,
        forces: &mut [f64],
        closure: &mut [f64],
    ) {
        let Balance { t, q, u, acceleration, multipliers } = at;
        let at = State { t, q, u, acceleration, multipliers, change };
        self.evaluate(FunctionKind::Tangent, at, &mut [forces, closure]);
    }
}

impl<E: Engine> StraightLine for Executable<E> {
    type Number = f64;

    fn write_acceleration(&self, t: f64, q: &[f64], u: &[f64], out: &mut [f64]) -> Margin<f64> {
        let mut margin = [f64::NAN; 2];
        let at = State { t, q, u, ..State::default() };
        self.evaluate(FunctionKind::Acceleration, at, &mut [out, &mut margin]);
        let [inverse_pivot, conditioning] = margin;
        Margin { inverse_pivot, conditioning }
    }

    fn write_projection(&self, q: &[f64], u: &[f64], out: ProjectionMut<'_, f64>) -> Margin<f64> {
        let mut margin = [f64::NAN; 2];
        let ProjectionMut { residual, positions, speeds } = out;
        let out: &mut [&mut [f64]] = &mut [residual, positions, speeds, &mut margin];
        self.evaluate(FunctionKind::Projection, State { q, u, ..State::default() }, out);
        let [inverse_pivot, conditioning] = margin;
        Margin { inverse_pivot, conditioning }
    }

    fn write_jacobian(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: JacobianMut<'_, f64>,
    ) -> Margin<f64> {
        let mut margin = [f64::NAN; 2];
        let JacobianMut { acceleration, dq, du, dt } = out;
        let out: &mut [&mut [f64]] = &mut [acceleration, dq, du, dt, &mut margin];
        self.evaluate(FunctionKind::Jacobian, State { t, q, u, ..State::default() }, out);
        let [inverse_pivot, conditioning] = margin;
        Margin { inverse_pivot, conditioning }
    }
}
