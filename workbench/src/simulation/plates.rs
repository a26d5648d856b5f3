//! Steps that may not jump over plates: a plate is thin, and the error estimate of a step does not see what lies between
//! the states at which it evaluates the forces.
//!
//! A step in which a point comes through the face of a plate ends within [`DEEPEST`] of its thickness, or it is taken
//! again, half as long. Planes without an outline need nothing of this: behind them there is force everywhere.

use lamc_runtime::plumbing::GapsMut;
use lamc_runtime::{Error, Mechanism as _, State};

use super::Simulation;
use crate::execution::Jit;

/// Share of the distance to the back and the edges of a plate that a point may sink in within the step in which it arrives.
const DEEPEST: f64 = 0.25;
/// A plane reaches less far than this from its edges to be a plate, in sizes of the mechanism.
const FAR: f64 = 1e6;
/// A step is halved at most so often.
const HALVINGS: usize = 40;

/// The contact points whose planes end.
pub struct Plates {
    points: Vec<usize>,
}

impl Plates {
    /// `None` if no point can touch a plate.
    ///
    /// # Errors
    /// [`Error::LeftOut`] if the program has no function for gaps.
    pub fn new(system: &Jit, q: &[f64]) -> Result<Option<Self>, Error> {
        if system.dimensions().contacts == 0 {
            return Ok(None);
        }
        let ends = |(point, [_, within]): (usize, [f64; 2])| {
            (within.abs() < FAR * system.size()).then_some(point)
        };
        let points: Vec<usize> =
            gaps(system, q)?.into_iter().enumerate().filter_map(ends).collect();
        Ok((!points.is_empty()).then_some(Self { points }))
    }

    /// Whether a point came through the face of a plate in a step and went too deep, or through.
    ///
    /// # Errors
    /// Those of the gaps.
    pub fn are_jumped(
        &self,
        system: &Jit,
        before: &State<Vec<f64>, f64>,
        after: &State<Vec<f64>, f64>,
    ) -> Result<bool, Error> {
        let [start, end] = [gaps(system, &before.q)?, gaps(system, &after.q)?];
        for &point in &self.points {
            let ([from, _], [to, _]) = (start[point], end[point]);
            if !(from >= 0.0 && to < 0.0) {
                continue;
            }
            // Where it comes through the plane, on the straight way.
            let mut q = before.q.clone();
            let mut way = system.speeds();
            system.write_difference(&before.q, &after.q, &mut way);
            way.iter_mut().for_each(|part| *part *= from / (from - to));
            system.advance(&mut q, &way);
            let [_, within] = gaps(system, &q)?[point];
            if within > 0.0 && -to > DEEPEST * within {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// Of each contact point the height over its plane, and the distance within the edges and the back of its plate, m.
fn gaps(system: &Jit, q: &[f64]) -> Result<Vec<[f64; 2]>, Error> {
    let d = system.dimensions();
    let mut gaps = vec![[0.0; 2]; d.contacts];
    let out = GapsMut {
        gap: gaps.as_flattened_mut(),
        friction: &mut vec![0.0; d.contacts],
        normal: &mut vec![0.0; 3 * d.contacts],
        rows: &mut vec![0.0; 3 * d.contacts * d.speeds],
    };
    system.write_gaps(0.0, q, out)?;
    Ok(gaps)
}

impl Simulation {
    /// One step to `t` at most, s, which is so short that no point jumps over a plate.
    pub(super) fn step_before_plates(&mut self, mut t: f64) -> Result<(), Error> {
        let Some(plates) = self.plates.take() else { return self.step(t) };
        let mut outcome = Ok(());
        for _ in 0..HALVINGS {
            let before = self.state.clone();
            let kept = (self.system.clone(), self.explicit.clone(), self.implicit.clone());
            outcome = self.step(t);
            let are_jumped = outcome.is_ok()
                && plates.are_jumped(&self.system.system, &before, &self.state).unwrap_or(false);
            if !are_jumped {
                break;
            }
            t = 0.5 * (before.t + self.state.t);
            self.state = before;
            (self.system, self.explicit, self.implicit) = kept;
        }
        self.plates = Some(plates);
        outcome
    }
}
