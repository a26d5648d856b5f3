//! Independent rows of a matrix whose rank is clear, without singular values.
//!
//! Householder reflections from the left, each of the longest column that is left, and then orthogonal rows from
//! the first to the last:
//!
//! ```text
//! A P = Q R,    R P^T = L Z
//! ```
//!
//! The diagonal of L follows the singular values of A, mostly within a small factor (G. W. Stewart, "The QLP approximation
//! to the singular value decomposition", 1999), and costs as much as one sweep of Jacobi's method. Where no value is near
//! the cut between those that count and those that do not, the decision on the rank is the same.

use super::{Kept, add_scaled, dot, exchange, rows_of_mut};
use crate::constants::{CLEAR_FACTOR, NEGLIGIBLE_EPSILONS, ORTHOGONAL_PASSES, PARTS_OF_SUM};
use crate::{Error, Scalar};

/// Columns that are changed at a time: their sums stay in registers.
const BLOCK: usize = 16;

/// Orthogonal rows that span those of `a` (m x n), in its place, and the rows of `b` (m x any but 0) that belong to
/// them. The lengths of the rows follow the singular values.
///
/// Returns `None` where a value lies so near to `cut` times the largest that singular values have to decide. Then `a`
/// and `b` are only reflected, and have the singular values that they had.
pub(crate) fn clearly_independent<S: Scalar>(
    a: &mut [S],
    b: &mut [S],
    [m, n]: [usize; 2],
    cut: S,
) -> Result<Option<Kept<S>>, Error> {
    let clear = S::from_f64(CLEAR_FACTOR);
    let Reduced { rank, first, next } = reduce_longest(a, b, [m, n], cut * clear)?;
    // Written so that NaN is not clear.
    if rank == 0 || !(next * clear <= cut * first) {
        return Ok(None);
    }
    let width = b.len() / m.max(1);
    let (a, b) = (rows_of_mut(a, n, 0..rank)?, rows_of_mut(b, width, 0..rank)?);
    take_out(a, b, n);
    let lengths = a.chunks_exact(n.max(1)).map(|row| dot(row, row).sqrt());
    let largest = lengths.clone().fold(S::ZERO, |most, length| most.max(length));
    let least = lengths.fold(largest, |least, length| least.min(length));
    Ok(Some(Kept { rank, least: least / largest, dropped: next / first }))
}

/// Of each group of `a` (m x n) of so many rows, moves those to the front that are independent within it, and the rows of
/// `b` (m x any) with them: their number. What of the others remains is no longer than `least` times the longest column
/// of the group.
pub(crate) fn reduce_groups<S: Scalar>(
    a: &mut [S],
    b: &mut [S],
    [m, n]: [usize; 2],
    group: usize,
    least: S,
) -> Result<usize, Error> {
    let width = b.len() / m.max(1);
    let mut kept = 0;
    for start in (0..m).step_by(group.max(1)) {
        let end = m.min(start + group);
        let (rows, rhs) = (rows_of_mut(a, n, start..end)?, rows_of_mut(b, width, start..end)?);
        let rank = reduce_longest(rows, rhs, [end - start, n], least)?.rank;
        for i in start..start + rank {
            exchange(a, n, i, kept)?;
            exchange(b, width, i, kept)?;
            kept += 1;
        }
    }
    Ok(kept)
}

/// Makes independent rows of `a` (of n columns) orthogonal, from the first to the last, and turns those of `b` (of any
/// number of columns but 0) with them.
pub(crate) fn orthogonalise_independent<S: Scalar>(a: &mut [S], b: &mut [S], n: usize) {
    for _ in 0..ORTHOGONAL_PASSES {
        take_out(a, b, n);
    }
}

/// Takes of each row of `a` (of n columns) what lies along those before it, and of `b` with them (modified Gram-Schmidt).
fn take_out<S: Scalar>(a: &mut [S], b: &mut [S], n: usize) {
    let width = b.len() / (a.len() / n.max(1)).max(1);
    let (mut rest, mut rest_b) = (a, b);
    while let (Some((row, later)), Some((row_b, later_b))) =
        (rest.split_at_mut_checked(n.max(1)), rest_b.split_at_mut_checked(width.max(1)))
    {
        let scale = -S::ONE / dot_in_parts(row, row);
        let others = later.chunks_exact_mut(n.max(1)).zip(later_b.chunks_exact_mut(width.max(1)));
        for (other, other_b) in others {
            let share = scale * dot_in_parts(other, row);
            add_scaled(other, share, row);
            add_scaled(other_b, share, row_b);
        }
        (rest, rest_b) = (later, later_b);
    }
}

