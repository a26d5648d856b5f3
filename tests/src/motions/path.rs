//! A motion integrated twice, so precisely that what is left of its error can be measured.

use lamc_runtime::{Integrator, Mechanism, project};
use lamc_workbench::execution::Jit;
use lamc_workbench::verify::solve;

use crate::compare::{keep_largest, largest};
use crate::dopri5;
use crate::uniform::Random;

use super::subject::{NOTHING_MOVES, Pair, Point, Subject};

/// Equal parts of a motion, at whose ends errors are known.
pub const PARTS: usize = 128;

/// Errors per step of the precise motion, and of the one that measures its error. That of the second is larger
/// by some power of their ratio, so that their difference bounds the error of the first. The second pair is for
/// stiff motions, in which rounding changes accelerations by more than the first allows.
const TOLERANCES: [[f64; 2]; 2] = [[1e-11, 1e-9], [1e-9, 1e-7]];

/// How far the fastest joint turns in the time that a motion takes, rad, as far as speeds and accelerations at
/// its start say.
const TURN: f64 = 2.0;

/// A motion ends where the rough one has taken so many steps.
pub const ENOUGH_STEPS: usize = 250;

/// The precise motion has a hundredth of the error by a method of order 5, which takes three times the steps, and
/// a step ends at the end of each part.
const MOST_STEPS: usize = 10 * ENOUGH_STEPS;

/// What rounding and the closing of loops leave of angles, rad, and of energies, as a share.
pub const ROUNDING: f64 = 1e-12;

/// Size of the perturbation that measures the sensitivity, rad: its square is rounding.
pub const PERTURBATION: f64 = 1e-7;

/// The sensitivity above which a motion says nothing.
const WILD: f64 = 1e6;

/// Share of the time until a motion breaks off that is followed.
const BEFORE_AN_END: f64 = 0.5;

/// The outer nodes of Gauss's rule of three points in -1 .. 1: the square root of 3/5.
const GAUSS: f64 = 0.774_596_669_241_483_4;

/// Why a motion is not followed to its end.
pub const BREAKS_OFF: &str = "the motion cannot be continued";

/// A motion.
pub struct Path {
    /// The states at the ends of all parts.
    pub precise: Vec<Point>,
    /// The same with larger errors.
    pub rough: Vec<Point>,
    /// s.
    pub duration: f64,
    /// The time in which the fastest joint turns, s, as far as the start says.
    pub intended: f64,
    /// Of the precise motion.
    pub steps: usize,
    /// The errors per step of both.
    pub tolerances: [f64; 2],
    /// By how much a small deviation grows at most along the motion, in any direction.
    pub growth: f64,
}

impl Path {
    /// The motion from the start of a model.
    pub fn of(pair: &Pair) -> Result<Self, String> {
        let (system, start) = (&pair.moves.system, pair.start()?.0);
        let [duration, intended] = duration(system, &start)?;
        let mut path = Err(String::new());
        for tolerances in TOLERANCES {
            path = Self::within(system, &start, duration, tolerances);
            if path.is_ok() {
                break;
            }
        }
        let mut path = path?;
        path.intended = intended;
        path.growth = path.sensitivity(system)?;
        match path.growth < WILD {
            true => Ok(path),
            false => Err(super::VAGUELY.to_owned()),
        }
    }

    fn within(
        system: &Jit,
        start: &Point,
        duration: f64,
        tolerances: [f64; 2],
    ) -> Result<Self, String> {
        let [precise, rough] =
            tolerances.map(|tolerance| counted(system, start, duration, tolerance));
        let ((precise, steps), (rough, _)) = (precise?, rough?);
        Ok(Self { precise, rough, duration, intended: duration, steps, tolerances, growth: 1.0 })
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
        let perturbed = follow(system, &start, self.duration, self.tolerances[1])?;
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
        keep_largest(difference(&a.q, &b.q), difference(&a.u, &b.u) * self.duration)
    }

    /// What the error of the precise state number k may be, rad.
    pub fn doubt(&self, k: usize) -> f64 {
        self.distance(&self.precise[k], &self.rough[k]) + ROUNDING * self.growth
    }

