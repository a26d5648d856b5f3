//! Whether a motion gains energy that nothing feeds.
//!
//! ```text
//! gain = (T + V) - (T + V at the start) - W      W: work of torques and dampers
//! ```
//!
//! is zero but for errors of the integration. Equations that contradict each other, as those of a
//! loop that rounding makes rigid, show in a gain as large as the motion's own energy.

use lamc::arithmetic::{larger, largest};
use lamc_runtime::{Error, Mechanism, State};

use super::Work;

/// Gain, over the largest kinetic energy so far, that is a fault.
const FAULT: f64 = 1e-3;
/// How many times the tolerance the error of one step may be: it is a mean over the coordinates.
const STEP_ERRORS: f64 = 10.0;
/// Next to a singular state, such as flat, loops are loose in directions they are not: what turning
/// every joint by this, rad, does to the energy is not told apart from what that does. It is also
/// the floor for motions from rest, which have no kinetic energy yet.
const LOOSE: f64 = 1e-3;
/// Shorter steps than this, rad, say nothing about the forces on the way.
const SHORT: f64 = 1e-6;
/// Rounding of energies, over those that were added.
const ROUNDING: f64 = 1e-12;

/// The energies of a motion on its way.
#[derive(Clone, Debug)]
pub struct Audit {
    /// Error allowed per step, relative and absolute (rad, rad/s).
    tolerance: f64,
    /// T + V at the start, J.
    begin: f64,
    /// V after the last step, J.
    potential: f64,
    /// Magnitude of the work after the last step, J.
    exchanged: f64,
    /// What turning joints by `LOOSE` does to the energy where forces are largest, J.
    floor: f64,
    /// Largest T so far, J.
    largest_kinetic: f64,
    /// What errors of the steps so far may have added, J.
    allowed: f64,
}

/// Energy that nothing fed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gain {
    /// J.
    pub energy: f64,
    /// Largest kinetic energy so far, J.
    pub largest_kinetic: f64,
}

impl Audit {
    /// Of a motion that begins at a state and is integrated with this tolerance.
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

    /// Looks at the end of a step, when its work has been added; `Some` where more energy was
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

    /// What an error of the tolerance in every coordinate and speed adds to the energy, J: to T by
    /// the inequality of Cauchy and Schwarz, to V by the forces so far.
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

/// What turning each joint by `LOOSE` does to V, summed, J.
fn loose<Y>(
    system: &Y,
    State { t, q, u }: &State<Vec<f64>, f64>,
    potential: f64,
) -> Result<f64, Error>
where
    Y: Mechanism<Scalar = f64, Coordinates = Vec<f64>, Speeds = Vec<f64>>,
{
    let turned = |joint: usize, angle: f64| {
        let mut q = q.clone();
        q[joint] += angle;
        Ok((system.energy(*t, &q, u)?.potential - potential).abs())
    };
    (0..q.len()).map(|joint| Ok(larger(turned(joint, LOOSE)?, turned(joint, -LOOSE)?))).sum()
}
