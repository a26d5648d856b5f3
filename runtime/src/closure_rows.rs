//! The rows of the closure at a state, solved: W y = b with W = J L^-T, whatever the rank.

use crate::decomposition::Decomposition;
use crate::linear::{
    Kept, add_scaled, backward, combine, conditioning, copy, dot, factor, forward, keep,
    orthogonalise, rows_of_mut, times_lower,
};
use crate::rank::{Fading, Gap};
use crate::trust::safe;
use crate::{Constraint, Error, Scalar};

/// A decision on the rank and, unless rows were far from dependence, what led to it.
pub(crate) type Decided<S> = (Constraint, Option<Kept<S>>);

/// The closure equations J a = -gamma and room to solve them in.
pub(crate) struct Rows<'a, S> {
    /// Factor of M.
    pub mass: &'a [S],
    /// J, C x N.
    pub jacobian: &'a [S],
    /// gamma, C.
    pub gamma: &'a [S],
    /// W or what takes its place, C x N.
    pub weighted: &'a mut [S],
    /// C x N.
    pub scratch: &'a mut [S],
    /// C.
    pub rhs: &'a mut [S],
    /// The contribution of the closure to y, N: L^-1 J^T lambda.
    pub push: &'a mut [S],
}

impl<S: Scalar> Rows<'_, S> {
    /// The right-hand sides become b = -gamma - W y.
    fn set_wanted(&mut self, rows: usize, y: &[S]) {
        let weighted = self.weighted.chunks_exact(y.len().max(1)).take(rows);
        for (value, row) in self.rhs.iter_mut().zip(weighted) {
            *value = -*value - dot(row, y);
        }
    }

    /// Adds W^+ b to `y` by the Cholesky factor of W W^T, if that is safe: rows certainly
    /// independent and far from dependence.
    pub fn direct(
        &mut self,
        decomposition: Decomposition,
        y: &mut [S],
    ) -> Result<Option<Constraint>, Error> {
        let (c, n) = (self.gamma.len(), y.len());
        if c > n {
            return Ok(None);
        }
        copy(self.weighted, self.jacobian)?;
        decomposition.weigh(self.mass, self.weighted, n);
        let trace = self.set_products(c, n);
        let safely =
            factor(self.scratch, c).is_ok() && conditioning(self.scratch, c, trace) > safe();
        if !safely {
            return Ok(None);
        }
        copy(self.rhs, self.gamma)?;
        self.set_wanted(c, y);
        forward(self.scratch, self.rhs);
        backward(self.scratch, self.rhs);
        self.push.fill(S::ZERO);
        for (row, &value) in self.weighted.chunks_exact(n.max(1)).zip(&*self.rhs) {
            add_scaled(self.push, value, row);
        }
        add_scaled(y, S::ONE, self.push);
        Ok(Some(Constraint::strong(c)))
    }

    /// The lower triangle of W W^T (C x C), into `scratch`; returns its trace.
    fn set_products(&mut self, c: usize, n: usize) -> S {
        let mut trace = S::ZERO;
        let rows = self.weighted.chunks_exact(n.max(1));
        let products = self.scratch.chunks_exact_mut(c.max(1)).zip(rows.clone());
        for (i, (products, row)) in products.enumerate() {
            let mut square = S::ZERO;
            for (product, other) in products.iter_mut().zip(rows.clone()).take(i + 1) {
                square = dot(row, other);
                *product = square;
            }
            trace += square;
        }
        trace
    }

    /// Adds W^+ b to `y` whatever the rank.
    pub fn general(
        &mut self,
        decomposition: Decomposition,
        gap: Gap<S>,
        y: &mut [S],
    ) -> Result<Decided<S>, Error> {
        let (c, n) = (self.gamma.len(), y.len());
        copy(self.weighted, self.jacobian)?;
        copy(self.rhs, self.gamma)?;
        let kept = decomposition.independent_units(self.weighted, self.rhs, [c, n], gap)?;
        let k = kept.rank;
        decomposition.weigh(self.mass, rows_of_mut(self.weighted, n, 0..k)?, n);
        self.set_wanted(k, y);
        let (weighted, rhs) =
            (rows_of_mut(self.weighted, n, 0..k)?, rows_of_mut(self.rhs, 1, 0..k)?);
        decomposition.orthogonalise(weighted, rhs, [k, n])?;
        combine(weighted, rhs, self.push);
        add_scaled(y, S::ONE, self.push);
        let is_weak = gap.is_below(Fading::of_rounding().weak, &kept);
        Ok((Constraint { rank: k, is_weak, is_closed: gap.is_closed() }, Some(kept)))
    }

    /// The smallest lambda with J^T lambda = L push: with the orthogonal rows B of J and their lengths
    /// s, lambda = J sum_i B_i (B_i . L push) / s_i^4. Of a shorter `lambda`, the last parts.
    pub fn multipliers(&mut self, gap: Gap<S>, lambda: &mut [S]) -> Result<(), Error> {
        let (c, n) = (self.gamma.len(), self.push.len());
        times_lower(self.mass, self.push);
        copy(self.scratch, self.jacobian)?;
        let k = orthogonalise(self.scratch, self.rhs, c, n)?;
        let (orthogonal, rhs) =
            (rows_of_mut(self.scratch, n, 0..k)?, rows_of_mut(self.rhs, 1, 0..k)?);
        let k = keep(orthogonal, rhs, k, n, gap.cut())?.rank;
        let sum = rows_of_mut(self.weighted, n, 0..1)?;
        sum.fill(S::ZERO);
        for row in orthogonal.chunks_exact(n.max(1)).take(k) {
            let square = dot(row, row);
            add_scaled(sum, dot(row, self.push) / square / square, row);
        }
        let rows = self.jacobian.chunks_exact(n.max(1)).skip(c.saturating_sub(lambda.len()));
        for (value, row) in lambda.iter_mut().zip(rows) {
            *value = dot(row, sum);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;

    /// What W^+ b and the multipliers are for W = J (M = 1): by a decomposition, or directly.
    fn solution(
        w: &[f64],
        b: &[f64],
        n: usize,
        decomposition: Option<Decomposition>,
    ) -> Option<(Vec<f64>, Vec<f64>)> {
        let c = b.len();
        let mut mass = vec![0.0; n * n];
        (0..n).for_each(|i| mass[i * n + i] = 1.0);
        let gamma: Vec<f64> = b.iter().map(|b| -b).collect();
        let [mut weighted, mut scratch] = [vec![0.0; c * n], vec![0.0; c * n]];
        let (mut rhs, mut push) = (vec![0.0; c], vec![0.0; n]);
        let (mut y, mut lambda) = (vec![0.0; n], vec![0.0; c]);
        let mut rows = Rows {
            mass: &mass,
            jacobian: w,
            gamma: &gamma,
            weighted: &mut weighted,
            scratch: &mut scratch,
            rhs: &mut rhs,
            push: &mut push,
        };
        let gap = Gap::closed();
        match decomposition {
            None => drop(rows.direct(Decomposition::for_speeds(n), &mut y).unwrap()?),
            Some(decomposition) => {
                assert_eq!(rows.general(decomposition, gap, &mut y).unwrap().0.rank, c);
            }
        }
        rows.multipliers(gap, &mut lambda).unwrap();
        Some((y, lambda))
    }

    #[test]
    fn all_ways_agree_where_the_fast_one_is_taken() {
        let mut taken = 0;
        for seed in 0..400 {
            let (c, n) = (1 + seed % 5, 6 + seed % 3);
            let w: Vec<f64> = test_matrix(c, n, seed as u64).iter().copied().collect();
            let b: Vec<f64> = (0..c).map(|i| (i as f64 + seed as f64).cos()).collect();
            let Some(fast) = solution(&w, &b, n, None) else { continue };
            taken += 1;
            for decomposition in [Decomposition::SingularValues, Decomposition::PivotedQr] {
                let slow = solution(&w, &b, n, Some(decomposition)).unwrap();
                for (fast, slow) in [(&fast.0, &slow.0), (&fast.1, &slow.1)] {
                    let scale = slow.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
                    for (fast, slow) in fast.iter().zip(slow) {
                        assert!((fast - slow).abs() <= 1e-10 * scale, "{fast} is not {slow}");
                    }
                }
            }
        }
        assert!(taken > 300, "the fast way was taken {taken} times of 400");
    }

    #[test]
    fn dependent_rows_never_take_the_fast_way() {
        for distance in [0.0, 1e-12, 1e-8, 1e-5, 1e-3] {
            let w = [1.0, 2.0, 3.0, 1.0, 2.0, 3.0 + distance];
            assert!(solution(&w, &[1.0, 1.0], 3, None).is_none(), "distance {distance}");
        }
    }
}
