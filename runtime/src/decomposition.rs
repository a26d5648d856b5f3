//! How the independent ones of the closure's rows are found: by singular values, or by pivoted QR where there are many
//! speeds.
//!
//! Jacobi's method gives singular values with all their digits, and decides on the rank by them. It takes some six
//! sweeps over all pairs of rows. Pivoted QR ([`clearly_independent`]) costs as much as one sweep, and is enough unless a
//! value is near the cut between those that count and those that do not; then singular values decide as well.

use crate::constants::{CLEAR_FACTOR, FEW_SPEEDS, RESIDUALS_OF_LOOP};
use crate::linear::{
    Kept, clearly_independent, forward, forward_rows, keep, normalise, orthogonalise,
    orthogonalise_independent, reduce, reduce_groups, rows_of_mut,
};
use crate::rank::Gap;
use crate::{Error, Mechanism, Scalar};

/// How orthogonal rows are found.
///
/// This is an argument of what uses it, and not a matter of the length of a slice, so that the optimiser leaves out of
/// firmware what a small mechanism does not need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Decomposition {
    /// By Jacobi's method.
    SingularValues,
    /// By reflections of the longest column, and singular values where they leave a doubt about the rank.
    PivotedQr,
}

impl Decomposition {
    /// For the rows of a mechanism: up to a few speeds, singular values cost no more than what avoids them.
    #[inline]
    pub fn of<Y: Mechanism>(system: &Y) -> Self {
        Self::for_speeds(system.dimensions().speeds)
    }

    /// For rows of n columns.
    #[inline]
    pub fn for_speeds(n: usize) -> Self {
        if n > FEW_SPEEDS { Self::PivotedQr } else { Self::SingularValues }
    }

    /// Orthogonal rows that span the independent rows of `jacobian` (m x n), in its place, and the right-hand sides that
    /// belong to them in that of `rhs` (m x any). The rows are as long as singular values, or nearly so.
    pub fn independent<S: Scalar>(
        self,
        jacobian: &mut [S],
        rhs: &mut [S],
        [m, n]: [usize; 2],
        gap: Gap<S>,
    ) -> Result<Kept<S>, Error> {
        if self == Self::PivotedQr
            && let Some(kept) = clearly_independent(jacobian, rhs, [m, n], gap.cut())?
        {
            return Ok(kept);
        }
        let width = rhs.len() / m.max(1);
        let k = orthogonalise(jacobian, rhs, m, n)?;
        keep(rows_of_mut(jacobian, n, 0..k)?, rows_of_mut(rhs, width, 0..k)?, k, n, gap.cut())
    }

    /// As [`independent`](Self::independent), of the nine rows of each loop and a row of each driven joint. Within a loop
    /// most are redundant.
    pub fn independent_of_loops<S: Scalar>(
        self,
        jacobian: &mut [S],
        rhs: &mut [S],
        [m, n]: [usize; 2],
        gap: Gap<S>,
    ) -> Result<Kept<S>, Error> {
        let width = rhs.len() / m.max(1);
        let m = match self {
            Self::SingularValues => reduce(jacobian, rhs, m, n)?,
            Self::PivotedQr => {
                // What is left out is far below the cut, also of all loops together.
                let least = gap.cut() / S::from_f64(CLEAR_FACTOR * CLEAR_FACTOR);
                reduce_groups(jacobian, rhs, [m, n], RESIDUALS_OF_LOOP, least)?
            }
        };
        let (jacobian, rhs) = (rows_of_mut(jacobian, n, 0..m)?, rows_of_mut(rhs, width, 0..m)?);
        self.independent(jacobian, rhs, [m, n], gap)
    }

    /// As [`independent`](Self::independent), of unit length.
    pub fn independent_units<S: Scalar>(
        self,
        jacobian: &mut [S],
        rhs: &mut [S],
        [m, n]: [usize; 2],
        gap: Gap<S>,
    ) -> Result<Kept<S>, Error> {
        let width = rhs.len() / m.max(1);
        let kept = self.independent(jacobian, rhs, [m, n], gap)?;
        let k = kept.rank;
        normalise(rows_of_mut(jacobian, n, 0..k)?, rows_of_mut(rhs, width, 0..k)?, n);
        Ok(kept)
    }

    /// Rows of J become rows of J L^-T, with the same bits either way.
    pub fn weigh<S: Scalar>(self, l: &[S], rows: &mut [S], n: usize) {
        match self {
            Self::SingularValues => rows.chunks_exact_mut(n.max(1)).for_each(|row| forward(l, row)),
            Self::PivotedQr => forward_rows(l, rows, n),
        }
    }

