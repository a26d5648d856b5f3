//! Assembly: from a rough guess to the nearest configuration with closed loops.
//!
//! Levenberg-Marquardt on all nine residuals r of each loop closes them, by steps as short as
//! possible; then q slides along the closure towards the guess g,
//!
//! ```text
//! step = -J^+ r + (I - J^+ J)(g - q) = (g - q) + J^+ (-r - J (g - q)),
//! ```
//!
//! closing again after each step. Joints stay within their limits, within half a turn where there are
//! none: one at its limit that would leave is held while the loops are closed, and those that would leave in a slide
//! move to their limits, those furthest out first. If a guess does not lead to a closed state, it is perturbed, always in the same way. After J. Nocedal
//! and S. Wright, "Numerical Optimization", 10.3 and 16.7; D. P. Bertsekas, "Projected Newton methods for optimization problems
//! with simple constraints", 1982; the damping proportional to |r| after J.
//! Fan and Y. Yuan, "On the quadratic convergence of the Levenberg-Marquardt method without
//! nonsingularity assumption", 2005.

mod steps;

use core::f64::consts::{PI, TAU};
use core::ops::Range;

use crate::acceleration::not_finite;
use crate::constants::{
    BENT_ANGLE, BRANCH_RESTARTS, MOST_TURNS, NEARLY_CLOSED, RESTART_REACH, RESTARTS, RESULT_NEAR,
    SEARCH_NEAR, SIGN_RESTARTS,
};
use crate::linear::{copy, max_abs};
use crate::noise::noise;
use crate::plumbing::Dimensions;
use crate::projection::worst_loop;
use crate::scalar::{truncated, whole};
use crate::workspace::{check, split};
use crate::{Arithmetic, Error, Mechanism, Scalar};

/// Result of an assembly.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Assembly<S> {
    /// Steps taken.
    pub iterations: usize,
    /// Largest remaining closure residual, m.
    pub residual: S,
}

/// Closes the loops: `q` (NQ, rad) is the guess, and the result. Driven joints are where they
/// should be at t (s).
///
/// Joints whose entry in `pinned` (one per joint) is true keep their angle if the loops can close that way,
/// and move like the others if not: from where the loops nearly close, if they do at these angles. Of the branches it finds, it prefers one in which no joint
/// has the sign opposite to its guess. On failure `q` is unchanged.
///
/// # Errors
///
/// [`Error::NotClosed`] names the loop that stayed open; [`Error::NotFinite`],
/// [`Error::Workspace`], [`Error::Length`].
pub fn assemble<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    pinned: &[bool],
    workspace: &mut [Y::Scalar],
) -> Result<Assembly<Y::Scalar>, Error> {
    let expected = system.dimensions().joints;
    if pinned.len() != expected {
        return Err(Error::Length { expected, given: pinned.len() });
    }
    let is_pinned = |joint: usize| pinned.get(joint) == Some(&true);
    assemble_pinned(system, t, q, &is_pinned, workspace)
}

/// As [`assemble`], with the pinned joints as a function.
pub(crate) fn assemble_pinned<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    is_pinned: &dyn Fn(usize) -> bool,
    mut workspace: &mut [Y::Scalar],
) -> Result<Assembly<Y::Scalar>, Error> {
    let dimensions = check(system, workspace, &[q.len()], &[])?;
    let Dimensions { coordinates, speeds: n, joints, loops, .. } = dimensions;
    let r = 9 * loops;
    let mut search = Search {
        system,
        t,
        residual: split(&mut workspace, r)?,
        jacobian: split(&mut workspace, r * n)?,
        normal: split(&mut workspace, n * n)?,
        factor: split(&mut workspace, n * n)?,
        rhs: split(&mut workspace, n)?,
        lower: split(&mut workspace, joints)?,
        upper: split(&mut workspace, joints)?,
        guess: split(&mut workspace, coordinates)?,
        step: split(&mut workspace, n)?,
        across: split(&mut workspace, n)?,
        free: split(&mut workspace, n)?,
        trial: split(&mut workspace, coordinates)?,
        last_q: split(&mut workspace, coordinates)?,
        last_step: split(&mut workspace, n)?,
        iterations: 0,
        failure: Error::NotClosed { loop_index: 0, residual: f32::INFINITY, joint: None },
        closest: Y::Scalar::from_f64(f64::INFINITY),
    };
    let attempt = split(&mut workspace, coordinates)?;
    let candidate = split(&mut workspace, coordinates)?;
    search.set_limits();
    search.set_guess(q)?;
    let holds: [&dyn Fn(usize) -> bool; 2] = [is_pinned, &|_| false];
    for held in holds {
        if !search.find(attempt, candidate, held, 0..RESTARTS)? {
            if (0..joints).any(is_pinned) {
                search.follow(attempt, held)?;
                continue;
            }
            break;
        }
        copy(q, attempt)?;
        if !search.has_signs(q) {
            search.improve(q, attempt, candidate, held)?;
        }
        search.evaluate(q)?;
        search.slide(q, candidate, held, RESULT_NEAR.of())?;
        let residual = search.evaluate(q)?;
        return Ok(Assembly { iterations: search.iterations, residual });
    }
    Err(search.failure)
}

