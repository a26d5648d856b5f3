//! Derivatives of the constrained acceleration, by implicit differentiation.
//!
//! M a = f + J^T lambda and J a = -gamma hold at every state. In any direction of t, q, u,
//!
//! ```text
//! M da - J^T dlambda = d(f - M a + J^T lambda)    at constant a and lambda
//! J da               = -d(gamma + J a)
//! ```
//!
//! which has the matrix of the acceleration itself: its factors serve for all directions. The
//! right-hand sides come from [`Mechanism::write_tangent`].
//!
//! Where closure equations are redundant this is the derivative along the closure; for directions
//! that open a loop the rank is kept constant.

use crate::acceleration::not_finite;
use crate::linear::copy;
use crate::linearised::Linearised;
use crate::plumbing::Dimensions;
use crate::trust::Trust;
use crate::{Error, Mechanism};

/// The direction of a derivative: how fast everything the equations depend on changes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Change<'a, S> {
    /// Derivative of t along the direction.
    pub t: S,
    /// Of q, as a step along the directions of u, NU.
    pub q: &'a [S],
    /// Derivative of u along the direction, NU.
    pub u: &'a [S],
    /// Derivatives of the parameters along the direction, in their order.
    pub parameters: &'a [S],
    /// Derivatives of the inputs along the direction, in their order.
    pub inputs: &'a [S],
}

/// Where [`jacobian`] writes. Matrices are NU x NU, row-major.
#[derive(Debug)]
pub struct JacobianMut<'a, S> {
    /// a = du/dt at the state itself, NU, rad/s^2.
    pub acceleration: &'a mut [S],
    /// da/dq along the directions of u, 1/s^2.
    pub dq: &'a mut [S],
    /// da/du, 1/s.
    pub du: &'a mut [S],
    /// da/dt, NU, rad/s^3.
    pub dt: &'a mut [S],
}

/// du/dt and its derivatives by q, u and t.
///
/// # Errors
///
/// As [`acceleration`](crate::acceleration()).
pub fn jacobian<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    workspace: &mut [Y::Scalar],
    out: JacobianMut<'_, Y::Scalar>,
) -> Result<(), Error> {
    differentiate(system, t, q, u, false, workspace, out).map(|_| ())
}

/// Which acceleration was differentiated.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Differentiated {
    /// The acceleration at the state.
    Given,
    /// The acceleration at the nearest closed state.
    Closed,
    /// The same, so close to a singular state that rounding has taken its digits.
    Rough,
}

/// As [`jacobian`]; next to a singular state, and for rows that depend on each other, of the acceleration at
/// the nearest closed state, if that is `wanted`: what an implicit integrator follows there.
pub(crate) fn differentiate<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    wanted: bool,
    workspace: &mut [Y::Scalar],
    mut out: JacobianMut<'_, Y::Scalar>,
) -> Result<Differentiated, Error> {
    let Dimensions { speeds: n, drives, rows, rank, .. } = system.dimensions();
    if drives == 0 {
        let JacobianMut { acceleration, dq, du, dt } = &mut out;
        let slices = JacobianMut { acceleration, dq, du, dt };
        let margin = system.write_jacobian(t, q, u, slices)?;
        if Trust::of(system.dimensions(), margin) == Trust::Strong
            && not_finite(&[out.acceleration, out.dq, out.du, out.dt]).is_none()
        {
            return Ok(Differentiated::Given);
        }
    }
    let mut linear = Linearised::at(system, t, q, u, workspace)?;
    copy(out.acceleration, linear.acceleration)?;
    // Where rows depend on each other, what they say of an open state depends on which of them are used.
    let is_redundant = rank < rows;
    let which = if !(wanted && (linear.is_weak || is_redundant)) {
        Differentiated::Given
    } else if linear.is_rough {
        Differentiated::Rough
    } else {
        Differentiated::Closed
    };
    match which {
        Differentiated::Given => linear.derivatives(out.dq, out.du, out.dt)?,
        _ => linear.derivatives_along_closure(out.dq, out.du, out.dt)?,
    }
    let JacobianMut { dq, du, dt, .. } = out;
    match not_finite(&[dq, du, dt]) {
        Some(index) => Err(Error::NotFinite { joint: index % n }),
        None => Ok(which),
    }
}

/// du/dt and its derivatives along some directions of q, u, the parameters and the inputs: NU
/// numbers in `out` for du/dt itself, and NU for each change, 1/s^2 per unit of it. Prescribed angles
/// stay as they are.
///
/// # Errors
///
/// As [`acceleration`](crate::acceleration()); [`Error::Length`] of an `out` of another length.
pub fn derivatives_along<'c, Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    changes: impl ExactSizeIterator<Item = Change<'c, Y::Scalar>>,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<(), Error>
where
    Y::Scalar: 'c,
{
    let n = system.dimensions().speeds;
    let (expected, given) = (n * (1 + changes.len()), out.len());
    if expected != given {
        return Err(Error::Length { expected, given });
    }
    let mut linear = Linearised::at(system, t, q, u, workspace)?;
    let (acceleration, derivatives) = out.split_at_mut(n);
    copy(acceleration, linear.acceleration)?;
    for (change, derivative) in changes.zip(derivatives.chunks_exact_mut(n.max(1))) {
        linear.along(change, derivative)?;
    }
    match not_finite(&[out]) {
        Some(index) => Err(Error::NotFinite { joint: index % n }),
        None => Ok(()),
    }
}
