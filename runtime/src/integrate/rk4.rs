//! The classical Runge-Kutta method of order 4 (W. Kutta, 1901).

use super::{Stabilisation, fixed};
use crate::linear::add_scaled;
use crate::{Arithmetic, Error, Scalar, StateOf, System};

/// Runge-Kutta of order 4 and fixed step: four evaluations per step.
#[derive(Clone, Debug)]
pub struct Rk4<Y: System> {
    /// How loops are kept closed.
    pub stabilisation: Stabilisation,
    workspace: Y::Workspace,
    acceleration: Y::Vector,
    /// State of a stage.
    q: Y::Vector,
    u: Y::Vector,
    /// Weighted sums of the stages' derivatives.
    dq: Y::Vector,
    du: Y::Vector,
}

impl<Y: System> Rk4<Y> {
    /// With storage for the system.
    pub fn new(system: &Y) -> Self {
        Self {
            stabilisation: Stabilisation::Projection,
            workspace: system.workspace(),
            acceleration: system.vector(),
            q: system.vector(),
            u: system.vector(),
            dq: system.vector(),
            du: system.vector(),
        }
    }

    /// Advances by `dt` (s); a step that leads to values that are not finite is cut into halves.
    ///
    /// # Errors
    ///
    /// Of [`acceleration`](crate::acceleration()) and [`project`](crate::project); the state is
    /// then unchanged. [`Error::Time`] for a step that is not finite.
    pub fn step(&mut self, system: &Y, state: &mut StateOf<Y>, dt: Y::Scalar) -> Result<(), Error> {
        fixed::step::<Y>(state, dt, |state, dt| self.attempt(system, state, dt))
    }

    /// Advances to `t_end` (s) in equal steps of at most `dt` (s), and shows the state after each.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step); the state is then the last good one.
    pub fn run(
        &mut self,
        system: &Y,
        state: &mut StateOf<Y>,
        t_end: Y::Scalar,
        dt: Y::Scalar,
        observe: impl FnMut(&StateOf<Y>),
    ) -> Result<(), Error> {
        fixed::run::<Y>(state, t_end, dt, |state, dt| self.step(system, state, dt), observe)
    }

    fn attempt(&mut self, system: &Y, state: &mut StateOf<Y>, dt: Y::Scalar) -> Result<(), Error> {
        let part = |share| Y::Scalar::from_f64(share) * dt;
        let (none, sixth, third, half) =
            (Y::Scalar::ZERO, part(1.0 / 6.0), part(1.0 / 3.0), part(0.5));
        self.q.as_mut().copy_from_slice(state.q.as_ref());
        self.u.as_mut().copy_from_slice(state.u.as_ref());
        self.dq.as_mut().fill(Y::Scalar::ZERO);
        self.du.as_mut().fill(Y::Scalar::ZERO);
        // How far ahead each stage lies, its weight, and how far ahead it sends the next.
        for (ahead, weight, next) in
            [(none, sixth, half), (half, third, half), (half, third, dt), (dt, sixth, dt)]
        {
            let (workspace, acceleration) = (&mut self.workspace, &mut self.acceleration);
            let at = (state.t + ahead, &self.q, &self.u);
            self.stabilisation.accelerate(system, dt, at, workspace, acceleration)?;
            let rates = (weight, next, self.u.as_ref());
            advance(self.q.as_mut(), self.dq.as_mut(), state.q.as_ref(), rates)?;
            let rates = (weight, next, self.acceleration.as_ref());
            advance(self.u.as_mut(), self.du.as_mut(), state.u.as_ref(), rates)?;
        }
        add_scaled(state.q.as_mut(), Y::Scalar::ONE, self.dq.as_ref());
        add_scaled(state.u.as_mut(), Y::Scalar::ONE, self.du.as_ref());
        state.t += dt;
        self.stabilisation.project(system, state.t, &mut state.q, &mut state.u, &mut self.workspace)
    }
}

/// `sum += weight rate`, `out = from + next rate`, one number after the other: they come fresh from
/// single stores, which a wide load would have to wait for.
#[inline]
fn advance<S: Scalar>(
    out: &mut [S],
    sum: &mut [S],
    from: &[S],
    (weight, next, rate): (S, S, &[S]),
) -> Result<(), Error> {
    let places = out.iter_mut().zip(sum).zip(from).zip(rate).enumerate();
    for (joint, (((out, sum), &from), &rate)) in places {
        if !rate.is_finite() {
            return Err(Error::NotFinite { joint });
        }
        *sum += weight * rate;
        *out = from + next * rate;
    }
    Ok(())
}
