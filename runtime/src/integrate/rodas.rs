//! RODASP, an L-stable Rosenbrock method of order 4(3) with six stages (G. Steinebach,
//! "Order-reduction of ROW-methods for DAEs and method of lines applications", 1995, in the
//! formulation of E. Hairer, G. Wanner, "Solving Ordinary Differential Equations II", IV.7).
//!
//! With y = (q, u), F = (u, a(t, q, u)), W = 1 / (h gamma) - dF/dy and the coefficients below,
//!
//! ```text
//! W k_i = F(t + c_i h, y + sum_j A_ij k_j) + sum_j C_ij / h k_j + d_i h dF/dt
//! y'    = y + sum_j A_5j k_j + k_5 + k_6          error = k_6
//! ```
//!
//! How W is factored: [`Derivatives`]. Steps end with a projection onto the closure, as everywhere.

use super::derivatives::{Derivatives, Place};
use super::rodasp::{A, C, GAMMA, PLACE, STAGES, TIME};
use super::steps::{Steps, first_step};
use super::{Integrator, Stabilisation, strayed};
use crate::linear::{add_scaled, dot, set_scaled, tolerance};
use crate::projection::{project_stage, project_to_rounding};
use crate::rank::Fading;
use crate::{Arithmetic, Error, Mechanism, Scalar, StateOf};

/// How far ahead of a state whose derivatives are rough others are looked for, in singular values that
/// are: beyond the singular state.
const AHEAD: f64 = 3.0;
/// Taken for the length of the first step before it is known, s.
const UNKNOWN_STEP: f64 = 1e-3;
/// The continuous extension, of order 3.
const DENSE: [[f64; 5]; 2] = [
    [25.09876703708589, 11.62013104361867, 28.49148307714626, -5.664021568594133, 0.0],
    [
        1.638054557396973,
        -0.7373619806678748,
        8.47791821923899,
        15.9925314877952,
        -1.882352941176471,
    ],
];

/// Adaptive and L-stable: for stiff hinges, whose rates an explicit method would have to resolve
/// long after they have died away. Six evaluations and one Jacobian per step.
///
/// The order is 4 where dq/dt = u, as for joints, and 2 where dq/dt depends on q, as for a quaternion: q is
/// advanced along the directions that u has at the start of the step.
///
/// Next to a singular state `f32` cannot tell which way loops close from some 1e-3 rad on: stiff
/// designs that rest there want `f64`.
#[derive(Clone, Debug)]
pub struct Rodas<Y: Mechanism> {
    /// Error allowed per step, relative to q and u.
    pub relative: Y::Scalar,
    /// Error allowed per step on top, rad and rad/s.
    pub absolute: Y::Scalar,
    /// Longest step, s; infinite unless set.
    pub max_step: Y::Scalar,
    /// Smallest step, s; below it (or where time no longer advances) integration fails.
    pub min_step: Y::Scalar,
    workspace: Y::Workspace,
    /// At the start of the step.
    derivatives: Derivatives<Y>,
    /// k of the stages: their parts in q, along the directions of u, and in u.
    positions: [Y::Speeds; STAGES],
    speeds: [Y::Speeds; STAGES],
    /// A step of q, and a rate of q.
    ahead: Y::Speeds,
    rate: Y::Coordinates,
    start: StateOf<Y>,
    end: StateOf<Y>,
    steps: Steps<Y::Scalar>,
}

impl<Y: Mechanism> Rodas<Y> {
    /// With storage for the system, a relative error of 1e-6 (1e-4 in `f32`) and an absolute one
    /// of 1e-8 (1e-4).
    pub fn new(system: &Y) -> Self {
        let zero = Y::Scalar::ZERO;
        let state = system.initial();
        Self {
            relative: tolerance(1e-6, 1000.0),
            absolute: tolerance(1e-8, 1000.0),
            max_step: Y::Scalar::from_f64(f64::INFINITY),
            min_step: zero,
            workspace: system.workspace(),
            derivatives: Derivatives::new(system),
            positions: core::array::from_fn(|_| system.speeds()),
            speeds: core::array::from_fn(|_| system.speeds()),
            ahead: system.speeds(),
            rate: state.q.clone(),
            start: state.clone(),
            end: state,
            steps: Steps::new(4.0),
        }
    }

