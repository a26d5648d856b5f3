//! A program as a mechanism of the runtime.

use lamc_runtime::plumbing::{
    Balance, Dimensions, Drive, EquationsMut, GapsMut, Margin, ProjectionMut, workspace_len,
};
use lamc_runtime::{Change, Energy, Error, JacobianMut, Mechanism, Momentum, StateOf, free_body};

<<<<<<< HEAD:codegen/src/program/executable/mechanism.rs
use super::{Executable, State};
use crate::program::{Engine, FunctionKind, Interface};
=======
use super::engine::{Engine, UnknownName};
use super::ir::{Interface, Program, Slot};
use super::signature::{Argument, FunctionKind};

/// Outputs of a function that solves, with its margin: those of the Jacobian are most.
const MOST_OUTPUTS: usize = 5;

/// A program that can be evaluated, with parameters and inputs that can be set.
#[derive(Clone, Debug)]
pub struct Executable<E> {
    engine: E,
    interface: Interface,
    /// Functions that the program does not leave out.
    functions: Vec<FunctionKind>,
    parameters: Vec<f64>,
    inputs: Vec<f64>,
}

/// The arguments of a function; those that it does not read may be empty.
#[derive(Clone, Copy, Default)]
struct State<'a> {
    t: f64,
    q: &'a [f64],
    u: &'a [f64],
    acceleration: &'a [f64],
    multipliers: &'a [f64],
    memory: &'a [f64],
    change: Change<'a, f64>,
}

impl<E: Engine> Executable<E> {
    /// A program with its default parameters and all inputs zero.
    pub fn new(program: &Program) -> Self {
        let interface = program.interface.clone();
        let written = program.functions.iter().filter(|function| !function.outputs.is_empty());
        Self {
            functions: written.map(|function| function.kind).collect(),
            engine: E::new(program),
            parameters: interface.parameters.iter().map(|p| p.value).collect(),
            inputs: vec![0.0; interface.inputs.len()],
            interface,
        }
    }

    /// The engine that evaluates the functions.
    pub fn engine(&self) -> &E {
        &self.engine
    }

    /// Data of the mechanism, such as its joints and bodies.
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The parameters, in the order of the model, SI.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The inputs, in the order of the model, SI.
    pub fn inputs(&self) -> &[f64] {
        &self.inputs
    }

    /// Sets a parameter, SI.
    ///
    /// # Errors
    /// If there is none with this name.
    pub fn set_parameter(&mut self, name: &str, value: f64) -> Result<(), UnknownName> {
        let index = self.interface.parameters.iter().position(|p| p.name == name);
        let index = index.ok_or_else(|| UnknownName(name.to_owned()))?;
        self.parameters[index] = value;
        Ok(())
    }

    /// Sets an input, SI.
    ///
    /// # Errors
    /// If there is none with this name.
    pub fn set_input(&mut self, name: &str, value: f64) -> Result<(), UnknownName> {
        let index = self.interface.inputs.iter().position(|input| input == name);
        let index = index.ok_or_else(|| UnknownName(name.to_owned()))?;
        self.inputs[index] = value;
        Ok(())
    }

    /// Sets all inputs, in the order of the model, SI.
    ///
    /// # Panics
    /// If there is another number of inputs.
    pub fn set_inputs(&mut self, values: &[f64]) {
        self.inputs.copy_from_slice(values);
    }

    /// Replaces the guess (rad) from which a joint starts.
    pub fn set_initial(&mut self, joint: usize, angle: f64) {
        let joint = &mut self.interface.joints[joint];
        (joint.initial_q, joint.initial_given) = (angle, true);
    }

    /// What all controllers would remember and command if they sampled now, by the function `control`: writes the
    /// memory at the next sample and the commands, in the order of the interface.
    ///
    /// # Errors
    /// [`Error::Length`], or [`Error::LeftOut`] if there are no controllers.
    pub fn write_control(
        &self,
        (t, q, u): (f64, &[f64], &[f64]),
        memory: &[f64],
        next: &mut [f64],
        commands: &mut [f64],
    ) -> Result<(), Error> {
        let at = State { t, q, u, memory, ..State::default() };
        self.evaluate(FunctionKind::Control, at, &mut [next, commands])
    }

    /// Resets parameters and inputs to their defaults.
    pub fn reset(&mut self) {
        self.parameters = self.interface.parameters.iter().map(|p| p.value).collect();
        self.inputs.fill(0.0);
    }

