//! Results as arrays, for mechanisms whose sizes are constants.

use crate::acceleration::not_finite;
use crate::jacobian::{Change, JacobianMut, derivatives_along, jacobian as write_jacobian};
use crate::plumbing::{Balance, exactly};
use crate::trust::Trust;
use crate::{Arithmetic, Error, Mechanism, acceleration_and_forces};

/// The equations of motion at a state: M du/dt = f + J^T lambda, J du/dt = -gamma.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equations<S, const NU: usize, const C: usize> {
    /// M, kg m^2.
    pub mass: [[S; NU]; NU],
    /// f, N m.
    pub forcing: [S; NU],
    /// J, m.
    pub jacobian: [[S; NU]; C],
    /// gamma, m/s^2.
    pub gamma: [S; C],
}

/// The acceleration and the constraint forces at a state, for J joints.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forces<S, const NU: usize, const C: usize, const J: usize> {
    /// du/dt, rad/s^2.
    pub acceleration: [S; NU],
    /// lambda, N: J^T lambda acts on the coordinates. If rows are redundant, the smallest lambda with this effect.
    pub closure: [S; C],
    /// Torque of each driven joint's motor on its second body, N m; 0 for other joints.
    pub motor: [S; J],
    /// Force (N) and moment (N m) of each hinge, as of [`Mechanism::write_reactions`].
    pub reactions: [[S; 6]; J],
}

/// du/dt and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian<S, const NU: usize> {
    /// a = du/dt, rad/s^2.
    pub acceleration: [S; NU],
    /// da/dq along the directions of u, 1/s^2.
    pub dq: [[S; NU]; NU],
    /// da/du, 1/s.
    pub du: [[S; NU]; NU],
    /// da/dt, rad/s^3.
    pub dt: [S; NU],
}

/// du/dt and its derivative by the P parameters.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JacobianParams<S, const NU: usize, const P: usize> {
    /// a = du/dt, rad/s^2.
    pub acceleration: [S; NU],
    /// da/dp, in the order of the parameters, per unit of each in SI.
    pub dp: [[S; P]; NU],
}

/// All R = 9 L closure equations, nine for every loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure<S, const NU: usize, const R: usize> {
    /// Residuals, m.
    pub residual: [S; R],
    /// Their derivatives along the directions of u, m.
    pub jacobian: [[S; NU]; R],
}

/// The acceleration and the constraint forces: see [`acceleration_and_forces`].
///
/// # Errors
///
/// As [`acceleration`](fn@crate::acceleration); [`Error::Length`] if the sizes are not the mechanism's.
pub fn forces<M: Mechanism, const NU: usize, const C: usize, const J: usize>(
    mechanism: &M,
    t: M::Scalar,
    q: &M::Coordinates,
    u: &M::Speeds,
) -> Result<Forces<M::Scalar, NU, C, J>, Error> {
    let zero = M::Scalar::ZERO;
    let mut forces = Forces {
        acceleration: [zero; NU],
        closure: [zero; C],
        motor: [zero; J],
        reactions: [[zero; 6]; J],
    };
    // The multipliers of the closure and of the drives need less storage than a workspace.
    let mut storage = mechanism.workspace();
    let lambda = storage.as_mut();
    forces.motor = solve_forces(mechanism, (t, q, u), &mut forces.acceleration, lambda)?;
    forces.closure = *exactly(&lambda[..mechanism.dimensions().rows])?;
    let (acceleration, multipliers) = (&forces.acceleration[..], &forces.closure[..]);
    let at = Balance { t, q: q.as_ref(), u: u.as_ref(), acceleration, multipliers };
    mechanism.write_reactions(at, forces.reactions.as_flattened_mut())?;
    Ok(forces)
}

/// The torque of each driven joint's motor on its second body, N m; 0 for other joints.
///
/// # Errors
///
/// As [`acceleration`](fn@crate::acceleration).
pub fn motor_torques<M: Mechanism, const J: usize>(
    mechanism: &M,
    t: M::Scalar,
    q: &M::Coordinates,
    u: &M::Speeds,
) -> Result<[M::Scalar; J], Error> {
    let (mut acceleration, mut lambda) = (mechanism.speeds(), mechanism.workspace());
    solve_forces(mechanism, (t, q, u), acceleration.as_mut(), lambda.as_mut())
}

