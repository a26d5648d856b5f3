//! A step of RODASP ([`Rodas`](lamc_runtime::Rodas)) of given length with dense derivatives, and its adjoint.
//!
//! With the stages k = (p, v) in q and u, W = 1 / (h gamma) - da/du - h gamma da/dq, and the right-hand sides r and s of a stage,
//!
//! ```text
//! W v = s + h gamma da/dq r,   p = h gamma (r + v)
//! r' = h gamma (p' + da/dq^T z),   s' = z,   W^T z = v' + h gamma p',   (da/dq)' += z p^T,   (da/du)' += z v^T
//! ```
//!
//! where adjoints have a prime, and p' goes to v' first.

use lamc::program::FunctionKind;
use lamc_runtime::plumbing::rodasp::{A, C, GAMMA, PLACE, STAGES, TIME};
use lamc_runtime::{JacobianMut, Mechanism as _, State};
use nalgebra::{DMatrix, DVector, Dyn, LU};

use super::differentiated::{Adjoints, At, Differentiated, Undifferentiable};
use super::orientation;
use super::tape::Tape;

/// Takes a step, and goes back.
pub struct Implicit {
    joints: usize,
    nq: usize,
    nu: usize,
}

/// The linearisation at the start of a step.
struct Linear {
    /// gamma times the step, s.
    ahead: f64,
    acceleration: Vec<f64>,
    by_position: DMatrix<f64>,
    by_time: Vec<f64>,
    /// W.
    factors: LU<f64, Dyn, Dyn>,
}

impl Implicit {
    /// For a mechanism.
    pub fn new(differentiated: &Differentiated) -> Self {
        Self {
            joints: differentiated.system.interface().joints.len(),
            nq: differentiated.layout.coordinates,
            nu: differentiated.layout.speeds,
        }
    }

    fn linear(
        &self,
        on: &Differentiated,
        at: At<'_>,
        length: f64,
    ) -> Result<Linear, Undifferentiable> {
        let nu = self.nu;
        let (mut acceleration, mut dt) = (vec![0.0; nu], vec![0.0; nu]);
        let (mut dq, mut du) = (vec![0.0; nu * nu], vec![0.0; nu * nu]);
        let out =
            JacobianMut { acceleration: &mut acceleration, dq: &mut dq, du: &mut du, dt: &mut dt };
        let singular = Undifferentiable::Singular { t: at.t };
        if !on.jacobian(at, out)? {
            return Err(singular);
        }
        let ahead = GAMMA * length;
        let by_position = DMatrix::from_row_slice(nu, nu, &dq);
        let mut matrix = -DMatrix::from_row_slice(nu, nu, &du) - ahead * &by_position;
        (0..nu).for_each(|k| matrix[(k, k)] += ahead.recip());
        let factors = matrix.lu();
        if !factors.is_invertible() {
            return Err(singular);
        }
        Ok(Linear { ahead, acceleration, by_position, by_time: dt, factors })
    }

    /// Takes a step of a length, s, without the projection. Records the start and, of each stage, its state and k.
    ///
    /// # Errors
    /// [`Undifferentiable`].
    pub fn step(
        &self,
        on: &Differentiated,
        state: &mut State<Vec<f64>, f64>,
        length: f64,
        tape: &mut Tape,
    ) -> Result<(), Undifferentiable> {
        let (nq, nu) = (self.nq, self.nu);
        let system = &on.system;
        let start = state.clone();
        let linear = self.linear(on, At { t: start.t, q: &start.q, u: &start.u }, length)?;
        let begin = tape.len();
        tape.push(&start.q);
        tape.push(&start.u);
        for stage in 0..STAGES {
            let before = |earlier: usize| {
                let numbers = &tape.from(begin)[nq + nu + earlier * (nq + 3 * nu)..];
                numbers[nq + nu..nq + 3 * nu].split_at(nu)
            };
            let (weights, from) = arguments(stage);
            if from == 0 {
                state.q.copy_from_slice(&start.q);
                state.u.copy_from_slice(&start.u);
            }
            let mut step = vec![0.0; nu];
            for (earlier, weight) in weights {
                let (position, speed) = before(earlier);
                add(&mut step, weight, position);
                add(&mut state.u, weight, speed);
            }
            system.advance(&mut state.q, &step);
            let mut right = linear.acceleration.clone();
            if stage > 0 {
                let t = start.t + length * PLACE[stage];
                let at = At { t, q: &state.q, u: &state.u };
                if !on.accelerate(at, &mut right)? {
                    return Err(Undifferentiable::Singular { t });
                }
            }
            let mut position = state.u.clone();
            add(&mut right, TIME[stage] * length, &linear.by_time);
            for (earlier, c) in C[stage].iter().enumerate().take(stage) {
                let (p, v) = before(earlier);
                add(&mut position, c / length, p);
                add(&mut right, c / length, v);
            }
            let speed = linear.solve(&mut position, right);
            tape.push(&state.q);
            tape.push(&state.u);
            tape.push(&position);
            tape.push(speed.as_slice());
        }
        let last = tape.top(2 * nu);
        let (position, speed) = last.split_at(nu);
        add(&mut state.u, 1.0, speed);
        system.advance(&mut state.q, position);
        Ok(())
    }