    /// What rounding of the states changes in a quantity that should stay the same: per step, the operations that
    /// lead to accelerations, and closing the loops, leave their rounding times the condition number of the
    /// hinges' equations in every angle (1 rad) and speed (the largest), and no step takes it away.
    pub fn rounded(&self, subject: &Subject, of: &dyn Fn(&Point) -> f64) -> f64 {
        let mechanism = &subject.compiled.topology.mechanism;
        let steps = (self.steps * rounding_steps(subject)) as f64;
        let at = |k: usize| {
            let at = &self.precise[k];
            let solution = solve(mechanism, &subject.values(at));
            let condition = solution.map_or(f64::NAN, |solution| solution.condition());
            let value = of(at);
            let fastest = largest(&at.u);
            let n = at.q.len();
            let change = |index: usize| {
                let mut moved = at.clone();
                match index.checked_sub(n) {
                    None => moved.q[index] += PERTURBATION,
                    Some(speed) => moved.u[speed] += PERTURBATION * fastest,
                }
                (of(&moved) - value).abs() / PERTURBATION
            };
            condition * (0..2 * n).map(change).sum::<f64>()
        };
        steps * f64::EPSILON * largest([0, PARTS / 2, PARTS].map(at))
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

/// Roundings in the longest chain of operations: for each joint a turn, sine or cosine, a product and a sum, of
/// orientation, position, velocity and the bias of the acceleration, and as many on the way back with forces.
const ROUNDINGS: usize = 24;

/// Roundings between the states of all joints and what is computed from them.
pub fn rounding_steps(subject: &Subject) -> usize {
    ROUNDINGS * subject.compiled.topology.mechanism.joints.len()
}

/// How long a motion is followed, and how long it should be, s.
fn duration(system: &Jit, start: &Point) -> Result<[f64; 2], String> {
    let acceleration = system.acceleration(start.t, &start.q, &start.u);
    let acceleration = acceleration.map_err(|error| error.to_string())?;
    let rate = keep_largest(largest(&start.u), largest(&acceleration).sqrt());
    if rate == 0.0 || !rate.is_finite() {
        return Err(NOTHING_MOVES.to_owned());
    }
    let intended = TURN / rate;
    let mut integrator = dopri5(system, TOLERANCES[0][1]);
    let mut state = start.clone();
    for _ in 0..ENOUGH_STEPS {
        if state.t >= start.t + intended {
            break;
        }
        // Where it cannot be continued it ends before.
        if let Err(error) = integrator.step(system, &mut state, start.t + intended) {
            return match state.t > start.t {
                true => Ok([BEFORE_AN_END * (state.t - start.t), intended]),
                false => Err(format!("{BREAKS_OFF}: {error}")),
            };
        }
    }
    Ok([state.t - start.t, intended])
}

/// The steps of the precise motion: its states at the beginning, at the three nodes of Gauss's rule, and at the
/// end.
pub fn steps(system: &Jit, path: &Path) -> Result<Vec<[Point; 5]>, String> {
    let mut integrator = dopri5(system, path.tolerances[0]);
    let (start, duration) = (&path.precise[0], path.duration);
    let mut state = start.clone();
    let mut steps = Vec::new();
    while state.t < start.t + duration {
        if steps.len() > MOST_STEPS {
            return Err(format!("the motion takes more than {MOST_STEPS} steps"));
        }
        let before = state.clone();
        let outcome = integrator.step(system, &mut state, start.t + duration);
        outcome.map_err(|error| format!("{BREAKS_OFF}: {error}"))?;
        let mut at = |node: f64| {
            let t = before.t + (state.t - before.t) * (0.5 + 0.5 * node);
            integrator.between(system, t).map_err(|error| format!("{BREAKS_OFF}: {error}"))
        };
        let nodes = [at(-GAUSS)?, at(0.0)?, at(GAUSS)?];
        let [first, middle, last] = nodes;
        steps.push([before, first, middle, last, state.clone()]);
    }
    Ok(steps)
}

/// The states at the ends of all parts of a motion.
pub fn follow(
    system: &Jit,
    start: &Point,
    duration: f64,
    tolerance: f64,
) -> Result<Vec<Point>, String> {
    counted(system, start, duration, tolerance).map(|(states, _)| states)
}

/// As [`follow`], with the number of steps.
fn counted(
    system: &Jit,
    start: &Point,
    duration: f64,
    tolerance: f64,
) -> Result<(Vec<Point>, usize), String> {
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
            outcome.map_err(|error| format!("{BREAKS_OFF}: {error}"))?;
        }
        states.push(state.clone());
    }
    Ok((states, steps))
}

/// Moves a state onto the closure.
pub fn closed(system: &Jit, state: &mut Point) -> Result<(), String> {
    let (q, u) = (&mut state.q, &mut state.u);
    let outcome = project(system, state.t, q, u, &mut system.workspace());
    outcome.map(|_| ()).map_err(|error| error.to_string())
}