/// Smallest and largest angle of each joint, rad.
fn limits<'a, S: Scalar>(lower: &'a [S], upper: &'a [S]) -> impl Iterator<Item = [S; 2]> + 'a {
    lower.iter().zip(upper).map(|(&lower, &upper)| [lower, upper])
}

fn clamped<S: Scalar>(angle: S, [lower, upper]: [S; 2]) -> S {
    // Not `min` and `max`: with lower above upper this stays in order.
    if angle < lower {
        lower
    } else if angle > upper {
        upper
    } else {
        angle
    }
}

/// Brings the joints within their limits.
fn clamp<S: Scalar>(q: &mut [S], limits: impl Iterator<Item = [S; 2]>) {
    for (angle, limits) in q.iter_mut().zip(limits) {
        *angle = clamped(*angle, limits);
    }
}

/// The same direction within the limits, or the nearest limit.
fn wrapped<S: Scalar>(angle: S, limits: [S; 2]) -> S {
    let of = S::from_f64;
    let turns = angle / of(TAU);
    if clamped(angle, limits) == angle || !(turns.abs() < of(MOST_TURNS)) {
        return clamped(angle, limits);
    }
    let nearest = truncated(turns + of(if turns < S::ZERO { -0.5 } else { 0.5 }));
    let wrapped = angle - nearest * of(TAU);
    let inside = clamped(wrapped, limits) == wrapped;
    clamped(if inside { wrapped } else { angle }, limits)
}

struct Search<'a, Y: Mechanism> {
    system: &'a Y,
    /// s.
    t: Y::Scalar,
    /// r, 9 L, m, and its derivatives along the directions of u, 9 L x NU, where last evaluated.
    residual: &'a mut [Y::Scalar],
    jacobian: &'a mut [Y::Scalar],
    /// J^T J of the free directions and its damped factor, NU x NU; the right-hand side, NU.
    normal: &'a mut [Y::Scalar],
    factor: &'a mut [Y::Scalar],
    rhs: &'a mut [Y::Scalar],
    /// Smallest and largest angles of the joints, rad.
    lower: &'a mut [Y::Scalar],
    upper: &'a mut [Y::Scalar],
    /// Angles to stay near, NQ, rad.
    guess: &'a mut [Y::Scalar],
    /// NU, rad.
    step: &'a mut [Y::Scalar],
    /// A step before the part of it that is across the closure is taken away.
    across: &'a mut [Y::Scalar],
    /// 1 for directions of u that may move in this step, 0 for others.
    free: &'a mut [Y::Scalar],
    /// Coordinates that a step leads to.
    trial: &'a mut [Y::Scalar],
    /// The last slide began here, along this step.
    last_q: &'a mut [Y::Scalar],
    last_step: &'a mut [Y::Scalar],
    iterations: usize,
    /// The attempt that came closest, and its residual, m.
    failure: Error,
    closest: Y::Scalar,
}

