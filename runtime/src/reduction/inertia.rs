//! The dense matrices of the independent speeds: N and H = N^T M N.
//!
//! Neither M nor the products of N with itself are formed: of M = G + G^T the [sweep](super::sweep) takes G N, and the transposed
//! [elimination](super::elimination) takes this back to the independent speeds. So H = A + A^T, A = N^T G N, costs some products
//! for each joint and each entry of L and U, for each independent speed. Where one block holds all of them, N^T is multiplied row
//! by row: that costs as much there, and loses no digit to numbers that cancel in the elimination.
//!
//! p is one more column of N: what it contributes to N^T (f - M p) follows from the same sweep.
//!
//! Everything is computed for one block of independent speeds after the other, so that what a step reads stays in the first cache.

use super::blocks::{
    Block, LINE, MOST_TO_LINE, NARROW, WIDE, at, at_mut, blocks, blocks_mut, largest_entries,
    mirror, padded, products, reduce, sum_of, total, width,
};
use super::driven::{Driven, Met};
use super::elimination::{Elimination, elimination_len};
use super::sweep::{Sweep, sweep_len};
use super::{Reduction, ReductionSizes, Terms};
use crate::constants::{REFINED_CONDITIONING, WEIGHT_OF_ENTRY};
use crate::linear::{backward, factor, forward};
use crate::trust::{Trust, safe};
use crate::workspace::split;
use crate::{Error, Scalar};

/// How large the entries of N are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Entries<S> {
    /// As small as suits.
    Small,
    /// The largest is so large that two passes have to make good what rounding takes.
    Large(S),
}

/// N and the factor of H at a state.
pub(super) struct Inertia<'a, S> {
    reduction: Reduction<'a, S>,
    /// d, the number of independent speeds.
    independent: usize,
    elimination: Elimination<'a, S>,
    /// N by block and branch, with p after the last column.
    null_space: &'a mut [S],
    /// G N of a block of speeds, by branch.
    half: &'a mut [S],
    sweep: Sweep<'a, S>,
    /// A number for each independent speed.
    row: &'a mut [S],
    /// x, by branch.
    x: &'a mut [S],
    /// M x, by branch.
    momenta: &'a mut [S],
    /// H on and below the diagonal, d x d, and its factor.
    inertia: &'a mut [S],
    /// N^T (f - M p), d.
    balance: &'a mut [S],
}

/// What p follows from and what it changes: what the rows of J have to be, by the order of the elimination, and f in the order
/// of u. Empty where there is no p.
#[derive(Clone, Copy)]
pub(super) struct Bias<'a, S> {
    pub opening: &'a [S],
    pub forces: &'a [S],
}

/// Numbers that [`Inertia`] needs.
pub(super) const fn inertia_len(sizes: ReductionSizes) -> usize {
    let ReductionSizes { branches, depth, independent: d, .. } = sizes;
    let in_blocks = padded(d) * (branches + 1) + width(d) * branches;
    elimination_len(sizes)
        + MOST_TO_LINE
        + in_blocks
        + sweep_len(depth, width(d))
        + 2 * branches
        + d * d
        + d
}

impl<'a, S: Scalar> Inertia<'a, S> {
    /// Room for it.
    pub fn of(
        reduction: Reduction<'a, S>,
        sizes: ReductionSizes,
        workspace: &mut &'a mut [S],
    ) -> Result<Self, Error> {
        let ReductionSizes { branches, depth, independent, .. } = sizes;
        let padded = padded(independent);
        let elimination = Elimination::of(&reduction, workspace)?;
        let to_line = workspace.as_ptr().align_offset(LINE);
        split(workspace, to_line.min(MOST_TO_LINE))?;
        let null_space = split(workspace, padded * branches)?;
        let half = split(workspace, width(independent) * branches)?;
        let row = split(workspace, padded)?;
        let sweep = Sweep::of(depth, width(independent), workspace)?;
        let (x, momenta) = (split(workspace, branches)?, split(workspace, branches)?);
        let inertia = split(workspace, independent * independent)?;
        let balance = split(workspace, independent)?;
        Ok(Self {
            reduction,
            independent,
            elimination,
            null_space,
            half,
            sweep,
            row,
            x,
            momenta,
            inertia,
            balance,
        })
    }