    /// The Jacobian at the start of a step, and the acceleration there. Where a motion passes so close
    /// to a singular state that derivatives have lost their digits, it is that of a little further on.
    fn linearise(&mut self, system: &Y, state: &StateOf<Y>) -> Result<(), Error> {
        let step = if self.steps.next > Y::Scalar::ZERO {
            self.steps.next
        } else {
            Y::Scalar::from_f64(UNKNOWN_STEP)
        };
        let is_rough = self.derivatives.at(system, state, step, &mut self.workspace)?;
        let place = self.derivatives.place;
        let speed = dot(state.u.as_ref(), state.u.as_ref()).sqrt();
        if is_rough && speed > Y::Scalar::ZERO {
            let mut ahead = state.clone();
            let time = Y::Scalar::from_f64(AHEAD) * Fading::of_rounding().rough / speed;
            set_scaled(self.ahead.as_mut(), time, state.u.as_ref());
            system.advance(ahead.q.as_mut(), self.ahead.as_ref());
            let (q, u) = (ahead.q.as_mut(), ahead.u.as_mut());
            project_stage(system, ahead.t, q, u, self.workspace.as_mut())?;
            self.derivatives.at(system, &ahead, step, &mut self.workspace)?;
            self.derivatives.place = place;
        }
        if place != Place::Given {
            let at = (state.t, &state.q, &state.u);
            let (workspace, out) = (&mut self.workspace, &mut self.derivatives.acceleration);
            Stabilisation::Projection.accelerate(system, Y::Scalar::ZERO, at, workspace, out)?;
        }
        Ok(())
    }

    /// As [`extend`] for q, whose stages lie along the directions of u.
    fn extend_coordinates(&mut self, system: &Y, state: &mut StateOf<Y>, part: Y::Scalar) {
        let rest = Y::Scalar::ONE - part;
        let Self { ahead, rate, positions, end, .. } = self;
        for (j, curve) in ahead.as_mut().iter_mut().enumerate() {
            let [quadratic, cubic] = DENSE.each_ref().map(|w| weighted(w, &*positions, j));
            *curve = quadratic + part * cubic;
        }
        system.write_rates(state.q.as_ref(), ahead.as_ref(), rate.as_mut());
        let values = state.q.as_mut().iter_mut().zip(end.q.as_ref()).zip(rate.as_ref());
        for ((value, &end), &curve) in values {
            *value = *value * rest + part * (end + rest * curve);
        }
        system.normalise(state.q.as_mut());
    }

    /// From `start` to `end`; the error in units of what is allowed.
    fn attempt(&mut self, system: &Y, step: Y::Scalar) -> Result<Y::Scalar, Error> {
        let of = Y::Scalar::from_f64;
        let ahead = step * of(GAMMA);
        let n = self.start.u.as_ref().len();
        if !self.derivatives.factor(ahead) {
            return Ok(of(f64::NAN));
        }
        for stage in 0..STAGES {
            self.stage(system, step, ahead, stage)?;
        }
        let Self { positions, speeds, start, end, workspace, rate, .. } = self;
        system.advance(end.q.as_mut(), positions[STAGES - 1].as_ref());
        system.write_rates(end.q.as_ref(), positions[STAGES - 1].as_ref(), rate.as_mut());
        add_scaled(end.u.as_mut(), Y::Scalar::ONE, speeds[STAGES - 1].as_ref());
        end.t = start.t + step;
        let mut sum = Y::Scalar::ZERO;
        let parts = [
            (start.q.as_ref(), end.q.as_ref(), rate.as_ref()),
            (start.u.as_ref(), end.u.as_ref(), speeds[STAGES - 1].as_ref()),
        ];
        for (start, end, errors) in parts {
            for ((&start, &end), &error) in start.iter().zip(end).zip(errors) {
                let allowed = self.absolute + self.relative * start.abs().max(end.abs());
                sum += (error / allowed) * (error / allowed);
            }
        }
        sum += strayed(system, end.t, end.q.as_ref(), [self.relative, self.absolute]);
        let count = (start.q.as_ref().len() + n).max(1);
        let error = (sum / of(count as f64)).sqrt();
        if error <= Y::Scalar::ONE {
            let (q, u) = (end.q.as_mut(), end.u.as_mut());
            project_to_rounding(system, end.t, q, u, workspace.as_mut())?;
        }
        Ok(error)
    }

