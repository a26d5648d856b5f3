//! Constrained acceleration: Kane's equations with closure forces, through the factored M.
//!
//! ```text
//! M = L L^T,  y = L^-1 f,  W = J L^-T
//! du/dt = M^-1 (f + J^T lambda),  lambda = (W W^T)^+ (-gamma - W y)
//!       = L^-T (y + W^+ (-gamma - W y))
//! ```
//!
//! Which rows are independent is decided on J ([`rank`](crate::rank)); orthogonal rows of unit length
//! that span the same take their place before they are weighted.
//!
//! Driven joints are rows more: e_j du/dt = d2s/dt2, scaled by the mechanism's size so that they
//! weigh as closure rows do.
//!
//! This is the pseudo-inverse solution of F. E. Udwadia and R. E. Kalaba, "A new perspective on
//! constrained motion", 1992: finite at every state, also where closure equations are redundant
//! or the mechanism is singular.

use crate::closure_rows::{Decided, Rows};
use crate::constants::NOISE_OF_ACCELERATION;
use crate::decomposition::Decomposition;
use crate::linear::{Kept, backward, copy, dot, factor, forward, max_abs};
use crate::passage::pass;
use crate::plumbing::{Dimensions, EquationsMut};
use crate::rank::{Fading, Gap};
use crate::reduction::fading;
use crate::trust::{Trust, direct, trusted};
use crate::workspace::{check, split};
use crate::{Arithmetic, Error, Mechanism, Scalar, reduction};

/// Properties of the closure equations at a state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[non_exhaustive]
pub struct Constraint {
    /// Independent rows among the C of the acceleration and the D driven joints.
    pub rank: usize,
    /// Whether a direction of the closure has faded to less than a hundredth of the strongest, or its pivot to less
    /// than a hundredth of the loop's length, as it does within about 0.1 rad of the flat state. There the acceleration is only as accurate
    /// as the closure of the loops, so [project](crate::project()) the state first.
    pub is_weak: bool,
    /// Whether the loops are closed to rounding; not computed if no direction is weak.
    pub(crate) is_closed: bool,
}

impl Constraint {
    /// Of a motion that passes through a singular state.
    pub(crate) fn passing(rank: usize, is_closed: bool) -> Self {
        Self { rank, is_weak: true, is_closed }
    }

    /// Rows far from dependence.
    pub(crate) fn strong(rank: usize) -> Self {
        Self { rank, is_weak: false, is_closed: false }
    }
}

/// du/dt of a state by itself, into `out` (N): for a plot, a controller, a derivative.
///
/// For the states of a trajectory use [`acceleration_in_motion`].
///
/// # Errors
///
/// [`Error::MassMatrix`], [`Error::NotFinite`]; [`Error::Workspace`] and [`Error::Length`] for
/// slices that are too short.
#[inline]
pub fn acceleration<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    solve(system, (t, q, u), || Fading::of_rounding().lost, false, workspace, out, None)
}

/// du/dt of a state on a trajectory, into `out` (N): what integrators use.
///
/// It differs from [`acceleration`] only next to a singular state, where a direction of the closure has
/// nearly faded: the speeds are taken to be those of the motion that led here, and show that direction
/// better than the state itself does (to the third power of the distance).
///
/// # Errors
///
/// As [`acceleration`].
#[inline]
pub fn acceleration_in_motion<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    solve(system, (t, q, u), || Fading::of_rounding().passing, false, workspace, out, None)
}

/// As [`acceleration_in_motion`], of a stage of an integrator. If the caller `closes` loops where [`Constraint::is_weak`] is set
/// but not [`Constraint::is_closed`], the result there may be worth nothing. It is not inlined: the stages of a step would each
/// have room for its results on the stack.
#[inline(never)]
pub(crate) fn acceleration_of_stage<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    closes: bool,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    solve(system, state, || Fading::of_rounding().passing, closes, workspace, out, None)
}

/// As [`acceleration`], and the constraint forces, C + D: the closure forces lambda (N), of which
/// J^T lambda acts on the coordinates, then the torque of each driven joint's motor (N m) on the
/// joint's second body. Of redundant rows it is the smallest that does.
///
/// Where a direction of the closure has faded to less than some 2e-6 of the strongest (3e-3 in `f32`), this
/// solves the equations of the state as they are, and [`acceleration`] takes that direction along the motion
/// where it can. What rounding leaves of the direction may then be most of the result here, of du/dt as of the
/// forces; du/dt of [`acceleration`] is the better one.
///
/// # Errors
///
/// As [`acceleration`].
pub fn acceleration_and_forces<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    let Dimensions { rows, drives, .. } = system.dimensions();
    let expected = rows + drives;
    if lambda.len() != expected {
        return Err(Error::Length { expected, given: lambda.len() });
    }
    solve(system, (t, q, u), || Y::Scalar::ZERO, false, workspace, out, Some(lambda))
}

