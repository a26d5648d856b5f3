//! The closed state nearest to a share of the targets.
//!
//! ```text
//! minimise  1/2 sum_i w_i (q_i - s t_i)^2    with closed loops and q_i within its bounds
//! ```
//!
//! by sequential quadratic programming with the curvature of the loops, or, where this is not positive on their
//! motions, without it (Gauss-Newton). The bounds are a joint's limits, half a turn, and on the side of the flat state
//! a small part of s t_i, so that a joint never bends to the other side than its assignment. Joints at their
//! bounds are held there until the others pull them back.

use std::f64::consts::PI;

use lamc::arithmetic::{larger, largest};

use super::chain::Placed;
use super::system::{Equations, open};

/// The weight of a joint with a `fold`, and of one without, which is drawn to 0 as a weak spring would.
pub const WEIGHT: f64 = 1.0;
/// See [`WEIGHT`].
pub const WEAK: f64 = 1e-3;
/// A joint bends by at least this part of its share of the target.
pub const LEAST: f64 = 0.02;
/// The weight that holds a joint at its bound.
const HELD: f64 = 1e8;

/// Largest change of an angle in one iteration, rad.
const LONGEST: f64 = 0.1;
/// Iterations of which the last changes no angle by more than this, rad, have converged.
const CONVERGED: f64 = 1e-8;
/// A joint that is held may be this far from its bound, rad: the force on it over its weight.
const OFF: f64 = 1e-6;
/// Loops are closed up to this, over the sheet's size: what a rounded drawing leaves, as for the projection of motions.
pub const CLOSED: f64 = 1e-9;
/// A joint is pulled away from its bound by more than this, rad: the multipliers have rounding errors of 1e-16 over
/// the proximity of the equations, and a joint that is let go too early would return at once.
const PULL: f64 = 1e-4;
/// A joint is at its bound if it is beyond it by more than this, rad.
const BEYOND: f64 = 1e-9;

/// What is to be minimised.
pub struct Problem {
    /// The loops.
    pub equations: Equations,
    /// Angles of the finished fold, rad; 0 for joints without.
    pub targets: Vec<f64>,
    /// w.
    pub weights: Vec<f64>,
    /// Least and greatest angle, rad: the limits, and half a turn.
    pub bounds: Vec<[f64; 2]>,
}

/// A bound of an angle.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The lower one.
    Low,
    /// The upper one.
    High,
}

/// A state of the fold.
#[derive(Clone, Debug)]
pub struct State {
    /// s.
    pub progress: f64,
    /// Angles, rad.
    pub q: Vec<f64>,
    /// Of the loops: the torques with which they hold the joints back, for springs of 1 N m/rad.
    pub multipliers: Vec<f64>,
    /// The bound at which each joint is held.
    pub held: Vec<Option<Side>>,
    /// Springs that draw all joints to where they were, with this weight: (r, the angles, rad).
    pub drag: Option<(f64, Vec<f64>)>,
}

/// Why no state was found.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trouble {
    /// The loops do not close.
    Open,
    /// The iterations do not converge.
    Wanders,
}

impl Problem {
    /// Returns the flat state.
    pub fn flat(&self) -> State {
        State {
            progress: 0.0,
            q: vec![0.0; self.targets.len()],
            multipliers: vec![0.0; self.equations.rows()],
            held: vec![None; self.targets.len()],
            drag: None,
        }
    }

    /// Returns half a turn, or a joint's limits where these are narrower.
    pub fn bounds([low, high]: [f64; 2]) -> [f64; 2] {
        [low.max(-PI), high.min(PI)]
    }

    /// Returns the angle of a bound at a progress, rad, and its change with the progress.
    fn bound(&self, joint: usize, side: Side, progress: f64) -> (f64, f64) {
        let ([low, high], target) = (self.bounds[joint], self.targets[joint]);
        let least = LEAST * target;
        match side {
            Side::Low if target > 0.0 && progress * least > low => (progress * least, least),
            Side::High if target < 0.0 && progress * least < high => (progress * least, least),
            Side::Low => (low, 0.0),
            Side::High => (high, 0.0),
        }
    }

    /// Returns the joints that are held at the bound away from the flat state, and those at the bound towards it.
    pub fn held(&self, state: &State) -> [Vec<usize>; 2] {
        let towards_flat = |joint: &usize| {
            let least = if self.targets[*joint] > 0.0 { Side::Low } else { Side::High };
            self.targets[*joint] != 0.0 && state.held[*joint] == Some(least)
        };
        let held = (0..state.q.len()).filter(|joint| state.held[*joint].is_some());
        let (least, most) = held.partition(towards_flat);
        [most, least]
    }

