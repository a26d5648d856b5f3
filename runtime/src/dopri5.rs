//! Adaptive steps: the Dormand-Prince pair of orders 5 and 4.
//!
//! Coefficients and step control as in Hairer, Norsett & Wanner, Solving Ordinary Differential
//! Equations I, II.4 and II.5 (PI controller with beta = 0.04).

use crate::linear::add_scaled;
use crate::{Error, Projection, Scalar, State, System, acceleration, project};

/// Stages before the last, which is the first of the next step.
const STAGES: usize = 6;
/// Nodes c_i.
const C: [f64; STAGES] = [0.0, 0.2, 0.3, 0.8, 8.0 / 9.0, 1.0];
/// Rows a_ij; the last is the solution of order 5.
const A: [[f64; STAGES]; STAGES] = [
    [0.2, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];
/// Difference of the two solutions.
const E: [f64; STAGES + 1] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// How a run went.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Steps taken.
    pub accepted: u64,
    /// Steps tried and found too inaccurate.
    pub rejected: u64,
    /// Accelerations evaluated.
    pub evaluations: u64,
}

/// The Dormand-Prince method with error control.
#[derive(Clone, Debug)]
pub struct Dopri5<M: System> {
    /// Error allowed per step, relative to the angle or speed.
    pub relative_tolerance: M::Scalar,
    /// Error allowed per step, rad and rad/s.
    pub absolute_tolerance: M::Scalar,
    /// Longest step, s.
    pub longest_step: M::Scalar,
    /// Projection after every step, or none.
    pub projection: Projection,
    /// What was done so far.
    pub statistics: Statistics,
    workspace: M::Workspace,
    /// Step to try next, s; not positive before the first.
    step: M::Scalar,
    previous_error: M::Scalar,
    /// Stage derivatives of q (speeds) and u (accelerations).
    speeds: [M::Vector; STAGES + 1],
    rates: [M::Vector; STAGES + 1],
    q: M::Vector,
    u: M::Vector,
}

impl<M: System> Dopri5<M> {
    /// Memory for one system; both tolerances as given.
    pub fn new(system: &M, tolerance: M::Scalar) -> Self {
        Self {
            relative_tolerance: tolerance,
            absolute_tolerance: tolerance,
            longest_step: M::Scalar::from_f64(f64::INFINITY),
            projection: Projection::default(),
            statistics: Statistics::default(),
            workspace: system.workspace(),
            step: M::Scalar::ZERO,
            previous_error: M::Scalar::from_f64(1e-4),
            speeds: core::array::from_fn(|_| system.vector()),
            rates: core::array::from_fn(|_| system.vector()),
            q: system.vector(),
            u: system.vector(),
        }
    }

    /// Advances to exactly `t_end`. The step size is remembered from call to call.
    ///
    /// # Errors
    /// As [`acceleration`] at the given state, or [`Error::StepTooSmall`] at the last good one.
    pub fn advance(
        &mut self,
        system: &M,
        state: &mut State<M::Vector, M::Scalar>,
        t_end: M::Scalar,
    ) -> Result<(), Error> {
        let n = system.dimensions().coordinates;
        if state.q.as_ref().len() != n || state.u.as_ref().len() != n {
            return Err(Error::Workspace);
        }
        while state.t < t_end {
            self.begin(system, state)?;
            let left = t_end - state.t;
            if self.step <= M::Scalar::ZERO {
                self.step = self.first_step(state, left);
            }
            let wanted = self.step.min(self.longest_step);
            // A last sliver of a step would only cost: stretch by up to a hundredth instead.
            let last = wanted * M::Scalar::from_f64(1.01) >= left;
            let h = if last { left } else { wanted };
            let shortest = M::Scalar::from_f64(16.0) * M::Scalar::EPSILON * state.t.abs().max(left);
            if wanted < shortest && !last {
                return Err(Error::StepTooSmall { t: state.t.to_f64() });
            }
            match self.attempt(system, state, h) {
                Ok(error) if error <= M::Scalar::ONE => {
                    state.t = if last { t_end } else { state.t + h };
                    state.q.as_mut().copy_from_slice(self.q.as_ref());
                    state.u.as_mut().copy_from_slice(self.u.as_ref());
                    self.statistics.accepted += 1;
                    // A step cut short by the end says nothing about a longer one.
                    let next = h * self.factor(error);
                    self.step = if last { self.step.max(next) } else { next };
                    self.previous_error = error.max(M::Scalar::from_f64(1e-4));
                }
                Ok(error) => {
                    self.statistics.rejected += 1;
                    self.step = h * self.factor(error).min(M::Scalar::ONE);
                }
                Err(Error::Workspace) => return Err(Error::Workspace),
                Err(_) => {
                    self.statistics.rejected += 1;
                    self.step = h * M::Scalar::from_f64(0.25);
                    if self.step < shortest {
                        return Err(Error::StepTooSmall { t: state.t.to_f64() });
                    }
                }
            }
        }
        Ok(())
    }

