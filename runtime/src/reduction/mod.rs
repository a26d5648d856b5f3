//! Acceleration and projection by independent speeds: of mechanisms that have many of them, or driven joints.
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
//! As elimination in straight-line code, this does not decide on the rank: where the pivots that the compiler
//! chose do not suit a state, the caller does.

mod blocks;
mod driven;
mod elimination;
mod inertia;
mod pattern;
mod sweep;

pub use pattern::{Branch, ROWS, Reduction, ReductionParts, ReductionSizes, Rows};

use driven::{Driven, Met, driven_len};
use inertia::{Bias, Entries, Inertia, inertia_len};
use sweep::PARTS;

use crate::constants::CHANGE_OF_REFINEMENT;
use crate::linear::max_abs;
use crate::plumbing::{Dimensions, Drive, ProjectionMut, ReductionMut};
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
    system.reduction().filter(|it| !it.is_for_driven || system.dimensions().drives != 0)
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
    match suitable(system) {
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
    let workspace = &mut &mut *workspace;
    let Dimensions { reduction: sizes, speeds: n, drives, rank, .. } = system.dimensions();
    let d = sizes.independent;
    let mut terms = Terms::of(sizes, workspace)?;
    let (opening, forces) = (split(workspace, sizes.dependent())?, split(workspace, n)?);
    let a = split(workspace, d)?;
    let mut driven = Driven::of(drives, d, workspace)?;
    let mut inertia = Inertia::of(reduction, sizes, workspace)?;
    reduction.parts.write_acceleration((t, q, u), terms.write(), opening, forces)?;
    let trust = inertia.eliminate(&terms)?;
    if trust == Trust::Doubtful {
        return Ok(nothing());
    }
    let Some(entries) = inertia.fill(&terms, Bias { opening, forces })? else {
        return Ok(nothing());
    };
    inertia.bias(out, a);
    let torques = torques.unwrap_or_default();
    torques.fill(Y::Scalar::ZERO);
    let mut change = Y::Scalar::ZERO;
    // What rounding has taken from N, p and the factor of H shows in what is left of both equations.
    let is_one_pass = inertia.is_exact() && entries == Entries::Small;
    let passes: &[Met] = if is_one_pass { &[Met::Here] } else { &[Met::Here, Met::Elsewhere] };
    for &met in passes {
        if met == Met::Elsewhere {
            if let Entries::Large(_) = entries {
                change = inertia.close(&terms, opening, out)?;
            }
            inertia.imbalance(&terms, (forces, out), a)?;
        }
        driven.prescribe(system, t, &inertia, |drive| match out.get(drive.joint) {
            Some(&found) => drive.acceleration - found,
            None => drive.acceleration,
        });
        if !inertia.solve(a, &mut driven, met)? {
            return Ok(nothing());
        }
        inertia.combine(Y::Scalar::ONE, a, out);
        driven.add_torques(torques);
    }
    if let Entries::Large(largest) = entries {
        change = change.max(largest * max_abs(a));
    }
    let allowed = Y::Scalar::from_f64(CHANGE_OF_REFINEMENT) * max_abs(out);
    let is_trusted = change <= allowed && out.iter().all(|x| x.is_finite());
    if !is_trusted {
        return Ok(nothing());
    }
    let rate = if trust == Trust::Strong { Y::Scalar::ZERO } else { inertia.rate(u) };
    Ok((trust, rank + driven.rank(), rate))
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

/// What a correction is taken from.
#[derive(Clone, Copy)]
enum Of {
    Positions,
    Speeds,
}

/// What closes the loops and brings driven joints to their prescribed angles, to be taken from q and u.
pub(crate) struct Correction<'a, S> {
    parts: &'a dyn ReductionParts<S>,
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
        let Dimensions { reduction: sizes, drives, .. } = system.dimensions();
        Ok(Self {
            parts: reduction.parts,
            terms: Terms::of(sizes, workspace)?,
            openings: [split(workspace, sizes.dependent())?, split(workspace, sizes.dependent())?],
            along: split(workspace, sizes.independent)?,
            driven: Driven::of(drives, sizes.independent, workspace)?,
            inertia: Inertia::of(reduction, sizes, workspace)?,
            known: None,
        })
    }

    /// The number of driven joints whose angles do not follow from those of the others.
    pub fn drives(&self) -> usize {
        self.driven.rank()
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
        let openings = self.openings.each_mut().map(|opening| &mut **opening);
        self.parts.write_projection(q, u, self.terms.write(), of_loops, openings)?;
        let eliminated = self.inertia.eliminate(&self.terms)?;
        let trust = match self.known {
            Some(trust) => trust,
            None if eliminated == Trust::Doubtful => return Ok(eliminated),
            None => match self.inertia.fill(&self.terms, Bias { opening: &[], forces: &[] })? {
                Some(_) => eliminated,
                None => return Ok(Trust::Doubtful),
            },
        };
        self.known = Some(trust);
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

    /// Writes p - N y, where a driven joint gets its `excess`.
    fn correct<Y: Mechanism<Scalar = S>>(
        &mut self,
        (system, t): (&Y, S),
        of: Of,
        p: &mut [S],
        excess: impl Fn(&Drive<S>) -> S,
    ) -> Result<bool, Error> {
        let Self { terms, openings: [of_positions, of_speeds], along, driven, inertia, .. } = self;
        // The residuals tell whether joints are where they should be.
        let (opening, met) = match of {
            Of::Positions => (of_positions, Met::Elsewhere),
            Of::Speeds => (of_speeds, Met::Here),
        };
        inertia.give(opening, p)?;
        inertia.momentum(terms, p, along)?;
        driven.prescribe(system, t, inertia, |drive| {
            p.get(drive.joint).copied().unwrap_or(S::ZERO) - excess(drive)
        });
        let is_solved = inertia.solve(along, driven, met)?;
        inertia.combine(-S::ONE, along, p);
        Ok(is_solved)
    }
}

/// Numbers that the algorithms of this module need.
pub(crate) const fn reduction_len(dimensions: Dimensions) -> usize {
    let Dimensions { reduction: sizes, coordinates, speeds, loops, drives, .. } = dimensions;
    let ReductionSizes { branches, independent: d, closure, .. } = sizes;
    if branches == 0 {
        return 0;
    }
    let terms = (2 * PARTS + 1) * branches + closure + 2 * sizes.dependent();
    let state = 9 * loops + drives + 2 * speeds + coordinates;
    terms + d + driven_len(drives, d) + state + inertia_len(sizes)
}