/// As [`acceleration_and_forces`], with the torques of the driven joints only, D; of driven joints whose angles follow from those
/// of others, some may have none.
pub(crate) fn acceleration_and_torques<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    torques: &mut [Y::Scalar],
) -> Result<Constraint, Error> {
    let (t, q, u) = state;
    let dimensions = check(system, workspace, &[q.len()], &[u.len(), out.len()])?;
    let (trust, rank, rate) =
        reduction::accelerate(system, state, workspace, out, Some(&mut *torques))?;
    match trusted(system, (trust, rank), |_| rate, (q, u), false, workspace, out)? {
        Some(constraint) => Ok(constraint),
        None => {
            decide(system, dimensions, (t, q, u), Y::Scalar::ZERO, workspace, out, Some(torques))
        }
    }
}

/// du/dt at (t, q, u) for callers without a workspace, which most states do not need.
#[inline]
pub(crate) fn without_workspace<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    out: &mut [Y::Scalar],
) -> Result<(), Error> {
    match direct(system, state, out)? {
        Trust::Strong => Ok(()),
        Trust::Weak(_) | Trust::Doubtful => with_workspace(system, state, out),
    }
}

/// As [`acceleration`]. The workspace stays out of the caller's frame, of which every page is touched at every call.
#[inline(never)]
fn with_workspace<Y: Mechanism>(
    system: &Y,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    out: &mut [Y::Scalar],
) -> Result<(), Error> {
    acceleration(system, t, q, u, system.workspace().as_mut(), out).map(|_| ())
}

/// du/dt at (t, q, u), and lambda, or its last parts, if there is a place for it. Directions that have faded to less than
/// `zone` of the strongest are taken along the motion; most states do not need this number. `may_be_open` is for those who
/// close the loops where that matters.
#[inline]
fn solve<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    zone: impl FnOnce() -> Y::Scalar,
    may_be_open: bool,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: Option<&mut [Y::Scalar]>,
) -> Result<Constraint, Error> {
    let (_, q, u) = state;
    let dimensions = check(system, workspace, &[q.len()], &[u.len(), out.len()])?;
    if lambda.is_none()
        && let Some(constraint) = by_elimination(system, state, may_be_open, workspace, out)?
    {
        return Ok(constraint);
    }
    let zone = zone();
    if lambda.is_none()
        && let Some(constraint) =
            fading::accelerate(system, state, zone, may_be_open, workspace, out)?
    {
        return Ok(constraint);
    }
    decide(system, dimensions, state, zone, workspace, out, lambda)
}

/// du/dt by the eliminations that the system has, the cheaper first; nothing where none can be trusted. A function of its own, so that
/// its room on the stack and that of [`decide`] are the same.
fn by_elimination<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    may_be_open: bool,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Option<Constraint>, Error> {
    let (_, q, u) = state;
    let found = (direct(system, state, out)?, system.dimensions().rank);
    let rate = |pivot| dot(u, u) / (pivot * pivot * pivot);
    if let Some(constraint) = trusted(system, found, rate, (q, u), may_be_open, workspace, out)? {
        return Ok(Some(constraint));
    }
    let (trust, rank, rate) = reduction::accelerate(system, state, workspace, out, None)?;
    trusted(system, (trust, rank), |_| rate, (q, u), may_be_open, workspace, out)
}

/// With a decision on the rank. Much code, seldom needed: not to be inlined.
#[inline(never)]
fn decide<Y: Mechanism>(
    system: &Y,
    dimensions: Dimensions,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    zone: Y::Scalar,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: Option<&mut [Y::Scalar]>,
) -> Result<Constraint, Error> {
    let (_, q, u) = state;
    let gap = Gap::at(system, q, workspace)?;
    let (constraint, kept) = general(system, dimensions, state, gap, workspace, out, lambda)?;
    let fades = |kept: &Kept<Y::Scalar>| {
        // A direction that is kept shows itself where rounding of the state makes little of the
        // acceleration.
        let rounding = gap.uncertainty(kept.least) * dot(u, u);
        let shows =
            rounding <= Y::Scalar::from_f64(NOISE_OF_ACCELERATION) * kept.least * max_abs(out);
        gap.is_below(zone, kept) && !(kept.least < zone && shows)
    };
    if zone > Y::Scalar::ZERO && kept.as_ref().is_some_and(fades) {
        let mut passing = system.speeds();
        let rounding = (gap, zone);
        let found = pass(system, dimensions, state, rounding, workspace, passing.as_mut())?;
        if let Some(constraint) = found {
            copy(out, passing.as_ref())?;
            return Ok(constraint);
        }
    }
    Ok(constraint)
}

