//! How far eliminations can be trusted that do not decide on the rank: in straight-line code, and by independent speeds.
//!
//! Next to a singular state a row w of the closure that fades is known as a direction to within g / s^2 rad, with g the gap of the
//! loops over the size of the mechanism and s the pivot of the row. So is the part of du/dt that divides by it, to within u^2 g / s^3.
//! The elimination itself loses no digits there, since the row fades together with its pivot. In a sheet these are the speeds of the
//! loop that fades, and of those around it.

use crate::constants::{LEAST_PIVOT, NOISE_OF_ACCELERATION, SAFE_CONDITIONING, WEAK_SHARE};
use crate::linear::max_abs;
use crate::plumbing::{Dimensions, Margin, ProjectionMut};
use crate::rank::Gap;
use crate::workspace::split;
use crate::{Arithmetic, Constraint, Error, Mechanism, Scalar, reduction};

/// The conditioning above which rows are certainly independent and far from dependence.
#[inline]
pub(crate) fn safe<S: Arithmetic>() -> S {
    SAFE_CONDITIONING.of()
}

/// How far the results of an elimination can be trusted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Trust<S> {
    /// Not at all.
    Doubtful,
    /// Next to a singular state, where this is the smallest pivot of the closure: as far as the loops are closed.
    Weak(S),
    /// As far as rounding allows.
    Strong,
}

impl<S: Scalar> Trust<S> {
    /// Of a straight-line elimination.
    #[inline]
    pub fn of(dimensions: Dimensions, margin: Option<Margin<S>>) -> Self {
        let Some(Margin { inverse_pivot, conditioning, pivot }) = margin else {
            return Self::Doubtful;
        };
        match (inverse_pivot > S::ZERO) & (conditioning > safe()) {
            true if dimensions.may_be_reduced() => Self::of_pivot(pivot),
            true => Self::Strong,
            false => Self::Doubtful,
        }
    }

    /// Of an elimination of the closure with this smallest pivot, over its loop's length.
    #[inline]
    pub fn of_pivot(pivot: S) -> Self {
        // Written so that NaN is doubtful.
        if !(pivot > LEAST_PIVOT.of()) {
            Self::Doubtful
        } else if pivot > S::from_f64(WEAK_SHARE) {
            Self::Strong
        } else {
            Self::Weak(pivot)
        }
    }
}

/// du/dt at (t, q, u) by the system's own elimination, and how far that can be trusted.
#[inline]
pub(crate) fn direct<Y: Mechanism>(
    system: &Y,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    out: &mut [Y::Scalar],
) -> Result<Trust<Y::Scalar>, Error> {
    let dimensions = system.dimensions();
    if dimensions.drives != 0 {
        return Ok(Trust::Doubtful);
    }
    let trust = Trust::of(dimensions, system.write_acceleration(t, q, u, out)?);
    let is_finite = trust != Trust::Doubtful && out.iter().all(|x| x.is_finite());
    Ok(if is_finite { trust } else { Trust::Doubtful })
}

/// What an elimination says of the closure; nothing where it cannot be trusted. Where loops `may_be_open`, this is the concern of the
/// caller. `rate` is the largest u^2 / s^3 of all rows with pivots s, of which it is given the smallest, with the speeds of the joints
/// that a row moves.
#[inline]
pub(crate) fn trusted<Y: Mechanism>(
    system: &Y,
    (trust, rank): (Trust<Y::Scalar>, usize),
    rate: impl FnOnce(Y::Scalar) -> Y::Scalar,
    (q, u): (&[Y::Scalar], &[Y::Scalar]),
    may_be_open: bool,
    workspace: &mut [Y::Scalar],
    out: &[Y::Scalar],
) -> Result<Option<Constraint>, Error> {
    match trust {
        Trust::Strong => Ok(Some(Constraint::strong(rank))),
        Trust::Weak(pivot) if system.dimensions().may_be_reduced() => {
            let gap = beside(system, (q, u), workspace)?;
            let (is_closed, noise) = (gap.is_closed(), gap.share() * rate(pivot));
            let allowed = Y::Scalar::from_f64(NOISE_OF_ACCELERATION) * max_abs(out);
            let is_certain = gap.shows(pivot) && (noise <= allowed || may_be_open && !is_closed);
            Ok(is_certain.then_some(Constraint { rank, is_weak: true, is_closed }))
        }
        Trust::Weak(_) | Trust::Doubtful => Ok(None),
    }
}

/// By how much the loops are open next to a singular state. Seldom needed: not to be inlined.
#[inline(never)]
pub(crate) fn beside<Y: Mechanism>(
    system: &Y,
    (q, u): (&[Y::Scalar], &[Y::Scalar]),
    mut workspace: &mut [Y::Scalar],
) -> Result<Gap<Y::Scalar>, Error> {
    let Dimensions { speeds: n, loops, .. } = system.dimensions();
    {
        // Many loops have a large Jacobian, and this function does without.
        let mut rest = &mut *workspace;
        let residual = split(&mut rest, 9 * loops)?;
        let is_written = match reduction::suitable(system) {
            Some(reduction) => {
                reduction::write_residual(system, reduction, (q, u), residual, rest)?;
                true
            }
            None => {
                let (positions, speeds) = (split(&mut rest, n)?, split(&mut rest, n)?);
                let out = ProjectionMut { residual, positions, speeds };
                system.write_projection(q, u, out)?.is_some()
            }
        };
        if is_written {
            return Ok(Gap::of_state(system, max_abs(split(&mut workspace, 9 * loops)?)));
        }
    }
    Gap::at(system, q, workspace)
}
