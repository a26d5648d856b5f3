//! Cholesky factor of a symmetric positive definite matrix, A = L L^T, in place.
//!
//! The diagonal holds 1 / `l_ii`, so that substitutions multiply instead of dividing. A row of L is zero as far as that of A is:
//! what is known to be zero is left out, and the bits are the same (A. Jennings, "A compact storage scheme for the solution of
//! symmetric linear simultaneous equations", 1966). Joints of a sheet that are far apart have no entry.

use super::{add_scaled, diagonal, dot};
use crate::Scalar;
use crate::scalar::whole;

/// Overwrites the lower triangle of `a` (n x n) by its factor; the rest is neither read nor
/// written. Fails with the index of the first pivot that is not safely positive, or that is missing.
pub(crate) fn factor<S: Scalar>(a: &mut [S], n: usize) -> Result<(), usize> {
    for i in 0..n {
        let (above, rest) = a.split_at_mut_checked(i * n).ok_or(i)?;
        let row = rest.get_mut(..=i).ok_or(i)?;
        let first = leading_zeros(&row[..i]);
        for (j, other) in (0..i).zip(above.chunks_exact(n)).skip(first) {
            let (done, rest) = row.split_at_mut_checked(j).ok_or(i)?;
            let (entry, reciprocal) = rest.first_mut().zip(other.get(j)).ok_or(i)?;
            *entry = (*entry - dot_from(first, done, other)) * *reciprocal;
        }
        let pivot = row[i] - dot_from(first, &row[..i], &row[..i]);
        // Written so that NaN and infinity fail too.
        if !(pivot > S::EPSILON * row[i]) || !pivot.is_finite() {
            return Err(i);
        }
        row[i] = S::ONE / pivot.sqrt();
    }
    Ok(())
}

/// With how many zeros a row begins.
pub(crate) fn leading_zeros<S: Scalar>(row: &[S]) -> usize {
    row.iter().take_while(|&&entry| entry == S::ZERO).count()
}

/// a . b without the numbers before `first`.
fn dot_from<S: Scalar>(first: usize, a: &[S], b: &[S]) -> S {
    dot(a.get(first..).unwrap_or_default(), b.get(first..).unwrap_or_default())
}

/// `x = L^-1 x`.
pub(crate) fn forward<S: Scalar>(l: &[S], x: &mut [S]) {
    let n = x.len();
    for (i, row) in (0..n).zip(l.chunks_exact(n.max(1))) {
        x[i] = (x[i] - dot_from(leading_zeros(&row[..i]), &row[..i], &x[..i])) * row[i];
    }
}

/// Rows x of `rows` become L^-1 x, with the bits of [`forward`]: four at a time, whose sums do not wait for each other.
pub(crate) fn forward_rows<S: Scalar>(l: &[S], rows: &mut [S], n: usize) {
    let mut groups = rows.chunks_exact_mut((4 * n).max(1));
    for group in &mut groups {
        let mut rows = group.chunks_exact_mut(n.max(1));
        let (Some(a), Some(b), Some(c), Some(d)) =
            (rows.next(), rows.next(), rows.next(), rows.next())
        else {
            continue;
        };
        for (i, row) in (0..n).zip(l.chunks_exact(n.max(1))) {
            let mut sums = [S::ZERO; 4];
            for ((((&l, &a), &b), &c), &d) in row.iter().zip(&*a).zip(&*b).zip(&*c).zip(&*d).take(i)
            {
                for (sum, x) in sums.iter_mut().zip([a, b, c, d]) {
                    *sum += l * x;
                }
            }
            for (x, sum) in [&mut *a, &mut *b, &mut *c, &mut *d].into_iter().zip(sums) {
                if let Some((x, &reciprocal)) = x.get_mut(i).zip(row.get(i)) {
                    *x = (*x - sum) * reciprocal;
                }
            }
        }
    }
    for x in groups.into_remainder().chunks_exact_mut(n.max(1)) {
        forward(l, x);
    }
}

