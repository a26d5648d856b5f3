//! Projection of a state by independent speeds: what closes the loops.

use super::driven::{Driven, Met};
use super::fading::FadingRows;
use super::inertia::{Bias, Inertia};
use super::{Reduction, Terms};
use crate::constants::WEAK_SHARE;
use crate::linear::{dot, max_abs_of_many, rows_of_mut};
use crate::plumbing::{Dimensions, Drive, ProjectionMut};
use crate::rank::Gap;
use crate::trust::Trust;
use crate::workspace::split;
use crate::{Error, Mechanism, Scalar};

/// What a correction is taken from.
#[derive(Clone, Copy)]
enum Of {
    Positions,
    Speeds,
}

/// What closes the loops and brings driven joints to their prescribed angles, to be taken from q and u.
pub(crate) struct Correction<'a, S> {
    reduction: Reduction<'a, S>,
    terms: Terms<'a, S>,
    /// What the rows of J have to take from q and from u.
    openings: [&'a mut [S]; 2],
    along: &'a mut [S],
    driven: Driven<'a, S>,
    inertia: Inertia<'a, S>,
    /// How far the matrices can be trusted, if there are some of a state near enough.
    known: Option<Trust<S>>,
}

impl<'a, S: Scalar> Correction<'a, S> {
    /// Of a mechanism with this reduction.
    pub fn of<Y: Mechanism<Scalar = S>>(
        system: &Y,
        reduction: Reduction<'a, S>,
        workspace: &mut &'a mut [S],
    ) -> Result<Self, Error> {
        let Dimensions { reduction: sizes, speeds, drives, loops, .. } = system.dimensions();
        let d = sizes.most_independent(speeds, loops);
        Ok(Self {
            reduction,
            terms: Terms::of(sizes, workspace)?,
            openings: [split(workspace, sizes.dependent())?, split(workspace, sizes.dependent())?],
            along: split(workspace, d)?,
            driven: Driven::of(drives + d - sizes.independent, d, workspace)?,
            inertia: Inertia::of(reduction, sizes, d, workspace)?,
            known: None,
        })
    }

    /// The number of independent rows of J and driven joints.
    pub fn rank<Y: Mechanism>(&self, system: &Y) -> usize {
        system.dimensions().rank + self.driven.rank() - self.inertia.left_out()
    }

    /// The matrices are computed again at the next state.
    pub fn forget(&mut self) {
        self.known = None;
    }