    /// The first stage, at the state as it is (projected, or changed by the caller).
    fn begin(&mut self, system: &M, state: &State<M::Vector, M::Scalar>) -> Result<(), Error> {
        let (q, u) = (state.q.as_ref(), state.u.as_ref());
        self.speeds[0].as_mut().copy_from_slice(u);
        self.statistics.evaluations += 1;
        let rate = self.rates[0].as_mut();
        acceleration(system, state.t, q, u, self.workspace.as_mut(), rate).map(|_| ())
    }

    /// One step of `h` into `self.q`, `self.u`; its error relative to the tolerances.
    fn attempt(
        &mut self,
        system: &M,
        state: &State<M::Vector, M::Scalar>,
        h: M::Scalar,
    ) -> Result<M::Scalar, Error> {
        let workspace = self.workspace.as_mut();
        for stage in 0..STAGES {
            let (q, u) = (self.q.as_mut(), self.u.as_mut());
            q.copy_from_slice(state.q.as_ref());
            u.copy_from_slice(state.u.as_ref());
            for (earlier, &a) in A[stage][..=stage].iter().enumerate() {
                let scaled = h * M::Scalar::from_f64(a);
                add_scaled(q, scaled, self.speeds[earlier].as_ref());
                add_scaled(u, scaled, self.rates[earlier].as_ref());
            }
            let next = stage + 1;
            let c = if next < STAGES { C[next] } else { 1.0 };
            self.speeds[next].as_mut().copy_from_slice(u);
            let rate = self.rates[next].as_mut();
            self.statistics.evaluations += 1;
            acceleration(system, state.t + h * M::Scalar::from_f64(c), q, u, workspace, rate)?;
        }
        let error = self.error(state, h);
        if error <= M::Scalar::ONE && self.projection == Projection::EveryStep {
            project(
                system,
                state.t + h,
                self.q.as_mut(),
                self.u.as_mut(),
                self.workspace.as_mut(),
            )?;
        }
        Ok(error)
    }

    /// Root mean square over q and u of the error estimate over the tolerance.
    fn error(&self, state: &State<M::Vector, M::Scalar>, h: M::Scalar) -> M::Scalar {
        let mut sum = M::Scalar::ZERO;
        let mut count = M::Scalar::ZERO;
        let sides = [
            (state.q.as_ref(), self.q.as_ref(), &self.speeds),
            (state.u.as_ref(), self.u.as_ref(), &self.rates),
        ];
        for (before, after, stages) in sides {
            for (joint, (x, y)) in before.iter().zip(after).enumerate() {
                let mut difference = M::Scalar::ZERO;
                for (stage, &weight) in stages.iter().zip(&E) {
                    difference += M::Scalar::from_f64(weight) * stage.as_ref()[joint];
                }
                let magnitude = x.abs().max(y.abs());
                let allowed = self.absolute_tolerance + self.relative_tolerance * magnitude;
                let ratio = h * difference / allowed;
                sum += ratio * ratio;
                count += M::Scalar::ONE;
            }
        }
        if count > M::Scalar::ZERO { (sum / count).sqrt() } else { M::Scalar::ZERO }
    }

    /// What to multiply the step by after an error.
    fn factor(&self, error: M::Scalar) -> M::Scalar {
        let least = M::Scalar::from_f64(1e-10);
        let error = if error < least { least } else { error };
        let now = error.pow(M::Scalar::from_f64(-0.17));
        let before = self.previous_error.pow(M::Scalar::from_f64(0.04));
        let factor = M::Scalar::from_f64(0.9) * now * before;
        factor.max(M::Scalar::from_f64(0.2)).min(M::Scalar::from_f64(10.0))
    }

    /// A cautious first step: a hundredth of the time in which the state would change by itself.
    fn first_step(&self, state: &State<M::Vector, M::Scalar>, left: M::Scalar) -> M::Scalar {
        let mut fastest = M::Scalar::ONE / left;
        let sides = [(state.q.as_ref(), &self.speeds[0]), (state.u.as_ref(), &self.rates[0])];
        for (value, derivative) in sides {
            for (x, dx) in value.iter().zip(derivative.as_ref()) {
                let rate = dx.abs() / (x.abs() + M::Scalar::from_f64(1e-3));
                fastest = fastest.max(rate);
            }
        }
        M::Scalar::from_f64(0.01) / fastest
    }
}
