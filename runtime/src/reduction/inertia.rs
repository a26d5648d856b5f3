//! The dense matrices of the independent speeds: N, M N and H = N^T M N.
//!
//! M is never formed ([`sweep`](super::sweep)). H takes half a product for each joint and pair of independent speeds.
//!
//! Everything is computed for [`LANES`] independent speeds after the other: so a step of a loop works on arrays of that
//! length, of which the compiler makes vector instructions, and what it reads stays in the first cache.

use super::driven::{Driven, Met};
use super::sweep::{PARTS, Sums};
use super::{Reduction, ReductionSizes, Terms};
use crate::constants::WEIGHT_OF_ENTRY;
use crate::linear::{backward, factor, forward};
use crate::trust::{Trust, safe};
use crate::workspace::split;
use crate::{Error, Scalar};

/// Numbers of a block.
pub(super) const LANES: usize = 8;

/// Rows of H that are summed at once.
const ROWS: usize = 4;

/// Numbers of neighbouring independent speeds.
pub(super) type Block<S> = [S; LANES];

/// Blocks of `d` independent speeds.
const fn blocks(d: usize) -> usize {
    d.div_ceil(LANES)
}

/// N, M N and the factor of H at a state.
pub(super) struct Inertia<'a, S> {
    reduction: Reduction<'a, S>,
    /// d, the number of independent speeds.
    independent: usize,
    /// N by block and branch.
    null_space: &'a mut [Block<S>],
    /// M N by block and branch.
    momenta: &'a mut [Block<S>],
    sums: Sums<'a, S>,
    /// A number for each independent speed.
    row: &'a mut [Block<S>],
    /// Zero for a joint whose row of M N is zero: one that moves no mass.
    active: &'a mut [S],
    /// H on and below the diagonal, d x d, and its factor.
    inertia: &'a mut [S],
}

/// Numbers that [`Inertia`] needs.
pub(super) const fn inertia_len(sizes: ReductionSizes) -> usize {
    let ReductionSizes { branches, depth, independent: d, .. } = sizes;
    ((2 * branches + 1) * blocks(d) + 2 * PARTS * depth) * LANES + branches + d * d
}

impl<'a, S: Scalar> Inertia<'a, S> {
    /// Room for it.
    pub fn of(
        reduction: Reduction<'a, S>,
        sizes: ReductionSizes,
        workspace: &mut &'a mut [S],
    ) -> Result<Self, Error> {
        let ReductionSizes { branches, depth, independent, .. } = sizes;
        let count = blocks(independent);
        let mut of = |blocks: usize| -> Result<&'a mut [Block<S>], Error> {
            Ok(split(workspace, blocks * LANES)?.as_chunks_mut().0)
        };
        let (null_space, momenta) = (of(count * branches)?, of(count * branches)?);
        let row = of(count)?;
        let sums = Sums::of(of(PARTS * depth)?, of(PARTS * depth)?);
        let active = split(workspace, branches)?;
        let inertia = split(workspace, independent * independent)?;
        Ok(Self { reduction, independent, null_space, momenta, sums, row, active, inertia })
    }

    /// d.
    pub fn independent(&self) -> usize {
        self.independent
    }

    /// Computes the matrices; returns how far they can be trusted.
    pub fn fill(&mut self, terms: &Terms<'_, S>) -> Result<Trust<S>, Error> {
        let largest = S::from_f64(WEIGHT_OF_ENTRY) * self.eliminate(terms.coefficients)?;
        let inverse_pivot = terms.largest.iter().fold(S::ZERO, |most, &value| most.max(value));
        let trust = Trust::of_pivot(S::ONE / inverse_pivot);
        // Written so that NaN is not trusted.
        if trust == Trust::Doubtful || !(safe::<S>() * largest * largest < S::ONE) {
            return Ok(Trust::Doubtful);
        }
        let Self { reduction, sums, null_space, momenta, active, .. } = &mut *self;
        let branches = reduction.branches;
        let blocks = null_space.chunks_exact(branches.len().max(1));
        for (n, mn) in blocks.zip(momenta.chunks_exact_mut(branches.len().max(1))) {
            sums.sweep(branches, terms, n, mn, active)?;
        }
        self.product();
        let is_positive = factor(self.inertia, self.independent).is_ok();
        Ok(if is_positive { trust } else { Trust::Doubtful })
    }

    /// N; returns its largest entry.
    fn eliminate(&mut self, coefficients: &[S]) -> Result<S, Error> {
        let Reduction { branches, independent, dependent, columns, .. } = self.reduction;
        self.null_space.fill([S::ZERO; LANES]);
        let mut largest = [S::ONE; LANES];
        let blocks = self.null_space.chunks_exact_mut(branches.len().max(1));
        for (null_space, independent) in blocks.zip(independent.chunks(LANES)) {
            for (lane, &branch) in independent.iter().enumerate() {
                if let Some(entry) = at_mut(null_space, branch.into())?.get_mut(lane) {
                    *entry = S::ONE;
                }
            }
            let mut terms = columns.iter().zip(coefficients);
            for dependent in dependent {
                let mut sum = [S::ZERO; LANES];
                for (&column, &coefficient) in terms.by_ref().take(dependent.terms.into()) {
                    sum = sum_of(coefficient, at(null_space, column.into())?, &sum);
                }
                for (largest, x) in largest.iter_mut().zip(sum) {
                    *largest = largest.max(x.abs());
                }
                *at_mut(null_space, dependent.branch.into())? = sum;
            }
        }
        Ok(largest.into_iter().fold(S::ONE, S::max))
    }

    /// H on and below the diagonal, and a little above.
    fn product(&mut self) {
        let (d, branches) = (self.independent.max(1), self.reduction.branches.len().max(1));
        let rows = self.inertia.chunks_mut(LANES * d);
        for (block, (rows, n)) in rows.zip(self.null_space.chunks_exact(branches)).enumerate() {
            for (index, rows) in rows.chunks_mut(ROWS * d).enumerate() {
                let columns = self.momenta.chunks_exact(branches).take(block + 1);
                for (mn, column) in columns.zip((0..d).step_by(LANES)) {
                    let sums = products(n, index, mn, self.active);
                    for (row, sums) in rows.chunks_exact_mut(d).zip(sums) {
                        for (entry, sum) in row.iter_mut().skip(column).zip(sums) {
                            *entry = sum;
                        }
                    }
                }
            }
        }
    }

    /// The row of N of a joint, by its place in u.
    pub fn row(&self, joint: usize, out: &mut [S]) -> Result<(), Error> {
        let mut branches = self.reduction.branches.iter();
        let Some(index) = branches.position(|branch| usize::from(branch.joint) == joint) else {
            return Ok(());
        };
        let blocks = self.null_space.chunks_exact(self.reduction.branches.len().max(1));
        for (out, n) in out.chunks_mut(LANES).zip(blocks) {
            for (out, &value) in out.iter_mut().zip(at(n, index)?) {
                *out = value;
            }
        }
        Ok(())
    }

    /// N^T x, for x in the order of u.
    pub fn reduce(&self, x: &[S], out: &mut [S]) {
        transposed(self.reduction, self.null_space, x, out);
    }

    /// N^T M x, for x in the order of u.
    pub fn momentum(&self, x: &[S], out: &mut [S]) {
        transposed(self.reduction, self.momenta, x, out);
    }

    /// H^-1 (r + B^T mu) in place of r, with B y = b for the driven joints; returns whether that can be trusted.
    pub fn solve(&self, r: &mut [S], driven: &mut Driven<'_, S>, met: Met) -> Result<bool, Error> {
        forward(self.inertia, r);
        let is_trusted = driven.push(self.inertia, r)?;
        backward(self.inertia, r);
        Ok(is_trusted && (met == Met::Elsewhere || driven.is_met(r)))
    }

    /// `out += sign N y`, in the order of u.
    pub fn combine(&mut self, sign: S, y: &[S], out: &mut [S]) -> Result<(), Error> {
        self.row.fill([S::ZERO; LANES]);
        for (place, &y) in self.row.as_flattened_mut().iter_mut().zip(y) {
            *place = sign * y;
        }
        let branches = self.reduction.branches;
        for (index, branch) in branches.iter().enumerate() {
            let mut sums = [S::ZERO; LANES];
            for (n, y) in self.null_space.chunks_exact(branches.len().max(1)).zip(&*self.row) {
                let n = at(n, index)?;
                sums = core::array::from_fn(|lane| n[lane].mul_add(y[lane], sums[lane]));
            }
            if let Some(out) = out.get_mut(usize::from(branch.joint)) {
                *out += sums.into_iter().fold(S::ZERO, |sum, x| sum + x);
            }
        }
        Ok(())
    }
}

