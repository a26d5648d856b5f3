//! Projection of a state onto the closure, by the least change weighted with M.
//!
//! Coordinates by Gauss-Newton on all nine residuals r of each loop, q += -M^-1 J^T (J M^-1
//! J^T)^+ r, then speeds onto J u = 0 in the same metric, u += -M^-1 J^T (J M^-1 J^T)^+ J u: what
//! keeps an index-1 integration on the constraints. A driven joint is a tenth kind of residual,
//! its distance from where it should be times the mechanism's size. After E. Hairer, C. Lubich, G. Wanner,
//! "Geometric Numerical Integration", IV.4; E. Eich, "Convergence results for a coordinate
//! projection method", 1993.
//!
//! A body at which loops are cut is in the tree several times. M of the equations gives each copy an equal share of its mass;
//! straight-line code for independent speeds gives all of it to one. At speeds that keep the loops closed the energy is the same.
//!
//! Where no direction of the closure is weak, loops are closed to 1e-12 of the mechanism's size; next to
//! a singular state, where a residual says little of the position, to rounding. How far off the
//! directions themselves are is known there ([`rank`](crate::rank)), and speeds are corrected by no less
//! than that: what is rounding must not turn them away from their branch.

mod gauss_newton;

use gauss_newton::GaussNewton;

use crate::acceleration::not_finite;
use crate::constants::PROJECTION_STEPS;
use crate::decomposition::Decomposition;
use crate::linear::{add_scaled, copy, max_abs, max_abs_of_many};
use crate::plumbing::{Dimensions, ProjectionMut};
use crate::rank::{Gap, acceptable_residual, closed, closed_to_rounding};
use crate::reduction::{Correction, Reduction, beyond_solution, suitable};
use crate::trust::Trust;
use crate::workspace::{check, split};
use crate::{Arithmetic, Error, Mechanism, Scalar};

/// Result of a projection.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Projected<S> {
    /// Largest remaining closure residual, m.
    pub residual: S,
    /// Independent rows among all nine of every loop.
    pub rank: usize,
}

/// The loop with the largest residual, and that residual; the first 9 L residuals are those of the loops.
pub(crate) fn worst_loop<S: Scalar>(residual: &[S], loops: usize) -> (usize, S) {
    let mut worst = (0, S::ZERO);
    for (index, part) in residual.chunks_exact(9).take(loops).enumerate() {
        let size = max_abs(part);
        if worst.1.is_finite() && !(size <= worst.1) {
            worst = (index, size);
        }
    }
    worst
}

/// Moves q (rad) onto the closure and u (rad/s) onto its tangent, driven joints to where they
/// should be at t (s). Without loops and drives nothing moves.
///
/// # Errors
///
/// [`Error::NotClosed`] or [`Error::NotDriven`] if q is too far away; [`Error::MassMatrix`], [`Error::NotFinite`],
/// [`Error::Workspace`], [`Error::Length`].
#[inline]
pub fn project<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    project_within(system, t, q, u, closed(system), workspace)
}

/// As [`project`], to rounding everywhere.
pub(crate) fn project_to_rounding<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    project_within(system, t, q, u, closed_to_rounding(system), workspace)
}

/// As [`project`]; loops that are closed by elimination are closed to `enough` (m).
#[inline]
fn project_within<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    enough: Y::Scalar,
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    let dimensions = check(system, workspace, &[q.len()], &[u.len()])?;
    let projected = if dimensions.loops + dimensions.drives == 0 {
        Projected { residual: Y::Scalar::ZERO, rank: 0 }
    } else {
        match directly(system, t, q, u, enough, workspace)? {
            Some(projected) => projected,
            None => generally(system, t, q, u, workspace)?,
        }
    };
    // Not every coordinate takes part in the closure.
    match not_finite(&[q, u]) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(projected),
    }
}

/// Moves the state of a stage of an integrator next to a singular state as near to the closure as
/// directions that are certain lead: which branch it belongs to is not decided here.
pub(crate) fn project_stage<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<(), Error> {
    check(system, workspace, &[q.len()], &[u.len()])?;
    if directly(system, t, q, u, closed_to_rounding(system), workspace)?.is_some() {
        return Ok(());
    }
    let (mut closure, previous) = GaussNewton::new(system, t, q, u, workspace)?;
    let residual = closure.move_coordinates(system, q, false, previous)?;
    closure.move_speeds(system, u, Gap::of(system, residual))?;
    Ok(())
}

