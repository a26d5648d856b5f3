//! What the algorithms need of a mechanism: its equations, written into slices.
//!
//! ```text
//! M(t, q) du/dt = f(t, q, u) + J(q)^T lambda      Kane's equations with closure forces
//! J(q) du/dt = -gamma(q, u)                        closure, differentiated twice
//! ```

use crate::Scalar;

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
    /// P, output points.
    pub points: usize,
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

/// Energy of the whole mechanism, J.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy<S> {
    /// Of motion.
    pub kinetic: S,
    /// Of gravity and springs.
    pub potential: S,
}

/// A mechanism the algorithms of this crate can run: compiled, or interpreted in process.
///
/// Slices have exactly the lengths that [`dimensions`](Self::dimensions) gives; an implementation
/// handed others writes nothing.
pub trait System {
    /// Number type.
    type Scalar: Scalar;
    /// Storage for N numbers.
    type Vector: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// Storage for [`workspace_len`](crate::workspace_len) numbers.
    type Workspace: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;

    /// Sizes.
    fn dimensions(&self) -> Dimensions;
    /// N zeros.
    fn vector(&self) -> Self::Vector;
    /// [`workspace_len`](crate::workspace_len) zeros.
    fn workspace(&self) -> Self::Workspace;
    /// Diagonal of the flat bounding box, m: the scale of closure residuals.
    fn size(&self) -> Self::Scalar;
    /// Least and greatest angle of a joint, rad; infinite where there is no limit.
    fn limits(&self, joint: usize) -> [Self::Scalar; 2];
    /// Rough guess of a joint's angle, rad.
    fn initial_position(&self, joint: usize) -> Self::Scalar;
    /// Initial speed of a joint, rad/s.
    fn initial_speed(&self, joint: usize) -> Self::Scalar;
    /// Whether the guess of a joint was given by the designer: assembly holds it if it can.
    fn is_given(&self, joint: usize) -> bool;
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
    /// Per body 12 numbers: R row-major, then p (m), so that the point drawn at x lies at R x + p.
    fn write_poses(&self, q: &[Self::Scalar], out: &mut [Self::Scalar]);
    /// Positions of the output points in the base frame, m, 3 P.
    fn write_points(&self, q: &[Self::Scalar], out: &mut [Self::Scalar]);
    /// Energies at a state.
    fn energy(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
    ) -> Energy<Self::Scalar>;
}

/// Time, coordinates and speeds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct State<V, S> {
    /// s.
    pub t: S,
    /// q, rad.
    pub q: V,
    /// u = dq/dt, rad/s.
    pub u: V,
}

impl<S: Scalar, V: AsMut<[S]>> State<V, S> {
    /// The designer's guess at t = 0: not closed yet, see [`assemble`](crate::assemble()).
    pub fn initial<M: System<Scalar = S, Vector = V>>(system: &M) -> Self {
        let (mut q, mut u) = (system.vector(), system.vector());
        for (joint, slot) in q.as_mut().iter_mut().enumerate() {
            *slot = system.initial_position(joint);
        }
        for (joint, slot) in u.as_mut().iter_mut().enumerate() {
            *slot = system.initial_speed(joint);
        }
        Self { t: S::ZERO, q, u }
    }
}