    /// Writes what [`write_projection`](Mechanism::write_projection) does, the residuals followed by those of the
    /// driven joints; returns how far that can be trusted. After the first state N and M are those of the first, which
    /// changes only by what least change is measured.
    pub fn write<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        (t, q, u): (S, &[S], &[S]),
        out: ProjectionMut<'_, S>,
    ) -> Result<Trust<S>, Error> {
        let ProjectionMut { mut residual, positions, speeds } = out;
        let of_loops = split(&mut residual, 9 * system.dimensions().loops)?;
        let trust = self.eliminate(system, (q, u), of_loops)?;
        if trust == Trust::Doubtful {
            return Ok(trust);
        }
        let mut of_drives = residual.iter_mut();
        let size = system.size();
        let of = |values: &[S], joint: usize| values.get(joint).copied().unwrap_or(S::ZERO);
        system.drives(t, |drive| {
            if let Some(residual) = of_drives.next() {
                *residual = size * (of(q, drive.joint) - drive.position);
            }
        });
        let too_far = |drive: &Drive<S>| of(q, drive.joint) - drive.position;
        let too_fast = |drive: &Drive<S>| of(u, drive.joint) - drive.speed;
        let is_solved = self.correct((system, t), Of::Positions, positions, too_far)?
            && self.correct((system, t), Of::Speeds, speeds, too_fast)?;
        Ok(if is_solved { trust } else { Trust::Doubtful })
    }

    /// Writes what is to be taken from v, rad/s, so that it is a motion along the closure in which driven joints stand still; returns how far
    /// that can be trusted. The residuals, 9 L, come with it.
    pub fn write_along<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        (t, q, v): (S, &[S], &[S]),
        [residual, across]: [&mut [S]; 2],
    ) -> Result<Trust<S>, Error> {
        let trust = self.eliminate(system, (q, v), residual)?;
        let moves = |drive: &Drive<S>| v.get(drive.joint).copied().unwrap_or(S::ZERO);
        let is_solved =
            trust != Trust::Doubtful && self.correct((system, t), Of::Speeds, across, moves)?;
        Ok(if is_solved { trust } else { Trust::Doubtful })
    }

    /// Eliminates the closure at a state, and writes the residuals of the loops, 9 L; returns how far it can be trusted.
    fn eliminate<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        (q, u): (&[S], &[S]),
        of_loops: &mut [S],
    ) -> Result<Trust<S>, Error> {
        let openings = self.openings.each_mut().map(|opening| &mut **opening);
        self.reduction.parts.write_projection(q, u, self.terms.write(), of_loops, openings)?;
        let mut eliminated = self.inertia.eliminate(&self.terms)?;
        if self.inertia.may_free() && (eliminated != Trust::Strong || self.inertia.is_freed()) {
            let gap = Gap::of(system, max_abs_of_many(of_loops));
            eliminated = self.without_unknown_rows(system, eliminated, gap, u)?;
        }
        let trust = match self.known {
            Some(trust) => trust,
            None if eliminated == Trust::Doubtful => return Ok(eliminated),
            None => match self.inertia.fill(&self.terms, Bias { opening: &[], forces: &[] })? {
                Some(_) => eliminated,
                None => return Ok(Trust::Doubtful),
            },
        };
        self.known = Some(trust);
        Ok(trust)
    }

    /// Leaves out the rows along whose directions Newton's method does not find its way, where there are some; returns how far the
    /// others can be trusted. Speeds are corrected by no less than what the directions of rows are uncertain by.
    fn without_unknown_rows<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        eliminated: Trust<S>,
        gap: Gap<S>,
        u: &[S],
    ) -> Result<Trust<S>, Error> {
        let Self { reduction, terms, openings: [of_positions, of_speeds], inertia, .. } = self;
        if inertia.is_freed() {
            inertia.keep_rows();
            self.known = None;
        }
        match eliminated {
            Trust::Strong => return Ok(eliminated),
            Trust::Weak(pivot) if gap.shows(pivot) => return Ok(eliminated),
            Trust::Weak(_) | Trust::Doubtful => {}
        }
        inertia.keep_rows();
        let rows = FadingRows::of(system, *reduction, gap, terms.closure);
        let speed = dot(u, u).sqrt();
        let mut least = S::ONE;
        let openings = of_positions.iter_mut().zip(of_speeds.iter_mut());
        for (joint, (of_position, of_speed)) in rows.joints().zip(openings) {
            let row = rows.entries_mut(joint, terms.closure);
            let share = rows.share(row);
            if gap.shows(share) {
                least = least.min(share);
                let uncertain = dot(row, row).sqrt() * speed * gap.uncertainty(share);
                if share < S::from_f64(WEAK_SHARE) && of_speed.abs() <= uncertain {
                    *of_speed = S::ZERO;
                }
                continue;
            }
            if !rows.may_be_fewer() || !inertia.leave_out(joint)? {
                return Ok(Trust::Doubtful);
            }
            (*of_position, *of_speed) = (S::ZERO, S::ZERO);
        }
        let is_suitable = inertia.eliminate_suitably(terms)?;
        if inertia.is_freed() {
            self.known = None;
        }
        Ok(if is_suitable { Trust::Weak(least) } else { Trust::Doubtful })
    }

    /// Writes p - N y, where a driven joint gets its `excess`.
    fn correct<Y: Mechanism<Scalar = S>>(
        &mut self,
        (system, t): (&Y, S),
        of: Of,
        p: &mut [S],
        excess: impl Fn(&Drive<S>) -> S,
    ) -> Result<bool, Error> {
        let Self { terms, openings: [of_positions, of_speeds], along, driven, inertia, .. } = self;
        let along = rows_of_mut(along, 1, 0..inertia.independent())?;
        // The residuals tell whether joints are where they should be.
        let (opening, met) = match of {
            Of::Positions => (of_positions, Met::Elsewhere),
            Of::Speeds => (of_speeds, Met::Here),
        };
        inertia.give(opening, p)?;
        inertia.momentum(terms, p, along)?;
        let wanted =
            |drive: &Drive<S>| p.get(drive.joint).copied().unwrap_or(S::ZERO) - excess(drive);
        driven.prescribe((system, t), (inertia, terms), wanted, (-S::ONE, opening, p));
        let is_solved = inertia.solve(along, driven, met)?;
        inertia.combine(-S::ONE, along, p);
        Ok(is_solved)
    }
}
