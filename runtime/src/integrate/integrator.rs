//! Common interface of adaptive integrators: a step, the state within it, and runs of several
//! steps.

use crate::{Error, Mechanism, StateOf};

/// An integrator that chooses its own steps.
pub trait Integrator<Y: Mechanism> {
    /// One accepted step, not beyond `t_end` (s), after as many rejected ones as it takes.
    ///
    /// # Errors
    ///
    /// [`Error::StepTooSmall`]; [`Error::Time`] if the end is not later than the state, or not finite; at a new state
    /// those of [`acceleration`](crate::acceleration()). The state is then unchanged.
    fn step(&mut self, system: &Y, state: &mut StateOf<Y>, t_end: Y::Scalar) -> Result<(), Error>;

    /// The state at a time (s) within the last step: the continuous extension, projected as steps
    /// are.
    ///
    /// # Errors
    ///
    /// Those of [`project`](crate::project).
    fn between(&mut self, system: &Y, t: Y::Scalar) -> Result<StateOf<Y>, Error>;

    /// Discards data of the last step. Call it after parameters, inputs or constraints have
    /// changed.
    fn restart(&mut self);

    /// Advances to `t_end` (s) and shows the state after every step. An end that is not later
    /// than the state changes nothing. Between calls the system's parameters and inputs and the
    /// state may be changed freely.
    ///
    /// # Errors
    ///
    /// As [`step`](Self::step); the state is then the last good one. [`Error::Time`] if the end is
    /// not finite.
    fn run(
        &mut self,
        system: &Y,
        state: &mut StateOf<Y>,
        t_end: Y::Scalar,
        mut observe: impl FnMut(&StateOf<Y>),
    ) -> Result<(), Error>
    where
        Self: Sized,
    {
        drive(self, system, state, t_end, |_, state| {
            observe(state);
            Ok(())
        })
    }

    /// As [`run`](Self::run), but shows the state at the given ascending times (s), from
    /// [`between`](Self::between). Times outside the run are left out.
    ///
    /// # Errors
    ///
    /// As [`run`](Self::run), and those of [`between`](Self::between).
    fn sample(
        &mut self,
        system: &Y,
        state: &mut StateOf<Y>,
        t_end: Y::Scalar,
        times: impl IntoIterator<Item = Y::Scalar>,
        mut observe: impl FnMut(&StateOf<Y>),
    ) -> Result<(), Error>
    where
        Self: Sized,
    {
        let begin = state.t;
        let mut times = times.into_iter().skip_while(|&time| time < begin).peekable();
        while times.next_if(|&time| time == begin).is_some() {
            observe(state);
        }
        drive(self, system, state, t_end, |integrator, state| {
            while let Some(time) = times.next_if(|&time| time <= state.t) {
                if time == state.t {
                    observe(state);
                } else {
                    observe(&integrator.between(system, time)?);
                }
            }
            Ok(())
        })
    }
}

/// Steps to `t_end`.
fn drive<Y: Mechanism, I: Integrator<Y>>(
    integrator: &mut I,
    system: &Y,
    state: &mut StateOf<Y>,
    t_end: Y::Scalar,
    mut after: impl FnMut(&mut I, &StateOf<Y>) -> Result<(), Error>,
) -> Result<(), Error> {
    if !crate::Scalar::is_finite(t_end - state.t) {
        return Err(Error::Time);
    }
    integrator.restart();
    while state.t < t_end {
        integrator.step(system, state, t_end)?;
        after(integrator, state)?;
    }
    Ok(())
}