    /// Evaluates a function; everything that it reads and writes must have the length of its signature.
    fn evaluate(
        &self,
        kind: FunctionKind,
        at: State<'_>,
        out: &mut [&mut [f64]],
    ) -> Result<(), Error> {
        let signature = kind.signature();
        if !self.functions.contains(&kind) {
            return Err(Error::LeftOut { function: signature.name });
        }
        let read = signature.inputs.iter().map(|&argument| {
            let expected = argument.array().shape.length(&self.interface);
            (expected, self.read(argument, &at).len())
        });
        let written = signature.lengths(&self.interface).zip(out.iter().map(|out| out.len()));
        if let Some((expected, given)) =
            read.chain(written).find(|(expected, given)| expected != given)
        {
            return Err(Error::Length { expected, given });
        }
        let load = |slot: Slot| {
            let (argument, index) = slot.place();
            self.read(argument, &at)[index]
        };
        self.engine.run(kind, load, out);
        Ok(())
    }

    /// As [`evaluate`](Self::evaluate), for a function that may be left out: how far its results can be
    /// trusted.
    fn solve(
        &self,
        kind: FunctionKind,
        at: State<'_>,
        out: &mut [&mut [f64]],
    ) -> Result<Option<Margin<f64>>, Error> {
        if !self.functions.contains(&kind) {
            return Ok(None);
        }
        let mut margin = [f64::NAN; 2];
        // Without an allocation: this is what a simulation does most.
        let mut places: [&mut [f64]; MOST_OUTPUTS] = Default::default();
        let count = out.len();
        for (place, out) in places.iter_mut().zip(out.iter_mut()) {
            *place = out;
        }
        places[count] = &mut margin;
        self.evaluate(kind, at, &mut places[..=count])?;
        let [inverse_pivot, conditioning] = margin;
        Ok(Some(Margin { inverse_pivot, conditioning }))
    }

    /// Numbers in rows of K.
    fn rows<const K: usize>(
        &self,
        kind: FunctionKind,
        q: &[f64],
        rows: usize,
    ) -> Result<Vec<[f64; K]>, Error> {
        let mut out = vec![[f64::NAN; K]; rows];
        let at = State { q, ..State::default() };
        self.evaluate(kind, at, &mut [out.as_flattened_mut()])?;
        Ok(out)
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
            Argument::Memory => at.memory,
            Argument::TimeChange => std::slice::from_ref(&at.change.t),
            Argument::PositionChange => at.change.q,
            Argument::SpeedChange => at.change.u,
            Argument::ParameterChange => at.change.parameters,
            Argument::InputChange => at.change.inputs,
        }
    }
}
>>>>>>> ctrl:codegen/src/program/executable.rs

impl<E: Engine> Mechanism for Executable<E> {
    type Scalar = f64;
    type Coordinates = Vec<f64>;
    type Speeds = Vec<f64>;
    type Matrix = Vec<f64>;
    type Workspace = Vec<f64>;
    type Poses = Vec<[f64; 12]>;
    type Points = Vec<[f64; 3]>;

    fn dimensions(&self) -> Dimensions {
        let interface = &self.interface;
        Dimensions {
            rows: interface.rows,
            rank: interface.rank,
            loops: interface.loops.len(),
            bodies: interface.bodies.len(),
            points: interface.points.len(),
            contacts: interface.contacts.len(),
            drives: interface.driven().len(),
            parameters: interface.parameters.len(),
            inputs: interface.inputs.len(),
            coordinates: interface.coordinates(),
            speeds: interface.speeds(),
            joints: interface.joints.len(),
        }
    }

