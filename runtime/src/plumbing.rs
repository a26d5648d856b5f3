//! What generated code, hand-written mechanisms and engines of the workbench need, and users of a
//! generated module do not: where equations are written, and how far solutions can be trusted.
//!
//! Slices have exactly the lengths that their documentation states in the sizes of
//! [`Dimensions`]; [`exactly`] and [`exactly_mut`] turn them into arrays.

use crate::{Error, Scalar};

pub use crate::arrays::{forces, jacobian, jacobian_params, motor_torques};
pub use crate::integrate::rodasp;
pub use crate::jacobian::{Change, JacobianMut};
pub use crate::reduction::{Branch, ROWS, Reduction, ReductionParts, ReductionSizes, Rows};
pub use crate::workspace::workspace_len;

/// Sizes of a mechanism.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dimensions {
    /// NQ, coordinates: the length of q.
    pub coordinates: usize,
    /// NU, speeds: the length of u.
    pub speeds: usize,
    /// Joints with an angle. That of joint j is `q[j]`, and `u[j]` is its rate; coordinates and speeds
    /// of anything else follow after those of the joints.
    pub joints: usize,
    /// C, closure rows of the acceleration.
    pub rows: usize,
    /// How many of these rows are independent where the mechanism is not singular.
    pub rank: usize,
    /// L, loops: nine residuals each.
    pub loops: usize,
    /// B, bodies.
    pub bodies: usize,
    /// P, points.
    pub points: usize,
    /// K, contact points.
    pub contacts: usize,
    /// D, joints that follow a prescribed angle.
    pub drives: usize,
    /// Parameters.
    pub parameters: usize,
    /// Inputs.
    pub inputs: usize,
    /// Of the reduction to independent speeds.
    pub reduction: ReductionSizes,
}

impl Dimensions {
    /// Nothing at all.
    pub const ZERO: Self = Self::of_joints(0);

    /// Joints whose angles are all the coordinates there are, and nothing else.
    pub const fn of_joints(joints: usize) -> Self {
        Self {
            coordinates: joints,
            speeds: joints,
            joints,
            rows: 0,
            rank: 0,
            loops: 0,
            bodies: 0,
            points: 0,
            contacts: 0,
            drives: 0,
            parameters: 0,
            inputs: 0,
            reduction: ReductionSizes::NONE,
        }
    }

    /// See [`may_be_reduced`].
    #[inline(always)]
    pub(crate) const fn may_be_reduced(self) -> bool {
        may_be_reduced(self.loops, self.coordinates > self.speeds)
    }
}

/// Whether the compiler may solve the closure of mechanisms with so many loops by independent speeds. The modules of others do
/// not eliminate next to singular states, and have no code for that.
#[inline(always)]
pub const fn may_be_reduced(loops: usize, has_free_bodies: bool) -> bool {
    loops > 1 || loops == 1 && has_free_bodies
}

/// Where [`write_equations`](crate::Mechanism::write_equations) writes. Matrices are row-major.
#[derive(Debug)]
pub struct EquationsMut<'a, S> {
    /// M, NU x NU, kg m^2.
    pub mass: &'a mut [S],
    /// f, NU, N m.
    pub forcing: &'a mut [S],
    /// J, C x NU, m.
    pub jacobian: &'a mut [S],
    /// gamma, C, m/s^2.
    pub gamma: &'a mut [S],
}

/// Where [`write_projection`](crate::Mechanism::write_projection) writes.
#[derive(Debug)]
pub struct ProjectionMut<'a, S> {
    /// Closure residuals, 9 L, m.
    pub residual: &'a mut [S],
    /// The step from the nearest closed loops to q, to first order, NU, rad.
    pub positions: &'a mut [S],
    /// By what u exceeds the nearest speeds that keep the loops as they are, NU, rad/s.
    pub speeds: &'a mut [S],
}

