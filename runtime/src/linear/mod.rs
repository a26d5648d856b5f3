//! Small dense linear algebra on slices. Matrices are row-major.
//!
//! Nothing here indexes a slice where a wrong length could panic: entries are paired by iterators, and parts of a
//! matrix are taken by [`rows_of`] and [`rows_of_mut`], which return [`Error::Length`]. `tests/embedded/run` checks that
//! firmware links no function that panics.

mod cholesky;
mod householder;
mod independent;
mod largest;
mod pseudoinverse;
#[cfg(test)]
#[path = "../../../tests/src/uniform.rs"]
#[allow(dead_code, reason = "tests of this crate need a part of it")]
mod uniform;

pub(crate) use cholesky::{
    backward, conditioning, factor, forward, forward_rows, leading_zeros, times_lower, times_upper,
};
pub(crate) use householder::{reflect, solve};
pub(crate) use independent::{clearly_independent, orthogonalise_independent, reduce_groups};
pub(crate) use largest::{max_abs, max_abs_of_many};
pub(crate) use pseudoinverse::{Kept, combine, exchange, keep, normalise, orthogonalise, reduce};

use core::ops::Range;

use crate::constants::Tolerance;
use crate::{Arithmetic, Error};

/// Scalar product; entries that only one of the slices has do not count.
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

/// Consecutive rows of a matrix of `n` columns; entries of a vector if `n` is 1.
#[inline]
pub(crate) fn rows_of<S>(matrix: &[S], n: usize, range: Range<usize>) -> Result<&[S], Error> {
    let (expected, given) = (range.end * n, matrix.len());
    matrix.get(range.start * n..expected).ok_or(Error::Length { expected, given })
}

/// As [`rows_of`], to write to.
#[inline]
pub(crate) fn rows_of_mut<S>(
    matrix: &mut [S],
    n: usize,
    range: Range<usize>,
) -> Result<&mut [S], Error> {
    let (expected, given) = (range.end * n, matrix.len());
    matrix.get_mut(range.start * n..expected).ok_or(Error::Length { expected, given })
}

/// The diagonal of a matrix (n x n).
#[inline]
pub(crate) fn diagonal<S>(matrix: &[S], n: usize) -> impl Iterator<Item = &S> {
    matrix.chunks_exact(n.max(1)).enumerate().filter_map(|(i, row)| row.get(i))
}

/// Copies a slice of the same length.
#[inline]
pub(crate) fn copy<S: Copy>(to: &mut [S], from: &[S]) -> Result<(), Error> {
    let (expected, given) = (to.len(), from.len());
    if expected != given {
        return Err(Error::Length { expected, given });
    }
    to.copy_from_slice(from);
    Ok(())
}

/// A [`Tolerance`] of one algorithm alone.
#[inline]
pub(crate) fn tolerance<S: Arithmetic>(constant: f64, epsilons: f64) -> S {
    Tolerance { constant, epsilons }.of()
}

/// A matrix of numbers in -1 .. 1 that look random and never change.
#[cfg(test)]
pub(crate) fn test_matrix(rows: usize, columns: usize, seed: u64) -> nalgebra::DMatrix<f64> {
    let mut random = uniform::Random::new(seed);
    nalgebra::DMatrix::from_fn(rows, columns, |_, _| random.range(-1.0, 1.0))
}
