//! Driven joints, and joints held at stops, as conditions on the independent speeds.
//!
//! ```text
//! B a = b    a = H^-1 (r + B^T mu),  B H^-1 B^T mu = b - B H^-1 r
//! ```
//!
//! The rows of B are rows of N, so that mu is the torque at each joint. So are rows of J that the elimination does without
//! ([`Inertia::eliminate_suitably`]), times N.
//!
//! Where many joints of a sheet meet their stops at once, most conditions follow from the others. Those that do are left
//! out, without a torque, and have to be met by what the others lead to.

use super::Terms;
use super::inertia::Inertia;
use crate::constants::ORTHOGONAL_PASSES;
use crate::linear::{add_scaled, backward, dot, factor, forward, rows_of, rows_of_mut};
use crate::plumbing::Drive;
use crate::trust::safe;
use crate::workspace::split;
use crate::{Error, Mechanism, Scalar};

/// A condition follows from others if what they leave of it, squared, is below this multiple of rounding.
const DEPENDENT_EPSILONS: f64 = 1024.0;

/// Whether the conditions that are left out have to be met.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Met {
    /// They have to be.
    Here,
    /// The caller looks after them.
    Elsewhere,
}

/// The conditions.
pub(super) struct Driven<'a, S> {
    /// B, D x d: those that are kept come first, and become L^-1 B^T by rows, where H = L L^T.
    rows: &'a mut [S],
    /// b, D, in the order of the rows.
    wanted: &'a mut [S],
    /// mu of those that are kept, D.
    push: &'a mut [S],
    /// What a pass adds to mu, D.
    more: &'a mut [S],
    /// By driven joint: 1 where its condition is kept, else 0; D.
    is_kept: &'a mut [S],
    /// B H^-1 B^T of those that are kept, D x D at most, and its factor.
    inertia: &'a mut [S],
    /// The number of conditions.
    count: usize,
    /// The number of those that are kept.
    kept: usize,
}

/// Numbers that [`Driven`] needs.
pub(super) const fn driven_len(drives: usize, d: usize) -> usize {
    drives * d + 4 * drives + drives * drives
}

impl<'a, S: Scalar> Driven<'a, S> {
    /// Room for it.
    pub fn of(drives: usize, d: usize, workspace: &mut &'a mut [S]) -> Result<Self, Error> {
        Ok(Self {
            rows: split(workspace, drives * d)?,
            wanted: split(workspace, drives)?,
            push: split(workspace, drives)?,
            more: split(workspace, drives)?,
            is_kept: split(workspace, drives)?,
            inertia: split(workspace, drives * drives)?,
            count: 0,
            kept: 0,
        })
    }

    /// Fills B and b: `wanted` is what the part N y of a driven joint has to be. The rows of J that are torn follow: `opening`, by the
    /// order of the elimination, is what they have to be for x and the part `sign` N y.
    pub fn prescribe<Y: Mechanism<Scalar = S>>(
        &mut self,
        (system, t): (&Y, S),
        (inertia, terms): (&Inertia<'_, S>, &Terms<'_, S>),
        wanted: impl Fn(&Drive<S>) -> S,
        (sign, opening, x): (S, &[S], &[S]),
    ) {
        let d = inertia.independent();
        self.count = 0;
        let mut places = self.rows.chunks_exact_mut(d.max(1)).zip(self.wanted.iter_mut());
        system.drives(t, |drive| {
            if let Some((row, value)) = places.next() {
                *value = wanted(&drive);
                inertia.row(drive.joint, row);
                self.count += 1;
            }
        });
        for ((index, joint), (row, value)) in inertia.torn().zip(places) {
            let wanted = opening.get(index).copied().unwrap_or(S::ZERO);
            *value = sign * inertia.condition(terms, joint, (wanted, x), row);
            self.count += 1;
        }
    }

    /// The number of conditions that do not follow from others.
    pub fn rank(&self) -> usize {
        self.kept
    }

