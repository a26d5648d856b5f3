//! The path of the fold: from the flat state the nearest closed states to growing shares of the
//! targets, each found from the one before.

use lamc::arithmetic::largest;

use super::depart::{self, Stuck};
use super::state::{Problem, State, Trouble, WEIGHT};
use super::system::open;

/// Iterations of a step before it is divided.
const ITERATIONS: usize = 15;
/// The largest change of an angle in one step, rad. More is a jump to another minimum.
const JUMP: f64 = 0.35;
/// Steps are not divided below this share of the targets.
const SHORTEST: f64 = 1e-5;
/// Iterations of the first state.
const LONG: usize = 400;
/// Steps of the way to another minimum, where the one that was followed ends.
const SLIDES: usize = 1000;
/// The largest change of an angle in one of them, rad.
const SLIDE: f64 = 0.1;
/// The largest weight of the springs that make them short.
const MOST_DRAG: f64 = 1e6;
/// The fold stands still if the angles follow the targets by less than this share of their change.
const STANDSTILL: f64 = 0.01;
/// How far the targets go on, over the whole, before a fold that stands still has ended.
const PATIENCE: f64 = 0.03;
/// A fold ends in the targets themselves if they are this near, rad, and closed.
const NEAR: f64 = 0.2;
/// How far loops may be open in the targets, over the sheet's size: the rounding errors of the angles.
const CLOSED_AT_END: f64 = 1e-10;

/// A state of the path.
#[derive(Clone, Debug)]
pub struct Sample {
    /// s: the share of the targets.
    pub progress: f64,
    /// How far the angles have come along the targets: 1 where they are the targets.
    pub reached: f64,
    /// Angles, rad.
    pub q: Vec<f64>,
    /// Largest opening of a loop, over the sheet's size.
    pub open: f64,
}

/// Why a path ends.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// It reaches the progress that was asked for.
    Reached,
    /// It does not leave the flat state.
    Flat(Stuck),
    /// Joints at their bounds hold all others.
    AtBounds {
        /// At half a turn or at their limits.
        most: Vec<usize>,
        /// Nearly flat: they would bend to the other side.
        least: Vec<usize>,
    },
    /// Loops lock: the multipliers of the loops, the largest first, and the joint that is farthest from
    /// its target.
    Locked {
        /// Loops, the one that holds the joints back most first.
        loops: Vec<usize>,
        /// The joint that is farthest from its share of the target.
        joint: usize,
        /// Whether the loops did not close farther on; if false, the angles no longer follow the targets.
        is_open: bool,
    },
    /// The user ended it.
    Interrupted,
}

/// A path with its end.
pub struct Path {
    /// From the flat state on.
    pub samples: Vec<Sample>,
    /// Why it ends.
    pub end: End,
    /// Progress at which the nearest state ended, and the sheet moved on to another one at the same progress.
    pub slides: Vec<f64>,
}

/// Follows the path from the flat state up to a progress, in so many equal steps. `go_on` is asked before each.
pub fn follow(
    problem: &mut Problem,
    to: f64,
    steps: usize,
    mut go_on: impl FnMut(usize) -> bool,
) -> Path {
    let flat = problem.flat();
    let mut path =
        Path { samples: vec![problem.sample(&flat)], end: End::Reached, slides: Vec::new() };
    let mut state = match depart::depart(problem) {
        Ok(state) => state,
        Err(stuck) => return Path { end: End::Flat(stuck), ..path },
    };
    state.progress = state.progress.min(to / steps as f64);
    if problem.settle(&mut state, LONG).is_err() {
        // The loops almost close next to the flat state, as those of a sheet that is almost right.
        return Path { end: End::Flat(depart::stuck(problem, &state.q)), ..path };
    }
    let mut still_since = None;
    for step in 1..=steps {
        if !go_on(step) {
            return Path { end: End::Interrupted, ..path };
        }
        let next = to * step as f64 / steps as f64;
        if next == 1.0 && problem.ends_in_targets(&mut state) {
            path.samples.push(problem.sample(&state));
            break;
        }
        if let Err(trouble) = problem.advance(&mut state, next, &mut path) {
            path.samples.push(problem.sample(&state));
            return Path { end: problem.locked(&state, trouble == Trouble::Open), ..path };
        }
        path.samples.push(problem.sample(&state));
        match (problem.follows(&state), still_since) {
            (true, _) => still_since = None,
            (false, None) => still_since = Some((state.progress, path.samples.len())),
            (false, Some((since, samples))) if state.progress - since >= PATIENCE => {
                path.samples.truncate(samples);
                return Path { end: problem.locked(&state, false), ..path };
            }
            (false, Some(_)) => {}
        }
    }
    path
}

