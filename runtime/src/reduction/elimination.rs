//! The elimination of the closure: L U of the rows of J that determine the dependent joints, and what follows from it.
//!
//! Where the pivots are and which entries there can be is known before ([`Reduction`]). A row of J is named by the joint that it
//! determines, and L has the independent joints' entries of J beside its own:
//!
//! ```text
//! J x = b        z_i = b_i - sum L_ij z_j        x_i = (z_i - sum U_ij x_j) / pivot_i        z_i = x_i of independent joints
//! ```
//!
//! A step takes the rows of one loop, at most [`ROWS`], which have entries for the same joints: what is read of a joint serves
//! for all of them, and there are fewer short loops, whose ends a processor does not foresee. The rows of a step are built
//! in a place of their own for every joint (T. A. Davis, "Direct Methods for Sparse Linear Systems", 2006, 6.2, by rows
//! instead of columns).

use super::blocks::{Block, at, at_mut, sum_of};
use super::fading::SPOILING_PIVOT;
use super::pattern::ROWS;
use super::{Reduction, ReductionSizes};
use crate::constants::WEAK_SHARE;
use crate::linear::dot;
use crate::workspace::split;
use crate::{Error, Scalar};

/// Numbers of a step: one for each row, and nothing in the rest, so that they fill a register of the processor.
const LANES: usize = 4;

/// A number for each row of a step.
type Step<S> = [S; LANES];

/// The entries of L and U within a step: of each row, those of the joints of the rows before it, or after it.
type Within<S> = [Step<S>; ROWS];

/// L, U and the pivots at a state.
pub(super) struct Elimination<'a, S> {
    /// L, as [`Reduction::lower`] orders it.
    lower: &'a mut [Step<S>],
    /// U, as [`Reduction::upper`] orders it.
    upper: &'a mut [Step<S>],
    /// By step: L and U of its own joints, and 1 / pivot on the diagonal.
    within: &'a mut [Within<S>],
    /// The rows of the present step, by branch; zeros else.
    rows: &'a mut [Step<S>],
}

/// Joints that are independent because their rows of J are left out: a number for each branch that is not 0, where there are some.
#[derive(Clone, Copy)]
pub(super) struct Freed<'a, S>(pub Option<&'a [S]>);

impl<S: Scalar> Freed<'_, S> {
    pub fn contains(self, joint: u16) -> bool {
        self.0
            .is_some_and(|flags| flags.get(usize::from(joint)).is_some_and(|&flag| flag != S::ZERO))
    }
}

/// Numbers that [`Elimination`] needs.
pub(super) const fn elimination_len(sizes: ReductionSizes) -> usize {
    LANES * (sizes.factors + sizes.branches)
}

impl<'a, S: Scalar> Elimination<'a, S> {
    /// Room for it.
    pub fn of(reduction: &Reduction<'_, S>, workspace: &mut &'a mut [S]) -> Result<Self, Error> {
        let mut steps = |count| Ok(split(workspace, LANES * count)?.as_chunks_mut().0);
        Ok(Self {
            lower: steps(reduction.lower.columns.len())?,
            upper: steps(reduction.upper.columns.len())?,
            within: steps(ROWS * reduction.steps.len())?.as_chunks_mut().0,
            rows: steps(reduction.branches.len())?,
        })
    }

    /// Computes L and U of the rows of J, `closure`; returns the largest inverse pivot. The rows of joints that are `freed` are those
    /// of the joint alone.
    pub fn factor(
        &mut self,
        reduction: &Reduction<'_, S>,
        closure: &[S],
        freed: Freed<'_, S>,
    ) -> Result<S, Error> {
        let Self { lower, upper, within, rows } = self;
        let mut largest = S::ZERO;
        rows.fill([S::ZERO; LANES]);
        for (step, joints) in reduction.steps.iter().enumerate() {
            for (row, &joint) in joints.iter().enumerate() {
                if freed.contains(joint) {
                    at_mut(rows, joint)?[row] = S::ONE;
                    continue;
                }
                for (&column, &entry) in reduction.closure.of(joint.into(), closure) {
                    at_mut(rows, column)?[row] = entry;
                }
            }
            let (done, rest) = within.split_at_mut(step);
            for (&column, place) in reduction.lower.of_mut(step, lower) {
                let mut factors = take(rows, column)?;
                let of_column = usize::from(*at(reduction.places, column)?);
                let (before, row) = (of_column / ROWS, of_column % ROWS);
                if let Some((own, others)) = done.get(before).zip(reduction.steps.get(before)) {
                    factors = factors.map(|factor| factor * own[row][row]);
                    for (&other, &entry) in others.iter().zip(&own[row]).skip(row + 1) {
                        if let Some(other) = rows.get_mut(usize::from(other)) {
                            *other = sum_of(-entry, &factors, other);
                        }
                    }
                    for (&column, entries) in reduction.upper.of(before, upper) {
                        let place = at_mut(rows, column)?;
                        *place = sum_of(-entries[row], &factors, place);
                    }
                }
                *place = factors;
            }
            let Some(own) = rest.first_mut() else { break };
            largest = largest.max(factor_step(joints, rows, own));
            for (&column, place) in reduction.upper.of_mut(step, upper) {
                let mut entries = take(rows, column)?;
                entries[1] = (-own[1][0]).mul_add(entries[0], entries[1]);
                entries[2] = (-own[2][0]).mul_add(entries[0], entries[2]);
                entries[2] = (-own[2][1]).mul_add(entries[1], entries[2]);
                *place = entries;
            }
        }
        Ok(largest)
    }

