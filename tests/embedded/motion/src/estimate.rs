//! The stiffness of a hinge from an encoder: an extended Kalman filter (R. E. Kalman, 1960; A. H. Jazwinski, "Stochastic Processes
//! and Filtering Theory", 1970, section 8.3).
//!
//! The state x = (q, u, k) moves with dq/dt = u, du/dt = a(q, u, k), dk/dt = 0, and its covariance P with the transition
//!
//! ```text
//! F = 1 + A h + A^2 h^2 / 2,   A = [0 1 0; da/dq da/du da/dk; 0 0 0],   P <- F P F^T
//! ```
//!
//! where `jacobian` and `jacobian_params` of the module give the derivatives of a. The encoder measures q with the variance r:
//!
//! ```text
//! s = P_qq + r,   K = P e_q / s,   x <- x + K (z - q),   P <- P - K s K^T
//! ```
//!
//! k counts in units of the stiffness that the module has.

use core::f64::consts::TAU;

use lamc_generated::swing::{Params, Swing};
use lamc_runtime::{Error, Mechanism as _, Rk4, Scalar, State};

use crate::Task;

/// Positions of the encoder in a turn: 12 bits.
const COUNTS: f64 = 4096.0;
/// The variance of an angle that is rounded to counts, rad^2.
const VARIANCE: f64 = TAU / COUNTS * (TAU / COUNTS) / 12.0;
/// The length of a step, s.
const STEP: f64 = 1e-3;
/// The stiffness with which the filter begins, in units of the true one.
const GUESS: f64 = 0.7;
/// The standard deviations of speed (rad/s) and stiffness with which it begins.
const SPEED: f64 = 0.5;
const STIFFNESS: f64 = 0.5;
/// The angle from which the leg is released, rad, its moment of inertia about the hinge, kg m^2, and the stiffness and the damping of
/// the model, N m/rad and N m s/rad.
const RELEASED: f64 = 0.3;
const INERTIA: f64 = 3e-7 + 2e-3 * 0.02 * 0.02;
const TRUE_STIFFNESS: f64 = 2e-3;
const DAMPING: f64 = 4e-6;

type Square<S> = [[S; 3]; 3];

/// The filter, and the leg that it watches.
pub struct Estimation<S: Scalar> {
    leg: Swing<S>,
    rk4: Rk4<Swing<S>>,
    state: State<[S; 1], S>,
    /// k, in units of the model's.
    stiffness: S,
    covariance: Square<S>,
}

impl<S: Scalar> Estimation<S> {
    /// The estimate of the stiffness and its standard deviation, both in units of the true one.
    pub fn stiffness(&self) -> (S, S) {
        (self.stiffness, self.covariance[2][2].sqrt())
    }

    /// What the encoder shows at a time, s: the swing in closed form, in whole counts, as an angle.
    ///
    /// q = q0 exp(-d t) (cos w t + d / w sin w t), with d = b / (2 I) and w^2 = k / I - d^2.
    fn encoder(t: S) -> S {
        const DECAY: f64 = DAMPING / (2.0 * INERTIA);
        let of = S::from_f64;
        let frequency = of(TRUE_STIFFNESS / INERTIA - DECAY * DECAY).sqrt();
        let (sine, cosine) = (frequency * t).sin_cos();
        let angle = of(RELEASED) * (-of(DECAY) * t).exp() * (cosine + of(DECAY) / frequency * sine);
        // A number of this size has no digits behind the point, so that the sum is rounded to whole counts.
        let large = of(1.5) / S::EPSILON;
        let counts = (angle * of(COUNTS / TAU) + large) - large;
        counts * of(TAU / COUNTS)
    }

    /// The state and its covariance a step later.
    fn predict(&mut self) -> Result<(), Error> {
        let of = S::from_f64;
        self.leg.params.k = self.stiffness * of(TRUE_STIFFNESS);
        let State { t, q, u } = self.state;
        let by_state = self.leg.jacobian(t, &q, &u)?;
        let by_params = self.leg.jacobian_params(t, &q, &u)?;
        let by_stiffness = by_params.dp[0][0] * of(TRUE_STIFFNESS);
        let zero = S::ZERO;
        let rates =
            [[zero, S::ONE, zero], [by_state.dq[0][0], by_state.du[0][0], by_stiffness], [zero; 3]];
        let squares = product(&rates, &rates);
        let (h, half) = (of(STEP), of(0.5 * STEP * STEP));
        let mut transition = [[zero; 3]; 3];
        for (i, row) in transition.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                let one = if i == j { S::ONE } else { zero };
                *entry = one + h * rates[i][j] + half * squares[i][j];
            }
        }
        let moved = product(&transition, &self.covariance);
        self.covariance = product(&moved, &transposed(&transition));
        self.rk4.step(&self.leg, &mut self.state, h)
    }

    /// Takes what the encoder shows into account.
    fn correct(&mut self, shown: S) {
        let covariance = &mut self.covariance;
        let sum = covariance[0][0] + S::from_f64(VARIANCE);
        let gain: [S; 3] = core::array::from_fn(|i| covariance[i][0] / sum);
        let error = shown - self.state.q[0];
        self.state.q[0] += gain[0] * error;
        self.state.u[0] += gain[1] * error;
        self.stiffness += gain[2] * error;
        for (i, row) in covariance.iter_mut().enumerate() {
            for (j, entry) in row.iter_mut().enumerate() {
                *entry -= gain[i] * sum * gain[j];
            }
        }
    }
}

impl<S: Scalar> Task for Estimation<S> {
    type Number = S;
    const STEPS: u32 = 1_000;

    fn assembled() -> Result<Self, Error> {
        let of = S::from_f64;
        let leg = Swing { params: Params::default(), ..Swing::default() };
        let rk4 = Rk4::new(&leg);
        let mut state = leg.initial();
        state.q[0] = Self::encoder(state.t);
        let mut covariance = [[S::ZERO; 3]; 3];
        // As numbers of this type: a loop would convert them on the board.
        let begin = [of(VARIANCE), of(SPEED * SPEED), of(STIFFNESS * STIFFNESS)];
        for (i, variance) in begin.into_iter().enumerate() {
            covariance[i][i] = variance;
        }
        Ok(Self { leg, rk4, state, stiffness: of(GUESS), covariance })
    }

    fn step(&mut self) -> Result<(), Error> {
        self.predict()?;
        self.correct(Self::encoder(self.state.t));
        Ok(())
    }

    fn coordinates(&self) -> impl Iterator<Item = S> {
        let (stiffness, deviation) = self.stiffness();
        [self.state.q[0], self.state.u[0], stiffness, deviation].into_iter()
    }
}

fn product<S: Scalar>(a: &Square<S>, b: &Square<S>) -> Square<S> {
    a.map(|row| core::array::from_fn(|j| row[0] * b[0][j] + row[1] * b[1][j] + row[2] * b[2][j]))
}

fn transposed<S: Scalar>(a: &Square<S>) -> Square<S> {
    core::array::from_fn(|i| core::array::from_fn(|j| a[j][i]))
}
