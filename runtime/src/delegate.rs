//! Mechanisms that forward to another mechanism and may add driven joints.

use crate::plumbing::{
    Balance, Change, Dimensions, Drive, EquationsMut, GapsMut, JacobianMut, Margin, ProjectionMut,
    Reduction,
};
use crate::{Energy, Error, Mechanism, StateOf};

/// A mechanism that forwards to another one, and may have additional driven joints.
pub trait Delegate {
    /// The other mechanism.
    type Inner: Mechanism;

    /// The other mechanism.
    fn inner(&self) -> &Self::Inner;

    /// The number of driven joints: those of the other mechanism and the additional ones.
    fn drive_count(&self) -> usize {
        self.inner().dimensions().drives
    }

    /// Calls `visit` with each driven joint.
    fn visit_drives(
        &self,
        t: <Self::Inner as Mechanism>::Scalar,
        visit: impl FnMut(Drive<<Self::Inner as Mechanism>::Scalar>),
    ) {
        self.inner().drives(t, visit);
    }
}

impl<M: Mechanism> Delegate for &M {
    type Inner = M;

    fn inner(&self) -> &M {
        self
    }
}

impl<D: Delegate> Mechanism for D {
    type Scalar = <D::Inner as Mechanism>::Scalar;
    type Coordinates = <D::Inner as Mechanism>::Coordinates;
    type Speeds = <D::Inner as Mechanism>::Speeds;
    type Matrix = <D::Inner as Mechanism>::Matrix;
    type Workspace = <D::Inner as Mechanism>::Workspace;
    type Poses = <D::Inner as Mechanism>::Poses;
    type Points = <D::Inner as Mechanism>::Points;

    fn dimensions(&self) -> Dimensions {
        Dimensions { drives: self.drive_count(), ..self.inner().dimensions() }
    }
    fn speeds(&self) -> Self::Speeds {
        self.inner().speeds()
    }
    fn matrix(&self) -> Self::Matrix {
        self.inner().matrix()
    }
    fn workspace(&self) -> Self::Workspace {
        self.inner().workspace()
    }
    fn size(&self) -> Self::Scalar {
        self.inner().size()
    }
    fn limits(&self, joint: usize) -> [Self::Scalar; 2] {
        self.inner().limits(joint)
    }
    fn initial(&self) -> StateOf<Self> {
        self.inner().initial()
    }
    fn is_pinned(&self, joint: usize) -> bool {
        self.inner().is_pinned(joint)
    }
    fn energy(
        &self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        u: &Self::Speeds,
    ) -> Result<Energy<Self::Scalar>, Error> {
        self.inner().energy(t, q, u)
    }
    fn poses(&self, q: &Self::Coordinates) -> Result<Self::Poses, Error> {
        self.inner().poses(q)
    }
    fn points(&self, q: &Self::Coordinates) -> Result<Self::Points, Error> {
        self.inner().points(q)
    }
    fn write_equations(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: EquationsMut<'_, Self::Scalar>,
    ) -> Result<(), Error> {
        self.inner().write_equations(t, q, u, out)
    }
    fn write_closure(
        &self,
        q: &[Self::Scalar],
        residual: &mut [Self::Scalar],
        jacobian: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        self.inner().write_closure(q, residual, jacobian)
    }
    fn drives(&self, t: Self::Scalar, visit: impl FnMut(Drive<Self::Scalar>)) {
        self.visit_drives(t, visit);
    }
    fn advance(&self, q: &mut [Self::Scalar], step: &[Self::Scalar]) {
        self.inner().advance(q, step);
    }
    fn write_rates(&self, q: &[Self::Scalar], u: &[Self::Scalar], out: &mut [Self::Scalar]) {
        self.inner().write_rates(q, u, out);
    }
    fn write_difference(
        &self,
        from: &[Self::Scalar],
        to: &[Self::Scalar],
        out: &mut [Self::Scalar],
    ) {
        self.inner().write_difference(from, to, out);
    }
    fn normalise(&self, q: &mut [Self::Scalar]) {
        self.inner().normalise(q);
    }
    fn write_contacts(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        self.inner().write_contacts(t, q, u, out)
    }
    fn write_gaps(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        out: GapsMut<'_, Self::Scalar>,
    ) -> Result<(), Error> {
        self.inner().write_gaps(t, q, out)
    }
    fn write_reactions(
        &self,
        at: Balance<'_, Self::Scalar>,
        out: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        self.inner().write_reactions(at, out)
    }
    fn write_tangent(
        &self,
        at: Balance<'_, Self::Scalar>,
        change: Change<'_, Self::Scalar>,
        forces: &mut [Self::Scalar],
        closure: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        self.inner().write_tangent(at, change, forces, closure)
    }
    fn write_acceleration(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: &mut [Self::Scalar],
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        self.inner().write_acceleration(t, q, u, out)
    }
    fn write_projection(
        &self,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: ProjectionMut<'_, Self::Scalar>,
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        self.inner().write_projection(q, u, out)
    }
    fn reduction(&self) -> Option<Reduction<'_, Self::Scalar>> {
        self.inner().reduction()
    }
    fn write_jacobian(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: JacobianMut<'_, Self::Scalar>,
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        self.inner().write_jacobian(t, q, u, out)
    }
    fn write_jacobian_params(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        acceleration: &mut [Self::Scalar],
        dp: &mut [Self::Scalar],
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        self.inner().write_jacobian_params(t, q, u, acceleration, dp)
    }
}