    /// d.
    pub fn independent(&self) -> usize {
        self.independent
    }

    /// Eliminates the closure; returns how far that can be trusted.
    pub fn eliminate(&mut self, terms: &Terms<'_, S>) -> Result<Trust<S>, Error> {
        let inverse_pivot = self.elimination.factor(&self.reduction, terms.closure)?;
        Ok(Trust::of_pivot(S::ONE / inverse_pivot))
    }

    /// Computes N and H, p and N^T (f - M p) after the elimination; returns nothing if they cannot be trusted.
    pub fn fill(
        &mut self,
        terms: &Terms<'_, S>,
        bias: Bias<'_, S>,
    ) -> Result<Option<Entries<S>>, Error> {
        match width(self.independent) {
            NARROW => self.fill_blocks::<NARROW>(terms, bias),
            _ => self.fill_blocks::<WIDE>(terms, bias),
        }
    }

    fn fill_blocks<const W: usize>(
        &mut self,
        terms: &Terms<'_, S>,
        bias: Bias<'_, S>,
    ) -> Result<Option<Entries<S>>, Error> {
        let mut largest = S::ONE;
        self.balance.fill(S::ZERO);
        // The last block has p, which the others need.
        for index in (0..padded(self.independent) / W).rev() {
            largest = largest.max(self.fill_block::<W>(index, terms, bias)?);
        }
        let weight = S::from_f64(WEIGHT_OF_ENTRY) * largest;
        mirror(self.inertia, self.independent)?;
        // Written so that NaN is not trusted.
        if !(REFINED_CONDITIONING.of::<S>() * weight * weight < S::ONE)
            || factor(self.inertia, self.independent).is_err()
        {
            return Ok(None);
        }
        let is_small = safe::<S>() * weight * weight < S::ONE;
        Ok(Some(if is_small { Entries::Small } else { Entries::Large(largest) }))
    }

    /// Computes a block of N and what it contributes to A = N^T G N; returns its largest entry.
    fn fill_block<const W: usize>(
        &mut self,
        index: usize,
        terms: &Terms<'_, S>,
        bias: Bias<'_, S>,
    ) -> Result<S, Error> {
        let Self { reduction, elimination, sweep, null_space, half, x, .. } = self;
        let Reduction { branches, independent, .. } = *reduction;
        let first = index * W;
        let count = independent.len() - first;
        let of_p = (count < W).then_some(count);
        let given = null_space.len();
        let n = blocks_mut::<S, W>(null_space, branches.len()).nth(index);
        let n = n.ok_or(Error::Length { expected: (first + W) * branches.len(), given })?;
        for (k, &branch) in independent.iter().enumerate() {
            let unit = |lane| if first + lane == k { S::ONE } else { S::ZERO };
            *at_mut(n, branch)? = core::array::from_fn(unit);
        }
        let at_p = |value: S| -> Block<S, W> {
            core::array::from_fn(|lane| if Some(lane) == of_p { value } else { S::ZERO })
        };
        elimination.substitute(reduction, n, bias.opening.iter().map(|&value| at_p(value)))?;
        let largest = largest_entries(n);
        let half = half.as_chunks_mut::<W>().0;
        sweep.half(branches, terms, n, half)?;
        if let Some(of_p) = of_p {
            for ((x, row), (half, branch)) in
                x.iter_mut().zip(&*n).zip(half.iter_mut().zip(branches))
            {
                *x = row.get(of_p).copied().unwrap_or(S::ZERO);
                // G p becomes G p - f.
                let force = bias.forces.get(usize::from(branch.joint));
                if let Some((half, &force)) = half.get_mut(of_p).zip(force) {
                    *half -= force;
                }
            }
        }
        self.take_block::<W>(index, of_p)?;
        Ok(largest.into_iter().take(count).fold(S::ZERO, S::max))
    }

