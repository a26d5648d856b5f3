//! What the algorithms need of a mechanism: its equations, written into slices.
//!
//! ```text
//! M(t, q) du/dt = f(t, q, u) + J(q)^T lambda      Kane's equations with closure forces
//! J(q) du/dt = -gamma(q, u)                        closure, differentiated twice
//! ```

use crate::{Arithmetic, JacobianMut, Scalar};

/// Sizes of a mechanism.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Dimensions {
    /// N, coordinates.
    pub coordinates: usize,
    /// C, closure rows of the acceleration.
    pub rows: usize,
    /// L, loops: nine residuals each.
    pub loops: usize,
    /// B, bodies.
    pub bodies: usize,
    /// P, points.
    pub points: usize,
    /// D, joints that follow a prescribed angle.
    pub drives: usize,
    /// Parameters.
    pub parameters: usize,
    /// Inputs.
    pub inputs: usize,
}

impl Dimensions {
    /// Nothing at all.
    pub const ZERO: Self = Self {
        coordinates: 0,
        rows: 0,
        loops: 0,
        bodies: 0,
        points: 0,
        drives: 0,
        parameters: 0,
        inputs: 0,
    };
}

/// Where [`System::write_equations`] writes. Matrices are row-major.
#[derive(Debug)]
pub struct EquationsMut<'a, S> {
    /// M, N x N, kg m^2.
    pub mass: &'a mut [S],
    /// f, N, N m.
    pub forcing: &'a mut [S],
    /// J, C x N, m.
    pub jacobian: &'a mut [S],
    /// gamma, C, m/s^2.
    pub gamma: &'a mut [S],
}

/// Where [`StraightLine::write_projection`] writes.
#[derive(Debug)]
pub struct ProjectionMut<'a, S> {
    /// Closure residuals, 9 L, m.
    pub residual: &'a mut [S],
    /// By what q exceeds the nearest closed loops to first order, N, rad.
    pub positions: &'a mut [S],
    /// By what u exceeds the nearest speeds that keep the loops as they are, N, rad/s.
    pub speeds: &'a mut [S],
}

/// How far results of a straight-line elimination can be trusted: not at all where a number is
/// not positive, or is not a number.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Margin<S> {
    /// The least of the inverse pivots of M.
    pub inverse_pivot: S,
    /// A lower bound of smallest over largest eigenvalue of J M^-1 J^T; 1 without rows.
    pub conditioning: S,
}

impl<S: Arithmetic> Margin<S> {
    /// Nothing was computed.
    pub fn none() -> Self {
        let nan = S::from_f64(f64::NAN);
        Self { inverse_pivot: nan, conditioning: nan }
    }
}

/// Energy of the whole mechanism, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy<S> {
    /// Of motion.
    pub kinetic: S,
    /// Of gravity and springs.
    pub potential: S,
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
    /// q, N, rad.
    pub q: &'a [S],
    /// u, N, rad/s.
    pub u: &'a [S],
    /// du/dt, N, rad/s^2.
    pub acceleration: &'a [S],
    /// lambda, C.
    pub multipliers: &'a [S],
}

/// The direction of a derivative: how fast everything the equations depend on changes.
#[derive(Clone, Copy, Debug, Default)]
pub struct Change<'a, S> {
    /// Of t.
    pub t: S,
    /// Of q, N.
    pub q: &'a [S],
    /// Of u, N.
    pub u: &'a [S],
    /// Of the parameters, in their order.
    pub parameters: &'a [S],
    /// Of the inputs, in their order.
    pub inputs: &'a [S],
}

/// The functions of a mechanism that solve, in straight-line code: for numbers, or for vectors of
/// which each lane is a state or a design of its own. Slices are as for [`System`].
pub trait StraightLine {
    /// What is computed with.
    type Number: Arithmetic;

