//! Small dense linear algebra on slices. Matrices are row-major.

mod cholesky;
mod householder;
mod pseudoinverse;

pub(crate) use cholesky::{backward, conditioning, factor, forward, times_lower};
pub(crate) use householder::{reflect, solve};
pub(crate) use pseudoinverse::{Kept, combine, exchange, keep, normalise, orthogonalise, reduce};

use crate::Arithmetic;
use crate::constants::Tolerance;

/// Scalar product of equally long slices.
#[inline]
pub(crate) fn dot<S: Arithmetic>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::ZERO, |sum, (&a, &b)| sum + a * b)
}

/// `y += factor x`.
#[inline]
pub(crate) fn add_scaled<S: Arithmetic>(y: &mut [S], factor: S, x: &[S]) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// `y = factor x`.
#[inline]
pub(crate) fn set_scaled<S: Arithmetic>(y: &mut [S], factor: S, x: &[S]) {
    for (y, &x) in y.iter_mut().zip(x) {
        *y = factor * x;
    }
}

/// Largest magnitude; NaN if any entry is.
pub(crate) fn max_abs<S: Arithmetic>(values: &[S]) -> S {
    values.iter().fold(S::ZERO, |largest, value| largest.max(value.abs()))
}

/// A [`Tolerance`] of one algorithm alone.
#[inline]
pub(crate) fn tolerance<S: Arithmetic>(constant: f64, epsilons: f64) -> S {
    Tolerance { constant, epsilons }.of()
}

/// A matrix of numbers in -1 .. 1 that look random and never change.
#[cfg(test)]
pub(crate) fn test_matrix(rows: usize, columns: usize, seed: u64) -> nalgebra::DMatrix<f64> {
    let mut state = seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1;
    nalgebra::DMatrix::from_fn(rows, columns, |_, _| {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963);
        (state >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    })
}