    /// Moves a state to the nearest minimum for its progress, within so many iterations.
    ///
    /// # Errors
    /// [`Trouble`]; the state is then of no use.
    pub fn settle(&mut self, state: &mut State, iterations: usize) -> Result<(), Trouble> {
        for _ in 0..iterations {
            let placed = self.equations.place(&state.q);
            let changed = self.iterate(state, &placed)?;
            if changed <= CONVERGED && open(&placed) <= CLOSED && !self.release(state) {
                return Ok(());
            }
        }
        let placed = self.equations.place(&state.q);
        Err(if open(&placed) > CLOSED { Trouble::Open } else { Trouble::Wanders })
    }

    /// Takes one step; returns the largest change of an angle that it aims at, rad.
    fn iterate(&mut self, state: &mut State, placed: &[Placed]) -> Result<f64, Trouble> {
        let (weights, gradient) = self.quadratic(state);
        if !self.equations.factorise(placed, &weights, &state.multipliers) {
            let none = vec![0.0; state.multipliers.len()];
            self.equations.factorise(placed, &weights, &none);
        }
        let step = self.equations.solve(&gradient, placed, &state.multipliers);
        let step = step.ok_or(Trouble::Wanders)?;
        let aimed = largest(&step.q);
        let share = if aimed > LONGEST { LONGEST / aimed } else { 1.0 };
        for (joint, (q, change)) in state.q.iter_mut().zip(&step.q).enumerate() {
            *q += share * change;
            if state.held[joint].is_none() {
                let beyond = |side| self.bound(joint, side, state.progress).0 - *q;
                state.held[joint] = match (beyond(Side::Low) > BEYOND, beyond(Side::High) < -BEYOND)
                {
                    (true, _) => Some(Side::Low),
                    (_, true) => Some(Side::High),
                    (false, false) => None,
                };
            }
        }
        for (old, new) in state.multipliers.iter_mut().zip(&step.multipliers) {
            *old += share * (new - *old);
        }
        let off = (0..state.q.len()).filter_map(|joint| {
            let (bound, _) = self.bound(joint, state.held[joint]?, state.progress);
            Some((bound - state.q[joint]).abs())
        });
        Ok(off.filter(|off| *off > OFF).fold(aimed, larger))
    }

    /// Returns the weights and the gradient of what is minimised.
    fn quadratic(&self, state: &State) -> (Vec<f64>, Vec<f64>) {
        let of_joint = |joint: usize| {
            let q = state.q[joint];
            if let Some(side) = state.held[joint] {
                return (HELD, HELD * (q - self.bound(joint, side, state.progress).0));
            }
            let weight = self.weights[joint];
            let gradient = weight * (q - state.progress * self.targets[joint]);
            match &state.drag {
                Some((drag, from)) => (weight + drag, gradient + drag * (q - from[joint])),
                None => (weight, gradient),
            }
        };
        (0..state.q.len()).map(of_joint).unzip()
    }

    /// Lets joints go that are pulled away from their bounds; returns whether there are any.
    fn release(&self, state: &mut State) -> bool {
        let placed = self.equations.place(&state.q);
        let pull = self.equations.pull(&placed, &state.multipliers);
        let mut any = false;
        for joint in 0..state.q.len() {
            let Some(side) = state.held[joint] else { continue };
            let (bound, _) = self.bound(joint, side, state.progress);
            let off = bound - state.progress * self.targets[joint];
            let drag = state.drag.as_ref().map_or(0.0, |(drag, from)| drag * (bound - from[joint]));
            let down = self.weights[joint] * off + drag + pull[joint];
            let inward = if side == Side::High { down } else { -down };
            if inward > PULL {
                state.held[joint] = None;
                any = true;
            }
        }
        any
    }

    /// Returns dq/ds and dl/ds along the path of the minima, at a state that has settled.
    pub fn tangent(&mut self, state: &State) -> Option<super::system::Step> {
        let placed = self.equations.place(&state.q);
        let (weights, _) = self.quadratic(state);
        if !self.equations.factorise(&placed, &weights, &state.multipliers) {
            return None;
        }
        let gradient: Vec<f64> = (0..state.q.len())
            .map(|joint| match state.held[joint] {
                Some(side) => -HELD * self.bound(joint, side, state.progress).1,
                None => -self.weights[joint] * self.targets[joint],
            })
            .collect();
        self.equations.tangent(&gradient)
    }

    /// Returns the sum of w t x over that of w t^2: 1 for the targets themselves.
    pub fn along_targets(&self, x: &[f64]) -> f64 {
        let sum = |x: &[f64]| -> f64 {
            let terms = self.weights.iter().zip(&self.targets).zip(x);
            terms.map(|((weight, target), x)| weight * target * x).sum()
        };
        sum(x) / sum(&self.targets)
    }
}