/// Where [`ReductionParts`] are written, for B branches of the [`Reduction`].
#[derive(Debug)]
pub struct ReductionMut<'a, S> {
    /// The velocity of each branch's hinge at unit speed about the origin of the base frame, B x 6: the unit vector along the
    /// hinge, then the velocity of the origin, m.
    pub axes: &'a mut [S],
    /// The momentum of all that moves with each branch at its unit speed, B x 6: its moment about the origin of the base
    /// frame, kg m^2, then its force, kg m.
    pub momenta: &'a mut [S],
    /// The inertia of each branch's rotor, B, kg m^2.
    pub rotors: &'a mut [S],
    /// The rows of J that determine the dependent joints, over their loops' lengths: what [`Reduction::closure`] names.
    pub closure: &'a mut [S],
}

/// Where [`write_gaps`](crate::Mechanism::write_gaps) writes, for K contact points. Matrices are row-major.
#[derive(Debug)]
pub struct GapsMut<'a, S> {
    /// The height of each point over its plane, then how far it lies within the edges and the back of the plate
    /// that carries the plane, K x 2, m.
    pub gap: &'a mut [S],
    /// The coefficient of friction, K.
    pub friction: &'a mut [S],
    /// The unit normal of the plane in the base frame, K x 3.
    pub normal: &'a mut [S],
    /// The velocity of each point relative to the body of the plane in the base frame is these rows times u,
    /// 3 K x NU, m.
    pub rows: &'a mut [S],
}

/// How far results of a straight-line elimination can be trusted: not at all where a number is
/// not positive, or is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin<S> {
    /// The least of the inverse pivots of M.
    pub inverse_pivot: S,
    /// A lower bound of smallest over largest eigenvalue of J M^-1 J^T; 1 without rows. For a reduction
    /// to independent speeds, what its largest entry of N counts as.
    pub conditioning: S,
    /// For a reduction to independent speeds, the smallest pivot of the closure as a share of its loop's length: it
    /// fades with the distance from a singular state. 1 for others.
    pub pivot: S,
}

/// A joint that follows a prescribed angle s(t): `q_j` = s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drive<S> {
    /// j.
    pub joint: usize,
    /// s, rad.
    pub position: S,
    /// ds/dt, rad/s.
    pub speed: S,
    /// Its derivative, rad/s^2.
    pub acceleration: S,
    /// Its derivative in turn, rad/s^3.
    pub jerk: S,
}

/// A state with du/dt and the closure forces that go with it.
#[derive(Clone, Copy, Debug)]
pub struct Balance<'a, S> {
    /// t, s.
    pub t: S,
    /// q, NQ, rad.
    pub q: &'a [S],
    /// u, NU, rad/s.
    pub u: &'a [S],
    /// du/dt, NU, rad/s^2.
    pub acceleration: &'a [S],
    /// lambda, C.
    pub multipliers: &'a [S],
}

/// A slice as an array.
///
/// # Errors
///
/// [`Error::Length`] unless the slice has exactly that length.
#[inline]
pub fn exactly<S, const K: usize>(slice: &[S]) -> Result<&[S; K], Error> {
    let given = slice.len();
    slice.try_into().map_err(|_| Error::Length { expected: K, given })
}

/// A slice as an array to write to.
///
/// # Errors
///
/// [`Error::Length`] unless the slice has exactly that length.
#[inline]
pub fn exactly_mut<S, const K: usize>(slice: &mut [S]) -> Result<&mut [S; K], Error> {
    let given = slice.len();
    slice.try_into().map_err(|_| Error::Length { expected: K, given })
}

/// The rows of a matrix.
#[inline]
pub fn matrix<S: Scalar, const ROWS: usize, const COLUMNS: usize>(
    flat: &[S],
) -> [[S; COLUMNS]; ROWS] {
    let mut matrix = [[S::ZERO; COLUMNS]; ROWS];
    for (value, &entry) in matrix.as_flattened_mut().iter_mut().zip(flat) {
        *value = entry;
    }
    matrix
}
