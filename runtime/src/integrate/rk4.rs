//! The classical Runge-Kutta method of order 4 (W. Kutta, 1901).

use super::{Stabilisation, fixed};
use crate::linear::add_scaled;
use crate::{Arithmetic, Error, Scalar, State, StateOf, System};

/// Runge-Kutta of order 4 and fixed step: four evaluations per step.
#[derive(Clone, Debug)]
pub struct Rk4<Y: System> {
    /// How loops are kept closed.
    pub stabilisation: Stabilisation,
    workspace: Y::Workspace,
    stages: Stages<Y::Vector>,
}

impl<Y: System> Rk4<Y> {
    /// With storage for the system.
    pub fn new(system: &Y) -> Self {
        Self {
            stabilisation: Stabilisation::Projection,
            workspace: system.workspace(),
            stages: Stages::new(system.vector()),
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
        let accelerate = |t, q: &Y::Vector, u: &Y::Vector, out: &mut Y::Vector| {
            stabilisation.accelerate(system, dt, (t, q, u), workspace, out)
        };
        let check = |joint, rate: Y::Scalar| {
            if rate.is_finite() { Ok(()) } else { Err(Error::NotFinite { joint }) }
        };
        self.stages.advance(state, dt, accelerate, check)?;
        let workspace = &mut self.workspace;
        stabilisation.project(system, state.t, &mut state.q, &mut state.u, workspace)
    }
}

/// What the stages of a step are computed in; V holds N numbers.
#[derive(Clone, Debug)]
pub(crate) struct Stages<V> {
    acceleration: V,
    /// State of a stage.
    q: V,
    u: V,
    /// Weighted sums of the stages' derivatives.
    dq: V,
    du: V,
}

impl<V: Clone> Stages<V> {
    /// With this storage.
    pub(crate) fn new(vector: V) -> Self {
        Self {
            acceleration: vector.clone(),
            q: vector.clone(),
            u: vector.clone(),
            dq: vector.clone(),
            du: vector,
        }
    }

    /// Advances by `dt` (s), where `accelerate` writes du/dt at (t, q, u) and `check` sees the number
    /// of each joint; failure leaves the state as it was. Nothing is projected.
    #[inline]
    pub(crate) fn advance<S: Arithmetic, E>(
        &mut self,
        state: &mut State<V, S>,
        dt: S,
        mut accelerate: impl FnMut(S, &V, &V, &mut V) -> Result<(), E>,
        check: impl Fn(usize, S) -> Result<(), E>,
    ) -> Result<(), E>
    where
        V: AsRef<[S]> + AsMut<[S]>,
    {
        let part = |share| S::from_f64(share) * dt;
        let (none, sixth, third, half) = (S::ZERO, part(1.0 / 6.0), part(1.0 / 3.0), part(0.5));
        self.q.as_mut().copy_from_slice(state.q.as_ref());
        self.u.as_mut().copy_from_slice(state.u.as_ref());
        self.dq.as_mut().fill(S::ZERO);
        self.du.as_mut().fill(S::ZERO);
        // How far ahead each stage lies, its weight, and how far ahead it sends the next.
        for (ahead, weight, next) in
            [(none, sixth, half), (half, third, half), (half, third, dt), (dt, sixth, dt)]
        {
            accelerate(state.t + ahead, &self.q, &self.u, &mut self.acceleration)?;
            // One number after the other: they come fresh from single stores, which a wide load
            // would have to wait for.
            let advance = |out: &mut V, sum: &mut V, from: &V, rate: &V| {
                let places = out.as_mut().iter_mut().zip(sum.as_mut()).zip(from.as_ref());
                for (joint, (((out, sum), &from), &rate)) in places.zip(rate.as_ref()).enumerate() {
                    check(joint, rate)?;
                    *sum += weight * rate;
                    *out = from + next * rate;
                }
                Ok(())
            };
            advance(&mut self.q, &mut self.dq, &state.q, &self.u)?;
            advance(&mut self.u, &mut self.du, &state.u, &self.acceleration)?;
        }
        add_scaled(state.q.as_mut(), S::ONE, self.dq.as_ref());
        add_scaled(state.u.as_mut(), S::ONE, self.du.as_ref());
        state.t += dt;
        Ok(())
    }
}
