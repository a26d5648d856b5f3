//! The Runge-Kutta pair of order 5(4) of J. R. Dormand and P. J. Prince, "A family of embedded
//! Runge-Kutta formulae", 1980, with the step control and the dense output of E. Hairer,
//! S. P. Norsett, G. Wanner, "Solving Ordinary Differential Equations I", II.4 and II.6.
//!
//! The seventh stage is evaluated at the projected end of the step. It is then the first stage of
//! the next step, the continuous extension is smooth through projected points, and its part in
//! the error estimate differs only in a term of higher order. What the projection moves is not
//! counted as an error: where the rank changes it is finite however short the step.

use super::steps::{Steps, first_step};
use super::{Integrator, Stabilisation, same, strayed};
use crate::linear::{add_scaled, tolerance};
use crate::{Arithmetic, Error, Mechanism, Scalar, StateOf};

const STAGES: usize = 7;

/// Times of the stages, relative to the step.
const C: [f64; STAGES] = [0.0, 1.0 / 5.0, 3.0 / 10.0, 4.0 / 5.0, 8.0 / 9.0, 1.0, 1.0];

/// Each stage from those before; the last row is the solution of order 5.
const A: [[f64; 6]; STAGES] = [
    [0.0; 6],
    [1.0 / 5.0, 0.0, 0.0, 0.0, 0.0, 0.0],
    [3.0 / 40.0, 9.0 / 40.0, 0.0, 0.0, 0.0, 0.0],
    [44.0 / 45.0, -56.0 / 15.0, 32.0 / 9.0, 0.0, 0.0, 0.0],
    [19372.0 / 6561.0, -25360.0 / 2187.0, 64448.0 / 6561.0, -212.0 / 729.0, 0.0, 0.0],
    [9017.0 / 3168.0, -355.0 / 33.0, 46732.0 / 5247.0, 49.0 / 176.0, -5103.0 / 18656.0, 0.0],
    [35.0 / 384.0, 0.0, 500.0 / 1113.0, 125.0 / 192.0, -2187.0 / 6784.0, 11.0 / 84.0],
];

/// The solution of order 5 less the embedded one of order 4.
const ERROR: [f64; STAGES] = [
    71.0 / 57600.0,
    0.0,
    -71.0 / 16695.0,
    71.0 / 1920.0,
    -17253.0 / 339200.0,
    22.0 / 525.0,
    -1.0 / 40.0,
];

/// The term of the continuous extension that takes all stages.
const DENSE: [f64; STAGES] = [
    -12715105075.0 / 11282082432.0,
    0.0,
    87487479700.0 / 32700410799.0,
    -10690763975.0 / 1880347072.0,
    701980252875.0 / 199316789632.0,
    -1453857185.0 / 822651844.0,
    69997945.0 / 29380423.0,
];

/// Adaptive Runge-Kutta of order 5: six evaluations per step, and the projection.
#[derive(Clone, Debug)]
pub struct Dopri5<Y: Mechanism> {
    /// Error allowed per step, relative to q and u.
    pub relative: Y::Scalar,
    /// Error allowed per step on top, rad and rad/s.
    pub absolute: Y::Scalar,
    /// Longest step, s; infinite unless set.
    pub max_step: Y::Scalar,
    /// Smallest step, s; below it (or where time no longer advances) integration fails.
    pub min_step: Y::Scalar,
    /// How loops are kept closed, at the ends of steps and at samples between them.
    pub stabilisation: Stabilisation,
    workspace: Y::Workspace,
    /// dq/dt of the stages.
    rates: [Y::Coordinates; STAGES],
    /// du/dt of the stages.
    accelerations: [Y::Speeds; STAGES],
    /// Start of the last step.
    start: StateOf<Y>,
    /// End of the last step.
    end: StateOf<Y>,
    /// Argument of the sixth stage.
    sixth: (Y::Coordinates, Y::Speeds),
    /// Steps at the limit of stability, and others since the last of these.
    at_limit: (u32, u32),
    steps: Steps<Y::Scalar>,
    /// Whether the last stage belongs to `end` and to the system as it is.
    fresh: bool,
}