    /// The first joint that is not `freed` whose pivot spoils the rows after it: less than a hundredth of the length of its row of J.
    pub fn first_unsuitable(
        &self,
        reduction: &Reduction<'_, S>,
        closure: &[S],
        freed: Freed<'_, S>,
    ) -> Option<u16> {
        let (weak, spoiling) = (S::from_f64(WEAK_SHARE), S::from_f64(SPOILING_PIVOT));
        let pivots = self.within.iter().flat_map(|within| (0..ROWS).map(|row| within[row][row]));
        let mut joints = reduction.steps.as_flattened().iter().copied().zip(pivots);
        let is_unsuitable = |&(joint, inverse): &(u16, S)| {
            let row = reduction.closure.entries_of(joint.into(), closure);
            let least = spoiling.min(weak * dot(row, row).sqrt());
            // Written so that NaN is not suitable.
            usize::from(joint) < reduction.branches.len()
                && !freed.contains(joint)
                && !(inverse.abs() * least <= S::ONE)
        };
        joints.find(is_unsuitable).map(|(joint, _)| joint)
    }

    /// The dependent joints' rows of x beside those of the independent joints, which are given, so that J x = b, for b by the order
    /// of the elimination.
    #[inline(always)]
    pub fn substitute<const W: usize>(
        &self,
        reduction: &Reduction<'_, S>,
        x: &mut [Block<S, W>],
        mut wanted: impl Iterator<Item = Block<S, W>>,
    ) -> Result<(), Error> {
        let steps = || reduction.steps.iter().zip(&*self.within).enumerate();
        for (step, (joints, within)) in steps() {
            let mut next = |joint: u16| match x.get(usize::from(joint)) {
                Some(_) => wanted.next().unwrap_or([S::ZERO; W]),
                None => [S::ZERO; W],
            };
            let [mut a, mut b, mut c] = [next(joints[0]), next(joints[1]), next(joints[2])];
            for (&column, factors) in reduction.lower.of(step, self.lower) {
                let x = at(x, column)?;
                a = sum_of(-factors[0], x, &a);
                b = sum_of(-factors[1], x, &b);
                c = sum_of(-factors[2], x, &c);
            }
            b = sum_of(-within[1][0], &a, &b);
            c = sum_of(-within[2][0], &a, &c);
            c = sum_of(-within[2][1], &b, &c);
            put(x, *joints, [&a, &b, &c]);
        }
        for (step, (joints, within)) in steps().rev() {
            let [mut a, mut b, mut c] = [get(x, joints[0]), get(x, joints[1]), get(x, joints[2])];
            for (&column, entries) in reduction.upper.of(step, self.upper) {
                let x = at(x, column)?;
                a = sum_of(-entries[0], x, &a);
                b = sum_of(-entries[1], x, &b);
                c = sum_of(-entries[2], x, &c);
            }
            c = times(within[2][2], &c);
            b = times(within[1][1], &sum_of(-within[1][2], &c, &b));
            a = sum_of(-within[0][2], &c, &sum_of(-within[0][1], &b, &a));
            a = times(within[0][0], &a);
            put(x, *joints, [&a, &b, &c]);
        }
        Ok(())
    }

    /// Takes J x from `wanted`, by the order of the elimination, for x by branch, but not for joints that are `freed`.
    pub fn take_rows(
        &self,
        reduction: &Reduction<'_, S>,
        closure: &[S],
        x: &[S],
        wanted: &mut [S],
        freed: Freed<'_, S>,
    ) -> Result<(), Error> {
        let rows = reduction.dependent().zip(wanted).filter(|(joint, _)| !freed.contains(*joint));
        for (joint, wanted) in rows {
            for (&column, &entry) in reduction.closure.of(joint.into(), closure) {
                *wanted = (-entry).mul_add(*at(x, column)?, *wanted);
            }
        }
        Ok(())
    }

