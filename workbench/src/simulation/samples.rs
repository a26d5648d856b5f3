//! The times at which a motion is recorded, and what a sample has.

use lamc::laminate::Mechanism;
use lamc_runtime::{Error, Mechanism as _};

use super::{Method, Simulation};
use crate::execution::Jit;
use crate::motion::Tensions;

/// Most numbers a recorded motion may have: a gigabyte.
const MOST_NUMBERS: f64 = 125e6;

/// What is a whole number of samples but for this share has no further one: decimal fractions are rounded.
const ROUNDING: f64 = 1e-12;

/// A motion of so many samples is too large to keep.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{samples} samples are too many: lamc keeps at most {most:.0} for this model")]
pub struct TooMany {
    samples: f64,
    most: f64,
}

/// The times, s, from 0 to `duration`, s, at `rate` samples per second; the last step may be shorter.
///
/// # Errors
/// A recorded motion of this mechanism would be too large.
pub fn sample_times(system: &Jit, duration: f64, rate: f64) -> Result<Vec<f64>, TooMany> {
    let samples = (duration * rate * (1.0 - ROUNDING)).ceil();
    let d = system.dimensions();
    let numbers = (4 + d.coordinates + 2 * d.speeds + 3 * d.points + 12 * d.bodies) as f64;
    if samples * numbers > MOST_NUMBERS {
        return Err(TooMany { samples, most: MOST_NUMBERS / numbers });
    }
    Ok((0..=samples as usize).map(|sample| (sample as f64 / rate).min(duration)).collect())
}

impl Simulation {
    /// Records the tensions of the springs and tendons of the mechanism in each further sample.
    pub fn record_tensions(&mut self, mechanism: &Mechanism) {
        self.tensions = Tensions::new(mechanism);
        self.motion.tensions = self.tensions.names().collect();
    }

    /// Records the state that was reached.
    pub(super) fn record(&mut self) -> Result<(), Error> {
        let system = &self.system.system;
        let settings = (system.parameters(), system.inputs());
        let tensions = self.tensions.at(system, settings, &self.state)?;
        self.motion.record(&self.system, &self.state)?;
        let Some(sample) = self.motion.samples.last_mut() else { return Ok(()) };
        sample.tensions = tensions;
        if !self.motion.inputs.is_empty() {
            let system = &self.system.system;
            let commands = system.interface().commands();
            sample.inputs = commands.map(|id| system.inputs()[id.index()]).collect();
        }
        if let Method::Rigid { .. } = self.method {
            self.rigid.correct(&self.system, &self.state, sample);
        }
        Ok(())
    }
}
