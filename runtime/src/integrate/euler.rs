//! Semi-implicit (symplectic) Euler: u += a(q, u) dt, then q += u dt. Order 1.

use super::{Stabilisation, fixed};
use crate::linear::{add_scaled, set_scaled};
use crate::{Error, Mechanism, StateOf};

/// Semi-implicit Euler of fixed step: one evaluation per step, bounded energy error.
#[derive(Clone, Debug)]
pub struct SemiImplicitEuler<Y: Mechanism> {
    /// How loops are kept closed.
    pub stabilisation: Stabilisation,
    workspace: Y::Workspace,
    acceleration: Y::Speeds,
}

impl<Y: Mechanism> SemiImplicitEuler<Y> {
    /// With storage for the system.
    pub fn new(system: &Y) -> Self {
        Self {
            stabilisation: Stabilisation::Projection,
            workspace: system.workspace(),
            acceleration: system.speeds(),
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
        let (workspace, acceleration) = (&mut self.workspace, &mut self.acceleration);
        let at = (state.t, &state.q, &state.u);
        self.stabilisation.accelerate(system, dt, at, workspace, acceleration)?;
        add_scaled(state.u.as_mut(), dt, acceleration.as_ref());
        // The acceleration's storage takes the step of q.
        set_scaled(acceleration.as_mut(), dt, state.u.as_ref());
        system.advance(state.q.as_mut(), acceleration.as_ref());
        state.t += dt;
        self.stabilisation.project(system, state.t, &mut state.q, &mut state.u, workspace)
    }
}
