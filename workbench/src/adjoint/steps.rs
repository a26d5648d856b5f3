//! Steps of integrators with a record of what they went through, and their adjoints.
//!
//! The steps are those of [`lamc_runtime`]: the classical Runge-Kutta method ([`Rk4`](lamc_runtime::Rk4)), semi-implicit
//! Euler ([`SemiImplicitEuler`](lamc_runtime::SemiImplicitEuler)) and RODASP, each with a projection onto the closure at its
//! end. The adjoint of a step is that of each of its operations, in the opposite order: exact for the numbers that were
//! computed.

use lamc_runtime::constants::{CLOSED, CLOSED_EPSILONS};
use lamc_runtime::{Error, Mechanism as _, State};

use super::constrained::Constrained;
use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::implicit::Implicit;
use super::orientation;
use super::tape::Tape;

/// How a motion is integrated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Method {
    /// The classical Runge-Kutta method, of order 4.
    #[default]
    Rk4,
    /// Semi-implicit Euler, of order 1.
    Euler,
    /// RODASP, of order 4: implicit, for stiff mechanisms.
    Rodas,
}

/// Stages of the classical method: the time of each, its weight, and how far its rates lead to the next stage, all in
/// steps.
const RK4: [[f64; 3]; 4] =
    [[0.0, 1.0 / 6.0, 0.5], [0.5, 1.0 / 3.0, 0.5], [0.5, 1.0 / 3.0, 1.0], [1.0, 1.0 / 6.0, 0.0]];

/// Takes steps, records them, and goes back.
pub struct Stepper {
    differentiated: Differentiated,
    method: Method,
    joints: usize,
    constrained: Constrained,
    implicit: Implicit,
    tape: Tape,
    /// dq/dt and du/dt of a stage, or their adjoints.
    rate: Vec<f64>,
    acceleration: Vec<f64>,
    /// The state of a stage.
    q: Vec<f64>,
    u: Vec<f64>,
    /// The state at the begin of a step.
    start: Vec<f64>,
    /// The adjoints of a stage.
    stage: Adjoints,
}

impl Stepper {
    /// With an empty record.
    pub fn new(differentiated: Differentiated, method: Method) -> Self {
        let layout = differentiated.layout;
        let [nq, nu] = [layout.coordinates, layout.speeds];
        Self {
            method,
            joints: differentiated.system.interface().joints.len(),
            constrained: Constrained::new(&differentiated),
            implicit: Implicit::new(&differentiated),
            tape: Tape::default(),
            rate: vec![0.0; nq],
            acceleration: vec![0.0; nu],
            q: vec![0.0; nq],
            u: vec![0.0; nu],
            start: vec![0.0; layout.state()],
            stage: Adjoints::zeros(layout),
            differentiated,
        }
    }

    /// The mechanism, with the inputs of now.
    pub fn differentiated(&self) -> &Differentiated {
        &self.differentiated
    }

    /// How many numbers the record has.
    pub fn recorded(&self) -> usize {
        self.tape.len()
    }

    /// Forgets the record.
    pub fn forget(&mut self) {
        self.tape.clear();
    }