    /// Goes back over the last step of the record, which began at `t`, s: the adjoints of its end become those of its begin.
    pub fn pull(
        &self,
        on: &Differentiated,
        t: f64,
        length: f64,
        tape: &mut Tape,
        adjoints: &mut Adjoints,
    ) {
        let (nq, nu) = (self.nq, self.nu);
        let width = nq + 3 * nu;
        let numbers = tape.pop(nq + nu + STAGES * width);
        let (start, stages) = numbers.split_at(nq + nu);
        let (start_q, start_u) = start.split_at(nq);
        let at = At { t, q: start_q, u: start_u };
        let Ok(linear) = self.linear(on, at, length) else { return adjoints.spoil() };
        let mut back = Back {
            linear: &linear,
            record: Record { start_q, stages, nq, nu },
            joints: self.joints,
            length,
            of_k: vec![0.0; STAGES * 2 * nu],
            of_matrices: [DMatrix::zeros(nu, nu), DMatrix::zeros(nu, nu)],
            of_time: vec![0.0; nu],
        };
        // The end is the state of the last stage, advanced by its k; `adjoints` is that of this state from here on.
        back.pull_argument(STAGES, &mut adjoints.state);
        let mut of_start = vec![0.0; nq + nu];
        let mut of_first = vec![0.0; nu];
        for stage in (0..STAGES).rev() {
            let Some([z, of_r]) = back.pull_equation(stage) else { return adjoints.spoil() };
            add(&mut adjoints.state[nq..], 1.0, of_r.as_slice());
            if stage > 0 {
                let (q, u) = back.record.state(stage);
                let at = At { t: t + length * PLACE[stage], q, u };
                on.pull(FunctionKind::Acceleration, at, z.as_slice(), adjoints);
            } else {
                of_first.copy_from_slice(z.as_slice());
            }
            back.pull_argument(stage, &mut adjoints.state);
            if stage < STAGES - 1 {
                add(&mut of_start, 1.0, &adjoints.state);
                adjoints.state.fill(0.0);
            }
        }
        adjoints.state.copy_from_slice(&of_start);
        let Back { of_matrices, of_time, .. } = back;
        let rows = of_matrices.iter().flat_map(|matrix| matrix.transpose().as_slice().to_vec());
        let weights: Vec<f64> = of_first.into_iter().chain(rows).chain(of_time).collect();
        on.pull(FunctionKind::Jacobian, at, &weights, adjoints);
    }
}

/// What a step recorded.
#[derive(Clone, Copy)]
struct Record<'a> {
    start_q: &'a [f64],
    stages: &'a [f64],
    nq: usize,
    nu: usize,
}

impl<'a> Record<'a> {
    fn stage(self, stage: usize) -> &'a [f64] {
        let width = self.nq + 3 * self.nu;
        &self.stages[stage * width..][..width]
    }

    /// The state of a stage.
    fn state(self, stage: usize) -> (&'a [f64], &'a [f64]) {
        self.stage(stage)[..self.nq + self.nu].split_at(self.nq)
    }

    /// p and v of a stage.
    fn k(self, stage: usize) -> (&'a [f64], &'a [f64]) {
        self.stage(stage)[self.nq + self.nu..].split_at(self.nu)
    }
}