/// `x = L^-T x`.
pub(crate) fn backward<S: Scalar>(l: &[S], x: &mut [S]) {
    let n = x.len();
    for (i, row) in (0..n).zip(l.chunks_exact(n.max(1))).rev() {
        let value = x[i] * row[i];
        x[i] = value;
        add_scaled(&mut x[..i], -value, &row[..i]);
    }
}

/// `x = L x`.
pub(crate) fn times_lower<S: Scalar>(l: &[S], x: &mut [S]) {
    let n = x.len();
    for (i, row) in (0..n).zip(l.chunks_exact(n.max(1))).rev() {
        x[i] = x[i] / row[i] + dot(&row[..i], &x[..i]);
    }
}

/// `x = L^T x`.
pub(crate) fn times_upper<S: Scalar>(l: &[S], x: &mut [S]) {
    let n = x.len();
    for (i, row) in (0..n).zip(l.chunks_exact(n.max(1))) {
        let value = x[i];
        x[i] = value / row[i];
        add_scaled(&mut x[..i], value, &row[..i]);
    }
}

/// A lower bound of smallest over largest eigenvalue, from the factor and the trace:
/// by the inequality of the means det A <= `lambda_min` (trace / (n - 1))^(n - 1), and
/// `lambda_max` <= trace.
pub(crate) fn conditioning<S: Scalar>(l: &[S], n: usize, trace: S) -> S {
    let scale = whole::<S>(n.saturating_sub(1) as u64) / trace;
    diagonal(l, n).take(n).enumerate().fold(S::ONE, |bound, (i, &reciprocal)| {
        let weight = if i == 0 { S::ONE / trace } else { scale };
        bound * (weight / (reciprocal * reciprocal))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use nalgebra::{DMatrix, DVector};

    #[test]
    fn rows_at_a_time_have_the_bits_of_each_by_itself() {
        for (n, count) in [(1, 4), (7, 3), (13, 9), (20, 8)] {
            let mut l: Vec<f64> = matrix(n, n as u64).iter().copied().collect();
            factor(&mut l, n).unwrap();
            let mut together: Vec<f64> =
                crate::linear::test_matrix(count, n, 7).iter().copied().collect();
            let mut alone = together.clone();
            forward_rows(&l, &mut together, n);
            alone.chunks_exact_mut(n).for_each(|row| forward(&l, row));
            assert_eq!(together, alone);
        }
    }

    /// A random-looking positive definite matrix.
    fn matrix(n: usize, seed: u64) -> DMatrix<f64> {
        let a = crate::linear::test_matrix(n, n, seed);
        &a * a.transpose() + DMatrix::identity(n, n) * 0.1
    }

    #[test]
    fn solves_as_nalgebra_does_and_bounds_the_condition() {
        for n in 1..9 {
            let a = matrix(n, n as u64);
            let mut l: Vec<f64> = a.iter().copied().collect();
            factor(&mut l, n).unwrap();
            let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let mut x = b.clone();
            forward(&l, &mut x);
            backward(&l, &mut x);
            let residual = &a * DVector::from_vec(x) - DVector::from_vec(b);
            assert!(residual.amax() < 1e-12, "n = {n}: {}", residual.amax());

            let values = a.clone().symmetric_eigenvalues();
            let bound = conditioning(&l, n, a.trace());
            assert!(bound > 0.0 && bound <= values.min() / values.max() * (1.0 + 1e-12));
        }
    }

    #[test]
    fn names_the_pivot_that_is_not_positive() {
        let cases = [
            ([1.0, 0.0, 0.0, -1.0], 1),
            ([1.0, 1.0, 1.0, 1.0], 1),
            ([f64::NAN, 0.0, 0.0, 1.0], 0),
            ([f64::INFINITY, 0.0, 0.0, 1.0], 0),
            ([0.0, 0.0, 0.0, 1.0], 0),
        ];
        for (mut a, index) in cases {
            assert_eq!(factor(&mut a, 2), Err(index));
        }
    }
}
