//! What N and H of a state do to vectors of speeds, of momenta and of forces.

use super::Inertia;
use crate::linear::{backward, dot, forward};
use crate::reduction::Terms;
use crate::reduction::blocks::{NARROW, WIDE, padded, reduce, total, width};
use crate::reduction::driven::{Driven, Met};
use crate::reduction::elimination::Freed;
use crate::{Error, Scalar};

impl<S: Scalar> Inertia<'_, S> {
    /// Adds to `x`, in the order of u, what J x lacks of what it has to be, by the order of the elimination: `wanted` becomes what
    /// it lacked. Returns the largest part of what was added.
    pub fn close(
        &mut self,
        terms: &Terms<'_, S>,
        wanted: &mut [S],
        x: &mut [S],
    ) -> Result<S, Error> {
        self.read_x(x);
        self.elimination.take_rows(&self.reduction, terms.closure, self.x, wanted, self.freed())?;
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

    /// Solves J p = b with zeros for the independent joints, for b by the order of the elimination; writes p in the order
    /// of u.
    pub fn give(&mut self, wanted: &[S], out: &mut [S]) -> Result<(), Error> {
        self.solve_closure(wanted)?;
        self.write_x(out);
        Ok(())
    }

    /// x with zeros for the independent joints, so that J x = b.
    fn solve_closure(&mut self, wanted: &[S]) -> Result<(), Error> {
        let Self { reduction, elimination, freed, x, .. } = self;
        let freed = match self.independent > reduction.independent.len() {
            true => Freed(Some(&**freed)),
            false => Freed(None),
        };
        x.fill(S::ZERO);
        let value = |(joint, &value)| [if freed.contains(joint) { S::ZERO } else { value }];
        let wanted = reduction.dependent().zip(wanted).map(value);
        elimination.substitute(reduction, x.as_chunks_mut().0, wanted)
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
    pub(super) fn write_x(&self, out: &mut [S]) {
        for (&x, branch) in self.x.iter().zip(self.reduction.branches) {
            if let Some(place) = out.get_mut(usize::from(branch.joint)) {
                *place = x;
            }
        }
    }

    /// The row of N of a joint, by its place in u.
    pub fn row(&self, joint: usize, out: &mut [S]) {
        let mut branches = self.reduction.branches.iter();
        if let Some(branch) = branches.position(|branch| usize::from(branch.joint) == joint) {
            out.fill(S::ZERO);
            self.add_row(branch, S::ONE, out);
        }
    }

    /// Adds a multiple of the row of N of a branch.
    fn add_row(&self, branch: usize, factor: S, out: &mut [S]) {
        let width = width(self.independent);
        let blocks = self.null_space.chunks_exact((width * self.reduction.branches.len()).max(1));
        for (out, n) in out.chunks_mut(width).zip(blocks) {
            for (out, &value) in out.iter_mut().zip(n.iter().skip(branch * width)) {
                *out = factor.mul_add(value, *out);
            }
        }
    }

    /// The places, in the order of the elimination, and the joints of rows that are torn.
    pub fn torn(&self) -> impl Iterator<Item = (usize, u16)> {
        let is_torn = |&(_, joint): &(usize, u16)| {
            self.freed.get(usize::from(joint)).is_some_and(|&how| how == -S::ONE)
        };
        let most = if self.is_freed() { usize::MAX } else { 0 };
        self.reduction.dependent().enumerate().take(most).filter(is_torn)
    }

    /// What a torn row demands of the independent speeds: the row times N, and what that has to be for the row times x to be `wanted`; over
    /// the length of the row.
    pub fn condition(
        &self,
        terms: &Terms<'_, S>,
        joint: u16,
        (wanted, x): (S, &[S]),
        row: &mut [S],
    ) -> S {
        let torn = self.reduction.closure.entries_of(joint.into(), terms.closure);
        let scale = S::ONE / dot(torn, torn).sqrt();
        let mut lack = wanted;
        row.fill(S::ZERO);
        for (&column, &entry) in self.reduction.closure.of(joint.into(), terms.closure) {
            self.add_row(column.into(), scale * entry, row);
            let branch = self.reduction.branches.get(usize::from(column));
            if let Some(&x) = branch.and_then(|branch| x.get(usize::from(branch.joint))) {
                lack = (-entry).mul_add(x, lack);
            }
        }
        scale * lack
    }

    /// By branch what a force on the joints, given in the order of u, is for what the rows of J of dependent joints have to be.
    pub fn take_back(&mut self, force: &[S]) -> Result<&[S], Error> {
        self.read_x(force);
        self.elimination.take_back(&self.reduction, self.x.as_chunks_mut::<1>().0, true)?;
        Ok(self.x)
    }

    /// The direction `k` along the closure of a basis that is orthonormal in M, N L^-T with the factor L of H, in the order of u; d numbers
    /// of `room` are lost.
    pub fn direction(&mut self, k: usize, room: &mut [S], out: &mut [S]) {
        for (place, y) in room.iter_mut().enumerate() {
            *y = if place == k { S::ONE } else { S::ZERO };
        }
        backward(self.inertia, room);
        out.fill(S::ZERO);
        self.combine(S::ONE, room, out);
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
        // There is room for more blocks than there are.
        let row = self.row.get(..padded(self.independent)).unwrap_or_default();
        let (rows, y) = (self.null_space.as_chunks::<W>().0, row.as_chunks::<W>().0);
        for (index, branch) in branches.iter().enumerate() {
            let mut sums = [S::ZERO; W];
            for (n, y) in rows.iter().skip(index).step_by(branches.len()).zip(y) {
                for ((sum, &n), &y) in sums.iter_mut().zip(n).zip(y) {
                    *sum = n.mul_add(y, *sum);
                }
            }
            if let Some(out) = out.get_mut(usize::from(branch.joint)) {
                *out += total(&sums);
            }
        }
    }
}