impl<Y: Mechanism> Dopri5<Y> {
    /// With storage for the system, a relative error of 1e-8 (1e-5 in `f32`) and an absolute one
    /// of 1e-10 (1e-7).
    pub fn new(system: &Y) -> Self {
        let zero = Y::Scalar::ZERO;
        let state = system.initial();
        Self {
            relative: tolerance(1e-8, 100.0),
            absolute: tolerance(1e-10, 1.0),
            max_step: Y::Scalar::from_f64(f64::INFINITY),
            min_step: zero,
            stabilisation: Stabilisation::Projection,
            workspace: system.workspace(),
            rates: core::array::from_fn(|_| state.q.clone()),
            accelerations: core::array::from_fn(|_| system.speeds()),
            start: state.clone(),
            sixth: (state.q.clone(), state.u.clone()),
            end: state,
            at_limit: (0, 0),
            steps: Steps::new(5.0),
            fresh: false,
        }
    }

    /// Whether steps have been held short by stability, not by accuracy, for a while: an implicit
    /// method is faster then.
    pub fn is_stiff(&self) -> bool {
        self.at_limit.0 >= 15
    }

    /// Counts steps at which the largest eigenvalue, estimated from the last two stages (which have
    /// the same time), is at the limit of stability (Hairer and Wanner, "Solving Ordinary
    /// Differential Equations II", IV.2).
    fn watch_stability(&mut self) {
        let step = self.end.t - self.start.t;
        let last = STAGES - 1;
        let square = |a: &[Y::Scalar], b: &[Y::Scalar]| {
            a.iter().zip(b).fold(Y::Scalar::ZERO, |sum, (&a, &b)| sum + (a - b) * (a - b))
        };
        let Self { rates, accelerations, end, sixth, .. } = &*self;
        let above = square(rates[last].as_ref(), rates[last - 1].as_ref())
            + square(accelerations[last].as_ref(), accelerations[last - 1].as_ref());
        let below =
            square(end.q.as_ref(), sixth.0.as_ref()) + square(end.u.as_ref(), sixth.1.as_ref());
        let limit = Y::Scalar::from_f64(3.25);
        let (at_limit, others) = &mut self.at_limit;
        if above * step * step > limit * limit * below {
            (*at_limit, *others) = (*at_limit + 1, 0);
        } else {
            *others += 1;
            if *others >= 6 {
                *at_limit = 0;
            }
        }
    }

    /// From `start` to `end`; the error in units of what is allowed.
    fn attempt(&mut self, system: &Y, step: Y::Scalar) -> Result<Y::Scalar, Error> {
        let Self { workspace, rates, accelerations, start, end, stabilisation, sixth, .. } = self;
        let allowed = [self.relative, self.absolute];
        let mut away = Y::Scalar::ZERO;
        for stage in 1..STAGES {
            end.q.clone_from(&start.q);
            end.u.clone_from(&start.u);
            for (earlier, &a) in A[stage].iter().enumerate().take(stage) {
                if a != 0.0 {
                    let weight = step * Y::Scalar::from_f64(a);
                    add_scaled(end.q.as_mut(), weight, rates[earlier].as_ref());
                    add_scaled(end.u.as_mut(), weight, accelerations[earlier].as_ref());
                }
            }
            end.t = start.t + step * Y::Scalar::from_f64(C[stage]);
            if stage == STAGES - 1 {
                system.normalise(end.q.as_mut());
                away = strayed(system, end.t, end.q.as_ref(), allowed);
                stabilisation.project(system, end.t, &mut end.q, &mut end.u, workspace)?;
            }
            if stage == STAGES - 2 {
                sixth.0.clone_from(&end.q);
                sixth.1.clone_from(&end.u);
            }
            system.write_rates(end.q.as_ref(), end.u.as_ref(), rates[stage].as_mut());
            let (at, out) = ((end.t, &end.q, &end.u), &mut accelerations[stage]);
            stabilisation.accelerate(system, step, at, workspace, out)?;
        }
        let Self { rates, accelerations, start, end, .. } = &*self;
        let q = self.squared_error(step, start.q.as_ref(), end.q.as_ref(), rates);
        let u = self.squared_error(step, start.u.as_ref(), end.u.as_ref(), accelerations);
        let count = (start.q.as_ref().len() + start.u.as_ref().len()).max(1);
        Ok(((q + u + away) / Y::Scalar::from_f64(count as f64)).sqrt())
    }