    /// The largest u^2 / s^3 of the rows with pivots s, with the speeds of the joints that have entries in L or U, for u by branch.
    pub fn rate(&self, reduction: &Reduction<'_, S>, u: &[S]) -> S {
        let mut largest = S::ZERO;
        for (step, (joints, within)) in reduction.steps.iter().zip(&*self.within).enumerate() {
            let others =
                reduction.lower.columns_of(step).iter().chain(reduction.upper.columns_of(step));
            let speeds = joints.iter().chain(others).filter_map(|&joint| u.get(usize::from(joint)));
            let square = speeds.fold(S::ZERO, |sum, &u| u.mul_add(u, sum));
            let inverse = within.iter().enumerate().fold(S::ZERO, |most, (row, within)| {
                within.get(row).map_or(most, |inverse| most.max(inverse.abs()))
            });
            largest = largest.max(square * inverse * inverse * inverse);
        }
        largest
    }

    /// The transpose of [`substitute`](Self::substitute), in place: rows of independent joints become the sums over all joints of
    /// their entries of N times the joint's row; where the rows `of_all` joints are wanted, those of the others become the same for what
    /// their rows of J have to be.
    pub fn take_back<const W: usize>(
        &self,
        reduction: &Reduction<'_, S>,
        x: &mut [Block<S, W>],
        of_all: bool,
    ) -> Result<(), Error> {
        let steps = || reduction.steps.iter().zip(&*self.within).enumerate();
        for (step, (joints, within)) in steps() {
            let [mut a, mut b, mut c] = [get(x, joints[0]), get(x, joints[1]), get(x, joints[2])];
            a = times(within[0][0], &a);
            b = times(within[1][1], &sum_of(-within[0][1], &a, &b));
            c = sum_of(-within[1][2], &b, &sum_of(-within[0][2], &a, &c));
            c = times(within[2][2], &c);
            put(x, *joints, [&a, &b, &c]);
            for (&column, entries) in reduction.upper.of(step, self.upper) {
                let x = at_mut(x, column)?;
                *x = sum_of(-entries[0], &a, x);
                *x = sum_of(-entries[1], &b, x);
                *x = sum_of(-entries[2], &c, x);
            }
        }
        for (step, (joints, within)) in steps().rev() {
            let [mut a, mut b, c] = [get(x, joints[0]), get(x, joints[1]), get(x, joints[2])];
            b = sum_of(-within[2][1], &c, &b);
            a = sum_of(-within[1][0], &b, &sum_of(-within[2][0], &c, &a));
            if of_all {
                put(x, *joints, [&a, &b, &c]);
            }
            for (&column, factors) in reduction.lower.of(step, self.lower) {
                let x = at_mut(x, column)?;
                *x = sum_of(-factors[0], &a, x);
                *x = sum_of(-factors[1], &b, x);
                *x = sum_of(-factors[2], &c, x);
            }
        }
        Ok(())
    }
}

/// Factors the rows of a step at its own joints, and takes them out of `rows`; returns the largest inverse pivot.
fn factor_step<S: Scalar>(joints: &[u16; ROWS], rows: &mut [Step<S>], within: &mut Within<S>) -> S {
    let columns = joints.map(|joint| match rows.get_mut(usize::from(joint)) {
        Some(column) => core::mem::replace(column, [S::ZERO; LANES]),
        None => [S::ZERO; LANES],
    });
    *within = core::array::from_fn(|row| {
        core::array::from_fn(|lane| columns.get(lane).map_or(S::ZERO, |column| column[row]))
    });
    let mut largest = S::ZERO;
    for (pivot, &joint) in joints.iter().enumerate() {
        if usize::from(joint) >= rows.len() {
            break;
        }
        let inverse = S::ONE / within[pivot][pivot];
        largest = largest.max(inverse.abs());
        within[pivot][pivot] = inverse;
        for row in pivot + 1..ROWS {
            let factor = within[row][pivot] * inverse;
            within[row][pivot] = factor;
            for column in pivot + 1..ROWS {
                within[row][column] = (-factor).mul_add(within[pivot][column], within[row][column]);
            }
        }
    }
    largest
}

/// The row of a joint; zeros if there is none.
#[inline(always)]
fn get<S: Scalar, const W: usize>(x: &[Block<S, W>], joint: u16) -> Block<S, W> {
    match x.get(usize::from(joint)) {
        Some(row) => *row,
        None => [S::ZERO; W],
    }
}

/// Writes the rows of joints.
#[inline(always)]
fn put<S: Scalar, const W: usize>(
    x: &mut [Block<S, W>],
    joints: [u16; ROWS],
    rows: [&Block<S, W>; ROWS],
) {
    for (joint, row) in joints.into_iter().zip(rows) {
        if let Some(place) = x.get_mut(usize::from(joint)) {
            *place = *row;
        }
    }
}

/// `factor x`.
#[inline(always)]
fn times<S: Scalar, const W: usize>(factor: S, x: &Block<S, W>) -> Block<S, W> {
    core::array::from_fn(|lane| factor * x[lane])
}

/// Takes what is at a joint out of the rows.
#[inline(always)]
fn take<S: Scalar>(rows: &mut [Step<S>], column: u16) -> Result<Step<S>, Error> {
    Ok(core::mem::replace(at_mut(rows, column)?, [S::ZERO; LANES]))
}
