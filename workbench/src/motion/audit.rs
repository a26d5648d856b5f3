//! Check that a motion does not gain energy without a source.
//!
//! ```text
//! gain = (T + V) - (T + V at the start) - W      W: work of torques and dampers
//! ```
//!
//! is zero up to errors of the integration. Contradicting equations, such as those of a loop that rounding makes
//! rigid, cause a gain as large as the energy of the motion itself.

use lamc::arithmetic::{larger, largest};
use lamc_runtime::{Error, Mechanism, State};

use super::Work;

/// A gain above this share of the largest kinetic energy so far is a fault.
const FAULT: f64 = 1e-3;
/// The error of one step may be this many times the tolerance, which is a mean over the coordinates.
const STEP_ERRORS: f64 = 10.0;
/// Next to a singular state, such as the flat one, rounding leaves loops loose in additional directions. A change of
/// the energy is therefore accepted if turning every joint by this angle, rad, causes it. This is also the lower bound
/// for motions from rest, which have no kinetic energy yet.
const LOOSE: f64 = 1e-3;
/// Steps shorter than this, rad, say nothing about the forces along them.
const SHORT: f64 = 1e-6;
/// The rounding error of energies, as a share of those that were added.
const ROUNDING: f64 = 1e-12;

/// The energies of a motion so far.
#[derive(Clone, Debug)]
pub struct Audit {
    /// The error allowed per step, relative and absolute (rad, rad/s).
    tolerance: f64,
    /// T + V at the start, J.
    begin: f64,
    /// V after the last step, J.
    potential: f64,
    /// The magnitude of the work after the last step, J.
    exchanged: f64,
    /// The change of the energy if the joints turn by `LOOSE` where the forces are largest, J.
    floor: f64,
    /// The largest T so far, J.
    largest_kinetic: f64,
    /// The energy that errors of the steps so far may have added, J.
    allowed: f64,
}

/// A gain of energy without a source.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// J.
    pub energy: f64,
    /// Largest kinetic energy so far, J.
    pub largest_kinetic: f64,
}

impl Audit {
    /// Starts the audit of a motion that begins at a state and is integrated with this tolerance.
    pub fn new<Y>(system: &Y, state: &State<Vec<f64>, f64>, tolerance: f64) -> Result<Self, Error>
    where
        Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
    {
        let energy = system.energy(state.t, &state.q, &state.u)?;
        Ok(Self {
            tolerance,
            begin: energy.kinetic + energy.potential,
            potential: energy.potential,
            exchanged: 0.0,
            floor: loose(system, state, energy.potential)?,
            largest_kinetic: energy.kinetic,
            allowed: 0.0,
        })
    }

    /// Checks the end of a step, after its work has been added. Returns `Some` if more energy was
    /// gained than errors explain.
    pub fn look<Y>(
        &mut self,
        system: &Y,
        before: &State<Vec<f64>, f64>,
        after: &State<Vec<f64>, f64>,
        work: &Work,
    ) -> Result<Option<Gain>, Error>
    where
        Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
    {
        let State { t, q, u } = after;
        let energy = system.energy(*t, q, u)?;
        self.largest_kinetic = larger(self.largest_kinetic, energy.kinetic);
        let moved = largest(before.q.iter().zip(q).map(|(before, after)| after - before));
        let turned = (energy.potential - self.potential).abs() + work.exchanged - self.exchanged;
        if moved > SHORT {
            self.floor = larger(self.floor, LOOSE * turned / moved);
        }
        self.allowed += STEP_ERRORS * self.step_error(system, after, energy.kinetic)?;
        (self.potential, self.exchanged) = (energy.potential, work.exchanged);
        let total = energy.kinetic + energy.potential;
        let added = energy.kinetic + energy.potential.abs() + self.begin.abs() + work.exchanged;
        let gain = total - self.begin - work.total;
        let errors = self.allowed + work.doubt + ROUNDING * added;
        let least = FAULT * self.largest_kinetic + self.floor + errors;
        let largest_kinetic = self.largest_kinetic;
        // Energy that is not a number is a fault too.
        Ok((gain.is_nan() || least.is_nan() || gain > least)
            .then_some(Gain { energy: gain, largest_kinetic }))
    }

    /// The energy, J, that an error of the size of the tolerance in every coordinate and speed adds: to T by
    /// the Cauchy-Schwarz inequality, to V by the forces so far.
    fn step_error<Y>(
        &self,
        system: &Y,
        State { t, q, u }: &State<Vec<f64>, f64>,
        kinetic: f64,
    ) -> Result<f64, Error>
    where
        Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
    {
        let errors: Vec<f64> = u.iter().map(|u| self.tolerance * (1.0 + u.abs())).collect();
        let of_errors = system.energy(*t, q, &errors)?.kinetic;
        let added = 2.0 * (kinetic * of_errors).sqrt();
        Ok(added + self.floor * self.tolerance / LOOSE * (1.0 + largest(q)))
    }
}

/// The sum of the changes of V if each speed acts for `LOOSE`, J.
fn loose<Y>(
    system: &Y,
    State { t, q, u }: &State<Vec<f64>, f64>,
    potential: f64,
) -> Result<f64, Error>
where
    Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
{
    let turned = |speed: usize, angle: f64| {
        let (mut q, mut step) = (q.clone(), vec![0.0; u.len()]);
        step[speed] = angle;
        system.advance(&mut q, &step);
        Ok((system.energy(*t, &q, u)?.potential - potential).abs())
    };
    (0..u.len()).map(|speed| Ok(larger(turned(speed, LOOSE)?, turned(speed, -LOOSE)?))).sum()
}
