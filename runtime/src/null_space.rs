//! J x = b by elimination with pivots that are chosen at the state, and the least x in the metric of M.
//!
//! ```text
//! x = p + N y,    J p = b,    J N = 0,    N^T M N y = N^T (f - M p)
//! ```
//!
//! Rows of J have few entries, those of the joints around a loop. Elimination with the longest row that is left, and its
//! largest entry, leaves most of the zeros where they are, while orthogonal rows fill up. A row of a constraint that fades
//! stays apart from the others, so that it keeps its digits. What this does not tell for sure is the rank: where pivots, or
//! the size of J^+, do not show it clearly, [`Decomposition`](crate::decomposition::Decomposition) decides.
//!
//! The size of J^+ is that of solutions for right-hand sides of random signs: for rows w of independent signs, the mean of
//! |J^+ w|^2 is the sum of the squares of all entries of J^+.

use crate::constants::{CLEAR_FACTOR, ESTIMATE_FACTOR, LARGEST_DIRECTION, NEGLIGIBLE_EPSILONS};
use crate::linear::{
    Kept, add_scaled, backward, copy, dot_in_parts, exchange, factor, forward, max_abs,
};
use crate::linear::{rows_of, rows_of_mut, times_upper};
use crate::workspace::split;
use crate::{Error, Scalar};

/// Right-hand sides: b, and two of random signs.
const SIDES: usize = 3;

/// The rows of J after their elimination, and the unknowns.
pub(crate) struct NullSpace<'a, S> {
    /// N^T, d rows of n.
    directions: &'a mut [S],
    /// p, n.
    particular: &'a mut [S],
    /// Room for N^T M, d rows of n.
    momenta: &'a mut [S],
    /// Room for N^T M N, d x d.
    inertia: &'a mut [S],
    /// y, d.
    speeds: &'a mut [S],
    /// Rank and singular values, roughly.
    pub kept: Kept<S>,
}

/// What the elimination works on.
struct Rows<'a, S> {
    /// J, m x n; then its reduced rows.
    rows: &'a mut [S],
    /// Right-hand sides, m x [`SIDES`].
    sides: &'a mut [S],
    /// Squares of the lengths of rows, m.
    squares: &'a mut [S],
    /// Column of each pivot, as a number; n.
    columns: &'a mut [S],
    /// 1 for columns of pivots, else 0; n.
    taken: &'a mut [S],
    n: usize,
}

impl<'a, S: Scalar> NullSpace<'a, S> {
    /// Eliminates the rows of `jacobian` (m x n), which are lost, for b. Nothing where the workspace does not hold the
    /// directions, or where the rows do not show clearly how many of them are independent: they
    /// are dropped below `cut` times the longest row, and must be far from it.
    pub fn of(
        jacobian: &mut [S],
        b: impl Iterator<Item = S>,
        [m, n]: [usize; 2],
        cut: S,
        mut workspace: &'a mut [S],
    ) -> Result<Option<Self>, Error> {
        if workspace.len() < (SIDES + 1) * m + 4 * n {
            return Ok(None);
        }
        let sides = split(&mut workspace, SIDES * m)?;
        let squares = split(&mut workspace, m)?;
        let columns = split(&mut workspace, n)?;
        let taken = split(&mut workspace, n)?;
        let particular = split(&mut workspace, n)?;
        let probe = split(&mut workspace, n)?;
        for ((sides, b), number) in sides.chunks_exact_mut(SIDES).zip(b).zip(1_u64..) {
            let signs = [sign(2 * number), sign(2 * number + 1)];
            sides.iter_mut().zip([b, signs[0], signs[1]]).for_each(|(side, value)| *side = value);
        }
        let mut rows = Rows { rows: jacobian, sides, squares, columns, taken, n };
        let Some(Pivots { rank, first, next }) = rows.eliminate(cut)? else { return Ok(None) };
        let d = n - rank;
        if workspace.len() < 2 * d * n + d * d + d {
            return Ok(None);
        }
        let directions = split(&mut workspace, d * n)?;
        let momenta = split(&mut workspace, d * n)?;
        let inertia = split(&mut workspace, d * d)?;
        let speeds = split(&mut workspace, d)?;
        let mut size = S::ZERO;
        for side in 1..SIDES {
            rows.substitute(rank, side, probe)?;
            size += dot_in_parts(probe, probe);
        }
        rows.substitute(rank, 0, particular)?;
        rows.null_space(rank, directions)?;
        let grows = max_abs(directions) > S::from_f64(LARGEST_DIRECTION);
        let size = (size / S::from_f64((SIDES - 1) as f64)).sqrt();
        let least = S::ONE / (first * size);
        if grows || !least.is_finite() {
            return Ok(None);
        }
        let kept = Kept { rank, least, dropped: next / first };
        Ok(Some(Self { directions, particular, momenta, inertia, speeds, kept }))
    }

