//! Pseudo-inverse of a small dense matrix by the one-sided Jacobi method.
//!
//! Rotations from the left make the rows of A orthogonal, `B = Q A`, and turn the right-hand side
//! with them, `c = Q b`. The lengths of the rows of B are the singular values, so that
//!
//! ```text
//! A^+ b = sum_i B_i c_i / |B_i|^2          A^T (A A^T)^+ = A^+
//! ```
//!
//! needs neither factor of the singular value decomposition. More rows than columns are first
//! reduced by Householder reflections, so that rotations always work along the smaller dimension.
//! After M. R. Hestenes, "Inversion of matrices by biorthogonalization", 1958; Golub and
//! Van Loan, "Matrix Computations", 8.6.3.

use super::{add_scaled, dot};
use crate::Scalar;

/// Sweeps over all pairs; convergence is quadratic and takes about six.
const SWEEPS: usize = 40;

/// What [`combine`] does to the singular values s.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Spectrum<S> {
    /// Rows with s^2 below this share of the largest s^2 are dropped.
    pub cut: S,
    /// mu in s / (s^2 + mu), as a share of the largest s^2: 0 for the pseudo-inverse.
    pub damping: S,
}

/// Makes the rows of `a` (m x n) orthogonal and turns the rows of `b` (m x any) with them. Returns
/// the number of rows that remain, at most min(m, n); what `a` and `b` hold beyond is meaningless.
pub(crate) fn orthogonalise<S: Scalar>(a: &mut [S], b: &mut [S], m: usize, n: usize) -> usize {
    let k = if m > n { reduce(a, b, m, n) } else { m };
    if k > 0 {
        let width = b.len() / m;
        rotate(&mut a[..k * n], &mut b[..k * width], k, n);
    }
    k
}

/// Householder reflections of `a` (m x n) and with it of `b` (m x any) to the row echelon form:
/// returns the number of rows that remain, at most min(m, n). Others are shorter than rounding.
pub(crate) fn reduce<S: Scalar>(a: &mut [S], b: &mut [S], m: usize, n: usize) -> usize {
    let negligible = negligible(a);
    let width = b.len() / m.max(1);
    let mut done = 0;
    for j in 0..n {
        let (a, b) = (&mut a[done * n..], &mut b[done * width..]);
        let square = a.chunks_exact(n).fold(S::ZERO, |sum, row| sum + row[j] * row[j]);
        // Written so that what is not finite is kept and seen.
        if square < negligible || square == S::ZERO {
            continue;
        }
        let (head, length) = (a[j], square.sqrt());
        let alpha = if head > S::ZERO { -length } else { length };
        // v = column - alpha e_j, kept in the column; H = 1 - v v^T / (alpha (alpha - head)).
        a[j] = head - alpha;
        let scale = S::ONE / (alpha * (alpha - head));
        for column in j + 1..n {
            let rows = a.chunks_exact(n);
            let factor = scale * rows.fold(S::ZERO, |sum, row| sum + row[j] * row[column]);
            for row in a.chunks_exact_mut(n) {
                row[column] -= factor * row[j];
            }
        }
        for column in 0..width {
            let rows = a.chunks_exact(n).zip(b.chunks_exact(width));
            let factor = scale * rows.fold(S::ZERO, |sum, (row, b)| sum + row[j] * b[column]);
            for (row, b) in a.chunks_exact(n).zip(b.chunks_exact_mut(width)) {
                b[column] -= factor * row[j];
            }
        }
        a[..j].fill(S::ZERO);
        a[j] = alpha;
        done += 1;
        if done == m {
            break;
        }
    }
    done
}

/// The square of a length that is rounding beside the entries of `a`.
fn negligible<S: Scalar>(a: &[S]) -> S {
    S::from_f64(64.0) * S::EPSILON * S::EPSILON * dot(a, a)
}

/// Plane rotations of pairs of rows until all are orthogonal to rounding.
fn rotate<S: Scalar>(a: &mut [S], b: &mut [S], k: usize, n: usize) {
    let width = b.len() / k;
    let threshold = S::from_f64(16.0) * S::EPSILON * S::EPSILON;
    // Turning a row this short any further changes no other row.
    let negligible = negligible(a);
    for _ in 0..SWEEPS {
        let mut done = true;
        for p in 0..k {
            for q in p + 1..k {
                let (first, second) = two_rows(a, p, q, n);
                let product = dot(first, second);
                if product == S::ZERO {
                    continue;
                }
                let (alpha, beta) = (dot(first, first), dot(second, second));
                // Written so that NaN counts as done.
                if !(product * product > threshold * alpha * beta)
                    || !(alpha.min(beta) > negligible)
                {
                    continue;
                }
                done = false;
                let zeta = (beta - alpha) / (product + product);
                let root = zeta.abs() + (S::ONE + zeta * zeta).sqrt();
                let tangent = if zeta < S::ZERO { -S::ONE / root } else { S::ONE / root };
                let cosine = S::ONE / (S::ONE + tangent * tangent).sqrt();
                let sine = cosine * tangent;
                turn(first, second, cosine, sine);
                let (first, second) = two_rows(b, p, q, width);
                turn(first, second, cosine, sine);
            }
        }
        if done {
            break;
        }
    }
}

