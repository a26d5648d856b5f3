//! The plan of a sweep: text -> [`Plan`].

mod keys;
mod read;
mod terms;

pub use keys::{DISTRIBUTION, MAPPINGS};
pub use read::distributions;

use std::collections::HashSet;

use lamc::pipeline::Compiled;
use lamc::program::{Op, Slot};
use lamc::source::{AngleUnit, Diagnostics, Dimension, InputId, ParameterId, SourceFile};

use crate::execution::Jit;
use crate::simulation::{Method, Settings};

/// Most runs of a sweep.
pub const MOST_RUNS: u64 = 100_000_000;

/// What a sweep varies and records.
#[derive(Clone, Debug, PartialEq)]
pub struct Plan {
    /// What a run does.
    pub task: Task,
    /// The grid; the last axis changes fastest.
    pub axes: Vec<Axis>,
    /// What is drawn at random.
    pub varied: Vec<Varied>,
    /// How.
    pub sampler: Sampler,
    /// Samples at each point of the grid; 1 if nothing is drawn.
    pub samples: u64,
    /// Chooses the samples.
    pub seed: u64,
}

/// What a run does.
#[derive(Clone, Debug, PartialEq)]
pub enum Task {
    /// Simulates a motion.
    Simulate(Simulate),
    /// Finds the equilibrium.
    Equilibrium {
        /// Whether the last state is recorded.
        end: bool,
        /// Whether the energy is recorded.
        energy: bool,
        /// Whether natural frequencies and damping ratios are recorded.
        frequencies: bool,
    },
}

impl Task {
    /// Whether it needs a state of rest.
    pub fn rests(&self) -> bool {
        match self {
            Self::Simulate(simulate) => simulate.settling,
            Self::Equilibrium { .. } => true,
        }
    }
}

/// How to simulate, and what to record.
#[derive(Clone, Debug, PartialEq)]
pub struct Simulate {
    /// How.
    pub settings: Settings,
    /// Samples per second.
    pub rate: f64,
    /// A motion has settled when every joint stays within this share of the largest distance from the equilibrium.
    pub settling_band: f64,
    /// Whether the last state is recorded.
    pub end: bool,
    /// Whether extremes of angles and speeds are recorded.
    pub extremes: bool,
    /// Whether the time to settle is recorded.
    pub settling: bool,
    /// Whether energies are recorded.
    pub energy: bool,
    /// Whether the whole motion is recorded.
    pub motion: bool,
}

/// Values of a quantity, each of which is combined with those of the other axes.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// What takes them.
    pub quantity: Quantity,
    /// The values, SI.
    pub values: Vec<f64>,
}

/// A quantity that is drawn at random.
#[derive(Clone, Debug, PartialEq)]
pub struct Varied {
    /// Which.
    pub quantity: Quantity,
    /// From what.
    pub distribution: Distribution,
}

/// A distribution of numbers, SI.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distribution {
    /// Between two numbers.
    Uniform([f64; 2]),
    /// Its logarithm lies between those of two numbers of one sign.
    LogUniform([f64; 2]),
    /// Mean and standard deviation.
    Normal([f64; 2]),
}

/// How samples are drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampler {
    /// Independent numbers.
    Random,
    /// One number in each of as many parts of equal probability as there are samples.
    LatinHypercube,
    /// Sobol's sequence with a random digital shift.
    Sobol,
}

/// A quantity of a model that a plan may change.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantity {
    /// Its name in plans and tables: `k`, `input.motor` or `initial.j0`.
    pub name: String,
    /// What it is.
    pub target: Target,
    /// The value of the model, SI.
    pub value: f64,
    /// Its dimension, where it is known.
    pub dimension: Option<Dimension>,
    /// Whether a motion can depend on it. It cannot on an input that a formula has replaced or that a
    /// controller drives.
    pub has_effect: bool,
}

/// What a quantity is, with its index in the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// A parameter.
    Parameter(usize),
    /// An input that is held.
    Input(usize),
    /// The guess of a joint's initial angle.
    Initial(usize),
}

/// What the plans of a model may name.
#[derive(Clone, Debug, PartialEq)]
pub struct Quantities(pub Vec<Quantity>);

impl Quantities {
    /// Those of a compiled model. `system` holds the values of parameters and inputs, `guess` those of initial angles
    /// that differ from the model's, rad.
    pub fn of(compiled: &Compiled, system: &Jit, guess: &[(usize, f64)]) -> Self {
        let interface = &compiled.program.interface;
        let numbers = &compiled.numbers;
        let steps = compiled.program.functions.iter().flat_map(|function| &function.instructions);
        let slots: HashSet<Slot> = steps
            .filter_map(|step| if let Op::Load(slot) = step.op { Some(slot) } else { None })
            .collect();
        let mut all = Vec::new();
        let parameters = interface.parameters.iter().zip(system.parameters());
        for (index, (parameter, &value)) in parameters.enumerate() {
            let dimension = numbers.dimensions.get(&parameter.name).copied();
            let (name, target) = (parameter.name.clone(), Target::Parameter(index));
            let has_effect = slots.contains(&Slot::Parameter(ParameterId(index)));
            all.push(Quantity { name, target, value, dimension, has_effect });
        }
        for (index, (name, &value)) in interface.inputs.iter().zip(system.inputs()).enumerate() {
            let dimension = numbers.dimensions.get(name).copied();
            let (name, target) = (format!("input.{name}"), Target::Input(index));
            let id = InputId(index);
            let is_driven = interface.commands().any(|driven| driven == id);
            let has_effect = slots.contains(&Slot::Input(id)) && !is_driven;
            all.push(Quantity { name, target, value, dimension, has_effect });
        }
        for (index, joint) in interface.joints.iter().enumerate().filter(|(_, it)| !it.driven) {
            let given = guess.iter().rev().find(|(joint, _)| *joint == index);
            let value = given.map_or(joint.initial_q, |(_, angle)| *angle);
            let (name, target) = (format!("initial.{}", joint.name), Target::Initial(index));
            all.push(Quantity { name, target, value, dimension: None, has_effect: true });
        }
        Self(all)
    }
}

impl Plan {
    /// Reads a plan. Initial angles without a unit are in `angle`.
    ///
    /// # Errors
    /// Returns all mistakes together.
    pub fn read(
        file: &SourceFile,
        quantities: &Quantities,
        angle: AngleUnit,
    ) -> Result<Self, Diagnostics> {
        read::plan(file, quantities, angle)
    }

    /// Points of the grid times samples.
    pub fn runs(&self) -> u64 {
        self.axes.iter().map(|axis| axis.values.len() as u64).product::<u64>() * self.samples
    }

    /// What changes from run to run, in the order of the values of a run.
    pub fn quantities(&self) -> impl Iterator<Item = &Quantity> {
        let axes = self.axes.iter().map(|axis| &axis.quantity);
        axes.chain(self.varied.iter().map(|varied| &varied.quantity))
    }
}

impl Method {
    /// The method of a name.
    fn named(name: &str) -> Self {
        match name {
            "dopri5" => Self::Dopri5,
            "rodas" => Self::Rodas,
            _ => Self::Auto,
        }
    }
}

/// The unit of a quantity's values, as tables show it; empty where it is not known.
pub fn unit(quantity: &Quantity) -> &'static str {
    match quantity.target {
        Target::Initial(_) => "rad",
        Target::Parameter(_) | Target::Input(_) => "",
    }
}