/// Whether projections are straight-line code, where they are not by a decision on the rank.
pub(crate) fn is_in_code<Y: Mechanism>(system: &Y) -> bool {
    suitable(system).is_none()
}

/// The directions along the closure at a state, in which driven joints stand still: by the system's own elimination, as far as that can
/// be trusted.
pub(crate) struct AlongClosure<'a, S> {
    correction: Option<Correction<'a, S>>,
    residual: &'a mut [S],
    positions: &'a mut [S],
    across: &'a mut [S],
}

impl<'a, S: Scalar> AlongClosure<'a, S> {
    /// Room for it.
    pub fn of<Y: Mechanism<Scalar = S>>(
        system: &'a Y,
        mut workspace: &'a mut [S],
    ) -> Result<Self, Error> {
        let Dimensions { speeds: n, loops, .. } = system.dimensions();
        let reduction = suitable(system);
        Ok(Self {
            residual: split(&mut workspace, 9 * loops)?,
            positions: split(&mut workspace, n)?,
            across: split(&mut workspace, n)?,
            correction: match reduction {
                Some(reduction) => Some(Correction::of(system, reduction, &mut workspace)?),
                None => None,
            },
        })
    }

    /// In place of speeds v, writes those along the closure that are nearest in the metric of M; returns how far that can be
    /// trusted. Where it cannot, v stays. The state (t, q) is the same in each call.
    pub fn nearest<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        (t, q, v): (S, &[S], &mut [S]),
    ) -> Result<Trust<S>, Error> {
        let Self { correction, residual, positions, across } = self;
        let dimensions = system.dimensions();
        let trust = match correction {
            Some(correction) => correction.write_along(system, (t, q, v), [residual, across])?,
            None if dimensions.drives > 0 => return Ok(Trust::Doubtful),
            None => {
                let out = ProjectionMut { residual, positions, speeds: across };
                Trust::of(dimensions, system.write_projection(q, v, out)?)
            }
        };
        if trust != Trust::Doubtful {
            subtract(v, across)?;
        }
        Ok(trust)
    }

    /// The number of independent conditions on the speeds, after the first call.
    pub fn conditions<Y: Mechanism<Scalar = S>>(&self, system: &Y) -> usize {
        let rank = system.dimensions().rank;
        self.correction.as_ref().map_or(rank, |correction| correction.rank(system))
    }
}

/// With a decision on the rank. Much code, seldom needed: not to be inlined.
#[inline(never)]
fn generally<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    let (mut closure, previous) = GaussNewton::new(system, t, q, u, workspace)?;
    let residual = closure.move_coordinates(system, q, true, previous)?;
    if !(residual <= acceptable_residual(system)) {
        return Err(closure.open(system));
    }
    let rank = closure.move_speeds(system, u, Gap::of(system, residual))?;
    Ok(Projected { residual, rank })
}

/// By the system's own elimination, where that holds and closes the loops; otherwise q and u stay as
/// they are.
///
/// In a rounded drawing, rows that follow from others may remain open a little when the others are closed. They
/// are where the correction of q is less than `enough`, as an arc of the mechanism's size.
///
/// The rounding of a sheet grows with its joints, and may be more than `enough`: where steps no longer help, loops that
/// are closed to 1e-12 of the size are closed to rounding.
#[inline]
fn directly<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    enough: Y::Scalar,
    workspace: &mut [Y::Scalar],
) -> Result<Option<Projected<Y::Scalar>>, Error> {
    let dimensions = system.dimensions();
    if suitable(system).is_none() && dimensions.drives == 0 {
        let write = |q: &[_], u: &[_], out: ProjectionMut<'_, _>, _: bool| {
            Ok(Trust::of(dimensions, system.write_projection(q, u, out)?))
        };
        let room = Room::of(dimensions, &mut &mut *workspace)?;
        if let Some(residual) = repeat(system, q, u, enough, room, write)? {
            return Ok(Some(Projected { residual, rank: dimensions.rank }));
        }
    }
    match beyond_solution(system) {
        Some(reduction) => reduced(system, reduction, (t, q, u), enough, workspace),
        None => Ok(None),
    }
}

