//! The fixed-size front of a compiled mechanism: arrays in, arrays out.

use crate::{EquationsMut, Error, Scalar, System, acceleration};

/// M du/dt = f + J^T lambda and J du/dt = -gamma at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Equations<S, const N: usize, const C: usize> {
    /// M, kg m^2.
    pub mass: [[S; N]; N],
    /// f, N m.
    pub forcing: [S; N],
    /// J, m.
    pub jacobian: [[S; N]; C],
    /// gamma, m/s^2.
    pub gamma: [S; C],
}

/// Closure of all loops at a configuration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure<R, J> {
    /// Nine residuals per loop, m.
    pub residual: R,
    /// Their Jacobian by q, one row per residual, m.
    pub jacobian: J,
}

/// Where a body is: the point drawn at x lies at R x + p in the base frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Pose<S> {
    /// R.
    pub rotation: [[S; 3]; 3],
    /// p, m.
    pub position: [S; 3],
}

impl<S: Scalar> From<[S; 12]> for Pose<S> {
    /// R row-major, then p.
    fn from([a, b, c, d, e, f, g, h, i, x, y, z]: [S; 12]) -> Self {
        Self { rotation: [[a, b, c], [d, e, f], [g, h, i]], position: [x, y, z] }
    }
}

/// A compiled mechanism with N coordinates and C closure rows.
///
/// A generated module implements [`System`] and names its array types here; everything else is
/// provided.
pub trait Mechanism<S: Scalar, const N: usize, const C: usize>:
    System<Scalar = S, Vector = [S; N]> + Sized
{
    /// `[S; 9 * LOOPS]`.
    type Residual: AsMut<[S]>;
    /// `[[S; N]; 9 * LOOPS]`.
    type ClosureJacobian: AsMut<[[S; N]]>;
    /// `[[S; 12]; B]`: see [`Pose`].
    type Poses: AsMut<[[S; 12]]>;
    /// `[[S; 3]; P]`.
    type Points: AsMut<[[S; 3]]>;

    /// Zeros of each of the array types.
    fn arrays() -> (Self::Residual, Self::ClosureJacobian, Self::Poses, Self::Points);

    /// M, f, J, gamma at a state.
    fn equations(&self, t: S, q: &[S; N], u: &[S; N]) -> Equations<S, N, C> {
        let mut out = Equations {
            mass: [[S::ZERO; N]; N],
            forcing: [S::ZERO; N],
            jacobian: [[S::ZERO; N]; C],
            gamma: [S::ZERO; C],
        };
        let equations = EquationsMut {
            mass: out.mass.as_flattened_mut(),
            forcing: &mut out.forcing,
            jacobian: out.jacobian.as_flattened_mut(),
            gamma: &mut out.gamma,
        };
        self.write_equations(t, q, u, equations);
        out
    }

    /// du/dt at a state, rad/s^2.
    ///
    /// # Errors
    /// As [`acceleration`](crate::acceleration()).
    fn acceleration(&self, t: S, q: &[S; N], u: &[S; N]) -> Result<[S; N], Error> {
        let mut out = [S::ZERO; N];
        acceleration(self, t, q, u, self.workspace().as_mut(), &mut out)?;
        Ok(out)
    }

    /// Nine residuals per loop and their Jacobian.
    fn closure(&self, q: &[S; N]) -> Closure<Self::Residual, Self::ClosureJacobian> {
        let (mut residual, mut jacobian, ..) = Self::arrays();
        self.write_closure(q, residual.as_mut(), jacobian.as_mut().as_flattened_mut());
        Closure { residual, jacobian }
    }

    /// Where every body is; each row makes a [`Pose`].
    fn poses(&self, q: &[S; N]) -> Self::Poses {
        let (_, _, mut poses, _) = Self::arrays();
        self.write_poses(q, poses.as_mut().as_flattened_mut());
        poses
    }

    /// Positions of the output points in the base frame, m.
    fn points(&self, q: &[S; N]) -> Self::Points {
        let (.., mut points) = Self::arrays();
        self.write_points(q, points.as_mut().as_flattened_mut());
        points
    }
}
