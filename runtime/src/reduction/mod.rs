//! Acceleration and projection by independent speeds: of mechanisms that have many of them, or driven joints, and of sheets next to
//! singular states.
//!
//! ```text
//! u = N y            N from the compiler's elimination of the closure
//! du/dt = p + N a    H a = N^T (f - M p),  H = N^T M N
//! x = p - N y        H y = N^T M p:  what closes the loops, J x = r, with the least x^T M x
//! ```
//!
//! The mechanism writes what grows with its joints: the rows of J that determine the dependent ones, the hinges and what
//! moves about them, and f. The elimination, with pivots that the compiler chose, and the dense matrices of the independent
//! speeds are the work of this module ([`elimination`], [`inertia`]).
//!
//! Driven joints, which have a prescribed acceleration, are conditions on the independent speeds ([`driven`]).
//!
//! This decides on the rank only where rows of J fade by themselves ([`fading`]). Where the pivots that the compiler chose do not suit
//! a state in another way, the caller does.

mod blocks;
mod correction;
mod driven;
mod elimination;
pub(crate) mod fading;
mod inertia;
mod pattern;
mod rest;
mod sweep;

pub(crate) use correction::Correction;
pub use pattern::{Branch, ROWS, Reduction, ReductionParts, ReductionSizes, Rows};
pub(crate) use rest::at_rest;

use driven::{Driven, Met, driven_len};
use fading::FadingRows;
use inertia::{Bias, Entries, Inertia, inertia_len};
use sweep::PARTS;

use crate::constants::CHANGE_OF_REFINEMENT;
use crate::linear::{copy, max_abs, rows_of_mut};
use crate::plumbing::{Dimensions, Drive, ReductionMut};
use crate::trust::Trust;
use crate::workspace::split;
use crate::{Arithmetic, Error, Mechanism, Scalar};

/// What the mechanism writes; see [`ReductionMut`].
struct Terms<'a, S> {
    axes: &'a mut [S],
    momenta: &'a mut [S],
    rotors: &'a mut [S],
    closure: &'a mut [S],
}

impl<'a, S> Terms<'a, S> {
    fn of(sizes: ReductionSizes, workspace: &mut &'a mut [S]) -> Result<Self, Error> {
        Ok(Self {
            axes: split(workspace, PARTS * sizes.branches)?,
            momenta: split(workspace, PARTS * sizes.branches)?,
            rotors: split(workspace, sizes.branches)?,
            closure: split(workspace, sizes.closure)?,
        })
    }

    fn write(&mut self) -> ReductionMut<'_, S> {
        let Self { axes, momenta, rotors, closure } = self;
        ReductionMut { axes, momenta, rotors, closure }
    }
}

/// The reduction, where nothing faster takes its place. Mechanisms without one must not have any of its code.
#[inline(always)]
pub(crate) fn suitable<Y: Mechanism>(system: &Y) -> Option<Reduction<'_, Y::Scalar>> {
    system.reduction().filter(|it| !it.is_beside_solution || system.dimensions().drives != 0)
}

/// The reduction also where straight-line code solves most states: next to singular states of many speeds it goes on where that ends.
#[inline(always)]
pub(crate) fn beyond_solution<Y: Mechanism>(system: &Y) -> Option<Reduction<'_, Y::Scalar>> {
    let Dimensions { reduction: sizes, speeds, loops, drives, .. } = system.dimensions();
    let may_free = sizes.most_independent(speeds, loops) > sizes.independent;
    system.reduction().filter(|it| !it.is_beside_solution || drives != 0 || may_free)
}

/// How far an elimination can be trusted, the number of independent rows, and next to a singular state the largest u^2 / s^3 of the
/// rows with pivots s.
type Found<S> = (Trust<S>, usize, S);

/// du/dt at (t, q, u) into `out`, where the mechanism has a reduction; and the torque (N m) of each driven joint, if there is a place
/// for it.
#[inline(always)]
pub(crate) fn accelerate<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    torques: Option<&mut [Y::Scalar]>,
) -> Result<Found<Y::Scalar>, Error> {
    match beyond_solution(system) {
        Some(reduction) => reduced(system, reduction, state, workspace, out, torques),
        None => Ok(nothing()),
    }
}