    /// Takes G N of a block of speeds, and G p - f, back to the independent speeds: a part of A, and of N^T (f - M p).
    fn take_block<const W: usize>(
        &mut self,
        index: usize,
        of_p: Option<usize>,
    ) -> Result<(), Error> {
        let Self { reduction, elimination, null_space, half, x, inertia, balance, .. } = self;
        let Reduction { branches, independent, .. } = *reduction;
        let (d, first) = (independent.len(), index * W);
        let half = half.as_chunks_mut::<W>().0;
        let none = [S::ZERO; W];
        let of_bias = if d < W {
            let n = blocks::<S, W>(null_space, branches.len()).next().unwrap_or_default();
            let products = products(reduction, n, half)?;
            for (&branch, sums) in independent.iter().zip(&products) {
                *at_mut(half, branch)? = *sums;
            }
            products.get(d).copied().unwrap_or(none)
        } else {
            let sum = x.iter().zip(&*half).fold(none, |sum, (&x, row)| sum_of(x, row, &sum));
            elimination.take_back(reduction, half)?;
            sum
        };
        // p^T G N
        for (balance, sum) in balance.iter_mut().skip(first).zip(of_bias) {
            *balance -= sum;
        }
        let rows = inertia.chunks_exact_mut(d.max(1)).zip(balance.iter_mut());
        for (&branch, (row, balance)) in independent.iter().zip(rows) {
            let sums = at(half, branch)?;
            for (entry, &sum) in row.iter_mut().skip(first).zip(sums) {
                *entry = sum;
            }
            if let Some(&sum) = of_p.and_then(|of_p| sums.get(of_p)) {
                *balance -= sum;
            }
        }
        Ok(())
    }

    /// p, in the order of u, and N^T (f - M p).
    pub fn bias(&self, p: &mut [S], balance: &mut [S]) {
        self.write_x(p);
        for (place, &own) in balance.iter_mut().zip(&*self.balance) {
            *place = own;
        }
    }

    /// Adds to `x`, in the order of u, what J x lacks of what it has to be, by the order of the elimination: `wanted` becomes what
    /// it lacked. Returns the largest part of what was added.
    pub fn close(
        &mut self,
        terms: &Terms<'_, S>,
        wanted: &mut [S],
        x: &mut [S],
    ) -> Result<S, Error> {
        self.read_x(x);
        self.elimination.take_rows(&self.reduction, terms.closure, self.x, wanted)?;
        self.solve_closure(wanted)?;
        let mut largest = S::ZERO;
        for (&change, branch) in self.x.iter().zip(self.reduction.branches) {
            if let Some(x) = x.get_mut(usize::from(branch.joint)) {
                *x += change;
                largest = largest.max(change.abs());
            }
        }
        Ok(largest)
    }

    /// The largest u^2 / s^3 of the rows of J with pivots s, with the speeds of the joints that a row moves.
    pub fn rate(&mut self, u: &[S]) -> S {
        self.read_x(u);
        self.elimination.rate(&self.reduction, self.x)
    }

    /// Whether H and N^T (f - M p) are as exact as N.
    pub fn is_exact(&self) -> bool {
        self.independent < width(self.independent)
    }

    /// Solves J p = b with zeros for the independent joints, for b by the order of the elimination; writes p in the order
    /// of u.
    pub fn give(&mut self, wanted: &[S], out: &mut [S]) -> Result<(), Error> {
        self.solve_closure(wanted)?;
        self.write_x(out);
        Ok(())
    }

    /// x with zeros for the independent joints, so that J x = b.
    fn solve_closure(&mut self, wanted: &[S]) -> Result<(), Error> {
        self.x.fill(S::ZERO);
        let wanted = wanted.iter().map(|&value| [value]);
        self.elimination.substitute(&self.reduction, self.x.as_chunks_mut().0, wanted)
    }

