//! Checks of a user's own model: its equations against an independent formulation, its energy and its
//! closure along a motion, and single against double precision.
//!
//! | check | compares |
//! |---|---|
//! | acceleration | du/dt of the machine code with Newton's and Euler's equations in maximal coordinates |
//! | rank | the constraints that the runtime counts with those of that formulation |
//! | energy | T and V with sums over the bodies and springs |
//! | closure | where the two bodies of every hinge say the hinge is |
//! | interpreter | du/dt of the machine code with the interpreter's, bit by bit |
//! | single precision | du/dt in `f32` with that in `f64` |
//! | balance | the change of T + V along a motion with the work of torques and dampers |
//! | drift | how far the loops open along that motion |
//!
//! The first five are evaluated at random closed states and, if the model can lie flat at rest, there.

mod contact;
mod elements;
mod expression;
mod gauss;
mod maximal;
mod motion;
mod placement;
mod single;
mod states;

#[cfg(test)]
mod tests;

pub use elements::{Angle, Line, Place};
pub use expression::{Jet, Values};
pub use maximal::{Massless, Solution, solve, tree_mass_matrix};
pub use placement::{Motion, motions};
pub use states::closed as closed_states;

use lamc::arithmetic::{larger, largest};
use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::{Constraint, Mechanism, acceleration};

use crate::execution::Jit;
use single::Single;

/// What a relative error of the acceleration may be, times [`Solution::condition`].
pub const ACCELERATION: f64 = 1e-9;

/// What a relative error of the energies may be: the copies of a cut body coincide to 1e-12 of the size.
pub const ENERGY: f64 = 1e-10;

/// How far a hinge may be open at an assembled state, as a share of the model's size or as a sine.
const CLOSURE: f64 = 1e-9;

/// The same in single precision: some hundred units in the last place.
const SINGLE: f64 = 1e-5;

/// The condition number from which the square of it counts: lamc solves with J M^-1 J^T, whose singular values are
/// squares, where a unit in the last place is 1e-7.
const SQUARED: f64 = 100.0;

/// Largest error, relative to the largest acceleration, at which a digit is left.
const DIGIT: f64 = 0.1;

/// What to check.
#[derive(Clone, Copy, Debug)]
pub struct Settings {
    /// Random states.
    pub states: usize,
    /// Which ones.
    pub seed: u64,
    /// How long the motion is, s.
    pub duration: f64,
}

/// The result of a check.
#[derive(Clone, Debug, PartialEq)]
pub struct Check {
    /// Its name.
    pub name: &'static str,
    /// States or samples compared.
    pub cases: usize,
    /// The largest error found, and what is allowed.
    pub error: f64,
    /// The largest error allowed.
    pub allowed: f64,
    /// Why there is no error to show: nothing could be compared, or a comparison broke off.
    pub remark: Option<Remark>,
}

/// Why a check has no error to show.
#[derive(Clone, Debug, PartialEq)]
pub enum Remark {
    /// This model cannot be compared in this way.
    NotChecked(String),
    /// It should have been possible.
    Failed(String),
}

impl Check {
    /// A comparison that was made.
    pub fn new(name: &'static str, cases: usize, error: f64, allowed: f64) -> Self {
        Self { name, cases, error, allowed, remark: None }
    }

    /// A comparison without an error to show.
    pub fn without(name: &'static str, remark: Remark) -> Self {
        Self { name, cases: 0, error: f64::NAN, allowed: f64::NAN, remark: Some(remark) }
    }

    /// Whether the model failed.
    pub fn failed(&self) -> bool {
        match &self.remark {
            Some(Remark::NotChecked(_)) => false,
            Some(Remark::Failed(_)) => true,
            // An error that is not a number is a failure.
            None => self.error.is_nan() || self.error > self.allowed,
        }
    }
}

/// Runs all checks on a model.
pub fn verify(compiled: &Compiled, settings: &Settings) -> Vec<Check> {
    let mut checks = at_states(compiled, settings);
    checks.extend(motion::checks(compiled, settings));
    checks
}

/// Largest errors so far.
#[derive(Clone, Debug, Default)]
struct Errors {
    acceleration: f64,
    /// Why a state has no acceleration, if one has none.
    unanswered: Option<String>,
    rank: f64,
    energy: f64,
    closure: f64,
    interpreter: f64,
    single: f64,
    /// States at which single precision has a digit.
    single_cases: usize,
    /// Those of them with an answer in single precision.
    singles: usize,
}