/// Writes du/dt, and the multipliers of the closure and of the drives to the beginning of `lambda`; returns the
/// torques of the motors.
fn solve_forces<M: Mechanism, const J: usize>(
    mechanism: &M,
    (t, q, u): (M::Scalar, &M::Coordinates, &M::Speeds),
    acceleration: &mut [M::Scalar],
    lambda: &mut [M::Scalar],
) -> Result<[M::Scalar; J], Error> {
    let d = mechanism.dimensions();
    let lambda = &mut lambda[..d.rows + d.drives];
    let mut workspace = mechanism.workspace();
    let (q, u, workspace) = (q.as_ref(), u.as_ref(), workspace.as_mut());
    acceleration_and_forces(mechanism, t, q, u, workspace, acceleration, lambda)?;
    let mut torques = lambda[d.rows..].iter();
    let mut motor = [M::Scalar::ZERO; J];
    mechanism.drives(t, |drive| {
        if let (Some(&torque), Some(motor)) = (torques.next(), motor.get_mut(drive.joint)) {
            *motor = torque;
        }
    });
    Ok(motor)
}

/// du/dt and its derivative by the parameters, for P of them and I inputs: by straight-line code where that holds, else along one
/// parameter after the other.
///
/// # Errors
///
/// As [`derivatives_along`].
pub fn jacobian_params<M: Mechanism, const NU: usize, const P: usize, const I: usize>(
    mechanism: &M,
    t: M::Scalar,
    q: &M::Coordinates,
    u: &M::Speeds,
) -> Result<JacobianParams<M::Scalar, NU, P>, Error> {
    let zero = M::Scalar::ZERO;
    let mut found = JacobianParams { acceleration: [zero; NU], dp: [[zero; P]; NU] };
    let (q, u) = (q.as_ref(), u.as_ref());
    if mechanism.dimensions().drives == 0 {
        let (acceleration, dp) = (&mut found.acceleration, found.dp.as_flattened_mut());
        let margin = mechanism.write_jacobian_params(t, q, u, acceleration, dp)?;
        let is_finite = not_finite(&[&found.acceleration, found.dp.as_flattened()]).is_none();
        if Trust::of(mechanism.dimensions(), margin) == Trust::Strong && is_finite {
            return Ok(found);
        }
    }
    let mut workspace = mechanism.workspace();
    let (still, inputs) = ([zero; NU], [zero; I]);
    for parameter in 0..P {
        let mut parameters = [zero; P];
        if let Some(moving) = parameters.get_mut(parameter) {
            *moving = M::Scalar::ONE;
        }
        let change =
            Change { t: zero, q: &still, u: &still, parameters: &parameters, inputs: &inputs };
        let mut out = [[zero; NU]; 2];
        let one = core::iter::once(change);
        let workspace = workspace.as_mut();
        derivatives_along(mechanism, t, q, u, one, workspace, out.as_flattened_mut())?;
        let [acceleration, derivative] = out;
        found.acceleration = acceleration;
        for (row, value) in found.dp.iter_mut().zip(derivative) {
            if let Some(entry) = row.get_mut(parameter) {
                *entry = value;
            }
        }
    }
    Ok(found)
}

/// du/dt and its derivatives: see [`jacobian`](fn@crate::jacobian).
///
/// # Errors
///
/// As [`jacobian`](fn@crate::jacobian); [`Error::Length`] if the size is not the mechanism's.
pub fn jacobian<M: Mechanism, const NU: usize>(
    mechanism: &M,
    t: M::Scalar,
    q: &M::Coordinates,
    u: &M::Speeds,
) -> Result<Jacobian<M::Scalar, NU>, Error> {
    let zero = M::Scalar::ZERO;
    let mut found = Jacobian {
        acceleration: [zero; NU],
        dq: [[zero; NU]; NU],
        du: [[zero; NU]; NU],
        dt: [zero; NU],
    };
    let out = JacobianMut {
        acceleration: &mut found.acceleration,
        dq: found.dq.as_flattened_mut(),
        du: found.du.as_flattened_mut(),
        dt: &mut found.dt,
    };
    let (q, u) = (q.as_ref(), u.as_ref());
    write_jacobian(mechanism, t, q, u, mechanism.workspace().as_mut(), out)?;
    Ok(found)
}