    /// Sum of squares of the estimated errors, in units of what is allowed.
    fn squared_error<V: AsRef<[Y::Scalar]>>(
        &self,
        step: Y::Scalar,
        start: &[Y::Scalar],
        end: &[Y::Scalar],
        rates: &[V; STAGES],
    ) -> Y::Scalar {
        let mut sum = Y::Scalar::ZERO;
        for (j, (&start, &end)) in start.iter().zip(end).enumerate() {
            let allowed = self.absolute + self.relative * start.abs().max(end.abs());
            let error = step * weighted(&ERROR, rates, j) / allowed;
            sum += error * error;
        }
        sum
    }
}

impl<Y: Mechanism> Integrator<Y> for Dopri5<Y> {
    fn step(&mut self, system: &Y, state: &mut StateOf<Y>, t_end: Y::Scalar) -> Result<(), Error> {
        const LAST: usize = STAGES - 1;
        if !self.fresh || !same::<Y>(&self.end, state) {
            self.end.clone_from(state);
            let last = self.rates[LAST].as_mut();
            system.write_rates(state.q.as_ref(), state.u.as_ref(), last);
            let (last, workspace) = (&mut self.accelerations[LAST], &mut self.workspace);
            let at = (state.t, &state.q, &state.u);
            self.stabilisation.accelerate(system, self.steps.next, at, workspace, last)?;
            self.fresh = true;
        }
        if !(self.steps.next > Y::Scalar::ZERO) {
            let parts = [
                (self.end.q.as_ref(), self.rates[LAST].as_ref()),
                (self.end.u.as_ref(), self.accelerations[LAST].as_ref()),
            ];
            self.steps.next = first_step(parts, [self.relative, self.absolute]);
        }
        self.start.clone_from(&self.end);
        self.rates.swap(0, LAST);
        self.accelerations.swap(0, LAST);
        let mut steps = self.steps;
        let bounds = [self.min_step, self.max_step];
        let ends = steps.accept([state.t, t_end], bounds, |step| self.attempt(system, step));
        self.steps = steps;
        self.fresh = ends.is_ok();
        if ends? {
            self.end.t = t_end;
        }
        self.watch_stability();
        state.clone_from(&self.end);
        Ok(())
    }

    fn between(&mut self, system: &Y, t: Y::Scalar) -> Result<StateOf<Y>, Error> {
        let mut state = self.start.clone();
        state.t = t;
        let step = self.end.t - self.start.t;
        let part = (t - self.start.t) / step;
        extend(state.q.as_mut(), self.end.q.as_ref(), step, part, &self.rates);
        system.normalise(state.q.as_mut());
        extend(state.u.as_mut(), self.end.u.as_ref(), step, part, &self.accelerations);
        self.stabilisation.project(system, t, &mut state.q, &mut state.u, &mut self.workspace)?;
        Ok(state)
    }

    fn restart(&mut self) {
        self.fresh = false;
    }
}

/// Sum over the stages of weight times component `j`.
fn weighted<S: Scalar, V: AsRef<[S]>>(weights: &[f64], rates: &[V], j: usize) -> S {
    weights.iter().zip(rates).fold(S::ZERO, |sum, (&weight, rate)| match rate.as_ref().get(j) {
        Some(&rate) if weight != 0.0 => sum + S::from_f64(weight) * rate,
        _ => sum,
    })
}

/// The continuous extension: `values` at the start of the step become those at `part` of it.
fn extend<S: Scalar, V: AsRef<[S]>>(values: &mut [S], end: &[S], step: S, part: S, rates: &[V]) {
    let rest = S::ONE - part;
    for (j, (value, &end)) in values.iter_mut().zip(end).enumerate() {
        let change = end - *value;
        let component = |stage: usize| rates[stage].as_ref()[j];
        let slope = step * component(0) - change;
        let curve = change - step * component(STAGES - 1) - slope;
        let quartic = step * weighted(&DENSE, rates, j);
        *value += part * (change + rest * (slope + part * (curve + rest * quartic)));
    }
}
