//! Joint limits as stops: impacts, rest, and release, found as events of a motion.
//!
//! After F. Pfeiffer, C. Glocker, "Multibody Dynamics with Unilateral Contacts", 1996, without
//! friction: an impact changes u by an impulse along the joint's coordinate and along the closure,
//! M (u+ - u-) = J^T Lambda + e_j p, so that J u+ = 0 and u_j+ = -restitution u_j-.

mod stopped;

pub use stopped::Stopped;

use crate::acceleration::acceleration_and_torques;
use crate::integrate::Integrator;
use crate::linear::rows_of_mut;
use crate::projection::project_to_rounding;
use crate::{Arithmetic, Error, Mechanism, Scalar, StateOf, acceleration};

/// A joint this close to a limit is there, rad.
const TOUCH: f64 = 1e-10;
/// Bisections of the time of an event.
const BISECTIONS: usize = 48;
/// Places within a step at which joints that could reach a limit are looked at.
const SAMPLES_PER_STEP: usize = 4;
/// Events at one instant, at most.
const EVENTS: usize = 64;

impl<Y: Mechanism> Stopped<Y> {
    /// Advances to `t_end` (s), stopping joints at their limits, and shows the state after every
    /// step and every impact.
    ///
    /// # Errors
    ///
    /// As [`Integrator::run`].
    pub fn run<I: Integrator<Self>>(
        &mut self,
        integrator: &mut I,
        state: &mut StateOf<Y>,
        t_end: Y::Scalar,
        mut observe: impl FnMut(&StateOf<Y>),
    ) -> Result<(), Error> {
        if !(t_end - state.t).is_finite() {
            return Err(Error::Time);
        }
        integrator.restart();
        while state.t < t_end {
            self.step_with(integrator, state, t_end)?;
            observe(state);
        }
        Ok(())
    }

    /// One step, not beyond `t_end` (s), nor beyond the first joint to reach or to leave a stop.
    ///
    /// # Errors
    ///
    /// As [`Integrator::step`].
    pub fn step_with<I: Integrator<Self>>(
        &mut self,
        integrator: &mut I,
        state: &mut StateOf<Y>,
        t_end: Y::Scalar,
    ) -> Result<(), Error> {
        if self.resolve_impacts(state)? {
            integrator.restart();
        }
        let start = state.clone();
        integrator.step(self, state, t_end)?;
        let mut events = 0;
        while let Some(event) = self.first_event(integrator, &start, state)? {
            *state = event;
            self.resolve_impacts(state)?;
            integrator.restart();
            events += 1;
            if state.t > start.t || events > EVENTS {
                break;
            }
            // An event at the very start of the step restarts it.
            integrator.step(self, state, t_end)?;
        }
        Ok(())
    }

    /// Impacts and releases at a state, for integrators of fixed step after each step: joints
    /// beyond a limit go back to it and leave it as they should. Returns whether anything changed.
    ///
    /// # Errors
    ///
    /// Those of [`project`](crate::project) and [`acceleration`](crate::acceleration()).
    pub fn resolve_impacts(&mut self, state: &mut StateOf<Y>) -> Result<bool, Error> {
        let zero = Y::Scalar::ZERO;
        let n = self.system.dimensions().joints;
        let mut hit = false;
        for joint in 0..n {
            let (q, u) = (state.q.as_ref()[joint], state.u.as_ref()[joint]);
            let held = self.sides.as_ref()[joint] != zero;
            if held || self.is_driven(state.t, joint) {
                continue;
            }
            for side in [-Y::Scalar::ONE, Y::Scalar::ONE] {
                let beyond = (q - self.limit(joint, side)) * side;
                let touches = beyond >= -Y::Scalar::from_f64(TOUCH);
                if touches && (u * side >= zero || beyond > Y::Scalar::from_f64(TOUCH)) {
                    // One that is on its way back already keeps its speed.
                    let back = if u * side < zero { u } else { -self.restitution * u };
                    let leaves = u * side < zero || back.abs() > self.threshold;
                    self.sides.as_mut()[joint] = side;
                    self.speeds.as_mut()[joint] = if leaves { back } else { zero };
                    hit = true;
                }
            }
        }
        if hit {
            self.impulse(state)?;
            for joint in 0..n {
                if self.speeds.as_ref()[joint] != zero {
                    self.sides.as_mut()[joint] = zero;
                    self.speeds.as_mut()[joint] = zero;
                }
            }
        }
        while let Some((_, joint)) = self.pull(state)? {
            self.sides.as_mut()[joint] = zero;
            hit = true;
        }
        Ok(hit)
    }