    /// Reads x in the order of u.
    fn read_x(&mut self, x: &[S]) {
        for (place, branch) in self.x.iter_mut().zip(self.reduction.branches) {
            if let Some(&x) = x.get(usize::from(branch.joint)) {
                *place = x;
            }
        }
    }

    /// Writes x in the order of u.
    fn write_x(&self, out: &mut [S]) {
        for (&x, branch) in self.x.iter().zip(self.reduction.branches) {
            if let Some(place) = out.get_mut(usize::from(branch.joint)) {
                *place = x;
            }
        }
    }

    /// The row of N of a joint, by its place in u.
    pub fn row(&self, joint: usize, out: &mut [S]) {
        let mut branches = self.reduction.branches.iter();
        let Some(index) = branches.position(|branch| usize::from(branch.joint) == joint) else {
            return;
        };
        let width = width(self.independent);
        let blocks = self.null_space.chunks_exact((width * self.reduction.branches.len()).max(1));
        for (out, n) in out.chunks_mut(width).zip(blocks) {
            for (out, &value) in out.iter_mut().zip(n.iter().skip(index * width)) {
                *out = value;
            }
        }
    }

    /// N^T M x, for x in the order of u.
    pub fn momentum(&mut self, terms: &Terms<'_, S>, x: &[S], out: &mut [S]) -> Result<(), Error> {
        self.set_momenta(terms, x)?;
        self.reduce(out);
        Ok(())
    }

    /// N^T (f - M x), for f and x in the order of u.
    pub fn imbalance(
        &mut self,
        terms: &Terms<'_, S>,
        (f, x): (&[S], &[S]),
        out: &mut [S],
    ) -> Result<(), Error> {
        self.set_momenta(terms, x)?;
        for (momentum, branch) in self.momenta.iter_mut().zip(self.reduction.branches) {
            if let Some(&f) = f.get(usize::from(branch.joint)) {
                *momentum = f - *momentum;
            }
        }
        self.reduce(out);
        Ok(())
    }

    /// Computes M x, for x in the order of u.
    fn set_momenta(&mut self, terms: &Terms<'_, S>, x: &[S]) -> Result<(), Error> {
        self.read_x(x);
        self.sweep.whole(self.reduction.branches, terms, self.x, self.momenta)
    }

    /// N^T times the momenta.
    fn reduce(&self, out: &mut [S]) {
        match width(self.independent) {
            NARROW => reduce::<S, NARROW>(self.null_space, self.momenta, out),
            _ => reduce::<S, WIDE>(self.null_space, self.momenta, out),
        }
    }

    /// H^-1 (r + B^T mu) in place of r, with B y = b for the driven joints; returns whether that can be trusted.
    pub fn solve(&self, r: &mut [S], driven: &mut Driven<'_, S>, met: Met) -> Result<bool, Error> {
        forward(self.inertia, r);
        let is_trusted = driven.push(self.inertia, r)?;
        backward(self.inertia, r);
        Ok(is_trusted && (met == Met::Elsewhere || driven.is_met(r)))
    }

    /// `out += sign N y`, in the order of u.
    pub fn combine(&mut self, sign: S, y: &[S], out: &mut [S]) {
        self.row.fill(S::ZERO);
        for (place, &y) in self.row.iter_mut().zip(y) {
            *place = sign * y;
        }
        match width(self.independent) {
            NARROW => self.combine_blocks::<NARROW>(out),
            _ => self.combine_blocks::<WIDE>(out),
        }
    }

    fn combine_blocks<const W: usize>(&self, out: &mut [S]) {
        let branches = self.reduction.branches;
        let (rows, y) = (self.null_space.as_chunks::<W>().0, self.row.as_chunks::<W>().0);
        for (index, branch) in branches.iter().enumerate() {
            let mut sums = [S::ZERO; W];
            for (n, y) in rows.iter().skip(index).step_by(branches.len()).zip(y) {
                sums = core::array::from_fn(|lane| n[lane].mul_add(y[lane], sums[lane]));
            }
            if let Some(out) = out.get_mut(usize::from(branch.joint)) {
                *out += total(&sums);
            }
        }
    }
}
