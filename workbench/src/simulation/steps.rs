//! The steps of a simulation; those of fixed length with rigid contacts and stops, and what a sample says of them.

use lamc_runtime::{Error, Mechanism, Rigid, State, Stopped};

use crate::execution::Jit;
use crate::motion::Sample;

/// What is a whole number of steps but for this share takes no further one.
const ROUNDING: f64 = 1e-9;

/// The steps of a simulation so far.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Steps {
    /// Steps of Dormand and Prince's pair.
    pub explicit: usize,
    /// Steps of RODASP.
    pub implicit: usize,
    /// Steps of fixed length with rigid contacts.
    pub rigid: usize,
    /// Those of them whose impulses do not fulfil all conditions.
    pub unsolved: usize,
}

impl Steps {
    /// All of them.
    pub(super) fn total(self) -> usize {
        self.explicit + self.implicit + self.rigid
    }
}

/// The integrator, and where its last step began.
pub struct RigidSteps {
    integrator: Rigid<Stopped<Jit>>,
    before: State<Vec<f64>, f64>,
}

impl RigidSteps {
    /// Steps of a mechanism from a state on. Its stops are those of the integrator: none is held.
    /// `restitution` is the share of its speed with which a point leaves a plane, and a joint a stop.
    pub fn new(system: &Stopped<Jit>, state: &State<Vec<f64>, f64>, restitution: f64) -> Self {
        let mut integrator = Rigid::new(system);
        integrator.restitution = restitution;
        Self { integrator, before: state.clone() }
    }

    /// One of the equal steps of at most `length` (s) to a time, s.
    pub fn step(
        &mut self,
        system: &Stopped<Jit>,
        state: &mut State<Vec<f64>, f64>,
        t: f64,
        length: f64,
    ) -> Result<(), Error> {
        let left = t - state.t;
        let steps = (left / length * (1.0 - ROUNDING)).ceil().max(1.0);
        self.before.clone_from(state);
        self.integrator.step(system, state, left / steps)?;
        if steps == 1.0 {
            state.t = t;
        }
        Ok(())
    }

    /// Steps so far whose impulses do not fulfil all conditions.
    pub fn unsolved(&self) -> usize {
        self.integrator.unsolved
    }

    /// The state at a time within the last step, s: on the straight line between its ends, with closed loops.
    pub fn between(
        &self,
        system: &Stopped<Jit>,
        after: &State<Vec<f64>, f64>,
        t: f64,
    ) -> Result<State<Vec<f64>, f64>, Error> {
        let mut state = self.before.clone();
        if after.t <= state.t {
            return Ok(state);
        }
        let share = (t - state.t) / (after.t - state.t);
        let mut step = system.speeds();
        system.write_difference(&state.q, &after.q, &mut step);
        step.iter_mut().for_each(|step| *step *= share);
        system.advance(&mut state.q, &step);
        for (u, after) in state.u.iter_mut().zip(&after.u) {
            *u += share * (after - *u);
        }
        state.t = t;
        system.project(&mut state)?;
        Ok(state)
    }

    /// Marks the joints that a stop held during the last step.
    pub fn note_stops(&self, system: &Stopped<Jit>, stopped: &mut [bool]) {
        for (stopped, &torque) in stopped.iter_mut().zip(self.integrator.torques(system)) {
            *stopped |= torque != 0.0;
        }
    }

    /// Gives a sample the forces and the accelerations of the last step in place of those of the compliant law.
    pub fn correct(
        &self,
        system: &Stopped<Jit>,
        state: &State<Vec<f64>, f64>,
        sample: &mut Sample,
    ) {
        let duration = state.t - self.before.t;
        if duration <= 0.0 {
            return;
        }
        for (contact, force) in sample.contacts.iter_mut().zip(self.integrator.forces(system)) {
            contact[3..].copy_from_slice(force);
        }
        let speeds = state.u.iter().zip(&self.before.u);
        for (rate, (after, before)) in sample.acceleration.iter_mut().zip(speeds) {
            *rate = (after - before) / duration;
        }
    }
}
