//! The elimination of the closure: L U of the rows of J that determine the dependent joints, and what follows from it.
//!
//! Where the pivots are and which entries there can be is known before ([`Reduction`]). A row of J is named by the joint that it
//! determines, and L has the independent joints' entries of J beside its own:
//!
//! ```text
//! J x = b        z_i = b_i - sum L_ij z_j        x_i = (z_i - sum U_ij x_j) / pivot_i        z_i = x_i of independent joints
//! ```
//!
//! The rows come one after the other, each in a place of its own for every joint (T. A. Davis, "Direct Methods for Sparse
//! Linear Systems", 2006, 6.2, by rows instead of columns).

use super::inertia::{Block, at, at_mut, sum_of};
use super::{Reduction, ReductionSizes};
use crate::workspace::split;
use crate::{Error, Scalar};

/// L, U and the pivots at a state.
pub(super) struct Elimination<'a, S> {
    /// L, as [`Reduction::lower`] orders it.
    lower: &'a mut [S],
    /// U, as [`Reduction::upper`] orders it.
    upper: &'a mut [S],
    /// 1 / pivot, by branch; 1 for independent joints.
    inverse: &'a mut [S],
    /// The present row, by branch; zeros else.
    row: &'a mut [S],
}

/// Numbers that [`Elimination`] needs.
pub(super) const fn elimination_len(sizes: ReductionSizes) -> usize {
    sizes.lower + sizes.upper + 2 * sizes.branches
}

impl<'a, S: Scalar> Elimination<'a, S> {
    /// Room for it.
    pub fn of(sizes: ReductionSizes, workspace: &mut &'a mut [S]) -> Result<Self, Error> {
        Ok(Self {
            lower: split(workspace, sizes.lower)?,
            upper: split(workspace, sizes.upper)?,
            inverse: split(workspace, sizes.branches)?,
            row: split(workspace, sizes.branches)?,
        })
    }

    /// Computes L and U of the rows of J, `closure`; returns the largest inverse pivot.
    pub fn factor(&mut self, reduction: &Reduction<'_, S>, closure: &[S]) -> Result<S, Error> {
        let Self { lower, upper, inverse, row } = self;
        let mut largest = S::ZERO;
        inverse.fill(S::ONE);
        row.fill(S::ZERO);
        for &branch in reduction.order {
            for (&column, &entry) in reduction.closure.of(branch, closure) {
                *at_mut(row, column)? = entry;
            }
            for (&column, place) in reduction.lower.of_mut(branch, lower) {
                let factor = take(row, column)? * *at(inverse, column)?;
                *place = factor;
                for (&column, &entry) in reduction.upper.of(column, upper) {
                    let place = at_mut(row, column)?;
                    *place = (-factor).mul_add(entry, *place);
                }
            }
            let of_row = S::ONE / take(row, branch)?;
            *at_mut(inverse, branch)? = of_row;
            largest = largest.max(of_row.abs());
            for (&column, entry) in reduction.upper.of_mut(branch, upper) {
                *entry = take(row, column)?;
            }
        }
        Ok(largest)
    }

    /// N for some independent speeds, in place: rows of independent joints are given, those of dependent ones follow.
    pub fn spread<const W: usize>(
        &self,
        reduction: &Reduction<'_, S>,
        rows: &mut [Block<S, W>],
    ) -> Result<(), Error> {
        self.substitute(reduction, rows, core::iter::repeat([S::ZERO; W]))
    }

    /// x by branch, with zeros for the independent joints, for b by the order of the elimination.
    pub fn solve(
        &self,
        reduction: &Reduction<'_, S>,
        wanted: &[S],
        x: &mut [S],
    ) -> Result<(), Error> {
        x.fill(S::ZERO);
        self.substitute(reduction, x.as_chunks_mut().0, wanted.iter().map(|&b| [b]))
    }

    /// The dependent joints' rows of x, for their rows of b by the order of the elimination.
    #[inline(always)]
    fn substitute<const W: usize>(
        &self,
        reduction: &Reduction<'_, S>,
        x: &mut [Block<S, W>],
        wanted: impl Iterator<Item = Block<S, W>>,
    ) -> Result<(), Error> {
        for (&branch, mut sum) in reduction.order.iter().zip(wanted) {
            for (&column, &factor) in reduction.lower.of(branch, self.lower) {
                sum = sum_of(-factor, at(x, column)?, &sum);
            }
            *at_mut(x, branch)? = sum;
        }
        for &branch in reduction.order.iter().rev() {
            let mut sum = *at(x, branch)?;
            for (&column, &entry) in reduction.upper.of(branch, self.upper) {
                sum = sum_of(-entry, at(x, column)?, &sum);
            }
            let inverse = *at(self.inverse, branch)?;
            *at_mut(x, branch)? = sum.map(|x| inverse * x);
        }
        Ok(())
    }

    /// The transpose of [`spread`](Self::spread), in place: rows of independent joints become the sums over all joints of their
    /// entries of N times the joint's row.
    pub fn take_back<const W: usize>(
        &self,
        reduction: &Reduction<'_, S>,
        rows: &mut [Block<S, W>],
    ) -> Result<(), Error> {
        for &branch in reduction.order {
            let inverse = *at(self.inverse, branch)?;
            let own = at(rows, branch)?.map(|x| inverse * x);
            *at_mut(rows, branch)? = own;
            for (&column, &entry) in reduction.upper.of(branch, self.upper) {
                let row = at_mut(rows, column)?;
                *row = sum_of(-entry, &own, row);
            }
        }
        for &branch in reduction.order.iter().rev() {
            let own = *at(rows, branch)?;
            for (&column, &factor) in reduction.lower.of(branch, self.lower) {
                let row = at_mut(rows, column)?;
                *row = sum_of(-factor, &own, row);
            }
        }
        Ok(())
    }
}

/// Takes an entry out of a row.
#[inline(always)]
fn take<S: Scalar>(row: &mut [S], column: u16) -> Result<S, Error> {
    Ok(core::mem::replace(at_mut(row, column)?, S::ZERO))
}