    /// Makes independent rows of `a` (k x n) orthogonal, and turns those of `b` (k x any but 0) with them.
    pub fn orthogonalise<S: Scalar>(
        self,
        a: &mut [S],
        b: &mut [S],
        [k, n]: [usize; 2],
    ) -> Result<(), Error> {
        match self {
            Self::SingularValues => orthogonalise(a, b, k, n).map(|_| ()),
            Self::PivotedQr => {
                orthogonalise_independent(a, b, n);
                Ok(())
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::{combine, test_matrix};
    use nalgebra::{DMatrix, DVector};

    /// A^+ b of rows with these singular values, by orthonormal factors of nalgebra, values below the cut left out;
    /// compared with what the rows give that a decomposition finds.
    fn check(decomposition: Decomposition, [m, n]: [usize; 2], values: &[f64], cut: f64) {
        let k = values.len();
        let u = test_matrix(m, k, (m * 100 + n) as u64).qr().q();
        let v = test_matrix(n, k, (m + n * 100) as u64).qr().q();
        let a = &u * DMatrix::from_diagonal(&DVector::from_column_slice(values)) * v.transpose();
        let b = DVector::from_fn(m, |i, _| (1.0 + i as f64).sin());
        let share = |value: f64| if value > cut { 1.0 / value } else { 0.0 };
        let shares = DVector::from_iterator(k, values.iter().copied().map(share));
        let expected = v * DMatrix::from_diagonal(&shares) * u.transpose() * &b;

        let mut rows: Vec<f64> = a.transpose().iter().copied().collect();
        let mut rhs: Vec<f64> = b.iter().copied().collect();
        let mut x = vec![0.0; n];
        let gap = Gap::with_cut(cut);
        let kept = decomposition.independent_of_loops(&mut rows, &mut rhs, [m, n], gap);
        let rank = kept.unwrap().rank;
        let what = format!("{decomposition:?}, {m} x {n}, {values:?}");
        assert_eq!(rank, values.iter().filter(|&&value| value > cut).count(), "{what}");
        decomposition.orthogonalise(&mut rows[..rank * n], &mut rhs[..rank], [rank, n]).unwrap();
        combine(&rows[..rank * n], &rhs[..rank], &mut x);
        let error = (DVector::from_vec(x) - &expected).amax() / expected.amax();
        let least = values.iter().copied().filter(|&value| value > cut).fold(1.0, f64::min);
        // Without singular values, what is dropped turns the other rows; the root is that of the norms.
        let dropped =
            values.iter().copied().filter(|&value| value < cut / 100.0).fold(0.0, f64::max);
        assert!(error <= (1e-14 + dropped * (n as f64).sqrt()) / least, "{what}: {error:e}");
    }

    /// Within a factor of 100 of the cut singular values decide, on rows that are reflected already; beyond, the two ways
    /// agree without them.
    #[test]
    fn both_ways_give_the_pseudo_inverse_also_where_values_are_near_the_cut() {
        // As shares of the cut.
        let near: [&[f64]; 6] = [
            &[1e4],
            &[1e3, 1e-4],
            &[50.0, 1e-4],
            &[1e-2],
            &[0.4, 1e-3],
            &[3.0, 0.5, 20.0, 0.2, 5.0, 0.4, 0.1],
        ];
        for decomposition in [Decomposition::SingularValues, Decomposition::PivotedQr] {
            for size in [[54, 20], [20, 30], [18, 18], [108, 51]] {
                for cut in [6e-8, 1e-5, 2e-3] {
                    for near in near {
                        let mut values: Vec<f64> = (0..9).map(|i| 0.7_f64.powi(i)).collect();
                        values.extend(near.iter().map(|share| share * cut).filter(|&x| x < 0.1));
                        check(decomposition, size, &values, cut);
                    }
                }
            }
        }
    }

    /// Down to a ten-thousandth of the cut, what a loop's rows have beyond those that count is kept until it is known how
    /// large it is: the length of redundant rows tells whether a state is singular.
    #[test]
    fn the_size_of_what_is_dropped_is_known() {
        let (cut, [m, n]) = (1e-5, [9, 20]);
        for share in [1e-1, 1e-2, 1e-3] {
            let values = DVector::from_vec(vec![1.0, 0.7, share * cut]);
            let u = test_matrix(m, 3, 1).qr().q();
            let v = test_matrix(n, 3, 2).qr().q();
            let a = &u * DMatrix::from_diagonal(&values) * v.transpose();
            for decomposition in [Decomposition::SingularValues, Decomposition::PivotedQr] {
                let mut rows: Vec<f64> = a.transpose().iter().copied().collect();
                let gap = Gap::with_cut(cut);
                let kept =
                    decomposition.independent_of_loops(&mut rows, &mut [0.0; 9], [m, n], gap);
                let kept = kept.unwrap();
                let found = kept.dropped / (share * cut);
                assert_eq!(kept.rank, 2);
                assert!((0.5..2.0).contains(&found), "{decomposition:?}, {share}: {found}");
            }
        }
    }
}
