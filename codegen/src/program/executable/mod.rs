//! A program with values for its parameters and inputs: a mechanism that the runtime can integrate
//! without a Rust compiler. An [`Engine`] evaluates its functions.

mod controlled;
mod mechanism;

use lamc_runtime::plumbing::{Branch, Margin, ROWS};
use lamc_runtime::{Change, Error};

use super::argument::Argument;
use super::engine::{Engine, UnknownName};
use super::ir::{Interface, Program, Slot};
use super::reduction::ReductionInfo;
use super::signature::FunctionKind;

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
    /// The numbers that follow from the parameters alone.
    drawing: Vec<f64>,
    inputs: Vec<f64>,
    branches: Vec<Branch>,
    /// Of the reduction, as `places`.
    steps: Vec<[u16; ROWS]>,
    places: Vec<u16>,
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
        let reduction = interface.reduction.as_ref();
        let branches = reduction.into_iter().flat_map(|reduction| &reduction.branches);
        let mut executable = Self {
            functions: written.map(|function| function.kind).collect(),
            engine: E::new(program),
            parameters: interface.parameters.iter().map(|p| p.value).collect(),
            drawing: vec![0.0; interface.drawn],
            inputs: vec![0.0; interface.inputs.len()],
            branches: branches.map(|&(joint, depth)| Branch { joint, depth }).collect(),
            steps: reduction.map(ReductionInfo::padded_steps).unwrap_or_default(),
            places: reduction.map(ReductionInfo::places).unwrap_or_default(),
            interface,
        };
        executable.draw();
        executable
    }

    /// Computes the numbers that follow from the parameters alone.
    fn draw(&mut self) {
        if self.drawing.is_empty() {
            return;
        }
        let mut drawing = std::mem::take(&mut self.drawing);
        let drawn = self.evaluate(FunctionKind::Drawing, State::default(), &mut [&mut drawing]);
        debug_assert_eq!(drawn, Ok(()));
        self.drawing = drawing;
    }

    /// The engine that evaluates the functions.
    pub fn engine(&self) -> &E {
        &self.engine
    }

    /// Whether the program has a function.
    pub fn has(&self, kind: FunctionKind) -> bool {
        self.functions.contains(&kind)
    }

    /// Data of the mechanism, such as its joints and bodies.
    pub fn interface(&self) -> &Interface {
        &self.interface
    }

    /// The parameters, in the order of the model, SI.
    pub fn parameters(&self) -> &[f64] {
        &self.parameters
    }

    /// The numbers of the drawing that follow from the parameters alone, SI.
    pub fn drawing(&self) -> &[f64] {
        &self.drawing
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
        self.draw();
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

    /// Resets parameters and inputs to their defaults.
    pub fn reset(&mut self) {
        self.parameters = self.interface.parameters.iter().map(|p| p.value).collect();
        self.draw();
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
        if !self.has(kind) {
            return Err(Error::LeftOut { function: signature.name });
        }
        let read = kind.inputs(&self.interface).map(|argument| {
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
        if !self.has(kind) {
            return Ok(None);
        }
        let mut margin = [f64::NAN; 3];
        // Without an allocation: this is what a simulation does most.
        let mut places: [&mut [f64]; MOST_OUTPUTS] = Default::default();
        let count = out.len();
        for (place, out) in places.iter_mut().zip(out.iter_mut()) {
            *place = out;
        }
        places[count] = &mut margin;
        self.evaluate(kind, at, &mut places[..=count])?;
        let [inverse_pivot, conditioning, pivot] = margin;
        Ok(Some(Margin { inverse_pivot, conditioning, pivot }))
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
            Argument::Drawing => &self.drawing,
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