/// As [`directly`], by the runtime's elimination.
fn reduced<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    (t, q, u): (Y::Scalar, &mut [Y::Scalar], &mut [Y::Scalar]),
    enough: Y::Scalar,
    mut workspace: &mut [Y::Scalar],
) -> Result<Option<Projected<Y::Scalar>>, Error> {
    let room = Room::of(system.dimensions(), &mut workspace)?;
    let mut correction = Correction::of(system, reduction, &mut &mut *workspace)?;
    let write = |q: &[_], u: &[_], out: ProjectionMut<'_, _>, is_far: bool| {
        if is_far {
            correction.forget();
        }
        correction.write(system, (t, q, u), out)
    };
    let residual = repeat(system, q, u, enough, room, write)?;
    let rank = correction.rank(system);
    Ok(residual.map(|residual| Projected { residual, rank }))
}

/// Room for [`directly`].
struct Room<'a, S> {
    residual: &'a mut [S],
    positions: &'a mut [S],
    speeds: &'a mut [S],
    given: &'a mut [S],
}

impl<'a, S> Room<'a, S> {
    fn of(dimensions: Dimensions, workspace: &mut &'a mut [S]) -> Result<Self, Error> {
        let Dimensions { coordinates, speeds, loops, drives, .. } = dimensions;
        Ok(Self {
            residual: split(workspace, 9 * loops + drives)?,
            positions: split(workspace, speeds)?,
            speeds: split(workspace, speeds)?,
            given: split(workspace, coordinates)?,
        })
    }
}

/// Steps until the loops are closed; returns the largest residual, or nothing, with q as it was. `write` writes residuals and steps, and
/// returns how far they can be trusted; it is told whether the state before was far from closed. Next to a singular state, loops
/// are closed to rounding.
#[inline]
fn repeat<Y: Mechanism>(
    system: &Y,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    enough: Y::Scalar,
    room: Room<'_, Y::Scalar>,
    mut write: impl FnMut(
        &[Y::Scalar],
        &[Y::Scalar],
        ProjectionMut<'_, Y::Scalar>,
        bool,
    ) -> Result<Trust<Y::Scalar>, Error>,
) -> Result<Option<Y::Scalar>, Error> {
    let Room { residual, positions, speeds, given } = room;
    copy(given, q)?;
    let acceptable = acceptable_residual(system);
    let mut before = None;
    for _ in 0..PROJECTION_STEPS {
        let out = ProjectionMut { residual, positions, speeds };
        // Written so that NaN is far.
        let is_far = before.is_some_and(|before| !(before <= acceptable));
        let trust = write(q, u, out, is_far)?;
        let size = max_abs_of_many(residual);
        let enough = match trust {
            Trust::Strong => enough,
            Trust::Weak(pivot)
                if system.dimensions().may_be_reduced() && Gap::of(system, size).shows(pivot) =>
            {
                closed_to_rounding(system)
            }
            _ => break,
        };
        // Written so that NaN is no progress.
        let is_last = !before.is_none_or(|before| size + size < before);
        // Written so that NaN is not closed.
        if size <= enough
            || (size <= acceptable && max_abs_of_many(positions) <= enough / system.size())
            || (is_last && size <= closed(system))
        {
            subtract(u, speeds)?;
            return Ok(Some(size));
        }
        if is_last {
            break;
        }
        before = Some(size);
        positions.iter_mut().for_each(|step| *step = -*step);
        system.advance(q, positions);
    }
    copy(q, given)?;
    Ok(None)
}

/// `x -= y`.
#[inline]
fn subtract<S: Scalar>(x: &mut [S], y: &[S]) -> Result<(), Error> {
    add_scaled(x, -S::ONE, y);
    match not_finite(&[x]) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(()),
    }
}

/// Adds to du/dt what restores the constraints, -M^-1 J^T (J M^-1 J^T)^+ (2 g J u + g^2 r), all
/// nine rows per loop, with the gain g (1/s). It is not inlined: within the code of an acceleration it would take
/// registers from it.
#[inline(never)]
pub(crate) fn restore<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    gain: Y::Scalar,
    workspace: &mut [Y::Scalar],
    acceleration: &mut [Y::Scalar],
) -> Result<(), Error> {
    let dimensions = check(system, workspace, &[q.len()], &[u.len(), acceleration.len()])?;
    if dimensions.loops + dimensions.drives == 0 {
        return Ok(());
    }
    let (mut closure, _) = GaussNewton::new(system, t, q, u, workspace)?;
    let residual = closure.evaluate(system, q)?;
    closure.add_rates(system, u, gain + gain, gain * gain);
    let gap = Gap::of(system, residual);
    closure.solve(Decomposition::of(system), gap, Y::Scalar::ZERO)?;
    add_scaled(acceleration, Y::Scalar::ONE, closure.step);
    Ok(())
}