    /// k of one stage. Leaves the argument of F in `end`.
    fn stage(
        &mut self,
        system: &Y,
        step: Y::Scalar,
        ahead: Y::Scalar,
        stage: usize,
    ) -> Result<(), Error> {
        let of = Y::Scalar::from_f64;
        let Self { workspace, derivatives, positions, speeds, start, end, ahead: sum, .. } = self;
        if stage < STAGES - 1 {
            end.q.clone_from(&start.q);
            end.u.clone_from(&start.u);
            sum.as_mut().fill(Y::Scalar::ZERO);
            for (earlier, &a) in A[stage].iter().enumerate().take(stage) {
                add_scaled(sum.as_mut(), of(a), positions[earlier].as_ref());
                add_scaled(end.u.as_mut(), of(a), speeds[earlier].as_ref());
            }
            system.advance(end.q.as_mut(), sum.as_ref());
        } else {
            system.advance(end.q.as_mut(), positions[stage - 1].as_ref());
            add_scaled(end.u.as_mut(), Y::Scalar::ONE, speeds[stage - 1].as_ref());
        }
        if stage == 0 {
            speeds[0].clone_from(&derivatives.acceleration);
        } else {
            end.t = start.t + step * of(PLACE[stage]);
            derivatives.place.accelerate(system, end, workspace, &mut speeds[stage])?;
        }
        let (before, now) = positions.split_at_mut(stage);
        let (speeds_before, speeds_now) = speeds.split_at_mut(stage);
        let (position, speed) = (now[0].as_mut(), speeds_now[0].as_mut());
        position.copy_from_slice(end.u.as_ref());
        add_scaled(speed, of(TIME[stage]) * step, derivatives.by_time.as_ref());
        for (earlier, &c) in C[stage].iter().enumerate().take(stage) {
            let weight = of(c) / step;
            add_scaled(position, weight, before[earlier].as_ref());
            add_scaled(speed, weight, speeds_before[earlier].as_ref());
        }
        derivatives.solve(
            (system, start.t, start.q.as_ref()),
            ahead,
            [position, speed],
            sum.as_mut(),
            workspace,
        )?;
        Ok(())
    }
}

impl<Y: Mechanism> Integrator<Y> for Rodas<Y> {
    fn step(&mut self, system: &Y, state: &mut StateOf<Y>, t_end: Y::Scalar) -> Result<(), Error> {
        self.start.clone_from(state);
        self.linearise(system, state)?;
        if !(self.steps.next > Y::Scalar::ZERO) {
            let (q, u) = (state.q.as_ref(), state.u.as_ref());
            system.write_rates(q, u, self.rate.as_mut());
            let parts = [(q, self.rate.as_ref()), (u, self.derivatives.acceleration.as_ref())];
            self.steps.next = first_step(parts, [self.relative, self.absolute]);
        }
        let bounds = [self.min_step, self.max_step];
        let mut steps = self.steps;
        let ends = steps.accept([state.t, t_end], bounds, |step| self.attempt(system, step));
        self.steps = steps;
        if ends? {
            self.end.t = t_end;
        }
        state.clone_from(&self.end);
        Ok(())
    }

    fn between(&mut self, system: &Y, t: Y::Scalar) -> Result<StateOf<Y>, Error> {
        let part = (t - self.start.t) / (self.end.t - self.start.t);
        let mut state = self.start.clone();
        state.t = t;
        self.extend_coordinates(system, &mut state, part);
        extend(state.u.as_mut(), self.end.u.as_ref(), part, &self.speeds);
        let (q, u) = (state.q.as_mut(), state.u.as_mut());
        project_to_rounding(system, t, q, u, self.workspace.as_mut())?;
        Ok(state)
    }

    fn restart(&mut self) {}
}

/// `values` at the start of the step become those at `part` of it.
fn extend<S: Scalar, V: AsRef<[S]>>(values: &mut [S], end: &[S], part: S, stages: &[V]) {
    let rest = S::ONE - part;
    for (j, (value, &end)) in values.iter_mut().zip(end).enumerate() {
        let [quadratic, cubic] = DENSE.each_ref().map(|weights| weighted(weights, stages, j));
        *value = *value * rest + part * (end + rest * (quadratic + part * cubic));
    }
}

/// Sum over the stages of weight times component `j`.
fn weighted<S: Scalar, V: AsRef<[S]>>(weights: &[f64; 5], stages: &[V], j: usize) -> S {
    weights
        .iter()
        .zip(stages)
        .fold(S::ZERO, |sum, (&weight, stage)| sum + S::from_f64(weight) * stage.as_ref()[j])
}