/// Rows p < q of a matrix of n columns.
#[inline]
fn two_rows<S>(a: &mut [S], p: usize, q: usize, n: usize) -> (&mut [S], &mut [S]) {
    let (left, right) = a.split_at_mut(q * n);
    (&mut left[p * n..(p + 1) * n], &mut right[..n])
}

fn turn<S: Scalar>(first: &mut [S], second: &mut [S], cosine: S, sine: S) {
    for (x, y) in first.iter_mut().zip(second) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}

/// `x = A^+ b` from what [`orthogonalise`] left, and the rank it kept. With `power` 2 the terms
/// are divided by |B_i|^2 once more, which gives z with (A A^T)^+ b = A z.
pub(crate) fn combine<S: Scalar>(
    rows: &[S],
    b: &[S],
    spectrum: Spectrum<S>,
    power: u32,
    x: &mut [S],
) -> usize {
    let n = x.len();
    x.fill(S::ZERO);
    let row = |i: usize| &rows[i * n..(i + 1) * n];
    let largest = (0..b.len()).fold(S::ZERO, |most, i| most.max(dot(row(i), row(i))));
    let (cut, damping) = (spectrum.cut * largest, spectrum.damping * largest);
    let mut rank = 0;
    for (i, &value) in b.iter().enumerate() {
        let square = dot(row(i), row(i));
        // Written so that NaN is kept and seen.
        if !(square <= cut) {
            rank += 1;
            let factor = (0..power).fold(value, |factor, _| factor / (square + damping));
            add_scaled(x, factor, row(i));
        }
    }
    rank
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;
    use nalgebra::{DMatrix, DVector};

    const PLAIN: Spectrum<f64> = Spectrum { cut: 1e-7, damping: 0.0 };

    /// Compares `A^+ b` and `(A A^T)^+ b` for A = U diag(values) V^T, m x n, with U and V from
    /// nalgebra's QR, so that A^+ = V diag(1 / values) U^T with values below the cut left out.
    /// (Its own singular value decomposition errs by 1e-6 for some matrices of deficient rank.)
    fn check(m: usize, n: usize, values: &[f64], rank: usize) {
        let k = values.len();
        let u = test_matrix(m, k, (m * 100 + n * 10 + k) as u64).qr().q();
        let v = test_matrix(n, k, (m * 10 + n + k * 1000) as u64).qr().q();
        let a = &u * DMatrix::from_diagonal(&DVector::from_column_slice(values)) * v.transpose();
        let kept = |i: usize, _| if i < rank { 1.0 / values[i] } else { 0.0 };
        let inverse = v * DMatrix::from_diagonal(&DVector::from_fn(k, kept)) * u.transpose();

        let b = DVector::from_fn(m, |i, _| (1.0 + i as f64).sin());
        let mut rows: Vec<f64> = a.transpose().iter().copied().collect();
        let mut turned: Vec<f64> = b.iter().copied().collect();
        let remaining = orthogonalise(&mut rows, &mut turned, m, n);
        let mut x = vec![0.0; n];
        assert_eq!(combine(&rows, &turned[..remaining], PLAIN, 1, &mut x), rank, "{m} x {n}");
        let expected = &inverse * &b;
        let error = (DVector::from_vec(x.clone()) - &expected).amax();
        assert!(error <= 1e-12 * expected.amax(), "{m} x {n}: {error:e}");

        combine(&rows, &turned[..remaining], PLAIN, 2, &mut x);
        let multipliers = a * DVector::from_vec(x);
        let expected = inverse.transpose() * expected;
        let error = (multipliers - &expected).amax();
        assert!(error <= 1e-9 * expected.amax(), "{m} x {n}: {error:e}");
    }

    #[test]
    fn agrees_with_the_closed_form_for_every_shape_and_rank() {
        for m in 1..12 {
            for n in 1..8 {
                for rank in 1..=m.min(n) {
                    let values: Vec<f64> = (0..rank).map(|i| 0.4_f64.powi(i as i32)).collect();
                    check(m, n, &values, rank);
                }
            }
        }
        check(5, 4, &[2.0, 2.0, 2.0], 3);
    }

    #[test]
    fn keeps_small_values_above_the_cut_and_drops_those_below() {
        for (small, rank) in [(1e-3, 3), (1e-4, 2), (1e-9, 2)] {
            check(3, 3, &[1.0, 0.3, small], rank);
            check(9, 6, &[1.0, 0.3, small], rank);
        }
    }

    #[test]
    fn a_zero_matrix_has_rank_zero_and_solution_zero() {
        let (mut a, mut b, mut x, b_len) = ([0.0_f64; 12], [1.0; 4], [5.0; 3], 4);
        let k = orthogonalise(&mut a, &mut b, b_len, 3);
        assert_eq!(combine(&a, &b[..k], PLAIN, 1, &mut x), 0);
        assert_eq!(x, [0.0; 3]);
    }

    #[test]
    fn not_a_number_ends_and_stays_visible() {
        let (mut a, mut b, mut x, b_len) = ([f64::NAN; 6], [1.0; 2], [0.0; 3], 2);
        let k = orthogonalise(&mut a, &mut b, b_len, 3);
        combine(&a, &b[..k], PLAIN, 1, &mut x);
        assert!(x.iter().all(|x| x.is_nan()));
    }
}