/// The block of a branch.
#[inline(always)]
pub(super) fn at<S>(blocks: &[Block<S>], branch: usize) -> Result<&Block<S>, Error> {
    blocks.get(branch).ok_or(Error::Length { expected: branch + 1, given: blocks.len() })
}

/// As [`at`], to write to.
#[inline(always)]
pub(super) fn at_mut<S>(blocks: &mut [Block<S>], branch: usize) -> Result<&mut Block<S>, Error> {
    let given = blocks.len();
    blocks.get_mut(branch).ok_or(Error::Length { expected: branch + 1, given })
}

/// `sum + factor x`.
#[inline(always)]
pub(super) fn sum_of<S: Scalar>(factor: S, x: &Block<S>, sum: &Block<S>) -> Block<S> {
    core::array::from_fn(|lane| factor.mul_add(x[lane], sum[lane]))
}

/// The sums over the joints that are active of products of N and M N: for some speeds of a block of N, of which this group of
/// [`ROWS`] counts, and all of a block of M N.
#[inline(never)]
fn products<S: Scalar>(
    n: &[Block<S>],
    group: usize,
    mn: &[Block<S>],
    active: &[S],
) -> [Block<S>; ROWS] {
    let mut sums = [[S::ZERO; LANES]; ROWS];
    for ((n, mn), &active) in n.iter().zip(mn).zip(active) {
        if active != S::ZERO
            && let Some(n) = n.as_chunks::<ROWS>().0.get(group)
        {
            for (sum, &n) in sums.iter_mut().zip(n) {
                *sum = sum_of(n, mn, sum);
            }
        }
    }
    sums
}

/// The sum over the joints of x times the joint's row of a matrix.
fn transposed<S: Scalar>(reduction: Reduction<'_, S>, matrix: &[Block<S>], x: &[S], out: &mut [S]) {
    let branches = reduction.branches;
    for (out, rows) in out.chunks_mut(LANES).zip(matrix.chunks_exact(branches.len().max(1))) {
        let mut sum = [S::ZERO; LANES];
        for (branch, row) in branches.iter().zip(rows) {
            if let Some(&x) = x.get(usize::from(branch.joint)) {
                sum = sum_of(x, row, &sum);
            }
        }
        for (out, sum) in out.iter_mut().zip(sum) {
            *out = sum;
        }
    }
}
