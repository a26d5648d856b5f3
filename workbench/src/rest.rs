//! A state of rest, and the small motions about it.

use lamc::laminate::Mechanism;
use lamc_runtime::{Equilibrium, Error, Mechanism as _, State, Stopped, equilibrium};

use crate::execution::Jit;
use crate::linear::Motions;

/// A state of rest.
#[derive(Clone, Debug)]
pub struct Rest {
    /// How it was found.
    pub found: Equilibrium<f64>,
    /// The state: q, and u = 0.
    pub state: State<Vec<f64>, f64>,
    /// The potential energy, J.
    pub potential: f64,
    /// The system, its joints held at the stops that they rest on.
    pub system: Stopped<Jit>,
    /// The small motions about it.
    pub motions: Motions,
}

impl Rest {
    /// The state of rest that is reached from a closed state ([`settle`]).
    ///
    /// # Errors
    /// Those of [`equilibrium`] and of [`Motions::about`].
    pub fn new(
        mechanism: &Mechanism,
        system: Jit,
        mut state: State<Vec<f64>, f64>,
    ) -> Result<Self, Error> {
        let found = settle(&system, &mut state)?;
        let potential = system.energy(state.t, &state.q, &state.u)?.potential;
        let mut system = Stopped::new(system);
        let mut held = state.clone();
        system.resolve_impacts(&mut held)?;
        let motions = Motions::about(mechanism, &system, &held, found.stable)?;
        Ok(Self { found, state, potential, system, motions })
    }
}

/// Moves a closed state to rest.
///
/// # Errors
/// Those of [`equilibrium`]; then q stays as it was.
pub fn settle(system: &Jit, state: &mut State<Vec<f64>, f64>) -> Result<Equilibrium<f64>, Error> {
    state.u.fill(0.0);
    equilibrium(system, state.t, &mut state.q, &mut system.workspace())
}