/// a . b by several sums side by side, which do not wait for each other.
fn dot_in_parts<S: Scalar>(a: &[S], b: &[S]) -> S {
    let mut sums = [S::ZERO; PARTS_OF_SUM];
    let (a, b) = (a.chunks_exact(PARTS_OF_SUM), b.chunks_exact(PARTS_OF_SUM));
    let rest = dot(a.remainder(), b.remainder());
    for (a, b) in a.zip(b) {
        for (sum, (&a, &b)) in sums.iter_mut().zip(a.iter().zip(b)) {
            *sum += a * b;
        }
    }
    let mut half = PARTS_OF_SUM / 2;
    while half > 0 {
        for k in 0..half {
            let other = sums[k + half];
            sums[k] += other;
        }
        half /= 2;
    }
    rest + sums[0]
}

/// Result of [`reduce_longest`].
struct Reduced<S> {
    /// Rows that are left.
    rank: usize,
    /// Length of the first column that was reflected.
    first: S,
    /// Length of the longest column of what remains of the other rows.
    next: S,
}

/// Householder reflections of `a` (m x n), and with it of `b` (m x any), each of the longest column of the rows that are
/// left, until that is no longer than `least` times the first, or rounding.
fn reduce_longest<S: Scalar>(
    a: &mut [S],
    b: &mut [S],
    [m, n]: [usize; 2],
    least: S,
) -> Result<Reduced<S>, Error> {
    let width = b.len() / m.max(1);
    let rounding = S::from_f64(NEGLIGIBLE_EPSILONS) * S::EPSILON * dot(a, a).sqrt();
    let mut longest = Longest::of(a, n);
    let first = longest.length();
    for done in 0..m.min(n) {
        let (j, length) = (longest.column, longest.length());
        // Written so that NaN ends it.
        if !(length > least * first && length > rounding) {
            return Ok(Reduced { rank: done, first, next: length });
        }
        let (a, b) = (rows_of_mut(a, n, done..m)?, rows_of_mut(b, width, done..m)?);
        let given = a.len();
        let head = a.get_mut(j).ok_or(Error::Length { expected: n, given })?;
        let alpha = if *head > S::ZERO { -length } else { length };
        // v = column - alpha e_1, kept in the column; H = 1 - v v^T / (alpha (alpha - head)).
        let scale = S::ONE / (alpha * (alpha - *head));
        *head -= alpha;
        longest = reflect_others(a, n, j, scale);
        reflect(b, width, column(a, n, j), scale);
        for row in a.chunks_exact_mut(n.max(1)) {
            row.get_mut(j).into_iter().for_each(|entry| *entry = S::ZERO);
        }
        a.get_mut(j).into_iter().for_each(|head| *head = alpha);
    }
    Ok(Reduced { rank: m.min(n), first, next: S::ZERO })
}

/// Column j of n.
fn column<S>(a: &[S], n: usize, j: usize) -> impl Iterator<Item = &S> + Clone {
    a.chunks_exact(n.max(1)).filter_map(move |row| row.get(j))
}

/// The longest column so far.
struct Longest<S> {
    column: usize,
    square: S,
}

impl<S: Scalar> Longest<S> {
    const NONE: Self = Self { column: 0, square: S::ZERO };

    /// Of the n columns of `a`.
    fn of(a: &[S], n: usize) -> Self {
        let mut longest = Self::NONE;
        for start in (0..n).step_by(BLOCK) {
            let mut squares = [S::ZERO; BLOCK];
            for row in a.chunks_exact(n.max(1)) {
                for (square, &x) in squares.iter_mut().zip(row.get(start..).unwrap_or_default()) {
                    *square += x * x;
                }
            }
            longest.compare(start, &squares);
        }
        longest
    }

    /// With columns from `start` on.
    fn compare(&mut self, start: usize, squares: &[S]) {
        for (column, &square) in (start..).zip(squares) {
            // Written so that NaN is the longest.
            if !(square <= self.square) {
                *self = Self { column, square };
            }
        }
    }