    /// f becomes the x with J x = b for which N^T (f - M x) = 0. Returns false, with f as it was, where N^T M N has no
    /// factor or a number is not finite.
    pub fn solve(&mut self, mass: &[S], f: &mut [S]) -> Result<bool, Error> {
        let n = self.particular.len();
        let momenta = self.momenta.chunks_exact_mut(n.max(1));
        for (momentum, direction) in momenta.zip(self.directions.chunks_exact(n.max(1))) {
            for (value, row) in momentum.iter_mut().zip(mass.chunks_exact(n.max(1))) {
                *value = dot_in_parts(row, direction);
            }
        }
        let directions = self.directions.chunks_exact(n.max(1));
        let momenta = self.momenta.chunks_exact(n.max(1));
        for ((speed, momentum), direction) in self.speeds.iter_mut().zip(momenta).zip(directions) {
            *speed = dot_in_parts(direction, f) - dot_in_parts(momentum, self.particular);
        }
        set_products(self.inertia, self.momenta, self.directions, n);
        self.combine(f)
    }

    /// The least x in the metric of M = L L^T with J x = b, into `out`. Returns false where that is no number.
    pub fn least(&mut self, l: &[S], out: &mut [S]) -> Result<bool, Error> {
        let n = self.particular.len();
        copy(self.momenta, self.directions)?;
        self.momenta.chunks_exact_mut(n.max(1)).for_each(|row| times_upper(l, row));
        copy(out, self.particular)?;
        times_upper(l, out);
        for (speed, row) in self.speeds.iter_mut().zip(self.momenta.chunks_exact(n.max(1))) {
            *speed = -dot_in_parts(row, out);
        }
        set_products(self.inertia, self.momenta, self.momenta, n);
        self.combine(out)
    }

    /// p + N y into `out`, for N^T M N y = `speeds`. Returns false, with `out` as it was, where that is no number.
    fn combine(&mut self, out: &mut [S]) -> Result<bool, Error> {
        let n = self.particular.len();
        if factor(self.inertia, self.speeds.len()).is_err() {
            return Ok(false);
        }
        forward(self.inertia, self.speeds);
        backward(self.inertia, self.speeds);
        for (&speed, direction) in self.speeds.iter().zip(self.directions.chunks_exact(n.max(1))) {
            add_scaled(self.particular, speed, direction);
        }
        if !self.particular.iter().all(|x| x.is_finite()) {
            return Ok(false);
        }
        copy(out, self.particular)?;
        Ok(true)
    }
}

/// The lower triangle of A B^T, for rows of n entries.
fn set_products<S: Scalar>(products: &mut [S], a: &[S], b: &[S], n: usize) {
    let d = a.len() / n.max(1);
    let rows = products.chunks_exact_mut(d.max(1)).zip(a.chunks_exact(n.max(1)));
    for (count, (products, a)) in (1..).zip(rows) {
        for (product, b) in products.iter_mut().zip(b.chunks_exact(n.max(1))).take(count) {
            *product = dot_in_parts(a, b);
        }
    }
}

/// 1 or -1, the same for the same number, which looks random (SplitMix64; Steele, Lea and Flood, OOPSLA 2014).
fn sign<S: Scalar>(number: u64) -> S {
    let mut word = number.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    if (word ^ word >> 31) & 1 == 0 { S::ONE } else { -S::ONE }
}

/// Result of an elimination.
struct Pivots<S> {
    rank: usize,
    /// Length of the longest row.
    first: S,
    /// Length of the longest row that is left.
    next: S,
}

