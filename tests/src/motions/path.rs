//! A motion integrated twice, so precisely that what is left of its error can be measured.

use lamc_runtime::{Integrator, Mechanism, project};
use lamc_workbench::execution::Jit;

use crate::uniform::Random;
use crate::{dopri5, largest};

use super::subject::{Pair, Point};

/// Equal parts of a motion. A power of two: Romberg's method halves them.
pub const PARTS: usize = 128;

/// Errors per step of the precise motion, and of the one that measures its error. That of the second is larger
/// by some power of their ratio, so that their difference bounds the error of the first.
const TOLERANCES: [f64; 2] = [1e-11, 1e-9];

/// Steps that may be taken for a motion.
const MOST_STEPS: usize = 6_000;

/// How far the fastest joint turns in the time that a motion takes, rad, as far as speeds and accelerations at
/// its start say.
const TURN: f64 = 2.0;

/// Shares of that time that are tried while it takes too many steps.
const SHARES: [f64; 3] = [1.0, 0.1, 0.01];

/// What rounding and the closing of loops leave of angles, rad, and of energies, as a share.
pub const ROUNDING: f64 = 1e-12;

/// Size of the perturbation that measures the sensitivity, rad: its square is rounding.
const PERTURBATION: f64 = 1e-7;

/// The sensitivity above which a motion says nothing.
const WILD: f64 = 1e6;

/// A motion.
pub struct Path {
    /// The states at the ends of all parts.
    pub precise: Vec<Point>,
    /// The same with larger errors.
    pub rough: Vec<Point>,
    /// s.
    pub duration: f64,
    /// By how much a small deviation grows at most along the motion, in any direction.
    pub growth: f64,
}

impl Path {
    /// The motion from the start of a model.
    pub fn of(pair: &Pair) -> Result<Self, String> {
        let (system, start) = (&pair.moves.system, pair.start()?);
        let mut reason = String::new();
        for share in SHARES {
            let duration = share * TURN / rate(system, &start)?;
            match Self::lasting(system, &start, duration) {
                Ok(path) => return Ok(path),
                Err(failure) => reason = failure,
            }
        }
        Err(reason)
    }

    fn lasting(system: &Jit, start: &Point, duration: f64) -> Result<Self, String> {
        let [precise, rough] =
            TOLERANCES.map(|tolerance| follow(system, start, duration, tolerance));
        let (precise, rough) = (precise?, rough?);
        let mut path = Self { precise, rough, duration, growth: 1.0 };
        path.growth = path.sensitivity(system)?;
        match path.growth < WILD {
            true => Ok(path),
            false => Err(super::TOO_SENSITIVE.to_owned()),
        }
    }

    /// By how much a perturbation of all coordinates and speeds grows. Its direction is random: that of the
    /// fastest growth has a share of it of one in 2 N on average.
    fn sensitivity(&self, system: &Jit) -> Result<f64, String> {
        let mut start = self.precise[0].clone();
        let mut random = Random::new(start.q.len() as u64);
        let mut push = |value: &mut f64, most: f64| *value += random.range(-most, most);
        start.q.iter_mut().for_each(|q| push(q, PERTURBATION));
        start.u.iter_mut().for_each(|u| push(u, PERTURBATION / self.duration));
        closed(system, &mut start)?;
        let begin = self.distance(&start, &self.precise[0]);
        // Loops that leave no freedom allow no perturbation, and no error.
        if begin < PERTURBATION * 1e-3 {
            return Ok(1.0);
        }
        let perturbed = follow(system, &start, self.duration, TOLERANCES[1])?;
        let pairs = perturbed.iter().zip(&self.precise);
        let most = largest(pairs.map(|(a, b)| self.distance(a, b)));
        Ok(2.0 * start.q.len() as f64 * most / begin)
    }

    /// The last state.
    pub fn end(&self) -> &Point {
        &self.precise[PARTS]
    }

    /// How far two states are apart, rad: speeds count by what they turn in the time of the motion.
    pub fn distance(&self, a: &Point, b: &Point) -> f64 {
        let difference = |a: &[f64], b: &[f64]| largest(a.iter().zip(b).map(|(a, b)| a - b));
        difference(&a.q, &b.q).max(difference(&a.u, &b.u) * self.duration)
    }

    /// What the error of the last state may be, rad.
    pub fn doubt(&self) -> f64 {
        self.distance(self.end(), &self.rough[PARTS]) + ROUNDING * self.growth
    }

    /// What the error of a function of the precise state number k may be: each coordinate and speed of the rough
    /// state, put in its place, changes the function by so much.
    pub fn spread(&self, k: usize, of: &dyn Fn(&Point) -> f64) -> f64 {
        let (at, other) = (&self.precise[k], &self.rough[k]);
        let value = of(at);
        let n = at.q.len();
        let changed = |index: usize| {
            let mut changed = at.clone();
            match index.checked_sub(n) {
                None => changed.q[index] = other.q[index],
                Some(speed) => changed.u[speed] = other.u[speed],
            }
            (of(&changed) - value).abs()
        };
        (0..2 * n).map(changed).sum()
    }
}

/// The rate at which a state changes, 1/s: speeds, and accelerations over an angle of 1 rad.
fn rate(system: &Jit, start: &Point) -> Result<f64, String> {
    let acceleration = system.acceleration(start.t, &start.q, &start.u);
    let acceleration = acceleration.map_err(|error| error.to_string())?;
    let rate = largest(&start.u).max(largest(&acceleration).sqrt());
    match rate.is_finite() && rate > 0.0 {
        true => Ok(rate),
        false => Err("nothing moves".to_owned()),
    }
}

/// The states at the ends of all parts of a motion.
pub fn follow(
    system: &Jit,
    start: &Point,
    duration: f64,
    tolerance: f64,
) -> Result<Vec<Point>, String> {
    let mut integrator = dopri5(system, tolerance);
    let mut state = start.clone();
    let mut states = vec![state.clone()];
    let mut steps = 0;
    for part in 1..=PARTS {
        let end = start.t + duration * part as f64 / PARTS as f64;
        while state.t < end {
            steps += 1;
            if steps > MOST_STEPS {
                return Err(format!("the motion takes more than {MOST_STEPS} steps"));
            }
            let outcome = integrator.step(system, &mut state, end);
            outcome.map_err(|_| "the motion cannot be continued".to_owned())?;
        }
        states.push(state.clone());
    }
    Ok(states)
}

/// Moves a state onto the closure.
pub fn closed(system: &Jit, state: &mut Point) -> Result<(), String> {
    let (q, u) = (&mut state.q, &mut state.u);
    let outcome = project(system, state.t, q, u, &mut system.workspace());
    outcome.map(|_| ()).map_err(|error| error.to_string())
}