/// The way back over a step.
struct Back<'a> {
    linear: &'a Linear,
    record: Record<'a>,
    joints: usize,
    length: f64,
    /// Adjoints of p and v of each stage.
    of_k: Vec<f64>,
    /// Adjoints of da/dq and da/du.
    of_matrices: [DMatrix<f64>; 2],
    /// The adjoint of da/dt.
    of_time: Vec<f64>,
}

impl Back<'_> {
    /// From the adjoints of k of a stage to those of what it was solved for: z of the speeds, and r' of the positions.
    fn pull_equation(&mut self, stage: usize) -> Option<[DVector<f64>; 2]> {
        let Self { linear, record, length, of_k, of_matrices, of_time, .. } = self;
        let nu = record.nu;
        let (p, v) = record.k(stage);
        let (before, own) = of_k.split_at_mut(stage * 2 * nu);
        let (of_p, of_v) = own[..2 * nu].split_at(nu);
        let mut z = DVector::from_column_slice(of_v);
        z.axpy(linear.ahead, &DVector::from_column_slice(of_p), 1.0);
        let z = linear.transposed_solve(z)?;
        of_matrices[0] += &z * DVector::from_column_slice(p).transpose();
        of_matrices[1] += &z * DVector::from_column_slice(v).transpose();
        let mut of_r = linear.by_position.tr_mul(&z);
        of_r += DVector::from_column_slice(of_p);
        of_r *= linear.ahead;
        for (earlier, c) in C[stage].iter().enumerate().take(stage) {
            let (of_p, of_v) = before[earlier * 2 * nu..][..2 * nu].split_at_mut(nu);
            add(of_p, c / *length, of_r.as_slice());
            add(of_v, c / *length, z.as_slice());
        }
        add(of_time, TIME[stage] * *length, z.as_slice());
        Some([z, of_r])
    }

    /// From the adjoints of the state of a stage, or of the end, to those of the state from which it was advanced, and of the k that
    /// it has from earlier stages.
    fn pull_argument(&mut self, stage: usize, of_state: &mut [f64]) {
        let Self { record, joints, of_k, .. } = self;
        let nu = record.nu;
        let (weights, from) = arguments(stage);
        let from_q = if from == 0 { record.start_q } else { record.state(stage - 1).0 };
        let step = weights.iter().fold(vec![0.0; nu], |mut step, (earlier, weight)| {
            add(&mut step, *weight, record.k(*earlier).0);
            step
        });
        let mut of_step = vec![0.0; nu];
        let (of_q, of_u) = of_state.split_at_mut(record.nq);
        orientation::advance(from_q, &step, *joints, of_q, &mut of_step);
        for (earlier, weight) in weights {
            let (of_p, of_v) = of_k[earlier * 2 * nu..][..2 * nu].split_at_mut(nu);
            add(of_p, weight, &of_step);
            add(of_v, weight, of_u);
        }
    }
}

impl Linear {
    /// v of a stage, from its right-hand sides; that of the positions becomes p.
    fn solve(&self, position: &mut [f64], right: Vec<f64>) -> DVector<f64> {
        let mut speed = DVector::from_vec(right);
        speed += self.ahead * &self.by_position * DVector::from_column_slice(position);
        self.factors.solve_mut(&mut speed);
        for (position, speed) in position.iter_mut().zip(&speed) {
            *position = self.ahead * (*position + speed);
        }
        speed
    }

    /// z of W^T z = x. With P W = L U, W^T = U^T L^T P.
    fn transposed_solve(&self, mut x: DVector<f64>) -> Option<DVector<f64>> {
        let (upper, lower) = (self.factors.u(), self.factors.l());
        let solved = upper.tr_solve_upper_triangular_mut(&mut x)
            && lower.tr_solve_lower_triangular_mut(&mut x);
        self.factors.p().inv_permute_rows(&mut x);
        solved.then_some(x)
    }
}

/// The stages on which the state of a stage, or of the end behind the last, depends, with their weights, and whether it is advanced
/// from the start (0) or from the state of the stage before (1).
fn arguments(stage: usize) -> (Vec<(usize, f64)>, usize) {
    if stage < STAGES - 1 {
        (A[stage].iter().copied().enumerate().take(stage).collect(), 0)
    } else {
        (vec![(stage - 1, 1.0)], 1)
    }
}

/// `sum += weight x`
fn add(sums: &mut [f64], weight: f64, shares: &[f64]) {
    sums.iter_mut().zip(shares).for_each(|(sum, share)| *sum += weight * share);
}
