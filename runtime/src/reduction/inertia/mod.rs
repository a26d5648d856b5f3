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

mod factor;
mod vectors;

use self::factor::factor_sum;
use super::blocks::{
    Block, LINE, MOST_TO_LINE, NARROW, WIDE, at, at_mut, blocks, blocks_mut, largest_entries,
    mirror, padded, products, sum_of, width,
};
use super::elimination::{Elimination, Freed, elimination_len};
use super::sweep::{Sweep, sweep_len};
use super::{Reduction, ReductionSizes, Terms};
use crate::constants::{REFINED_CONDITIONING, WEIGHT_OF_ENTRY};
use crate::linear::{factor, rows_of_mut};
use crate::trust::{Trust, safe};
use crate::workspace::split;
use crate::{Error, Scalar};

/// How large the entries of N are.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Entries<S> {
    pub largest: S,
    /// Whether this is so small that rounding does no harm.
    pub are_small: bool,
}

/// N and the factor of H at a state.
pub(super) struct Inertia<'a, S> {
    reduction: Reduction<'a, S>,
    /// d, the number of independent speeds.
    independent: usize,
    /// By branch: 1 for joints that are independent because their rows of J are left out, -1 because they are torn, else 0.
    freed: &'a mut [S],
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

/// Numbers that [`Inertia`] needs, for `d` independent speeds at most.
pub(super) const fn inertia_len(sizes: ReductionSizes, d: usize) -> usize {
    let ReductionSizes { branches, depth, .. } = sizes;
    let in_blocks = padded(d) * (branches + 1) + width(d) * branches;
    elimination_len(sizes)
        + MOST_TO_LINE
        + in_blocks
        + sweep_len(depth, width(d))
        + 2 * branches
        + branches
        + d * d
        + d
}