    /// Projects a state onto the closure, and records that as a step of no length.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn project(&mut self, state: &mut State<Vec<f64>, f64>) -> Result<(), Undifferentiable> {
        self.tape.begin(state.t, 0.0);
        self.close(state)?;
        self.check(state)
    }

    /// Sets the inputs of the steps to come, or of those that are gone back over.
    pub fn set_inputs(&mut self, inputs: &[f64]) {
        self.differentiated.system.set_inputs(inputs);
    }

    /// Takes a step of a length, s, and records it.
    ///
    /// # Errors
    /// [`Undifferentiable`]; the state is then of no use.
    pub fn step(
        &mut self,
        state: &mut State<Vec<f64>, f64>,
        length: f64,
    ) -> Result<(), Undifferentiable> {
        self.tape.begin(state.t, length);
        match self.method {
            Method::Rk4 => self.rk4(state, length)?,
            Method::Euler => self.euler(state, length)?,
            Method::Rodas => {
                self.implicit.step(&self.differentiated, state, length, &mut self.tape)?
            }
        }
        state.t += length;
        self.close(state)?;
        self.check(state)
    }

    fn close(&mut self, state: &mut State<Vec<f64>, f64>) -> Result<(), Undifferentiable> {
        let share = match self.method {
            Method::Rk4 | Method::Euler => CLOSED.of::<f64>(),
            Method::Rodas => CLOSED_EPSILONS * f64::EPSILON,
        };
        let enough = share * self.differentiated.system.size();
        self.constrained.project(&self.differentiated, state, enough, &mut self.tape)
    }

    /// Nothing of the record has been gone back over.
    pub fn rewind(&mut self) {
        self.tape.rewind();
    }

    /// Goes back over the last step of the record that was not gone back over: all adjoints of the state at its end become those
    /// of the state at its begin.
    pub fn pull<'a>(&mut self, all: impl Iterator<Item = &'a mut Adjoints>) {
        for adjoints in all {
            let Some((t, length)) = self.tape.last() else { return };
            self.constrained.pull_projection(
                &self.differentiated,
                t + length,
                &mut self.tape,
                adjoints,
            );
            // A projection by itself.
            if length == 0.0 {
                continue;
            }
            match self.method {
                Method::Rk4 => self.pull_rk4(t, length, adjoints),
                Method::Euler => self.pull_euler(t, length, adjoints),
                Method::Rodas => {
                    self.implicit.pull(&self.differentiated, t, length, &mut self.tape, adjoints)
                }
            }
        }
        self.tape.end();
    }

    fn rk4(
        &mut self,
        state: &mut State<Vec<f64>, f64>,
        length: f64,
    ) -> Result<(), Undifferentiable> {
        let Self { differentiated, constrained, tape, rate, acceleration, q, u, start, .. } = self;
        q.copy_from_slice(&state.q);
        u.copy_from_slice(&state.u);
        start[..q.len()].copy_from_slice(q);
        start[q.len()..].copy_from_slice(u);
        let (start_q, start_u) = start.split_at(q.len());
        for [time, weight, next] in RK4 {
            tape.push(q);
            tape.push(u);
            let at = At { t: state.t + time * length, q, u };
            constrained.accelerate(differentiated, at, tape, acceleration)?;
            differentiated.system.write_rates(q, u, rate);
            let advance = |stage: &mut [f64], sum: &mut [f64], start: &[f64], rate: &[f64]| {
                for (((stage, sum), start), rate) in stage.iter_mut().zip(sum).zip(start).zip(rate)
                {
                    *sum += weight * length * rate;
                    *stage = start + next * length * rate;
                }
            };
            advance(q, &mut state.q, start_q, rate);
            advance(u, &mut state.u, start_u, acceleration);
        }
        tape.push(&state.q);
        differentiated.system.normalise(&mut state.q);
        Ok(())
    }

    fn pull_rk4(&mut self, t: f64, length: f64, adjoints: &mut Adjoints) {
        let Self {
            differentiated, constrained, tape, rate, acceleration, q, u, stage, joints, ..
        } = self;
        let (nq, nu) = (q.len(), u.len());
        orientation::normalise(tape.pop(nq), *joints, &mut adjoints.state[..nq]);
        // The adjoints of the end are those of the start, too, before the stages add to them.
        q.copy_from_slice(&adjoints.state[..nq]);
        u.copy_from_slice(&adjoints.state[nq..]);
        stage.state.fill(0.0);
        stage.rest.fill(0.0);
        for [time, weight, next] in RK4.into_iter().rev() {
            let share = |of: &mut [f64], end: &[f64], ahead: &[f64]| {
                for ((of, end), ahead) in of.iter_mut().zip(end).zip(ahead) {
                    *of = length * (weight * end + next * ahead);
                }
            };
            share(rate, q, &stage.state[..nq]);
            share(acceleration, u, &stage.state[nq..]);
            stage.state.fill(0.0);
            constrained.pull_acceleration(
                differentiated,
                t + time * length,
                tape,
                acceleration,
                stage,
            );
            let (at_q, at_u) = tape.pop(nq + nu).split_at(nq);
            let (of_q, of_u) = stage.state.split_at_mut(nq);
            orientation::rates(at_q, at_u, *joints, rate, of_q, of_u);
            add(&mut adjoints.state, &stage.state);
        }
        add(&mut adjoints.rest, &stage.rest);
    }

    fn euler(
        &mut self,
        state: &mut State<Vec<f64>, f64>,
        length: f64,
    ) -> Result<(), Undifferentiable> {
        let Self { differentiated, constrained, tape, acceleration, u: step, .. } = self;
        let at = At { t: state.t, q: &state.q, u: &state.u };
        constrained.accelerate(differentiated, at, tape, acceleration)?;
        tape.push(&state.q);
        for ((u, a), step) in state.u.iter_mut().zip(acceleration).zip(&mut *step) {
            *u += length * *a;
            *step = length * *u;
        }
        tape.push(step);
        differentiated.system.advance(&mut state.q, step);
        Ok(())
    }

    fn pull_euler(&mut self, t: f64, length: f64, adjoints: &mut Adjoints) {
        let Self { differentiated, constrained, tape, acceleration, u: of_step, joints, q, .. } =
            self;
        let (nq, nu) = (q.len(), of_step.len());
        let (at_q, step) = tape.pop(nq + nu).split_at(nq);
        let (of_q, of_u) = adjoints.state.split_at_mut(nq);
        orientation::advance(at_q, step, *joints, of_q, of_step);
        for ((of_u, step), a) in of_u.iter_mut().zip(&*of_step).zip(&mut *acceleration) {
            *of_u += length * step;
            *a = length * *of_u;
        }
        constrained.pull_acceleration(differentiated, t, tape, acceleration, adjoints);
    }

    /// Stops are not part of a step.
    fn check(&self, state: &State<Vec<f64>, f64>) -> Result<(), Undifferentiable> {
        let t = state.t;
        for values in [&state.q, &state.u] {
            if let Some(joint) = values.iter().position(|value| !value.is_finite()) {
                return Err(Undifferentiable::Motion { t, error: Error::NotFinite { joint } });
            }
        }
        let is_outside = |joint: &usize| {
            let [least, greatest] = self.differentiated.system.limits(*joint);
            !(least..=greatest).contains(&state.q[*joint])
        };
        match (0..self.joints).find(is_outside) {
            Some(joint) => Err(Undifferentiable::Stop { t, joint }),
            None => Ok(()),
        }
    }
}

fn add(sums: &mut [f64], shares: &[f64]) {
    sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += share);
}