impl Problem {
    fn sample(&self, state: &State) -> Sample {
        Sample {
            progress: state.progress,
            reached: self.along_targets(&state.q),
            q: state.q.clone(),
            open: open(&self.equations.place(&state.q)),
        }
    }

    /// Moves a state along the path up to a progress. If it cannot, the state is the last one it came to.
    fn advance(&mut self, state: &mut State, to: f64, path: &mut Path) -> Result<(), Trouble> {
        let mut length = to - state.progress;
        while state.progress < to {
            let next = (state.progress + length).min(to);
            let mut trial = self.predicted(state, next);
            if self.settle(&mut trial, ITERATIONS).is_ok() && moved(state, &trial) <= JUMP {
                *state = trial;
                length *= 2.0;
                continue;
            }
            length /= 2.0;
            if length < SHORTEST {
                // The minimum that was followed has ended.
                state.progress = to.min(state.progress + SHORTEST);
                path.slides.push(state.progress);
                self.slide(state, path)?;
                length = SHORTEST;
            }
        }
        Ok(())
    }

    /// Moves a state to another minimum for the same progress, through closed states that are near each
    /// other: each minimises the sum of what is to be minimised and of springs to the state before
    /// (the proximal point method).
    fn slide(&mut self, state: &mut State, path: &mut Path) -> Result<(), Trouble> {
        let mut drag = WEIGHT;
        for _ in 0..SLIDES {
            let mut trial = State { drag: Some((drag, state.q.clone())), ..state.clone() };
            let settled = self.settle(&mut trial, ITERATIONS);
            trial.drag = None;
            let length = moved(state, &trial);
            if settled.is_err() || length > SLIDE {
                drag *= 2.0;
                if drag > MOST_DRAG {
                    return settled;
                }
                continue;
            }
            *state = trial;
            path.samples.push(self.sample(state));
            drag /= 2.0;
            let mut free = state.clone();
            if length <= SLIDE / 2.0
                && self.settle(&mut free, ITERATIONS).is_ok()
                && moved(state, &free) <= SLIDE
            {
                *state = free;
                return Ok(());
            }
        }
        Err(Trouble::Wanders)
    }

    /// Returns where the path leads by its tangent.
    fn predicted(&mut self, state: &State, progress: f64) -> State {
        let mut next = State { progress, ..state.clone() };
        let by = progress - state.progress;
        let Some(tangent) = self.tangent(state) else { return next };
        if by * largest(&tangent.q) > JUMP {
            return next;
        }
        next.q.iter_mut().zip(&tangent.q).for_each(|(q, rate)| *q += by * rate);
        next.multipliers.iter_mut().zip(&tangent.multipliers).for_each(|(l, rate)| *l += by * rate);
        next
    }

    /// Returns whether the angles follow the targets.
    fn follows(&mut self, state: &State) -> bool {
        let tangent = self.tangent(state);
        // Without a tangent the minimum is about to end, and the angles move far.
        tangent.is_none_or(|tangent| self.along_targets(&tangent.q) > STANDSTILL)
    }

    /// Takes the targets themselves as the last state if they are near and closed.
    fn ends_in_targets(&self, state: &mut State) -> bool {
        let off =
            state.q.iter().zip(&self.targets).zip(&self.weights).map(|((q, target), weight)| {
                // Joints without a target may end anywhere near.
                (q - target).abs() * if *weight < WEIGHT { 0.0 } else { 1.0 }
            });
        let near = largest(off) <= NEAR;
        let is_closed = open(&self.equations.place(&self.targets)) <= CLOSED_AT_END;
        if near && is_closed {
            (state.q, state.progress) = (self.targets.clone(), 1.0);
        }
        near && is_closed
    }

    /// Returns what ends the path at a state.
    fn locked(&self, state: &State, is_open: bool) -> End {
        let [most, least] = self.held(state);
        if !(most.is_empty() && least.is_empty() || is_open) {
            return End::AtBounds { most, least };
        }
        let forces = self.equations.forces(&state.multipliers);
        let mut loops: Vec<usize> = (0..forces.len()).collect();
        loops.sort_by(|a, b| forces[*b].total_cmp(&forces[*a]));
        let short = |joint: &usize| {
            self.weights[*joint] * (state.progress * self.targets[*joint] - state.q[*joint]).abs()
        };
        let joint = (0..state.q.len()).max_by(|a, b| short(a).total_cmp(&short(b))).unwrap_or(0);
        End::Locked { loops, joint, is_open }
    }
}

/// Returns the largest difference of angles, rad.
fn moved(from: &State, to: &State) -> f64 {
    largest(from.q.iter().zip(&to.q).map(|(a, b)| (a - b).abs()))
}