impl<'a, S: Scalar> Inertia<'a, S> {
    /// Room for it, for so many independent speeds at most.
    pub fn of(
        reduction: Reduction<'a, S>,
        sizes: ReductionSizes,
        most: usize,
        workspace: &mut &'a mut [S],
    ) -> Result<Self, Error> {
        let ReductionSizes { branches, depth, independent, .. } = sizes;
        let padded = padded(most);
        let elimination = Elimination::of(&reduction, workspace)?;
        let to_line = workspace.as_ptr().align_offset(LINE);
        split(workspace, to_line.min(MOST_TO_LINE))?;
        let null_space = split(workspace, padded * branches)?;
        let half = split(workspace, width(most) * branches)?;
        let row = split(workspace, padded)?;
        let sweep = Sweep::of(depth, width(most), workspace)?;
        let (x, momenta) = (split(workspace, branches)?, split(workspace, branches)?);
        let inertia = split(workspace, most * most)?;
        let balance = split(workspace, most)?;
        let freed = split(workspace, branches)?;
        Ok(Self {
            reduction,
            independent,
            freed,
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

    /// Every row of J counts again.
    pub fn keep_rows(&mut self) {
        self.independent = self.reduction.independent.len();
        self.freed.fill(S::ZERO);
    }

    /// Leaves out the row of J of a joint. Returns whether there is room for one more independent speed.
    pub fn leave_out(&mut self, joint: u16) -> Result<bool, Error> {
        self.free(joint, S::ONE)
    }

    fn free(&mut self, joint: u16, how: S) -> Result<bool, Error> {
        if (self.independent + 1) * (self.independent + 1) > self.inertia.len() {
            return Ok(false);
        }
        *at_mut(self.freed, joint)? = how;
        self.independent += 1;
        Ok(true)
    }

    /// Eliminates the closure, and tears rows whose pivots fade without them, so that they are conditions on independent speeds
    /// ([`Driven`](super::driven::Driven)): rows after them would lose digits. Returns whether there is room for that.
    pub fn eliminate_suitably(&mut self, terms: &Terms<'_, S>) -> Result<bool, Error> {
        loop {
            let Self { reduction, elimination, .. } = self;
            let freed = match self.independent > reduction.independent.len() {
                true => Freed(Some(&*self.freed)),
                false => Freed(None),
            };
            elimination.factor(reduction, terms.closure, freed)?;
            match elimination.first_unsuitable(reduction, terms.closure, freed) {
                None => return Ok(true),
                Some(joint) if self.free(joint, -S::ONE)? => {}
                Some(_) => return Ok(false),
            }
        }
    }

    /// The number of rows of J that the elimination does without.
    pub fn left_out(&self) -> usize {
        self.independent - self.reduction.independent.len()
    }

    /// Whether there is room for joints whose rows of J are left out.
    pub fn may_free(&self) -> bool {
        self.inertia.len() > self.reduction.independent.len() * self.reduction.independent.len()
    }

    /// The joints whose rows of J are left out.
    fn freed(&self) -> Freed<'_, S> {
        Freed(self.is_freed().then_some(&*self.freed))
    }

    /// Whether rows of J are left out.
    pub fn is_freed(&self) -> bool {
        self.left_out() > 0
    }

    /// Eliminates the closure; returns how far that can be trusted.
    pub fn eliminate(&mut self, terms: &Terms<'_, S>) -> Result<Trust<S>, Error> {
        let inverse_pivot = self.elimination.factor(&self.reduction, terms.closure, Freed(None))?;
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
        let is_freed = self.is_freed();
        let inertia = rows_of_mut(self.inertia, self.independent, 0..self.independent)?;
        // Written so that NaN is not trusted.
        if !(REFINED_CONDITIONING.of::<S>() * weight * weight < S::ONE) {
            return Ok(None);
        }
        let is_positive = if self.independent < W {
            let half = self.half.as_chunks::<W>().0;
            let row = |branch: u16| half.get(usize::from(branch)).copied().unwrap_or([S::ZERO; W]);
            let rows = independent_joints(self.reduction, is_freed.then_some(&*self.freed));
            factor_sum::<S, W>(rows.map(row), inertia, self.independent)
        } else {
            mirror(inertia, self.independent)?;
            factor(inertia, self.independent).is_ok()
        };
        if !is_positive {
            return Ok(None);
        }
        Ok(Some(Entries { largest, are_small: safe::<S>() * weight * weight < S::ONE }))
    }

    /// Computes a block of N and what it contributes to A = N^T G N; returns its largest entry.
    fn fill_block<const W: usize>(
        &mut self,
        index: usize,
        terms: &Terms<'_, S>,
        bias: Bias<'_, S>,
    ) -> Result<S, Error> {
        let is_freed = self.is_freed();
        let d = self.independent;
        let Self { reduction, freed, elimination, sweep, null_space, half, x, .. } = self;
        let Reduction { branches, independent, .. } = *reduction;
        let first = index * W;
        let count = d - first;
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
        if is_freed {
            substitute_freed(
                elimination,
                reduction,
                Freed(Some(freed)),
                n,
                (first, bias.opening, of_p),
            )?;
        } else {
            elimination.substitute(reduction, n, bias.opening.iter().map(|&value| at_p(value)))?;
        }
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
        let (d, is_freed) = (self.independent, self.is_freed());
        let Self { reduction, freed, elimination, null_space, half, x, inertia, balance, .. } =
            self;
        let branches = reduction.branches;
        let first = index * W;
        let independent = || independent_joints(*reduction, is_freed.then_some(&**freed));
        let half = half.as_chunks_mut::<W>().0;
        let none = [S::ZERO; W];
        let of_bias = if d < W {
            let n = blocks::<S, W>(null_space, branches.len()).next().unwrap_or_default();
            let products = products(reduction, d, n, half)?;
            for (branch, sums) in independent().zip(&products) {
                *at_mut(half, branch)? = *sums;
            }
            products.get(d).copied().unwrap_or(none)
        } else {
            let sum = x.iter().zip(&*half).fold(none, |sum, (&x, row)| sum_of(x, row, &sum));
            elimination.take_back(reduction, half, is_freed)?;
            sum
        };
        // p^T G N
        for (balance, sum) in balance.iter_mut().skip(first).zip(of_bias) {
            *balance -= sum;
        }
        let rows = inertia.chunks_exact_mut(d.max(1)).zip(balance.iter_mut());
        for (branch, (row, balance)) in independent().zip(rows) {
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

    /// Whether H and N^T (f - M p) are as exact as N.
    pub fn is_exact(&self) -> bool {
        self.independent < width(self.independent)
    }
}

/// The independent joints, and after them those that are `freed`.
fn independent_joints<'s, S: Scalar>(
    reduction: Reduction<'s, S>,
    freed: Option<&'s [S]>,
) -> impl Iterator<Item = u16> + use<'s, S> {
    let is_freed = move |&joint: &u16| Freed(freed).contains(joint);
    let more = reduction.dependent().filter(move |_| freed.is_some()).filter(is_freed);
    reduction.independent.iter().copied().chain(more)
}

/// As [`Elimination::substitute`] for a block of N that begins with this column, where rows of J are left out: the joint of each has a
/// column of its own after those of the independent joints. A function of its own, so that other states do without its code.
#[inline(never)]
fn substitute_freed<S: Scalar, const W: usize>(
    elimination: &Elimination<'_, S>,
    reduction: &Reduction<'_, S>,
    freed: Freed<'_, S>,
    n: &mut [Block<S, W>],
    (first, opening, of_p): (usize, &[S], Option<usize>),
) -> Result<(), Error> {
    let mut next = reduction.independent.len();
    let wanted = reduction.dependent().enumerate().map(|(row, joint)| {
        let mut block = [S::ZERO; W];
        if let Some((place, &value)) =
            of_p.and_then(|of_p| block.get_mut(of_p)).zip(opening.get(row))
        {
            *place = value;
        }
        if freed.contains(joint) {
            let lane = next.checked_sub(first).and_then(|lane| block.get_mut(lane));
            lane.into_iter().for_each(|lane| *lane = S::ONE);
            next += 1;
        }
        block
    });
    elimination.substitute(reduction, n, wanted)
}
