//! Assembly: from a rough guess to the nearest configuration with closed loops.
//!
//! Levenberg-Marquardt on all nine residuals r of each loop closes them, by steps as short as
//! possible; then q slides along the closure towards the guess g,
//!
//! ```text
//! step = -J^+ r + (I - J^+ J)(g - q) = (g - q) + J^+ (-r - J (g - q)),
//! ```
//!
//! closing again after each step. Joints stay within their limits (projected steps: a joint at its
//! limit that would leave is held for that step), within half a turn where there are none. If a
//! guess does not lead to a closed state, it is perturbed, always in the same way. After J. Nocedal
//! and S. Wright, "Numerical Optimization", 10.3 and 16.7; the damping proportional to |r| after J.
//! Fan and Y. Yuan, "On the quadratic convergence of the Levenberg-Marquardt method without
//! nonsingularity assumption", 2005.

mod steps;

use core::f64::consts::{PI, TAU};
use core::ops::Range;

use crate::acceleration::not_finite;
use crate::constants::{
    BENT_ANGLE, BRANCH_RESTARTS, MOST_TURNS, NOISE_DROPPED, NOISE_FACTOR_1, NOISE_FACTOR_2,
    NOISE_HALF, NOISE_INCREMENT, NOISE_SHIFT_1, NOISE_SHIFT_2, NOISE_STRIDE, RESTART_REACH,
    RESTARTS, RESULT_NEAR, SEARCH_NEAR, SIGN_RESTARTS,
};
use crate::linear::max_abs;
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
/// and move like the others if not. Of the branches it finds, it prefers one in which no joint
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
    if let Some(joint) = not_finite(&[q]) {
        return Err(Error::NotFinite { joint });
    }
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
    search.guess.copy_from_slice(q);
    for joint in 0..joints {
        search.guess[joint] = search.wrapped(joint, q[joint]);
    }
    let holds: [&dyn Fn(usize) -> bool; 2] = [is_pinned, &|_| false];
    for held in holds {
        if !search.find(attempt, candidate, held, 0..RESTARTS) {
            if (0..joints).any(is_pinned) {
                continue;
            }
            break;
        }
        q.copy_from_slice(attempt);
        if !search.has_signs(q) {
            search.improve(q, attempt, candidate, held);
        }
        search.evaluate(q);
        search.slide(q, candidate, held, RESULT_NEAR.of());
        let residual = search.evaluate(q);
        return Ok(Assembly { iterations: search.iterations, residual });
    }
    Err(search.failure)
}

