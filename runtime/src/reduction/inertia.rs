//! The dense matrices of the independent speeds: N, M N and H = N^T M N.
//!
//! M is never formed ([`sweep`](super::sweep)). H takes half a product for each joint and pair of independent speeds.
//!
//! Rows are blocks of [`LANES`] numbers, so that the compiler makes vector instructions of the inner loops.

use super::driven::{Driven, Met};
use super::sweep::{PARTS, Sums};
use super::{Reduction, ReductionSizes, Terms};
use crate::constants::WEIGHT_OF_ENTRY;
use crate::linear::{backward, copy, factor, forward, rows_of, rows_of_mut};
use crate::trust::{Trust, safe};
use crate::workspace::split;
use crate::{Error, Scalar};

/// Numbers of a block.
pub(super) const LANES: usize = 8;

/// Rows of H to which products are added at once.
const ROWS: usize = 4;

/// Neighbouring numbers of a row.
pub(super) type Block<S> = [S; LANES];

/// Blocks of a row of `d` numbers.
const fn blocks(d: usize) -> usize {
    d.div_ceil(LANES)
}

/// N, M N and the factor of H at a state.
pub(super) struct Inertia<'a, S> {
    reduction: Reduction<'a, S>,
    /// d, the number of independent speeds.
    independent: usize,
    /// N by branch.
    null_space: &'a mut [Block<S>],
    /// M N by branch.
    momenta: &'a mut [Block<S>],
    sums: Sums<'a, S>,
    /// A row.
    row: &'a mut [Block<S>],
    /// Zero for a joint whose row of M N is zero: one that moves no mass.
    active: &'a mut [S],
    /// H on and below the diagonal, in blocks.
    products: &'a mut [Block<S>],
    /// H, d x d, and its factor.
    inertia: &'a mut [S],
}

/// Numbers that [`Inertia`] needs.
pub(super) const fn inertia_len(sizes: ReductionSizes) -> usize {
    let ReductionSizes { branches, depth, independent: d, .. } = sizes;
    let rows = 2 * branches + 2 * PARTS * depth + 1 + blocks(d) * LANES;
    rows * blocks(d) * LANES + branches + d * d
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
        let mut of = |rows: usize| -> Result<&'a mut [Block<S>], Error> {
            Ok(split(workspace, rows * count * LANES)?.as_chunks_mut().0)
        };
        let (null_space, momenta, row) = (of(branches)?, of(branches)?, of(1)?);
        let (outward, inward) = (of(PARTS * depth)?, of(PARTS * depth)?);
        let sums = Sums::of(count, outward, inward);
        let products = of(count * LANES)?;
        let active = split(workspace, branches)?;
        let inertia = split(workspace, independent * independent)?;
        Ok(Self {
            reduction,
            independent,
            null_space,
            momenta,
            sums,
            row,
            active,
            products,
            inertia,
        })
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
        sums.sweep(reduction.branches, terms, null_space, momenta, active)?;
        self.product();
        let is_positive = factor(self.inertia, self.independent).is_ok();
        Ok(if is_positive { trust } else { Trust::Doubtful })
    }

    /// N; returns its largest entry.
    fn eliminate(&mut self, coefficients: &[S]) -> Result<S, Error> {
        let count = blocks(self.independent);
        let Self { null_space, row, .. } = self;
        let Reduction { independent, dependent, columns, .. } = self.reduction;
        null_space.fill([S::ZERO; LANES]);
        for (k, &branch) in independent.iter().enumerate() {
            let row = rows_of_mut(null_space, count, at(branch))?;
            if let Some(entry) = row.as_flattened_mut().get_mut(k) {
                *entry = S::ONE;
            }
        }
        let mut terms = columns.iter().zip(coefficients);
        let mut largest = [S::ONE; LANES];
        for dependent in dependent {
            row.fill([S::ZERO; LANES]);
            for (&column, &coefficient) in terms.by_ref().take(dependent.terms.into()) {
                add(row, coefficient, rows_of(null_space, count, at(column))?);
            }
            for block in row.iter() {
                for (largest, x) in largest.iter_mut().zip(block) {
                    *largest = largest.max(x.abs());
                }
            }
            copy(rows_of_mut(null_space, count, at(dependent.branch))?, row)?;
        }
        Ok(largest.into_iter().fold(S::ONE, S::max))
    }

    /// H on and below the diagonal: two joints at once, because adding to H costs more than the products.
    fn product(&mut self) {
        let (d, count) = (self.independent, blocks(self.independent));
        self.products.fill([S::ZERO; LANES]);
        self.row.fill([S::ZERO; LANES]);
        let mut waiting = None;
        let joints = self.null_space.chunks_exact(count.max(1));
        let joints = joints.zip(self.momenta.chunks_exact(count.max(1)));
        for (joint, &active) in joints.zip(&*self.active) {
            if active == S::ZERO {
                continue;
            }
            match waiting.take() {
                None => waiting = Some(joint),
                Some(before) => add_products(self.products, count, [before, joint]),
            }
        }
        if let Some(last) = waiting {
            let none = (&*self.row, &*self.row);
            add_products(self.products, count, [last, none]);
        }
        let rows = self.products.chunks_exact(count.max(1));
        for (row, products) in self.inertia.chunks_exact_mut(d.max(1)).zip(rows) {
            for (entry, &value) in row.iter_mut().zip(products.as_flattened()) {
                *entry = value;
            }
        }
    }

    /// The row of N of a joint, by its place in u.
    pub fn row(&self, joint: usize, out: &mut [S]) -> Result<(), Error> {
        let count = blocks(self.independent);
        let mut branches = self.reduction.branches.iter();
        let index = branches.position(|branch| usize::from(branch.joint) == joint);
        let Some(index) = index else { return Ok(()) };
        let row = rows_of(self.null_space, count, index..index + 1)?.as_flattened();
        for (out, &value) in out.iter_mut().zip(row) {
            *out = value;
        }
        Ok(())
    }

    /// N^T x, for x in the order of u.
    pub fn reduce(&mut self, x: &[S], out: &mut [S]) -> Result<(), Error> {
        transposed(self.reduction, self.null_space, self.row, x, out)
    }

    /// N^T M x, for x in the order of u.
    pub fn momentum(&mut self, x: &[S], out: &mut [S]) -> Result<(), Error> {
        transposed(self.reduction, self.momenta, self.row, x, out)
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
        let count = blocks(self.independent);
        self.row.fill([S::ZERO; LANES]);
        for (place, &y) in self.row.as_flattened_mut().iter_mut().zip(y) {
            *place = sign * y;
        }
        let rows = self.null_space.chunks_exact(count.max(1));
        for (branch, row) in self.reduction.branches.iter().zip(rows) {
            let mut sums = [S::ZERO; LANES];
            for (n, y) in row.iter().zip(&*self.row) {
                sums = core::array::from_fn(|lane| n[lane].mul_add(y[lane], sums[lane]));
            }
            if let Some(out) = out.get_mut(usize::from(branch.joint)) {
                *out += sums.into_iter().fold(S::ZERO, |sum, x| sum + x);
            }
        }
        Ok(())
    }
}

