//! What a mechanism with a reduction to independent speeds says of itself.

use core::ops::Range;

use crate::Error;
use crate::constants::FEW_SPEEDS;
use crate::plumbing::ReductionMut;

/// Rows of J that a step of the elimination takes, at most: a vertex of a sheet has three.
pub const ROWS: usize = 3;

/// How the speeds of a mechanism follow from those of its independent joints: the same at every state.
///
/// Joints are given by their place in `branches`.
#[derive(Clone, Copy)]
pub struct Reduction<'a, S> {
    /// The joints of the spanning tree: each is followed by all joints beyond it.
    pub branches: &'a [Branch],
    /// The joints whose speeds are independent.
    pub independent: &'a [u16],
    /// The other joints, in the order in which their speeds are eliminated: each step takes rows of one loop, which determine
    /// these joints. `u16::MAX` where it has fewer rows.
    pub steps: &'a [[u16; ROWS]],
    /// In the same order, which of the C rows of [`write_equations`](crate::Mechanism::write_equations) it is that determines each of
    /// these joints.
    pub rows: &'a [u32],
    /// For each joint, the place of its row among those of all steps; `u16::MAX` for independent joints.
    pub places: &'a [u16],
    /// By joint, the joints that move what closes a loop, for the row of J that determines this joint.
    pub closure: Rows<'a>,
    /// L by step: the joints before it, and the independent ones, that are eliminated from its rows of J.
    pub lower: Rows<'a>,
    /// U by step: the joints after it that are left in its rows of J.
    pub upper: Rows<'a>,
    /// Whether it is for driven joints, those at stops, and states next to singular ones only: straight-line code solves elsewhere.
    pub is_beside_solution: bool,
    /// What depends on the state.
    pub parts: &'a dyn ReductionParts<S>,
}

impl<'a, S> Reduction<'a, S> {
    /// The joints that are not independent, in the order in which they are eliminated.
    pub(super) fn dependent(&self) -> impl Iterator<Item = u16> + Clone + use<'a, S> {
        let (steps, count) = (self.steps, self.branches.len());
        steps.as_flattened().iter().copied().filter(move |&joint| usize::from(joint) < count)
    }
}

/// Where the rows of a sparse matrix have entries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Rows<'a> {
    /// The end of each row in `columns`.
    pub ends: &'a [u32],
    /// The joint of each entry.
    pub columns: &'a [u16],
}

impl<'a> Rows<'a> {
    /// The joints of a row, and its entries.
    #[inline(always)]
    pub(super) fn of<T>(
        &self,
        row: usize,
        entries: &'a [T],
    ) -> impl DoubleEndedIterator<Item = (&'a u16, &'a T)> {
        self.columns_of(row).iter().zip(entries.get(self.range(row)).unwrap_or_default())
    }

    /// As [`of`](Self::of), to write to.
    #[inline(always)]
    pub(super) fn of_mut<'s, T>(
        &self,
        row: usize,
        entries: &'s mut [T],
    ) -> impl Iterator<Item = (&'s u16, &'s mut T)>
    where
        'a: 's,
    {
        self.columns_of(row).iter().zip(entries.get_mut(self.range(row)).unwrap_or_default())
    }

    /// The entries of a row.
    pub(super) fn entries_of<'s, T>(&self, row: usize, entries: &'s [T]) -> &'s [T] {
        entries.get(self.range(row)).unwrap_or_default()
    }

    /// As [`entries_of`](Self::entries_of), to write to.
    pub(super) fn entries_of_mut<'s, T>(&self, row: usize, entries: &'s mut [T]) -> &'s mut [T] {
        entries.get_mut(self.range(row)).unwrap_or_default()
    }

    /// The joints of a row.
    #[inline(always)]
    pub(super) fn columns_of(&self, row: usize) -> &'a [u16] {
        self.columns.get(self.range(row)).unwrap_or_default()
    }

    #[inline(always)]
    fn range(&self, row: usize) -> Range<usize> {
        let end = |row: usize| self.ends.get(row).map_or(0, |&end| end as usize);
        row.checked_sub(1).map_or(0, end)..end(row)
    }
}

/// What a mechanism writes for a [`Reduction`].
pub trait ReductionParts<S> {
    /// What du/dt needs: `opening`, by the order of elimination, is what the rows of J times du/dt have to be; `forces`,
    /// NU, N m, are f.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_acceleration(
        &self,
        at: (S, &[S], &[S]),
        out: ReductionMut<'_, S>,
        opening: &mut [S],
        forces: &mut [S],
    ) -> Result<(), Error>;

    /// The same for a projection of q and u: the residuals, 9 L, m, and by the order of elimination what the rows of J times
    /// what is to be taken from q and from u have to be.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_projection(
        &self,
        q: &[S],
        u: &[S],
        out: ReductionMut<'_, S>,
        residual: &mut [S],
        openings: [&mut [S]; 2],
    ) -> Result<(), Error>;
}

/// A joint of the spanning tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Branch {
    /// Its place in q and u.
    pub joint: u16,
    /// The number of joints between it and the ground.
    pub depth: u16,
}

impl Branch {
    /// Joints with their depths.
    #[must_use]
    pub const fn all<const COUNT: usize>(pairs: [(u16, u16); COUNT]) -> [Self; COUNT] {
        let mut all = [Self { joint: 0, depth: 0 }; COUNT];
        let mut index = 0;
        while index < COUNT {
            let (joint, depth) = pairs[index];
            all[index] = Self { joint, depth };
            index += 1;
        }
        all
    }
}

/// Sizes of a [`Reduction`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ReductionSizes {
    /// Joints of the tree.
    pub branches: usize,
    /// The greatest number of joints on the way from the ground.
    pub depth: usize,
    /// Independent joints.
    pub independent: usize,
    /// Entries of [`Reduction::closure`].
    pub closure: usize,
    /// Joints in [`Reduction::lower`] and [`Reduction::upper`], and [`ROWS`] for each step: each has a number for each row of a
    /// step.
    pub factors: usize,
}

impl ReductionSizes {
    /// Those of mechanisms that have no reduction.
    pub const NONE: Self = Self { branches: 0, depth: 0, independent: 0, closure: 0, factors: 0 };

    /// Whether rows of J may be left out of a mechanism of so many speeds. With fewer, a decomposition costs little.
    pub const fn may_leave_out(speeds: usize) -> bool {
        speeds > 2 * FEW_SPEEDS
    }

    /// Independent joints at most, where rows of J are left out: one for each loop.
    pub(super) const fn most_independent(self, speeds: usize, loops: usize) -> usize {
        self.independent + if Self::may_leave_out(speeds) { loops } else { 0 }
    }

    /// Dependent joints: the rows of J that are needed.
    #[must_use]
    pub const fn dependent(self) -> usize {
        self.branches - self.independent
    }
}