    fn length(&self) -> S {
        self.square.sqrt()
    }
}

/// Reflects all of n columns but j, in which the vector of the reflection is; the longest of these without the first row.
fn reflect_others<S: Scalar>(a: &mut [S], n: usize, j: usize, scale: S) -> Longest<S> {
    let (mut start, mut longest) = (0, Longest::NONE);
    while start < n {
        start += match n - start {
            BLOCK.. => reflect_block::<S, BLOCK>(a, n, [j, start], scale, &mut longest),
            4.. => reflect_block::<S, 4>(a, n, [j, start], scale, &mut longest),
            _ => reflect_block::<S, 1>(a, n, [j, start], scale, &mut longest),
        };
    }
    longest
}

/// As [`reflect_others`], W columns from `start` on; returns W.
fn reflect_block<S: Scalar, const W: usize>(
    a: &mut [S],
    n: usize,
    [j, start]: [usize; 2],
    scale: S,
    longest: &mut Longest<S>,
) -> usize {
    let mut sums = [S::ZERO; W];
    for row in a.chunks_exact(n.max(1)) {
        let block = row.get(start..).and_then(<[S]>::first_chunk::<W>);
        if let (Some(&v), Some(block)) = (row.get(j), block)
            && v != S::ZERO
        {
            let v = scale * v;
            for (sum, &x) in sums.iter_mut().zip(block) {
                *sum += v * x;
            }
        }
    }
    let own = j.checked_sub(start);
    if let Some(sum) = own.and_then(|own| sums.get_mut(own)) {
        *sum = S::ZERO;
    }
    let mut squares = [S::ZERO; W];
    for (i, row) in a.chunks_exact_mut(n.max(1)).enumerate() {
        let v = row.get(j).copied().unwrap_or(S::ZERO);
        let Some(block) = row.get_mut(start..).and_then(<[S]>::first_chunk_mut::<W>) else {
            continue;
        };
        for (x, &sum) in block.iter_mut().zip(&sums) {
            *x -= v * sum;
        }
        if i > 0 {
            for (square, &x) in squares.iter_mut().zip(&*block) {
                *square += x * x;
            }
        }
    }
    if let Some(square) = own.and_then(|own| squares.get_mut(own)) {
        *square = S::ZERO;
    }
    longest.compare(start, &squares);
    W
}

