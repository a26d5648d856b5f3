//! The classical Runge-Kutta method of order 4 (W. Kutta, 1901).

use super::{Stabilisation, fixed};
use crate::linear::add_scaled;
use crate::{Arithmetic, Error, Mechanism, State, StateOf};

/// Runge-Kutta of order 4 and fixed step: four evaluations per step.
#[derive(Clone, Debug)]
pub struct Rk4<Y: Mechanism> {
    /// How loops are kept closed.
    pub stabilisation: Stabilisation,
    workspace: Y::Workspace,
    stages: Stages<Y::Coordinates, Y::Speeds>,
}

impl<Y: Mechanism> Rk4<Y> {
    /// With storage for the system.
    pub fn new(system: &Y) -> Self {
        Self {
            stabilisation: Stabilisation::Projection,
            workspace: system.workspace(),
            stages: Stages::new(system.initial().q, system.speeds()),
        }
    }

    /// Advances by `dt` (s). A step that leads to values that are not finite is repeated in up to
    /// [`STEP_PIECES`](crate::constants::STEP_PIECES) equal pieces, which bounds the time that a step takes.
    ///
    /// # Errors
    ///
    /// Of [`acceleration`](crate::acceleration()) and [`project`](crate::project); the state is
    /// then unchanged. [`Error::Time`] for a step that is not a positive, finite number.
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
        let (stabilisation, workspace) = (self.stabilisation, &mut self.workspace);
        let differentiate =
            |t, q: &Y::Coordinates, u: &Y::Speeds, dq: &mut Y::Coordinates, du: &mut Y::Speeds| {
                system.write_rates(q.as_ref(), u.as_ref(), dq.as_mut());
                stabilisation.accelerate(system, dt, (t, q, u), workspace, du)
            };
        self.stages.advance(state, dt, differentiate)?;
        system.normalise(state.q.as_mut());
        let workspace = &mut self.workspace;
        stabilisation.project(system, state.t, &mut state.q, &mut state.u, workspace)
    }
}

/// Storage for the stages of a step; Q holds NQ numbers, U holds NU.
#[derive(Clone, Debug)]
pub(crate) struct Stages<Q, U> {
    /// dq/dt and du/dt of a stage.
    rate: Q,
    acceleration: U,
    /// State of a stage.
    q: Q,
    u: U,
    /// Weighted sums of the stages' derivatives.
    dq: Q,
    du: U,
}

impl<Q: Clone, U: Clone> Stages<Q, U> {
    /// With this storage.
    pub(crate) fn new(q: Q, u: U) -> Self {
        Self { rate: q.clone(), acceleration: u.clone(), q: q.clone(), u: u.clone(), dq: q, du: u }
    }

    /// Advances by `dt` (s), where `differentiate` writes dq/dt and du/dt at (t, q, u); its failure leaves the state as it
    /// was. Nothing is projected.
    #[inline]
    pub(crate) fn advance<S: Arithmetic, E>(
        &mut self,
        state: &mut State<Q, S, U>,
        dt: S,
        mut differentiate: impl FnMut(S, &Q, &U, &mut Q, &mut U) -> Result<(), E>,
    ) -> Result<(), E>
    where
        Q: AsRef<[S]> + AsMut<[S]>,
        U: AsRef<[S]> + AsMut<[S]>,
    {
        let part = |share| S::from_f64(share) * dt;
        let (none, sixth, third, half) = (S::ZERO, part(1.0 / 6.0), part(1.0 / 3.0), part(0.5));
        self.q.as_mut().copy_from_slice(state.q.as_ref());
        self.u.as_mut().copy_from_slice(state.u.as_ref());
        self.dq.as_mut().fill(S::ZERO);
        self.du.as_mut().fill(S::ZERO);
        // Time of each stage, its weight, and the time of the next stage.
        for (ahead, weight, next) in
            [(none, sixth, half), (half, third, half), (half, third, dt), (dt, sixth, dt)]
        {
            let t = state.t + ahead;
            differentiate(t, &self.q, &self.u, &mut self.rate, &mut self.acceleration)?;
            let advance = |out: &mut [S], sum: &mut [S], from: &[S], rate: &[S]| {
                let places = out.iter_mut().zip(sum).zip(from).zip(rate);
                for (((out, sum), &from), &rate) in places {
                    *sum += weight * rate;
                    *out = from + next * rate;
                }
            };
            let (q, dq) = (self.q.as_mut(), self.dq.as_mut());
            advance(q, dq, state.q.as_ref(), self.rate.as_ref());
            let (u, du) = (self.u.as_mut(), self.du.as_mut());
            advance(u, du, state.u.as_ref(), self.acceleration.as_ref());
        }
        add_scaled(state.q.as_mut(), S::ONE, self.dq.as_ref());
        add_scaled(state.u.as_mut(), S::ONE, self.du.as_ref());
        state.t += dt;
        Ok(())
    }
}