    /// Changes u by the impulses of the joints at stops; those that an impulse would have to hold
    /// back let go.
    fn impulse(&mut self, state: &mut StateOf<Y>) -> Result<(), Error> {
        let zero = Y::Scalar::ZERO;
        let mut workspace = self.workspace();
        let mut after = state.clone();
        let (q, u) = (after.q.as_mut(), after.u.as_mut());
        project_to_rounding(self, state.t, q, u, workspace.as_mut())?;
        for joint in 0..self.system.dimensions().joints {
            let side = self.sides.as_ref()[joint];
            if side == zero || self.speeds.as_ref()[joint] != zero {
                continue;
            }
            self.sides.as_mut()[joint] = zero;
            let mut without = state.clone();
            let (q, u) = (without.q.as_mut(), without.u.as_mut());
            let moved = project_to_rounding(self, state.t, q, u, workspace.as_mut());
            let small = Y::Scalar::from_f64(16.0) * Y::Scalar::EPSILON * u[joint].abs();
            let lets_go = moved.is_ok() && u[joint] * side < -small;
            if lets_go && self.gets_away(&without, joint, side)? {
                after = without;
            } else {
                self.sides.as_mut()[joint] = side;
            }
        }
        *state = after;
        Ok(())
    }

    /// Whether a joint that leaves a stop gets farther from it than [`TOUCH`]. One that does not would be back at once: two joints
    /// that push each other off their stops would take turns without end.
    fn gets_away(&self, state: &StateOf<Y>, joint: usize, side: Y::Scalar) -> Result<bool, Error> {
        let mut rates = Mechanism::speeds(self);
        let (mut workspace, out) = (self.workspace(), rates.as_mut());
        let (q, u) = (state.q.as_ref(), state.u.as_ref());
        acceleration(self, state.t, q, u, workspace.as_mut(), out)?;
        let (speed, back) = (u[joint], out[joint] * side);
        Ok(speed * speed > Y::Scalar::from_f64(2.0 * TOUCH) * back)
    }

    /// The torque (N m) by which a stop would have to pull, and the joint; the largest.
    fn pull(&self, state: &StateOf<Y>) -> Result<Option<(Y::Scalar, usize)>, Error> {
        let zero = Y::Scalar::ZERO;
        let sides = self.sides.as_ref();
        if sides.iter().all(|&side| side == zero) {
            return Ok(None);
        }
        let (d, own) = (self.dimensions(), self.system.dimensions());
        let (mut acceleration, mut torques) = (Mechanism::speeds(self), Mechanism::speeds(self));
        let torques = rows_of_mut(torques.as_mut(), 1, 0..d.drives)?;
        let at = (state.t, state.q.as_ref(), state.u.as_ref());
        let mut workspace = self.workspace();
        let (workspace, out) = (workspace.as_mut(), acceleration.as_mut());
        acceleration_and_torques(self, at, workspace, out, torques)?;
        let held = (0..sides.len()).filter(|&joint| sides[joint] != zero);
        let mut worst: Option<(Y::Scalar, usize)> = None;
        for (joint, &torque) in held.zip(torques.iter().skip(own.drives)) {
            // A stop at the greatest angle pushes back.
            let pull = torque * sides[joint];
            if pull > zero && worst.is_none_or(|(most, _)| pull > most) {
                worst = Some((pull, joint));
            }
        }
        Ok(worst)
    }