/// Reflects the columns of `b` by the vector with these entries.
fn reflect<'a, S: Scalar>(
    b: &mut [S],
    width: usize,
    vector: impl Iterator<Item = &'a S> + Clone,
    scale: S,
) {
    for start in (0..width).step_by(BLOCK) {
        let mut sums = [S::ZERO; BLOCK];
        for (row, &v) in b.chunks_exact(width.max(1)).zip(vector.clone()) {
            for (sum, &x) in sums.iter_mut().zip(row.get(start..).unwrap_or_default()) {
                *sum += scale * v * x;
            }
        }
        for (row, &v) in b.chunks_exact_mut(width.max(1)).zip(vector.clone()) {
            for (x, &sum) in row.get_mut(start..).unwrap_or_default().iter_mut().zip(&sums) {
                *x -= v * sum;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{normalise, test_matrix};
    use nalgebra::{DMatrix, DVector};

    /// Rows of an m x n matrix with these singular values, which b = A x has too.
    fn matrix(m: usize, n: usize, values: &[f64]) -> DMatrix<f64> {
        let k = values.len();
        let u = test_matrix(m, k, (m * 100 + n * 10 + k) as u64).qr().q();
        let v = test_matrix(n, k, (m * 10 + n + k * 1000) as u64).qr().q();
        u * DMatrix::from_diagonal(&DVector::from_column_slice(values)) * v.transpose()
    }

    fn row_major(matrix: &DMatrix<f64>) -> Vec<f64> {
        matrix.transpose().iter().copied().collect()
    }

    /// Checks that orthogonal rows span those of the matrix, and that the right-hand sides go with them.
    fn check(m: usize, n: usize, values: &[f64], rank: usize) {
        let a = matrix(m, n, values);
        let x = DMatrix::from_fn(n, 2, |i, k| (1.0 + i as f64 + 3.0 * k as f64).sin());
        let (mut rows, mut rhs) = (row_major(&a), row_major(&(&a * &x)));
        let found = clearly_independent(&mut rows, &mut rhs, [m, n], 1e-6).unwrap();
        let kept = found.expect("a clear rank");
        assert_eq!(kept.rank, rank, "{m} x {n}");
        normalise(&mut rows[..rank * n], &mut rhs[..rank * 2], n);
        let z = DMatrix::from_row_slice(rank, n, &rows[..rank * n]);
        let error = (&z * z.transpose() - DMatrix::identity(rank, rank)).amax();
        assert!(error <= 1e-14, "{m} x {n}: {error:e}");
        // What the rows leave of A is what was dropped.
        let dropped = values.get(rank).copied().unwrap_or(0.0);
        let rest = (&a - &a * z.transpose() * &z).amax();
        assert!(rest <= 1e-14 + 4.0 * dropped, "{m} x {n}: {rest:e}");
        let least = values[rank - 1] / values[0];
        let rhs = DMatrix::from_row_slice(rank, 2, &rhs[..rank * 2]);
        let error = (&z * x - rhs).amax();
        assert!(error <= (1e-14 + 4.0 * dropped) / least, "{m} x {n}: {error:e}");
        assert!((kept.least / least).ln().abs() < 3.0_f64.ln(), "{} for {least}", kept.least);
    }

    #[test]
    fn rows_of_every_shape_and_rank_are_spanned() {
        for m in 1..12 {
            for n in 1..20 {
                for rank in 1..=m.min(n) {
                    let values: Vec<f64> = (0..rank).map(|i| 0.5_f64.powi(i as i32)).collect();
                    check(m, n, &values, rank);
                }
            }
        }
        check(40, 30, &[3.0; 25], 25);
    }

    #[test]
    fn small_values_count_on_their_side_of_the_cut() {
        for (small, rank) in [(1e-3, 3), (1e-9, 2), (1e-15, 2)] {
            check(3, 3, &[1.0, 0.3, small], rank);
            check(9, 6, &[1.0, 0.3, small], rank);
        }
    }

    /// Next to the cut, and of matrices without a rank, nothing is decided, and the singular values are kept.
    #[test]
    fn doubtful_values_are_left_to_others() {
        for small in [2e-5, 1e-6, 5e-8] {
            let a = matrix(5, 4, &[1.0, 0.3, small]);
            let (mut rows, mut rhs) = (row_major(&a), vec![0.0; 5]);
            assert!(clearly_independent(&mut rows, &mut rhs, [5, 4], 1e-6).unwrap().is_none());
            let left = DMatrix::from_row_slice(5, 4, &rows);
            assert!((left.transpose() * &left - a.transpose() * &a).amax() < 1e-15);
        }
        for value in [0.0, f64::NAN] {
            let (mut rows, mut rhs) = ([value; 6], [1.0; 2]);
            assert!(clearly_independent(&mut rows, &mut rhs, [2, 3], 1e-6).unwrap().is_none());
        }
    }

    /// Groups of nine rows that are mixtures of three each, and a last group of two rows: x solves what is left as it does
    /// all.
    #[test]
    fn groups_keep_their_independent_rows() {
        let (n, groups) = (20, 5);
        let base = test_matrix(3 * groups + 2, n, 5);
        let mut mixed = DMatrix::zeros(9 * groups + 2, n);
        for group in 0..groups {
            let rows = test_matrix(9, 3, group as u64) * base.rows(3 * group, 3);
            mixed.rows_mut(9 * group, 9).copy_from(&rows);
        }
        mixed.rows_mut(9 * groups, 2).copy_from(&base.rows(3 * groups, 2));
        let x = DVector::from_fn(n, |i, _| (1.0 + i as f64).sin());
        let mut rows: Vec<f64> = mixed.transpose().iter().copied().collect();
        let mut rhs: Vec<f64> = (&mixed * &x).iter().copied().collect();
        let kept = reduce_groups(&mut rows, &mut rhs, [9 * groups + 2, n], 9, 1e-8).unwrap();
        assert_eq!(kept, 3 * groups + 2);
        let left = DMatrix::from_row_slice(kept, n, &rows[..kept * n]);
        let error = (&left * &x - DVector::from_column_slice(&rhs[..kept])).amax();
        assert!(error <= 1e-13, "{error:e}");
        // Reflections keep the squares of all entries.
        assert!((left.norm() / mixed.norm() - 1.0).abs() <= 1e-13);
    }
}