/// By the factor of M, with a decision on the rank and what led to it.
fn general<Y: Mechanism>(
    system: &Y,
    dimensions: Dimensions,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    gap: Gap<Y::Scalar>,
    mut workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
    lambda: Option<&mut [Y::Scalar]>,
) -> Result<Decided<Y::Scalar>, Error> {
    let (n, c) = (dimensions.speeds, dimensions.rows + dimensions.drives);
    let mass = split(&mut workspace, n * n)?;
    let jacobian = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    write(system, t, q, u, EquationsMut { mass, forcing: out, jacobian, gamma })?;
    factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
    let failure = not_finite(&[q, u, out]);
    let mut overflows = None;
    forward(mass, out);
    let found = if c == 0 {
        (Constraint::strong(0), None)
    } else {
        let weighted = split(&mut workspace, c * n)?;
        let scratch = split(&mut workspace, c * n)?;
        let rhs = split(&mut workspace, c)?;
        let push = split(&mut workspace, n)?;
        let mut rows = Rows { mass, jacobian, gamma, weighted, scratch, rhs, push };
        let decomposition = Decomposition::of(system);
        let found = match rows.direct(decomposition, out)? {
            Some(constraint) => (constraint, None),
            None => rows.general(decomposition, gap, out)?,
        };
        if let Some(lambda) = lambda {
            rows.multipliers(gap, lambda)?;
            for torque in lambda.iter_mut().rev().take(dimensions.drives) {
                *torque *= system.size();
            }
            // A force of a loop belongs to all of its joints.
            overflows = not_finite(&[lambda]).map(|_| 0);
        }
        found
    };
    backward(mass, out);
    match failure.or_else(|| not_finite(&[out])).or(overflows) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(found),
    }
}

/// The equations with a row more for each driven joint: J is (C + D) x NU, gamma C + D.
pub(crate) fn write<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    out: EquationsMut<'_, Y::Scalar>,
) -> Result<(), Error> {
    let Dimensions { rows, speeds: n, .. } = system.dimensions();
    let EquationsMut { mass, forcing, jacobian: mut driven, gamma: mut prescribed } = out;
    let jacobian = split(&mut driven, rows * n)?;
    let gamma = split(&mut prescribed, rows)?;
    system.write_equations(t, q, u, EquationsMut { mass, forcing, jacobian, gamma })?;
    driven.fill(Y::Scalar::ZERO);
    let size = system.size();
    let mut slots = driven.chunks_exact_mut(n.max(1)).zip(prescribed);
    system.drives(t, |drive| {
        if let Some((row, gamma)) = slots.next() {
            row[drive.joint] = size;
            *gamma = -size * drive.acceleration;
        }
    });
    Ok(())
}

/// Index of the first value that is not finite, in the first slice that has one: causes first,
/// effects last.
#[inline]
pub(crate) fn not_finite<S: Scalar>(slices: &[&[S]]) -> Option<usize> {
    // Without a branch for each number, several are looked at together.
    let all = |values: &[S]| values.iter().fold(true, |all, value| all & value.is_finite());
    if slices.iter().all(|values| all(values)) { None } else { first_not_finite(slices) }
}

#[cold]
fn first_not_finite<S: Scalar>(slices: &[&[S]]) -> Option<usize> {
    slices.iter().find_map(|values| values.iter().position(|value| !value.is_finite()))
}

/// Why the mass matrix has no factor.
pub(crate) fn blame<S: Scalar>([q, u]: &[&[S]; 2], mass: &[S], pivot: usize) -> Error {
    let state = &[*q, *u];
    let mut row = mass.iter().skip(pivot * u.len()).take(pivot + 1);
    match not_finite(state) {
        Some(joint) => Error::NotFinite { joint },
        None if row.any(|value| !value.is_finite()) => Error::NotFinite { joint: pivot },
        None => Error::MassMatrix { joint: pivot },
    }
}