    /// The state at the first event within the step from `start` to `end`: a joint reaches a
    /// limit, or is let go.
    fn first_event<I: Integrator<Self>>(
        &self,
        integrator: &mut I,
        start: &StateOf<Y>,
        end: &StateOf<Y>,
    ) -> Result<Option<StateOf<Y>>, Error> {
        let step = end.t - start.t;
        let samples = if self.may_reach(start, end) { SAMPLES_PER_STEP } else { 1 };
        let mut before = start.t;
        for sample in 1..=samples {
            let share = Y::Scalar::from_f64(sample as f64 / samples as f64);
            let after = if sample == samples { end.t } else { start.t + share * step };
            let state =
                if sample == samples { end.clone() } else { integrator.between(self, after)? };
            if self.happened(&state)? {
                return self.bisect(integrator, before, after, state).map(Some);
            }
            before = after;
        }
        Ok(None)
    }

    /// Returns whether a joint can have reached a limit within the step and returned before its
    /// end.
    fn may_reach(&self, start: &StateOf<Y>, end: &StateOf<Y>) -> bool {
        let step = end.t - start.t;
        (0..self.system.dimensions().joints).any(|joint| {
            let speed = start.u.as_ref()[joint].abs().max(end.u.as_ref()[joint].abs());
            let [least, greatest] = self.system.limits(joint);
            let (a, b) = (start.q.as_ref()[joint], end.q.as_ref()[joint]);
            let near = (a.min(b) - least).min(greatest - a.max(b));
            near < speed * step
        })
    }

    /// Whether at this state a free joint is beyond a limit or a held one is pulled.
    fn happened(&self, state: &StateOf<Y>) -> Result<bool, Error> {
        Ok(self.excess(state) > Y::Scalar::ZERO || self.pull(state)?.is_some())
    }

    /// How far the farthest free joint is beyond half of [`TOUCH`] from its limit, rad; not positive if none is.
    fn excess(&self, state: &StateOf<Y>) -> Y::Scalar {
        let joints = self.system.dimensions().joints;
        let touch = Y::Scalar::from_f64(TOUCH / 2.0);
        let mut most = Y::Scalar::from_f64(f64::NEG_INFINITY);
        for (joint, &q) in state.q.as_ref().iter().enumerate().take(joints) {
            let [least, greatest] = self.system.limits(joint);
            let beyond = (q - greatest).max(least - q) - touch;
            let is_held = self.sides.as_ref()[joint] != Y::Scalar::ZERO;
            if beyond > most && !is_held && !self.is_driven(state.t, joint) {
                most = beyond;
            }
        }
        most
    }

    /// The state just after the event between two times of a step, where `state` is the later.
    ///
    /// A joint that reaches its limit is found by false position, with the change of the Illinois algorithm (M. Dowell,
    /// P. Jarratt, 1971) for an end that stays; else the interval is halved.
    fn bisect<I: Integrator<Self>>(
        &self,
        integrator: &mut I,
        mut before: Y::Scalar,
        mut after: Y::Scalar,
        mut state: StateOf<Y>,
    ) -> Result<StateOf<Y>, Error> {
        let (zero, half) = (Y::Scalar::ZERO, Y::Scalar::from_f64(0.5));
        let touch = Y::Scalar::from_f64(TOUCH / 2.0);
        let mut beyond = self.excess(&state);
        let (mut low, mut high) = (zero, beyond);
        let mut stayed = 0;
        for _ in 0..BISECTIONS {
            let is_reached = beyond > zero && beyond <= touch;
            let share = if low < zero && high > zero { low / (low - high) } else { half };
            let middle = before + share * (after - before);
            if is_reached || !(middle > before && middle < after) {
                break;
            }
            let there = integrator.between(self, middle)?;
            let excess = self.excess(&there);
            if excess > zero || self.pull(&there)?.is_some() {
                (after, state, high) = (middle, there, excess);
                beyond = excess;
                stayed = stayed.max(0) + 1;
            } else {
                (before, low) = (middle, excess);
                stayed = stayed.min(0) - 1;
            }
            if stayed > 1 {
                low *= half;
            } else if stayed < -1 {
                high *= half;
            }
        }
        Ok(state)
    }
}