fn reduced<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    torques: Option<&mut [Y::Scalar]>,
) -> Result<Found<Y::Scalar>, Error> {
    let (mut motion, trust) = Motion::eliminated(system, reduction, (t, q, u), workspace)?;
    let torques = torques.unwrap_or_default();
    let mut refined = false;
    if matches!(trust, Trust::Weak(_)) && motion.inertia.may_free() {
        motion.inertia.keep_rows();
        if !motion.inertia.eliminate_suitably(&motion.terms)? {
            return Ok(nothing());
        }
        refined = motion.inertia.is_freed();
    }
    if trust == Trust::Doubtful || !motion.solve((system, t), refined, out, torques)? {
        return Ok(nothing());
    }
    let rate = if trust == Trust::Strong { Y::Scalar::ZERO } else { motion.inertia.rate(u) };
    Ok((trust, motion.rank(system), rate))
}

/// The equations of motion at a state.
struct Motion<'a, S> {
    terms: Terms<'a, S>,
    /// What the rows of J times du/dt have to be.
    opening: &'a mut [S],
    /// What they lack of that.
    lack: &'a mut [S],
    forces: &'a mut [S],
    /// Independent accelerations.
    a: &'a mut [S],
    driven: Driven<'a, S>,
    inertia: Inertia<'a, S>,
}

impl<'a, S: Scalar> Motion<'a, S> {
    /// Room for it.
    fn of<Y: Mechanism<Scalar = S>>(
        system: &Y,
        reduction: Reduction<'a, S>,
        workspace: &mut &'a mut [S],
    ) -> Result<Self, Error> {
        let Dimensions { reduction: sizes, speeds, drives, loops, .. } = system.dimensions();
        let d = sizes.most_independent(speeds, loops);
        Ok(Self {
            terms: Terms::of(sizes, workspace)?,
            opening: split(workspace, sizes.dependent())?,
            lack: split(workspace, sizes.dependent())?,
            forces: split(workspace, speeds)?,
            a: split(workspace, d)?,
            driven: Driven::of(drives + d - sizes.independent, d, workspace)?,
            inertia: Inertia::of(reduction, sizes, d, workspace)?,
        })
    }

    /// At a state, with its closure eliminated, and how far that can be trusted.
    fn eliminated<Y: Mechanism<Scalar = S>>(
        system: &Y,
        reduction: Reduction<'a, S>,
        state: (S, &[S], &[S]),
        mut workspace: &'a mut [S],
    ) -> Result<(Self, Trust<S>), Error> {
        let mut motion = Self::of(system, reduction, &mut workspace)?;
        motion.write(reduction, state)?;
        let trust = motion.inertia.eliminate(&motion.terms)?;
        Ok((motion, trust))
    }

    /// The number of independent rows of J and driven joints.
    fn rank<Y: Mechanism>(&self, system: &Y) -> usize {
        system.dimensions().rank + self.driven.rank() - self.inertia.left_out()
    }

    fn write(&mut self, reduction: Reduction<'_, S>, state: (S, &[S], &[S])) -> Result<(), Error> {
        let Self { terms, opening, forces, .. } = self;
        reduction.parts.write_acceleration(state, terms.write(), opening, forces)
    }

    /// Eliminates the closure without the rows whose directions are not known; `replace` is given the place of each row in the order of
    /// the elimination, its joint, its entries and what it times du/dt has to be, and returns whether it has written others. Returns
    /// whether there is room for that.
    fn leave_out(
        &mut self,
        rows: &FadingRows<'_, S>,
        mut replace: impl FnMut(usize, u16, &mut [S], &mut S) -> bool,
    ) -> Result<bool, Error> {
        let Self { terms, opening, inertia, .. } = self;
        inertia.keep_rows();
        for (index, (joint, opening)) in rows.joints().zip(opening.iter_mut()).enumerate() {
            let row = rows.entries_mut(joint, terms.closure);
            if replace(index, joint, row, opening) || rows.is_known(row) {
                continue;
            }
            if !rows.may_be_fewer() || !inertia.leave_out(joint)? {
                return Ok(false);
            }
            *opening = S::ZERO;
        }
        inertia.eliminate_suitably(terms)
    }

