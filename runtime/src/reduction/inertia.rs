//! The dense matrices of the independent speeds: N and H = N^T M N.
//!
//! M is never formed ([`sweep`](super::sweep)): of M = G + G^T the sweep takes G N, and what the closure's elimination
//! says of the speeds takes it back to the independent ones. So H = A + A^T, A = N^T G N, costs as many products for each
//! independent speed as there are joints and coefficients.
//!
//! Everything is computed for [`LANES`] independent speeds after the other: so a step of a loop works on arrays of that
//! length, of which the compiler makes vector instructions, and what it reads stays in the first cache.

use super::driven::{Driven, Met};
use super::sweep::{Sweep, sweep_len};
use super::{Branch, Reduction, ReductionSizes, Terms};
use crate::constants::WEIGHT_OF_ENTRY;
use crate::linear::{backward, factor, forward};
use crate::trust::{Trust, safe};
use crate::workspace::split;
use crate::{Error, Scalar};

/// Numbers of a block.
pub(super) const LANES: usize = 8;

/// Numbers of neighbouring independent speeds.
pub(super) type Block<S> = [S; LANES];

/// Blocks of `d` independent speeds.
const fn blocks(d: usize) -> usize {
    d.div_ceil(LANES)
}

/// N and the factor of H at a state.
pub(super) struct Inertia<'a, S> {
    reduction: Reduction<'a, S>,
    /// d, the number of independent speeds.
    independent: usize,
    /// N by block and branch.
    null_space: &'a mut [Block<S>],
    /// G N of a block of speeds, by branch.
    half: &'a mut [Block<S>],
    sweep: Sweep<'a, S>,
    /// A number for each independent speed.
    row: &'a mut [Block<S>],
    /// x and M x, by branch.
    x: [&'a mut [S]; 2],
    /// H on and below the diagonal, d x d, and its factor.
    inertia: &'a mut [S],
}

/// Numbers that [`Inertia`] needs.
pub(super) const fn inertia_len(sizes: ReductionSizes) -> usize {
    let ReductionSizes { branches, depth, independent: d, .. } = sizes;
    let in_blocks = (blocks(d) + 1) * branches + blocks(d);
    in_blocks * LANES + sweep_len(depth) + 2 * branches + d * d
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
        let (null_space, half, row) = (of(count * branches)?, of(branches)?, of(count)?);
        let sweep = Sweep::of(depth, workspace)?;
        let x = [split(workspace, branches)?, split(workspace, branches)?];
        let inertia = split(workspace, independent * independent)?;
        Ok(Self { reduction, independent, null_space, half, sweep, row, x, inertia })
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
        self.assemble(terms)?;
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

    /// H on and below the diagonal.
    fn assemble(&mut self, terms: &Terms<'_, S>) -> Result<(), Error> {
        let Self { reduction, sweep, null_space, half, inertia, .. } = self;
        let Reduction { branches, independent, .. } = *reduction;
        let d = independent.len().max(1);
        let blocks = null_space.chunks_exact(branches.len().max(1));
        for (n, first) in blocks.zip((0..d).step_by(LANES)) {
            sweep.half(branches, terms, n, half)?;
            take_back(reduction, terms.coefficients, half)?;
            for (&branch, row) in independent.iter().zip(inertia.chunks_exact_mut(d)) {
                let sums = at(half, branch.into())?;
                for (entry, &sum) in row.iter_mut().skip(first).zip(sums) {
                    *entry = sum;
                }
            }
        }
        for i in 0..d {
            let (expected, given) = (d * d, inertia.len());
            let split = inertia.split_at_mut_checked(i * d);
            let (above, rest) = split.ok_or(Error::Length { expected, given })?;
            let (own, row) = (rest.get(i).copied(), rest.iter_mut());
            let mirrored = above.chunks_exact(d).map(|row| row.get(i).copied()).chain([own]);
            for (entry, mirrored) in row.zip(mirrored.flatten()) {
                *entry += mirrored;
            }
        }
        Ok(())
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
        let branches = self.reduction.branches;
        let of = |branch: &Branch| x.get(usize::from(branch.joint)).copied().unwrap_or(S::ZERO);
        transposed(self.null_space, branches.len(), branches.iter().map(of), out);
    }

    /// N^T M x, for x in the order of u.
    pub fn momentum(&mut self, terms: &Terms<'_, S>, x: &[S], out: &mut [S]) -> Result<(), Error> {
        let branches = self.reduction.branches;
        let [by_branch, momenta] = &mut self.x;
        for (place, branch) in by_branch.iter_mut().zip(branches) {
            *place = x.get(usize::from(branch.joint)).copied().unwrap_or(S::ZERO);
        }
        self.sweep.whole(branches, terms, by_branch, momenta)?;
        let momenta = momenta.iter().copied();
        transposed(self.null_space, branches.len(), momenta, out);
        Ok(())
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

/// `rows` of some joints, by branch, become the sums over all joints of N, of which only those of the independent ones are used.
fn take_back<S: Scalar>(
    reduction: &Reduction<'_, S>,
    coefficients: &[S],
    rows: &mut [Block<S>],
) -> Result<(), Error> {
    let mut terms = reduction.columns.iter().zip(coefficients).rev();
    for dependent in reduction.dependent.iter().rev() {
        let own = *at(rows, dependent.branch.into())?;
        for (&column, &coefficient) in terms.by_ref().take(dependent.terms.into()) {
            let row = at_mut(rows, column.into())?;
            *row = sum_of(coefficient, &own, row);
        }
    }
    Ok(())
}

/// N^T x, for x by branch.
fn transposed<S: Scalar>(
    null_space: &[Block<S>],
    branches: usize,
    x: impl Iterator<Item = S> + Clone,
    out: &mut [S],
) {
    for (out, rows) in out.chunks_mut(LANES).zip(null_space.chunks_exact(branches.max(1))) {
        let mut sum = [S::ZERO; LANES];
        for (x, row) in x.clone().zip(rows) {
            sum = sum_of(x, row, &sum);
        }
        for (out, sum) in out.iter_mut().zip(sum) {
            *out = sum;
        }
    }
}