impl<S: Scalar> Rows<'_, S> {
    /// Eliminates with the longest row that is left and its largest entry, until no row is longer than `cut` times the
    /// first. Nothing where a row is near that.
    fn eliminate(&mut self, cut: S) -> Result<Option<Pivots<S>>, Error> {
        let (n, m) = (self.n, self.squares.len());
        let mut all = S::ZERO;
        for (square, row) in self.squares.iter_mut().zip(self.rows.chunks_exact(n.max(1))) {
            *square = dot_in_parts(row, row);
            all += *square;
        }
        let epsilons = S::from_f64(NEGLIGIBLE_EPSILONS) * S::EPSILON;
        let rounding = epsilons * epsilons * all;
        self.taken.fill(S::ZERO);
        let mut first = S::ZERO;
        for done in 0..=m.min(n) {
            let (row, square) = self.longest(done);
            if done == 0 {
                first = square;
            }
            let above = S::from_f64(ESTIMATE_FACTOR) * cut;
            let below = cut / S::from_f64(CLEAR_FACTOR);
            if done == m.min(n) || square <= rounding || square <= below * below * first {
                let pivots = Pivots { rank: done, first: first.sqrt(), next: square.sqrt() };
                return Ok((done > 0).then_some(pivots));
            }
            // Written so that NaN is not clear.
            if !(square > above * above * first) {
                return Ok(None);
            }
            self.take(row, done)?;
        }
        Ok(None)
    }

    /// Returns the longest row from this one on, and the square of its length.
    fn longest(&self, from: usize) -> (usize, S) {
        let mut longest = (from, S::ZERO);
        for (row, &square) in self.squares.iter().enumerate().skip(from) {
            // Written so that NaN is the longest.
            if !(square <= longest.1) {
                longest = (row, square);
            }
        }
        longest
    }

    /// Makes a row the next pivot row, and eliminates its largest entry from the rows that are left.
    fn take(&mut self, row: usize, done: usize) -> Result<(), Error> {
        let n = self.n;
        exchange(self.rows, n, row, done)?;
        exchange(self.sides, SIDES, row, done)?;
        exchange(self.squares, 1, row, done)?;
        let (mut rest, mut rest_sides) = (
            rows_of_mut(self.rows, n, done..self.squares.len())?,
            rows_of_mut(self.sides, SIDES, done..self.squares.len())?,
        );
        let (pivots, sides) = (split(&mut rest, n)?, split(&mut rest_sides, SIDES)?);
        let (column, pivot) = largest(pivots);
        if let (Some(place), Some(taken)) = (self.columns.get_mut(done), self.taken.get_mut(column))
        {
            (*place, *taken) = (S::from_f64(column as f64), S::ONE);
        }
        let inverse = -S::ONE / pivot;
        let others = rest.chunks_exact_mut(n.max(1)).zip(rest_sides.chunks_exact_mut(SIDES));
        for ((other, other_sides), square) in others.zip(self.squares.iter_mut().skip(done + 1)) {
            let entry = other.get(column).copied().unwrap_or(S::ZERO);
            if entry == S::ZERO {
                continue;
            }
            let share = inverse * entry;
            add_scaled(other, share, pivots);
            add_scaled(other_sides, share, sides);
            other.get_mut(column).into_iter().for_each(|entry| *entry = S::ZERO);
            *square = dot_in_parts(other, other);
        }
        Ok(())
    }

    /// Pivot rows from the last to the first, with their column, their pivot and their right-hand sides.
    fn backwards(&self, rank: usize) -> Result<impl Iterator<Item = Pivot<'_, S>>, Error> {
        let rows = rows_of(self.rows, self.n, 0..rank)?.chunks_exact(self.n.max(1));
        let sides = rows_of(self.sides, SIDES, 0..rank)?.chunks_exact(SIDES);
        let rows = rows.zip(sides).zip(self.columns.iter().take(rank)).rev();
        Ok(rows.map(|((row, sides), column)| {
            let column = column.to_f32() as usize;
            Pivot { row, sides, column, pivot: row.get(column).copied().unwrap_or(S::ZERO) }
        }))
    }

    /// The solution for a right-hand side, with zeros in the free columns.
    fn substitute(&self, rank: usize, side: usize, x: &mut [S]) -> Result<(), Error> {
        x.fill(S::ZERO);
        for Pivot { row, sides, column, pivot } in self.backwards(rank)? {
            let wanted = sides.get(side).copied().unwrap_or(S::ZERO);
            let value = (wanted - dot_in_parts(row, x)) / pivot;
            x.get_mut(column).into_iter().for_each(|x| *x = value);
        }
        Ok(())
    }

    /// N^T: for each free column the solution for zero with 1 there.
    fn null_space(&self, rank: usize, directions: &mut [S]) -> Result<(), Error> {
        directions.fill(S::ZERO);
        let free = self.taken.iter().enumerate().filter(|(_, taken)| **taken == S::ZERO);
        for (direction, (free, _)) in directions.chunks_exact_mut(self.n.max(1)).zip(free) {
            direction.get_mut(free).into_iter().for_each(|x| *x = S::ONE);
        }
        for Pivot { row, column, pivot, .. } in self.backwards(rank)? {
            let scale = -S::ONE / pivot;
            for direction in directions.chunks_exact_mut(self.n.max(1)) {
                let value = scale * dot_in_parts(row, direction);
                direction.get_mut(column).into_iter().for_each(|x| *x = value);
            }
        }
        Ok(())
    }
}