/// The checks at single states.
pub fn at_states(compiled: &Compiled, settings: &Settings) -> Vec<Check> {
    const NAMES: [&str; 6] =
        ["acceleration", "rank", "energy", "closure", "interpreter", "single precision"];
    let states = match states::closed(compiled, settings) {
        Ok(states) => states,
        Err(remark) => return NAMES.map(|name| Check::without(name, remark.clone())).to_vec(),
    };
    let count = states.len();
    let (machine, interpreter, single) = (
        Jit::new(&compiled.program),
        Interpreter::new(&compiled.program),
        Single::new(&compiled.program),
    );
    let mut systems = Systems { compiled, machine, interpreter, single };
    let mut errors = Errors::default();
    for (values, expected) in &states {
        systems.compare(values, expected, &mut errors);
    }
    let mut checks = vec![
        match errors.unanswered {
            Some(reason) => Check::without(NAMES[0], Remark::Failed(reason)),
            None => Check::new(NAMES[0], count, errors.acceleration, ACCELERATION),
        },
        Check::new(NAMES[1], count, errors.rank, 0.0),
        Check::new(NAMES[2], count, errors.energy, ENERGY),
        Check::new(NAMES[3], count, errors.closure, CLOSURE),
        Check::new(NAMES[4], count, errors.interpreter, 0.0),
    ];
    checks.push(match errors.singles {
        0 if errors.single_cases == 0 => {
            let reason = "single precision has no digit at any random state";
            Check::without(NAMES[5], Remark::NotChecked(reason.into()))
        }
        0 => Check::without(NAMES[5], Remark::Failed("no state has an acceleration in f32".into())),
        singles => Check::new(NAMES[5], singles, errors.single, SINGLE),
    });
    checks
}

/// Everything that evaluates a model.
struct Systems<'a> {
    compiled: &'a Compiled,
    machine: Jit,
    interpreter: Interpreter,
    single: Single,
}

impl Systems<'_> {
    /// Compares all at a state.
    fn compare(&mut self, values: &Values, expected: &Solution, errors: &mut Errors) {
        let names = &self.compiled.program.interface.inputs;
        for (name, &value) in names.iter().zip(&values.inputs) {
            // The names are the program's own.
            let _ = self.machine.set_input(name, value);
            let _ = self.interpreter.set_input(name, value);
            let _ = self.single.set_input(name, value);
        }
        let closed = larger(expected.open_by, expected.speed_mismatch);
        errors.closure = larger(errors.closure, closed);

        let n = values.q.len();
        let (found, constraint) = match accelerated(&self.machine, values) {
            Ok(answer) => answer,
            Err(error) => {
                errors.unanswered = Some(format!("none at q = {:?}: {error}", values.q));
                return;
            }
        };
        let error = expected.relative_error(&found) / expected.condition();
        errors.acceleration = larger(errors.acceleration, error);
        let moving = self.compiled.topology.mechanism.bodies.iter().filter(|body| !body.fixed);
        let freedom = expected.mobility(moving.count());
        let rank = (n as f64 - constraint.rank as f64 - freedom as f64).abs();
        errors.rank = larger(errors.rank, rank);

        let interpreted =
            accelerated(&self.interpreter, values).map_or(vec![f64::NAN; n], |(rates, _)| rates);
        let differ = |(a, b): (&f64, &f64)| a.to_bits() != b.to_bits();
        if found.iter().zip(&interpreted).any(differ) {
            errors.interpreter = larger(errors.interpreter, relative(&interpreted, &found));
            errors.interpreter = larger(errors.interpreter, f64::MIN_POSITIVE);
        }
        let energy = self.machine.energy(values.t, &values.q, &values.u);
        let error = energy.map_or(f64::NAN, |energy| {
            let total = expected.kinetic_energy.abs() + expected.potential_energy.abs();
            let kinetic = energy.kinetic - expected.kinetic_energy;
            let potential = energy.potential - expected.potential_energy;
            let off = larger(kinetic.abs(), potential.abs());
            if off == 0.0 { 0.0 } else { off / total }
        });
        errors.energy = larger(errors.energy, error);
        let condition = expected.condition();
        let condition = condition * (1.0 + condition / SQUARED);
        if SINGLE * condition > DIGIT {
            return;
        }
        errors.single_cases += 1;
        if let Ok((rounded, _)) = accelerated(&self.single, values) {
            errors.singles += 1;
            let error = expected.relative_error(&rounded) / condition;
            errors.single = larger(errors.single, error);
        }
    }
}

/// du/dt and the constraints that hold.
fn accelerated<M>(
    system: &M,
    values: &Values,
) -> Result<(Vec<f64>, Constraint), lamc_runtime::Error>
where
    M: Mechanism<Scalar = f64>,
{
    let mut rates = vec![f64::NAN; values.q.len()];
    let mut workspace = system.workspace();
    let (q, u) = (&values.q, &values.u);
    let constraint = acceleration(system, values.t, q, u, workspace.as_mut(), &mut rates)?;
    Ok((rates, constraint))
}

/// The largest difference over the largest magnitude.
fn relative(found: &[f64], expected: &[f64]) -> f64 {
    let difference = largest(found.iter().zip(expected).map(|(a, b)| a - b));
    if difference == 0.0 { 0.0 } else { difference / largest(expected) }
}
