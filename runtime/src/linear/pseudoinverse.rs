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
//! Rows of very different lengths keep their digits (J. Demmel, K. Veselic, "Jacobi's method is more
//! accurate than QR", 1992): next to a singular state the row that fades is as exact as the others.
//! After M. R. Hestenes, "Inversion of matrices by biorthogonalization", 1958; Golub and
//! Van Loan, "Matrix Computations", 8.6.3.

use super::{add_scaled, dot, rows_of, rows_of_mut};
use crate::constants::{JACOBI_SWEEPS, NEGLIGIBLE_EPSILONS, ORTHOGONAL_EPSILONS};
use crate::workspace::split;
use crate::{Error, Scalar};

/// Makes the rows of `a` (m x n) orthogonal and turns the rows of `b` (m x any but 0) with them. Returns
/// the number of rows that remain, at most min(m, n); what `a` and `b` hold beyond is meaningless.
pub(crate) fn orthogonalise<S: Scalar>(
    a: &mut [S],
    b: &mut [S],
    m: usize,
    n: usize,
) -> Result<usize, Error> {
    let k = if m > n { reduce(a, b, m, n)? } else { m };
    let width = b.len() / m.max(1);
    rotate(rows_of_mut(a, n, 0..k)?, rows_of_mut(b, width, 0..k)?, n, width);
    Ok(k)
}

/// Householder reflections of `a` (m x n) and with it of `b` (m x any) to the row echelon form:
/// returns the number of rows that remain, at most min(m, n). Others are shorter than rounding.
pub(crate) fn reduce<S: Scalar>(
    a: &mut [S],
    b: &mut [S],
    m: usize,
    n: usize,
) -> Result<usize, Error> {
    let negligible = negligible(a);
    let width = b.len() / m.max(1);
    let mut done = 0;
    for j in 0..n {
        let (a, b) = (rows_of_mut(a, n, done..m)?, rows_of_mut(b, width, done..m)?);
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
    Ok(done)
}

/// The square of a length that is rounding beside the entries of `a`.
fn negligible<S: Scalar>(a: &[S]) -> S {
    let share = S::from_f64(NEGLIGIBLE_EPSILONS) * S::EPSILON;
    share * share * dot(a, a)
}

/// Plane rotations of pairs of rows until all are orthogonal to rounding.
fn rotate<S: Scalar>(a: &mut [S], b: &mut [S], n: usize, width: usize) {
    let cosine = S::from_f64(ORTHOGONAL_EPSILONS) * S::EPSILON;
    let threshold = cosine * cosine;
    // Turning a row this short any further changes no other row.
    let negligible = negligible(a);
    for _ in 0..JACOBI_SWEEPS {
        if !sweep(a, b, [n, width], threshold, negligible) {
            break;
        }
    }
}

/// Rotates every pair of rows once; returns whether any was not orthogonal.
fn sweep<S: Scalar>(
    mut a: &mut [S],
    mut b: &mut [S],
    [n, width]: [usize; 2],
    threshold: S,
    negligible: S,
) -> bool {
    let mut turned = false;
    while let (Some((first, later)), Some((first_b, later_b))) =
        (a.split_at_mut_checked(n.max(1)), b.split_at_mut_checked(width.max(1)))
    {
        let pairs = later.chunks_exact_mut(n.max(1)).zip(later_b.chunks_exact_mut(width.max(1)));
        for (second, second_b) in pairs {
            let product = dot(first, second);
            if product == S::ZERO {
                continue;
            }
            let (alpha, beta) = (dot(first, first), dot(second, second));
            // Written so that NaN counts as done.
            if !(product * product > threshold * alpha * beta) || !(alpha.min(beta) > negligible) {
                continue;
            }
            turned = true;
            let zeta = (beta - alpha) / (product + product);
            let root = zeta.abs() + (S::ONE + zeta * zeta).sqrt();
            let tangent = if zeta < S::ZERO { -S::ONE / root } else { S::ONE / root };
            let cosine = S::ONE / (S::ONE + tangent * tangent).sqrt();
            let sine = cosine * tangent;
            turn(first, second, cosine, sine);
            turn(first_b, second_b, cosine, sine);
        }
        (a, b) = (later, later_b);
    }
    turned
}

fn turn<S: Scalar>(first: &mut [S], second: &mut [S], cosine: S, sine: S) {
    for (x, y) in first.iter_mut().zip(second) {
        (*x, *y) = (cosine * *x - sine * *y, sine * *x + cosine * *y);
    }
}

/// Result of [`keep`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Kept<S> {
    /// Rows that remain.
    pub rank: usize,
    /// The smallest singular value kept, as a share of the largest; 1 without rows.
    pub least: S,
    /// The largest singular value dropped, as a share of the largest; 0 if none is.
    pub dropped: S,
}