    /// du/dt, N, by elimination in straight-line code, without drives and without a decision on the
    /// rank. Provided: nothing.
    fn write_acceleration(
        &self,
        t: Self::Number,
        q: &[Self::Number],
        u: &[Self::Number],
        out: &mut [Self::Number],
    ) -> Margin<Self::Number> {
        let _ = (t, q, u, out);
        Margin::none()
    }
    /// How far the loops are open, and what closes them: M^-1 J^T (J M^-1 J^T)^-1 times the
    /// residuals along the rows of J, and times J u, in straight-line code as
    /// [`write_acceleration`](Self::write_acceleration). Provided: nothing.
    fn write_projection(
        &self,
        q: &[Self::Number],
        u: &[Self::Number],
        out: ProjectionMut<'_, Self::Number>,
    ) -> Margin<Self::Number> {
        let _ = (q, u, out);
        Margin::none()
    }
    /// du/dt and its derivatives, as [`write_acceleration`](Self::write_acceleration). Provided:
    /// nothing.
    fn write_jacobian(
        &self,
        t: Self::Number,
        q: &[Self::Number],
        u: &[Self::Number],
        out: JacobianMut<'_, Self::Number>,
    ) -> Margin<Self::Number> {
        let _ = (t, q, u, out);
        Margin::none()
    }
}

/// A mechanism the algorithms of this crate can run: compiled, or interpreted in process.
///
/// Slices have exactly the lengths that [`dimensions`](Self::dimensions) gives.
pub trait System: StraightLine<Number = <Self as System>::Scalar> {
    /// Number type.
    type Scalar: Scalar;
    /// Storage for N numbers.
    type Vector: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// Storage for N x N numbers.
    type Matrix: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// Storage for [`workspace_len`](crate::workspace_len) numbers.
    type Workspace: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;

    /// Sizes.
    fn dimensions(&self) -> Dimensions;
    /// N zeros.
    fn vector(&self) -> Self::Vector;
    /// N x N zeros.
    fn matrix(&self) -> Self::Matrix;
    /// [`workspace_len`](crate::workspace_len) zeros.
    fn workspace(&self) -> Self::Workspace;
    /// Diagonal of the flat bounding box, m: the scale of closure residuals.
    fn size(&self) -> Self::Scalar;
    /// Least and greatest angle of a joint, rad; infinite where there is no limit.
    fn limits(&self, joint: usize) -> [Self::Scalar; 2];
    /// Guess of a joint's angle to assemble from, rad.
    fn initial_position(&self, joint: usize) -> Self::Scalar;
    /// A joint's initial speed, rad/s.
    fn initial_speed(&self, joint: usize) -> Self::Scalar;
    /// Whether the user gave [`initial_position`](Self::initial_position): such a joint is pinned
    /// during assembly.
    fn is_pinned(&self, joint: usize) -> bool;
    /// M, f, J, gamma at a state.
    fn write_equations(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: EquationsMut<'_, Self::Scalar>,
    );
    /// Closure residuals, 9 L, m, and their Jacobian by q, 9 L x N, m.
    fn write_closure(
        &self,
        q: &[Self::Scalar],
        residual: &mut [Self::Scalar],
        jacobian: &mut [Self::Scalar],
    );
    /// Energies at a state.
    fn energy(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
    ) -> Energy<Self::Scalar>;
    /// Poses of the bodies, 12 numbers each: R row-major, then p in m, so that the point drawn at
    /// x lies at R x + p in the base frame.
    fn write_poses(&self, q: &[Self::Scalar], out: &mut [Self::Scalar]);
    /// Positions of the points in the base frame, 3 numbers each, m.
    fn write_points(&self, q: &[Self::Scalar], out: &mut [Self::Scalar]);
    /// Shows each driven joint, in ascending order of the joints. Provided: none.
    fn drives(&self, t: Self::Scalar, visit: impl FnMut(Drive<Self::Scalar>)) {
        let _ = (t, visit);
    }
    /// Per joint the force (N) and the moment about the first point of the hinge line (N m) by
    /// which the first body of the joint acts on the second, N x 6, in the joint's frame: x along
    /// the hinge, z normal to the flat sheet, fixed to the second body. The moment about x is that
    /// of spring, damper, torque and motor. Provided: not a number.
    fn write_reactions(&self, at: Balance<'_, Self::Scalar>, out: &mut [Self::Scalar]) {
        let _ = at;
        out.fill(Self::Scalar::from_f64(f64::NAN));
    }
    /// The changes of f - M du/dt + J^T lambda, N, and of gamma + J du/dt, C, in the direction of
    /// `change` at constant du/dt and lambda. Provided: not a number, with which everything that
    /// needs derivatives fails.
    fn write_tangent(
        &self,
        at: Balance<'_, Self::Scalar>,
        change: Change<'_, Self::Scalar>,
        forces: &mut [Self::Scalar],
        closure: &mut [Self::Scalar],
    ) {
        let _ = (at, change);
        forces.fill(Self::Scalar::from_f64(f64::NAN));
        closure.fill(Self::Scalar::from_f64(f64::NAN));
    }
}