    fn speeds(&self) -> Vec<f64> {
        vec![0.0; self.interface.speeds()]
    }
    fn matrix(&self) -> Vec<f64> {
        vec![0.0; self.interface.speeds() * self.interface.speeds()]
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

    fn initial(&self) -> StateOf<Self> {
        let Interface { joints, free, .. } = &self.interface;
        let q = joints.iter().map(|joint| joint.initial_q);
        let u = joints.iter().map(|joint| joint.initial_u);
        lamc_runtime::State {
            t: 0.0,
            q: q.chain(free.iter().flat_map(|body| body.q)).collect(),
            u: u.chain(free.iter().flat_map(|body| body.u)).collect(),
        }
    }

    fn is_pinned(&self, joint: usize) -> bool {
        self.interface.joints.get(joint).is_some_and(|joint| joint.initial_given)
    }

    fn advance(&self, q: &mut [f64], step: &[f64]) {
        free_body::advance(q, step, self.interface.joints.len());
    }

    fn write_rates(&self, q: &[f64], u: &[f64], out: &mut [f64]) {
        free_body::write_rates(q, u, out, self.interface.joints.len());
    }

    fn write_difference(&self, from: &[f64], to: &[f64], out: &mut [f64]) {
        free_body::write_difference(from, to, out, self.interface.joints.len());
    }

    fn normalise(&self, q: &mut [f64]) {
        free_body::normalise(q, self.interface.joints.len());
    }

    fn momentum(&self, q: &Vec<f64>, u: &Vec<f64>) -> Result<Momentum<f64>, Error> {
        let mut out = [[f64::NAN; 3]; 3];
        let at = State { q, u, ..State::default() };
        self.evaluate(FunctionKind::Momentum, at, &mut [out.as_flattened_mut()])?;
        let [centre, linear, angular] = out;
        Ok(Momentum { centre, linear, angular })
    }

    fn energy(&self, t: f64, q: &Vec<f64>, u: &Vec<f64>) -> Result<Energy<f64>, Error> {
        let (mut kinetic, mut potential) = ([f64::NAN], [f64::NAN]);
        let at = State { t, q, u, ..State::default() };
        self.evaluate(FunctionKind::Energy, at, &mut [&mut kinetic, &mut potential])?;
        Ok(Energy { kinetic: kinetic[0], potential: potential[0] })
    }

    fn poses(&self, q: &Vec<f64>) -> Result<Vec<[f64; 12]>, Error> {
        self.rows(FunctionKind::Poses, q, self.interface.bodies.len())
    }

    fn points(&self, q: &Vec<f64>) -> Result<Vec<[f64; 3]>, Error> {
        self.rows(FunctionKind::Points, q, self.interface.points.len())
    }

    fn write_equations(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: EquationsMut<'_, f64>,
    ) -> Result<(), Error> {
        let out = &mut [out.mass, out.forcing, out.jacobian, out.gamma];
        self.evaluate(FunctionKind::Equations, State { t, q, u, ..State::default() }, out)
    }

    fn write_closure(
        &self,
        q: &[f64],
        residual: &mut [f64],
        jacobian: &mut [f64],
    ) -> Result<(), Error> {
        let at = State { q, ..State::default() };
        self.evaluate(FunctionKind::Closure, at, &mut [residual, jacobian])
    }

    fn drives(&self, t: f64, mut visit: impl FnMut(Drive<f64>)) {
        let driven = self.interface.driven();
        let mut values = vec![[f64::NAN; 4]; driven.len()];
        let at = State { t, ..State::default() };
        let out = &mut [values.as_flattened_mut()];
        let outcome = self.evaluate(FunctionKind::Drives, at, out);
        debug_assert_eq!(outcome, Ok(()));
        for (joint, [position, speed, acceleration, jerk]) in driven.iter().zip(values) {
            visit(Drive { joint: joint.index(), position, speed, acceleration, jerk });
        }
    }

    fn write_contacts(&self, t: f64, q: &[f64], u: &[f64], out: &mut [f64]) -> Result<(), Error> {
        let at = State { t, q, u, ..State::default() };
        self.evaluate(FunctionKind::Contacts, at, &mut [out])
    }

    fn write_gaps(&self, t: f64, q: &[f64], out: GapsMut<'_, f64>) -> Result<(), Error> {
        if out.gap.is_empty() {
            return Ok(());
        }
        let GapsMut { gap, friction, normal, rows } = out;
        let at = State { t, q, ..State::default() };
        self.evaluate(FunctionKind::Gaps, at, &mut [gap, friction, normal, rows])
    }

    fn write_reactions(&self, at: Balance<'_, f64>, out: &mut [f64]) -> Result<(), Error> {
        let Balance { t, q, u, acceleration, multipliers } = at;
        let at = State { t, q, u, acceleration, multipliers, ..State::default() };
        self.evaluate(FunctionKind::Reactions, at, &mut [out])
    }

    fn write_tangent(
        &self,
        at: Balance<'_, f64>,
        change: Change<'_, f64>,
        forces: &mut [f64],
        closure: &mut [f64],
    ) -> Result<(), Error> {
        let Balance { t, q, u, acceleration, multipliers } = at;
        let at = State { t, q, u, acceleration, multipliers, change, ..State::default() };
        self.evaluate(FunctionKind::Tangent, at, &mut [forces, closure])
    }

    fn write_acceleration(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: &mut [f64],
    ) -> Result<Option<Margin<f64>>, Error> {
        let at = State { t, q, u, ..State::default() };
        self.solve(FunctionKind::Acceleration, at, &mut [out])
    }

    fn write_projection(
        &self,
        q: &[f64],
        u: &[f64],
        out: ProjectionMut<'_, f64>,
    ) -> Result<Option<Margin<f64>>, Error> {
        let ProjectionMut { residual, positions, speeds } = out;
        let at = State { q, u, ..State::default() };
        self.solve(FunctionKind::Projection, at, &mut [residual, positions, speeds])
    }

    fn write_jacobian(
        &self,
        t: f64,
        q: &[f64],
        u: &[f64],
        out: JacobianMut<'_, f64>,
    ) -> Result<Option<Margin<f64>>, Error> {
        let JacobianMut { acceleration, dq, du, dt } = out;
        let at = State { t, q, u, ..State::default() };
        self.solve(FunctionKind::Jacobian, at, &mut [acceleration, dq, du, dt])
    }
}
