//! Householder reflections from the left, each of the longest column that is left.

use super::{dot, rows_of_mut};
use crate::constants::NEGLIGIBLE_EPSILONS;
use crate::{Error, Scalar};

/// Columns that are changed at a time: their sums stay in registers.
const BLOCK: usize = 16;

/// Result of [`reduce_longest`].
pub(super) struct Reduced<S> {
    /// Rows that are left.
    pub rank: usize,
    /// Length of the first column that was reflected.
    pub first: S,
    /// Length of the longest column of what remains of the other rows.
    pub next: S,
}

/// Householder reflections of `a` (m x n), and with it of `b` (m x any), each of the longest column of the rows that are
/// left, until that is no longer than `least` times the first, or rounding.
pub(super) fn reduce_longest<S: Scalar>(
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