/// The methods of [`System`] that another system answers, but for `dimensions` and `drives`.
macro_rules! delegate {
    ($self:ident => $inner:expr) => {
        fn vector(&$self) -> Self::Vector {
            $inner.vector()
        }
        fn matrix(&$self) -> Self::Matrix {
            $inner.matrix()
        }
        fn workspace(&$self) -> Self::Workspace {
            $inner.workspace()
        }
        fn size(&$self) -> Self::Scalar {
            $inner.size()
        }
        fn limits(&$self, joint: usize) -> [Self::Scalar; 2] {
            $inner.limits(joint)
        }
        fn initial_position(&$self, joint: usize) -> Self::Scalar {
            $inner.initial_position(joint)
        }
        fn initial_speed(&$self, joint: usize) -> Self::Scalar {
            $inner.initial_speed(joint)
        }
        fn is_pinned(&$self, joint: usize) -> bool {
            $inner.is_pinned(joint)
        }
        fn write_equations(
            &$self,
            t: Self::Scalar,
            q: &[Self::Scalar],
            u: &[Self::Scalar],
            out: $crate::EquationsMut<'_, Self::Scalar>,
        ) {
            $inner.write_equations(t, q, u, out);
        }
        fn write_closure(
            &$self,
            q: &[Self::Scalar],
            residual: &mut [Self::Scalar],
            jacobian: &mut [Self::Scalar],
        ) {
            $inner.write_closure(q, residual, jacobian);
        }
        fn energy(
            &$self,
            t: Self::Scalar,
            q: &[Self::Scalar],
            u: &[Self::Scalar],
        ) -> $crate::Energy<Self::Scalar> {
            $inner.energy(t, q, u)
        }
        fn write_poses(&$self, q: &[Self::Scalar], out: &mut [Self::Scalar]) {
            $inner.write_poses(q, out);
        }
        fn write_points(&$self, q: &[Self::Scalar], out: &mut [Self::Scalar]) {
            $inner.write_points(q, out);
        }
        fn write_reactions(
            &$self,
            at: $crate::Balance<'_, Self::Scalar>,
            out: &mut [Self::Scalar],
        ) {
            $inner.write_reactions(at, out);
        }
        fn write_tangent(
            &$self,
            at: $crate::Balance<'_, Self::Scalar>,
            change: $crate::Change<'_, Self::Scalar>,
            forces: &mut [Self::Scalar],
            closure: &mut [Self::Scalar],
        ) {
            $inner.write_tangent(at, change, forces, closure);
        }
    };
}
pub(crate) use delegate;

/// The methods of [`StraightLine`] that another system answers.
macro_rules! delegate_straight_line {
    ($self:ident => $inner:expr) => {
        fn write_acceleration(
            &$self,
            t: Self::Number,
            q: &[Self::Number],
            u: &[Self::Number],
            out: &mut [Self::Number],
        ) -> $crate::Margin<Self::Number> {
            $inner.write_acceleration(t, q, u, out)
        }
        fn write_projection(
            &$self,
            q: &[Self::Number],
            u: &[Self::Number],
            out: $crate::ProjectionMut<'_, Self::Number>,
        ) -> $crate::Margin<Self::Number> {
            $inner.write_projection(q, u, out)
        }
        fn write_jacobian(
            &$self,
            t: Self::Number,
            q: &[Self::Number],
            u: &[Self::Number],
            out: $crate::JacobianMut<'_, Self::Number>,
        ) -> $crate::Margin<Self::Number> {
            $inner.write_jacobian(t, q, u, out)
        }
    };
}
pub(crate) use delegate_straight_line;

impl<Y: System> StraightLine for &Y {
    type Number = Y::Scalar;

    delegate_straight_line!(self => (**self));
}

impl<Y: System> System for &Y {
    type Scalar = Y::Scalar;
    type Vector = Y::Vector;
    type Matrix = Y::Matrix;
    type Workspace = Y::Workspace;

    fn dimensions(&self) -> Dimensions {
        (**self).dimensions()
    }

    fn drives(&self, t: Self::Scalar, visit: impl FnMut(Drive<Self::Scalar>)) {
        (**self).drives(t, visit);
    }

    delegate!(self => (**self));
}