    /// z = L^-1 r becomes L^-1 (r + B^T mu), where L is the factor of H; returns whether that can be trusted.
    ///
    /// The mechanism's own acceleration, which drives are up against, may be many times what they prescribe. So what
    /// rounding leaves of B y = b is taken away once more.
    pub fn push(&mut self, lower: &[S], z: &mut [S]) -> Result<bool, Error> {
        let d = z.len();
        self.push.fill(S::ZERO);
        if !self.keep_independent(d)? {
            return Ok(false);
        }
        let kept = self.kept;
        let rows = rows_of_mut(self.rows, d, 0..kept)?;
        rows.chunks_exact_mut(d.max(1)).for_each(|row| forward(lower, row));
        let rows = || rows.chunks_exact(d.max(1));
        let inertia = rows_of_mut(self.inertia, kept, 0..kept)?;
        for (row, entries) in rows().zip(inertia.chunks_exact_mut(kept.max(1))) {
            for (other, entry) in rows().zip(entries) {
                *entry = dot(row, other);
            }
        }
        if factor(inertia, kept).is_err() {
            return Ok(false);
        }
        let more = rows_of_mut(self.more, 1, 0..kept)?;
        for _ in 0..ORTHOGONAL_PASSES {
            for ((more, &wanted), row) in more.iter_mut().zip(&*self.wanted).zip(rows()) {
                *more = wanted - dot(row, z);
            }
            forward(inertia, more);
            backward(inertia, more);
            for (&more, row) in more.iter().zip(rows()) {
                add_scaled(z, more, row);
            }
            add_scaled(self.push, S::ONE, more);
        }
        Ok(true)
    }

    /// Brings the conditions that do not follow from those before them to the front. Returns false if that is not clear:
    /// the independent speeds can move each joint while those before it stay, by at least a hundredth of themselves, or not at
    /// all.
    fn keep_independent(&mut self, d: usize) -> Result<bool, Error> {
        let count = self.count;
        self.kept = 0;
        for index in 0..count {
            let kept = self.kept;
            let row = rows_of(self.rows, d, index..index + 1)?;
            // A row of the factor of B B^T.
            let (above, rest) = self.inertia.split_at_mut(kept * count);
            let products = rows_of_mut(rest, 1, 0..kept + 1)?;
            let others = above.chunks_exact(count).zip(self.rows.chunks_exact(d.max(1)));
            for (k, (factor, other)) in others.enumerate() {
                let (done, next) = products.split_at_mut(k);
                for (entry, reciprocal) in next.iter_mut().zip(factor.get(k)) {
                    *entry = (dot(row, other) - dot(done, factor)) * *reciprocal;
                }
            }
            let square = dot(row, row);
            let (done, last) = products.split_at_mut(kept);
            let left = square - dot(done, done);
            let is_kept = left > safe();
            // Written so that NaN is not left out.
            if !is_kept && !(left <= S::from_f64(DEPENDENT_EPSILONS) * S::EPSILON * square) {
                return Ok(false);
            }
            last.fill(S::ONE / left.sqrt());
            if is_kept {
                rows_of_mut(self.rows, d, kept..index + 1)?.rotate_right(d);
                rows_of_mut(self.wanted, 1, kept..index + 1)?.rotate_right(1);
                self.kept += 1;
            }
            let flag = if is_kept { S::ONE } else { S::ZERO };
            rows_of_mut(self.is_kept, 1, index..index + 1)?.fill(flag);
        }
        Ok(true)
    }

    /// Whether y meets the conditions that were left out, to half of the digits, or of one rad/s or rad/s^2: of joints that are at
    /// rest, only rounding is left.
    pub fn is_met(&self, y: &[S]) -> bool {
        let rows = self.rows.chunks_exact(y.len().max(1)).zip(&*self.wanted);
        let rows = rows.take(self.count).skip(self.kept);
        let mut terms = rows.map(|(row, &wanted)| {
            let terms = row.iter().zip(y).map(|(&n, &y)| (n * y).abs());
            (dot(row, y) - wanted, terms.fold(S::ONE + wanted.abs(), |sum, term| sum + term))
        });
        terms.all(|(error, size)| error.abs() <= S::EPSILON.sqrt() * size)
    }

    /// Adds the torque of each driven joint.
    pub fn add_torques(&self, out: &mut [S]) {
        let kept = out.iter_mut().zip(&*self.is_kept).filter(|(_, flag)| **flag != S::ZERO);
        kept.zip(&*self.push).for_each(|((torque, _), &push)| *torque += push);
    }
}