/// A pivot row.
struct Pivot<'a, S> {
    row: &'a [S],
    sides: &'a [S],
    column: usize,
    pivot: S,
}

/// Returns the largest entry and its place.
fn largest<S: Scalar>(row: &[S]) -> (usize, S) {
    row.iter().enumerate().fold((0, S::ZERO), |found, (column, &entry)| {
        if entry.abs() > found.1.abs() { (column, entry) } else { found }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;
    use nalgebra::{DMatrix, DVector};

    /// Rows with few entries, of which some follow from the others, and the x by nalgebra: of all x that solve the rows, the
    /// one for which N^T (f - M x) = 0.
    fn check([m, n, rank]: [usize; 3], fade: f64, tolerance: f64) {
        let mut base = test_matrix(rank, n, (m + n) as u64);
        for row in 0..rank {
            for column in 0..n {
                if (column + 7 * row) % n > 6 && column != row {
                    base[(row, column)] = 0.0;
                }
            }
        }
        base.row_mut(rank - 1).scale_mut(fade);
        let mut mixed = DMatrix::zeros(m, n);
        for row in 0..m {
            let (own, other) = (row % rank, (row + 1) % rank);
            let rows = base.row(own) + if row < rank { 0.0 } else { 0.5 } * base.row(other);
            mixed.row_mut(row).copy_from(&rows);
        }
        let a = test_matrix(n, n, 3);
        let mass = &a * a.transpose() + DMatrix::identity(n, n);
        let f = DVector::from_fn(n, |i, _| (1.0 + i as f64).cos());
        let closed = DVector::from_fn(n, |i, _| (2.0 + i as f64).sin());
        let b = &mixed * &closed;
        // W = J L^-T of the independent rows, with the faded one at full length.
        base.row_mut(rank - 1).scale_mut(1.0 / fade);
        let l = mass.clone().cholesky().unwrap();
        let y = l.l().solve_lower_triangular(&f).unwrap();
        let w = l.l().solve_lower_triangular(&base.transpose()).unwrap().transpose();
        let gram = (&w * w.transpose()).cholesky().unwrap();
        let push = w.transpose() * gram.solve(&(&base * &closed - &w * &y));
        let expected = l.l().transpose().solve_upper_triangular(&(y + push)).unwrap();

        let flat = |matrix: &DMatrix<f64>| matrix.transpose().iter().copied().collect::<Vec<_>>();
        let (mut rows, mut x) = (flat(&mixed), f.iter().copied().collect::<Vec<_>>());
        let mut room = vec![0.0; 4 * m + 4 * n + 2 * n * n + n * n];
        let b = b.iter().copied();
        let space = NullSpace::of(&mut rows, b, [m, n], 6e-8, &mut room).unwrap();
        let mut space = space.expect("a clear rank");
        assert_eq!(space.kept.rank, rank);
        let smallest = base.clone().svd(false, false).singular_values.min() * fade;
        assert!(space.kept.least < 1.0 && space.kept.least > 1e-3 * smallest, "{:?}", space.kept);
        assert!(space.solve(&flat(&mass), &mut x).unwrap());
        let error = (DVector::from_vec(x) - &expected).amax() / expected.amax();
        assert!(error <= tolerance, "{m} x {n}, {fade:e}: {error:e}");
    }

    #[test]
    fn independent_and_redundant_rows_are_solved() {
        for size in [[20, 30, 20], [45, 30, 24], [12, 13, 12], [60, 40, 39]] {
            check(size, 1.0, 1e-11);
        }
    }

    /// A row that fades stays apart from the others.
    #[test]
    fn a_faded_row_keeps_its_digits() {
        for fade in [1e-2, 1e-4] {
            check([20, 30, 20], fade, 1e-11);
        }
    }

    #[test]
    fn what_is_not_clear_is_left_to_others() {
        let clear = |mut rows: [f64; 6]| {
            let (b, mut room) = ([1.0, 2.0].into_iter(), [0.0; 200]);
            NullSpace::of(&mut rows, b, [2, 3], 1e-6, &mut room).unwrap().is_some()
        };
        assert!(clear([1.0, 2.0, 3.0, 1.0, 2.0, 4.0]));
        for distance in [1e-6, 1e-7] {
            assert!(!clear([1.0, 2.0, 3.0, 1.0, 2.0, 3.0 + distance]), "{distance}");
        }
        assert!(!clear([0.0; 6]) && !clear([f64::NAN; 6]));
    }
}