    /// du/dt, and the torque of each driven joint, after the elimination, `refined` once more than else; returns whether they can be
    /// trusted.
    fn solve<Y: Mechanism<Scalar = S>>(
        &mut self,
        (system, t): (&Y, S),
        refined: bool,
        out: &mut [S],
        torques: &mut [S],
    ) -> Result<bool, Error> {
        let Self { terms, opening, lack, forces, a, driven, inertia } = self;
        let Some(Entries { are_small, largest }) = inertia.fill(terms, Bias { opening, forces })?
        else {
            return Ok(false);
        };
        let a = rows_of_mut(a, 1, 0..inertia.independent())?;
        inertia.bias(out, a);
        torques.fill(S::ZERO);
        let mut change = S::ZERO;
        // What rounding has taken from N, p and the factor of H shows in what is left of both equations.
        let closes = refined || !are_small;
        let is_one_pass = inertia.is_exact() && are_small && !refined;
        let passes = if is_one_pass { 1 } else { 2 + usize::from(refined) };
        for pass in 0..passes {
            let met = if pass == 0 { Met::Here } else { Met::Elsewhere };
            if pass > 0 {
                if closes {
                    copy(lack, opening)?;
                    let closed = inertia.close(terms, lack, out)?;
                    change = if pass == 1 { closed } else { change };
                }
                inertia.imbalance(terms, (forces, out), a)?;
            }
            let wanted = |drive: &Drive<S>| match out.get(drive.joint) {
                Some(&found) => drive.acceleration - found,
                None => drive.acceleration,
            };
            driven.prescribe((system, t), (inertia, terms), wanted, (S::ONE, opening, out));
            if !inertia.solve(a, driven, met)? {
                return Ok(false);
            }
            inertia.combine(S::ONE, a, out);
            driven.add_torques(torques);
            if closes && pass == 1 {
                change = change.max(largest * max_abs(a));
            }
        }
        let allowed = S::from_f64(CHANGE_OF_REFINEMENT) * max_abs(out);
        Ok(change <= allowed && out.iter().all(|x| x.is_finite()))
    }
}

/// Where there are no results.
fn nothing<S: Scalar>() -> Found<S> {
    (Trust::Doubtful, 0, S::ZERO)
}

/// The closure residuals, 9 L.
pub(crate) fn write_residual<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    (q, u): (&[Y::Scalar], &[Y::Scalar]),
    residual: &mut [Y::Scalar],
    mut workspace: &mut [Y::Scalar],
) -> Result<(), Error> {
    let sizes = system.dimensions().reduction;
    let mut terms = Terms::of(sizes, &mut workspace)?;
    let mut opening = || split(&mut workspace, sizes.dependent());
    let openings = [opening()?, opening()?];
    reduction.parts.write_projection(q, u, terms.write(), residual, openings)
}

/// Numbers that the algorithms of this module need.
pub(crate) const fn reduction_len(dimensions: Dimensions) -> usize {
    let Dimensions { reduction: sizes, coordinates, speeds, loops, drives, .. } = dimensions;
    let ReductionSizes { branches, closure, .. } = sizes;
    let d = sizes.most_independent(speeds, loops);
    if branches == 0 {
        return 0;
    }
    // The rows' changes along a motion.
    let changes = if d > sizes.independent { closure + sizes.dependent() } else { 0 };
    let terms = (2 * PARTS + 1) * branches + closure + 2 * sizes.dependent();
    let state = 9 * loops + drives + 2 * speeds + coordinates;
    terms
        + changes
        + d
        + driven_len(drives + d - sizes.independent, d)
        + state
        + inertia_len(sizes, d)
}