/// Of the orthogonal rows of `a` (m x n), moves those to the front whose singular value is more than
/// `cut` times the largest, and the rows of `b` (m x any) with them.
pub(crate) fn keep<S: Scalar>(
    a: &mut [S],
    b: &mut [S],
    m: usize,
    n: usize,
    cut: S,
) -> Result<Kept<S>, Error> {
    let width = b.len() / m.max(1);
    let length = |row: &[S]| dot(row, row).sqrt();
    let all = a.chunks_exact(n.max(1)).take(m);
    let largest = all.fold(S::ZERO, |most, row| most.max(length(row)));
    let mut kept = Kept { rank: 0, least: S::ONE, dropped: S::ZERO };
    for i in 0..m {
        let value = length(rows_of(a, n, i..i + 1)?);
        // Written so that NaN is kept and seen.
        if value <= cut * largest {
            if value > S::ZERO {
                kept.dropped = kept.dropped.max(value / largest);
            }
            continue;
        }
        kept.least = kept.least.min(value / largest);
        exchange(a, n, i, kept.rank)?;
        exchange(b, width, i, kept.rank)?;
        kept.rank += 1;
    }
    Ok(kept)
}

/// Exchanges row `i` of a matrix of n columns with a row `k` that is not after it. (Slices' own moves would bring
/// a function of a library that is larger than all of these.)
pub(crate) fn exchange<S: Copy>(
    mut matrix: &mut [S],
    n: usize,
    i: usize,
    k: usize,
) -> Result<(), Error> {
    let before = split(&mut matrix, i * n)?;
    let from = split(&mut matrix, n)?;
    if k < i {
        for (x, y) in rows_of_mut(before, n, k..k + 1)?.iter_mut().zip(from) {
            core::mem::swap(x, y);
        }
    }
    Ok(())
}

/// Divides the rows of `a` (of n columns), and those of `b` with them, by the lengths of the rows of `a`.
pub(crate) fn normalise<S: Scalar>(a: &mut [S], b: &mut [S], n: usize) {
    let width = b.len() / (a.len() / n.max(1)).max(1);
    for (a, b) in a.chunks_exact_mut(n.max(1)).zip(b.chunks_exact_mut(width.max(1))) {
        let scale = S::ONE / dot(a, a).sqrt();
        for value in a.iter_mut().chain(b) {
            *value *= scale;
        }
    }
}

/// `x = A^+ b` from the orthogonal rows that [`keep`] selected.
pub(crate) fn combine<S: Scalar>(rows: &[S], b: &[S], x: &mut [S]) {
    let n = x.len();
    x.fill(S::ZERO);
    for (row, &value) in rows.chunks_exact(n.max(1)).zip(b) {
        add_scaled(x, value / dot(row, row), row);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;
    use nalgebra::{DMatrix, DVector};

    /// The pseudo-inverse of a matrix (m x n) times b, and the rank: singular values up to `cut`
    /// times the largest are dropped.
    fn pseudo_inverse(
        a: &mut [f64],
        b: &mut [f64],
        m: usize,
        n: usize,
        cut: f64,
    ) -> (Vec<f64>, usize) {
        let k = orthogonalise(a, b, m, n).unwrap();
        let Kept { rank, .. } = keep(&mut a[..k * n], &mut b[..k], k, n, cut).unwrap();
        let mut x = vec![0.0; n];
        normalise(&mut a[..rank * n], &mut b[..rank], n);
        combine(&a[..rank * n], &b[..rank], &mut x);
        (x, rank)
    }

    /// Compares `A^+ b` for A = U diag(values) V^T, m x n, with U and V from nalgebra's QR, so that
    /// A^+ = V diag(1 / values) U^T with values below the cut left out.
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
        let (x, found) = pseudo_inverse(&mut rows, &mut turned, m, n, 3e-4);
        assert_eq!(found, rank, "{m} x {n}");
        let expected = &inverse * &b;
        let error = (DVector::from_vec(x) - &expected).amax();
        assert!(error <= 1e-12 * expected.amax(), "{m} x {n}: {error:e}");
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

    /// A row that fades is known to as many digits as its entries are, however short it is.
    #[test]
    fn a_short_row_keeps_its_digits() {
        for scale in [1e-3, 1e-6, 1e-9, 1e-12] {
            let mut rows = [1.0, 2.0, 0.5, 0.3 * scale, -0.7 * scale, 0.1 * scale];
            let mut b = [1.0, 2.0 * scale];
            let (x, rank) = pseudo_inverse(&mut rows, &mut b, 2, 3, 1e-14);
            // The same with the row at full length, by nalgebra.
            let a = DMatrix::from_row_slice(2, 3, &[1.0, 2.0, 0.5, 0.3, -0.7, 0.1]);
            let gram = (&a * a.transpose()).cholesky().unwrap();
            let expected = a.transpose() * gram.solve(&DVector::from_vec(vec![1.0, 2.0]));
            assert_eq!(rank, 2);
            let error = (DVector::from_vec(x) - &expected).amax();
            assert!(error <= 1e-14 * expected.amax(), "scale {scale:e}: {error:e}");
        }
    }

    #[test]
    fn a_zero_matrix_has_rank_zero_and_solution_zero() {
        let (mut a, mut b) = ([0.0_f64; 12], [1.0; 4]);
        let (x, rank) = pseudo_inverse(&mut a, &mut b, 4, 3, 1e-7);
        assert_eq!((x.as_slice(), rank), (&[0.0; 3][..], 0));
    }

    #[test]
    fn not_a_number_ends_and_stays_visible() {
        let (mut a, mut b) = ([f64::NAN; 6], [1.0; 2]);
        let (x, _) = pseudo_inverse(&mut a, &mut b, 2, 3, 1e-7);
        assert!(x.iter().all(|x| x.is_nan()));
    }
}