fn at(branch: u16) -> core::ops::Range<usize> {
    usize::from(branch)..usize::from(branch) + 1
}

/// `sum + factor x`.
#[inline(always)]
pub(super) fn sum_of<S: Scalar>(factor: S, x: &Block<S>, sum: &Block<S>) -> Block<S> {
    core::array::from_fn(|lane| factor.mul_add(x[lane], sum[lane]))
}

/// `row += factor other`.
#[inline]
fn add<S: Scalar>(row: &mut [Block<S>], factor: S, other: &[Block<S>]) {
    for (row, other) in row.iter_mut().zip(other) {
        *row = sum_of(factor, other, row);
    }
}

/// A joint's rows of N and M N.
type Pair<'a, S> = (&'a [Block<S>], &'a [Block<S>]);

/// Adds what two joints contribute to H on and below the diagonal, from their rows of N and M N.
#[inline(never)]
fn add_products<S: Scalar>(
    products: &mut [Block<S>],
    count: usize,
    [(n, mn), (m, mm)]: [Pair<'_, S>; 2],
) {
    let groups = products.chunks_exact_mut((ROWS * count).max(1));
    let factors = n.as_flattened().as_chunks::<ROWS>().0.iter();
    let factors = factors.zip(m.as_flattened().as_chunks::<ROWS>().0);
    for (index, (group, (n, m))) in groups.zip(factors).enumerate() {
        let used = index * ROWS / LANES + 1;
        for ((row, &n), &m) in group.chunks_exact_mut(count.max(1)).zip(n).zip(m) {
            for ((sum, mn), mm) in row.iter_mut().zip(mn).zip(mm).take(used) {
                *sum = sum_of(m, mm, &sum_of(n, mn, sum));
            }
        }
    }
}

/// The sum over the joints of x times the joint's row.
fn transposed<S: Scalar>(
    reduction: Reduction<'_, S>,
    rows: &[Block<S>],
    sum: &mut [Block<S>],
    x: &[S],
    out: &mut [S],
) -> Result<(), Error> {
    sum.fill([S::ZERO; LANES]);
    for (branch, row) in reduction.branches.iter().zip(rows.chunks_exact(sum.len().max(1))) {
        if let Some(&x) = x.get(usize::from(branch.joint)) {
            add(sum, x, row);
        }
    }
    for (out, &value) in out.iter_mut().zip(sum.as_flattened()) {
        *out = value;
    }
    Ok(())
}