/// A number between -1 and 1, always the same for the same arguments.
fn noise<S: Scalar>(restart: usize, joint: usize) -> S {
    let mut bits = (restart as u64 * NOISE_STRIDE + joint as u64 + 1).wrapping_mul(NOISE_INCREMENT);
    bits = (bits ^ (bits >> NOISE_SHIFT_1)).wrapping_mul(NOISE_FACTOR_1);
    bits = (bits ^ (bits >> NOISE_SHIFT_2)).wrapping_mul(NOISE_FACTOR_2);
    whole::<S>(bits >> NOISE_DROPPED) / whole(NOISE_HALF) - S::ONE
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
        for joint in 0..self.lower.len() {
            let [lower, upper] = self.system.limits(joint);
            self.lower[joint] = if lower.is_finite() { lower } else { -half_turn };
            self.upper[joint] = if upper.is_finite() { upper } else { half_turn };
        }
        // A driven joint is where it should be.
        self.system.drives(self.t, |drive| {
            self.lower[drive.joint] = drive.position;
            self.upper[drive.joint] = drive.position;
        });
    }

    /// Lets no joint leave the side of zero on which its guess lies.
    fn set_signs(&mut self) {
        let zero = Y::Scalar::ZERO;
        for joint in 0..self.lower.len() {
            if self.lower[joint] == self.upper[joint] {
                continue;
            }
            if self.guess[joint] > zero {
                self.lower[joint] = self.lower[joint].max(zero);
            } else if self.guess[joint] < zero {
                self.upper[joint] = self.upper[joint].min(zero);
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

    fn clamped(&self, joint: usize, angle: Y::Scalar) -> Y::Scalar {
        // Not `min` and `max`: with lower above upper this stays in order.
        if angle < self.lower[joint] {
            self.lower[joint]
        } else if angle > self.upper[joint] {
            self.upper[joint]
        } else {
            angle
        }
    }

    /// Brings the joints within their limits.
    fn clamp(&self, q: &mut [Y::Scalar]) {
        for joint in 0..self.lower.len() {
            q[joint] = self.clamped(joint, q[joint]);
        }
    }

    /// The same direction within the limits, or the nearest limit.
    fn wrapped(&self, joint: usize, angle: Y::Scalar) -> Y::Scalar {
        let of = Y::Scalar::from_f64;
        let turns = angle / of(TAU);
        if self.clamped(joint, angle) == angle || !(turns.abs() < of(MOST_TURNS)) {
            return self.clamped(joint, angle);
        }
        let nearest = truncated(turns + of(if turns < Y::Scalar::ZERO { -0.5 } else { 0.5 }));
        let wrapped = angle - nearest * of(TAU);
        let inside = self.clamped(joint, wrapped) == wrapped;
        self.clamped(joint, if inside { wrapped } else { angle })
    }

    /// Residual and Jacobian at q; the largest residual.
    fn evaluate(&mut self, q: &[Y::Scalar]) -> Y::Scalar {
        match self.system.write_closure(q, self.residual, self.jacobian) {
            Ok(()) => max_abs(self.residual),
            // It cannot be the case: the slices have the lengths of the mechanism's own dimensions.
            Err(_) => Y::Scalar::from_f64(f64::NAN),
        }
    }

    /// Closes the loops from the guess, or from perturbed ones, and slides towards the guess.
    fn find(
        &mut self,
        q: &mut [Y::Scalar],
        candidate: &mut [Y::Scalar],
        held: &dyn Fn(usize) -> bool,
        restarts: Range<usize>,
    ) -> bool {
        for restart in restarts {
            let reach = Y::Scalar::from_f64(RESTART_REACH) * whole(restart as u64);
            for direction in 0..self.step.len() {
                let share =
                    if held(direction) { Y::Scalar::ZERO } else { noise(restart, direction) };
                self.step[direction] = reach * share;
            }
            q.copy_from_slice(self.guess);
            self.system.advance(q, self.step);
            self.clamp(q);
            if self.close(q, held) {
                self.slide(q, candidate, held, SEARCH_NEAR.of());
                return true;
            }
            self.note_failure(q);
        }
        false
    }

    /// Looks for a branch with the signs of the guess, or else for a nearer one: a guess between
    /// two branches may have led to the singular state where they meet.
    fn improve(
        &mut self,
        q: &mut [Y::Scalar],
        attempt: &mut [Y::Scalar],
        candidate: &mut [Y::Scalar],
        held: &dyn Fn(usize) -> bool,
    ) {
        self.set_signs();
        let found = self.find(attempt, candidate, held, 0..SIGN_RESTARTS);
        self.set_limits();
        if found && self.has_signs(attempt) {
            q.copy_from_slice(attempt);
            return;
        }
        // Flat joints that should be bent: where branches meet.
        let clear = Y::Scalar::from_f64(BENT_ANGLE);
        let flat = |(&guess, &q): (&Y::Scalar, &Y::Scalar)| guess.abs() > clear && q.abs() <= clear;
        if !self.guess.iter().zip(&*q).take(self.lower.len()).any(flat) {
            return;
        }
        for restart in 1..BRANCH_RESTARTS {
            let found = self.find(attempt, candidate, held, restart..restart + 1);
            if found && self.distance(attempt) < self.distance(q) {
                q.copy_from_slice(attempt);
            }
        }
    }

    fn note_failure(&mut self, q: &[Y::Scalar]) {
        let (loop_index, residual) = worst_loop(self.residual);
        if residual < self.closest {
            let joint = (0..self.lower.len()).find(|&joint| {
                let [lower, upper] = self.system.limits(joint);
                q[joint] <= lower || q[joint] >= upper
            });
            self.closest = residual;
            self.failure = Error::NotClosed { loop_index, residual: residual.to_f32(), joint };
        }
    }
}