impl<Y: Mechanism> Search<'_, Y> {
    fn set_limits(&mut self) {
        let half_turn = Y::Scalar::from_f64(PI);
        for (joint, slots) in self.lower.iter_mut().zip(&mut *self.upper).enumerate() {
            let [lower, upper] = self.system.limits(joint);
            *slots.0 = if lower.is_finite() { lower } else { -half_turn };
            *slots.1 = if upper.is_finite() { upper } else { half_turn };
        }
        // A driven joint is where it should be.
        self.system.drives(self.t, |drive| {
            let slots = [self.lower.get_mut(drive.joint), self.upper.get_mut(drive.joint)];
            slots.into_iter().flatten().for_each(|limit| *limit = drive.position);
        });
    }

    /// Takes a guess, with angles within the limits. Quaternions of zeros, or whose squares are not numbers, have no
    /// direction: after the second division they are NaN.
    fn set_guess(&mut self, q: &[Y::Scalar]) -> Result<(), Error> {
        copy(self.trial, q)?;
        self.system.normalise(self.trial);
        self.system.normalise(self.trial);
        if let Some(joint) = not_finite(&[self.trial]) {
            return Err(Error::NotFinite { joint });
        }
        copy(self.guess, q)?;
        for (angle, limits) in self.guess.iter_mut().zip(limits(self.lower, self.upper)) {
            *angle = wrapped(*angle, limits);
        }
        Ok(())
    }

    /// Lets no joint leave the side of zero on which its guess lies.
    fn set_signs(&mut self) {
        let zero = Y::Scalar::ZERO;
        let limits = self.lower.iter_mut().zip(&mut *self.upper);
        for ((lower, upper), &guess) in limits.zip(&*self.guess) {
            if lower == upper {
                continue;
            }
            if guess > zero {
                *lower = lower.max(zero);
            } else if guess < zero {
                *upper = upper.min(zero);
            }
        }
    }

    /// Whether each joint with a guess lies clearly on its guess's side of zero.
    fn has_signs(&self, q: &[Y::Scalar]) -> bool {
        let zero = Y::Scalar::ZERO;
        let clear = Y::Scalar::from_f64(BENT_ANGLE);
        self.guess
            .iter()
            .zip(q)
            .take(self.lower.len())
            .all(|(&guess, &q)| guess == zero || if guess > zero { q > clear } else { q < -clear })
    }

    /// Residual and Jacobian at q; the largest residual.
    fn evaluate(&mut self, q: &[Y::Scalar]) -> Result<Y::Scalar, Error> {
        self.system.write_closure(q, self.residual, self.jacobian)?;
        Ok(max_abs(self.residual))
    }

    /// Closes the loops from the guess, or from perturbed ones, and slides towards the guess.
    fn find(
        &mut self,
        q: &mut [Y::Scalar],
        candidate: &mut [Y::Scalar],
        held: &dyn Fn(usize) -> bool,
        restarts: Range<usize>,
    ) -> Result<bool, Error> {
        for restart in restarts {
            let reach = Y::Scalar::from_f64(RESTART_REACH) * whole(restart as u64);
            for (direction, step) in self.step.iter_mut().enumerate() {
                let share =
                    if held(direction) { Y::Scalar::ZERO } else { noise(restart, direction) };
                *step = reach * share;
            }
            copy(q, self.guess)?;
            self.system.advance(q, self.step);
            clamp(q, limits(self.lower, self.upper));
            if self.close(q, held)? {
                self.slide(q, candidate, held, SEARCH_NEAR.of())?;
                return Ok(true);
            }
            self.note_failure(q);
        }
        Ok(false)
    }

    /// Where the loops nearly close at the held angles, the guess of the other joints becomes their angles there. Held angles
    /// that agree but for rounding are then hardly moved.
    fn follow(&mut self, q: &mut [Y::Scalar], held: &dyn Fn(usize) -> bool) -> Result<(), Error> {
        copy(q, self.guess)?;
        self.close(q, held)?;
        let nearly = Y::Scalar::from_f64(NEARLY_CLOSED) * self.system.size();
        if max_abs(self.residual) <= nearly {
            copy(self.guess, q)?;
        }
        Ok(())
    }

    /// Looks for a branch with the signs of the guess, or else for a nearer one: a guess between
    /// two branches may have led to the singular state where they meet.
    fn improve(
        &mut self,
        q: &mut [Y::Scalar],
        attempt: &mut [Y::Scalar],
        candidate: &mut [Y::Scalar],
        held: &dyn Fn(usize) -> bool,
    ) -> Result<(), Error> {
        self.set_signs();
        let found = self.find(attempt, candidate, held, 0..SIGN_RESTARTS)?;
        self.set_limits();
        if found && self.has_signs(attempt) {
            return copy(q, attempt);
        }
        // Flat joints that should be bent: where branches meet.
        let clear = Y::Scalar::from_f64(BENT_ANGLE);
        let flat = |(&guess, &q): (&Y::Scalar, &Y::Scalar)| guess.abs() > clear && q.abs() <= clear;
        if !self.guess.iter().zip(&*q).take(self.lower.len()).any(flat) {
            return Ok(());
        }
        for restart in 1..BRANCH_RESTARTS {
            let found = self.find(attempt, candidate, held, restart..restart + 1)?;
            if found && self.distance(attempt) < self.distance(q) {
                copy(q, attempt)?;
            }
        }
        Ok(())
    }

    fn note_failure(&mut self, q: &[Y::Scalar]) {
        let (loop_index, residual) = worst_loop(self.residual, self.system.dimensions().loops);
        if residual < self.closest {
            let mut joints = q.iter().take(self.lower.len()).enumerate();
            let at_limit = |&(joint, &angle): &(usize, &Y::Scalar)| {
                let [lower, upper] = self.system.limits(joint);
                angle <= lower || angle >= upper
            };
            let joint = joints.find(at_limit).map(|(joint, _)| joint);
            self.closest = residual;
            self.failure = Error::NotClosed { loop_index, residual: residual.to_f32(), joint };
        }
    }
}
