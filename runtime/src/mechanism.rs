//! The trait of a mechanism: what the compiler writes for it, and what follows from that.
//!
//! ```text
//! M(t, q) du/dt = f(t, q, u) + J(q)^T lambda      Kane's equations with closure forces
//! J(q) du/dt = -gamma(q, u)                        closure, differentiated twice
//! ```

use crate::acceleration::without_workspace;
use crate::assembly::assemble_pinned;
use crate::plumbing::{
    Balance, Change, Dimensions, Drive, EquationsMut, GapsMut, JacobianMut, Margin, ProjectionMut,
    Reduction,
};
use crate::{Energy, Equilibrium, Error, Momentum, Rk4, Scalar, StateOf, equilibrium, project};

/// A mechanism: its sizes, its equations, and everything that the algorithms of this crate make of them.
///
/// The compiler implements it for the type of a module, whose inherent methods are the same with arrays
/// in place of the associated types. Code for any mechanism is written over this trait:
///
/// ```
/// use lamc_runtime::{Error, Mechanism, Rk4, Scalar};
///
/// /// The energy after `steps` of `dt` (s) from the initial state, J.
/// fn energy_after<M: Mechanism>(m: &M, dt: M::Scalar, steps: usize) -> Result<M::Scalar, Error> {
///     let mut state = m.assembled()?;
///     let mut rk4 = Rk4::new(m);
///     for _ in 0..steps {
///         rk4.step(m, &mut state, dt)?;
///     }
///     let energy = m.energy(state.t, &state.q, &state.u)?;
///     Ok(energy.kinetic + energy.potential)
/// }
/// ```
///
/// Those who implement it write the required functions, and those provided `write_` functions for which
/// there is straight-line code; their types are in [`plumbing`](crate::plumbing). Slices have exactly the
/// stated lengths; a function that gets another length returns [`Error::Length`].
///
/// # Coordinates and speeds
///
/// There are NQ coordinates and NU speeds. For the angles of joints u = dq/dt; the orientation of a free
/// body may be a unit quaternion in q and an angular velocity in u. Steps of q, the closure's Jacobian,
/// derivatives by q and the rows of M belong to the NU directions of u. [`advance`](Self::advance) is the
/// only place where a step is added to q.
pub trait Mechanism: Sized {
    /// Number type.
    type Scalar: Scalar;
    /// NQ numbers: q.
    type Coordinates: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// NU numbers: u, du/dt, steps of q.
    type Speeds: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// NU x NU numbers.
    type Matrix: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// [`workspace_len`](crate::plumbing::workspace_len) numbers.
    type Workspace: Clone + AsRef<[Self::Scalar]> + AsMut<[Self::Scalar]>;
    /// The pose of each body, 12 numbers: R row-major, then p in m, so that the point drawn at x lies
    /// at R x + p in the base frame.
    type Poses: Clone + AsRef<[[Self::Scalar; 12]]>;
    /// The position of each point in the base frame, m.
    type Points: Clone + AsRef<[[Self::Scalar; 3]]>;

    /// Sizes.
    fn dimensions(&self) -> Dimensions;
    /// NU zeros.
    fn speeds(&self) -> Self::Speeds;
    /// NU x NU zeros.
    fn matrix(&self) -> Self::Matrix;
    /// [`workspace_len`](crate::plumbing::workspace_len) zeros.
    fn workspace(&self) -> Self::Workspace;
    /// Diagonal of the flat bounding box, m: the scale of closure residuals.
    fn size(&self) -> Self::Scalar;
    /// Least and greatest angle of a joint, rad; infinite where there is no limit.
    fn limits(&self, joint: usize) -> [Self::Scalar; 2];
    /// The model's state at t = 0: a guess of q, from which [`assemble`](crate::assemble) starts, and the initial speeds.
    fn initial(&self) -> StateOf<Self>;
    /// Whether the model states the angle of a joint: such a joint is pinned during assembly.
    fn is_pinned(&self, joint: usize) -> bool;
    /// M, f, J, gamma at a state.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_equations(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: EquationsMut<'_, Self::Scalar>,
    ) -> Result<(), Error>;

    /// Closure residuals, 9 L, m, and their derivatives along the directions of u, 9 L x NU, m.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_closure(
        &self,
        q: &[Self::Scalar],
        residual: &mut [Self::Scalar],
        jacobian: &mut [Self::Scalar],
    ) -> Result<(), Error>;

    /// Shows each driven joint, in ascending order of the joints. Provided: none.
    fn drives(&self, t: Self::Scalar, visit: impl FnMut(Drive<Self::Scalar>)) {
        let _ = (t, visit);
    }

    /// q goes on by a step, NU, as at constant speeds it would in unit time. Coordinates that are not
    /// independent are brought back to their condition: unit quaternions to norm one. Provided: q + step.
    #[inline]
    fn advance(&self, q: &mut [Self::Scalar], step: &[Self::Scalar]) {
        for (q, &step) in q.iter_mut().zip(step) {
            *q += step;
        }
    }

    /// dq/dt at speeds u, NQ: linear in u. Provided: u.
    #[inline]
    fn write_rates(&self, q: &[Self::Scalar], u: &[Self::Scalar], out: &mut [Self::Scalar]) {
        let _ = q;
        out.copy_from_slice(u);
    }

    /// The step that [`advance`](Self::advance) takes from one q to another, NU. Provided: their
    /// difference.
    #[inline]
    fn write_difference(
        &self,
        from: &[Self::Scalar],
        to: &[Self::Scalar],
        out: &mut [Self::Scalar],
    ) {
        for ((out, &from), &to) in out.iter_mut().zip(from).zip(to) {
            *out = to - from;
        }
    }

    /// Brings coordinates that are not independent back to their condition, where rates were added to
    /// them. Provided: nothing.
    #[inline]
    fn normalise(&self, q: &mut [Self::Scalar]) {
        let _ = q;
    }

    /// Energies at a state. Provided: the module was written without this function.
    ///
    /// # Errors
    ///
    /// [`Error::LeftOut`].
    fn energy(
        &self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        u: &Self::Speeds,
    ) -> Result<Energy<Self::Scalar>, Error> {
        let _ = (t, q, u);
        Err(Error::LeftOut { function: "energy" })
    }

    /// Centre of mass and momenta at a state. Provided: the module was written without this function.
    ///
    /// # Errors
    ///
    /// [`Error::LeftOut`].
    fn momentum(
        &self,
        q: &Self::Coordinates,
        u: &Self::Speeds,
    ) -> Result<Momentum<Self::Scalar>, Error> {
        let _ = (q, u);
        Err(Error::LeftOut { function: "momentum" })
    }

    /// The pose of each body. Provided: the module was written without this function.
    ///
    /// # Errors
    ///
    /// [`Error::LeftOut`].
    fn poses(&self, q: &Self::Coordinates) -> Result<Self::Poses, Error> {
        let _ = q;
        Err(Error::LeftOut { function: "poses" })
    }

    /// The position of each point in the base frame, m. Provided: the module was written without this
    /// function.
    ///
    /// # Errors
    ///
    /// [`Error::LeftOut`].
    fn points(&self, q: &Self::Coordinates) -> Result<Self::Points, Error> {
        let _ = q;
        Err(Error::LeftOut { function: "points" })
    }

    /// Per contact point its position (m) and the force on its body (N), 6 per point, in the base frame. Provided:
    /// the module has no contacts, or was written without this function.
    ///
    /// # Errors
    ///
    /// [`Error::Length`], [`Error::LeftOut`].
    fn write_contacts(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        let _ = (t, q, u);
        if out.is_empty() { Ok(()) } else { Err(Error::LeftOut { function: "contacts" }) }
    }

    /// The gap between each contact point and its plane, and how it changes with u: what [`Rigid`](crate::Rigid) needs.
    /// Provided: the module has no contacts, or was written without this function.
    ///
    /// # Errors
    ///
    /// [`Error::Length`], [`Error::LeftOut`].
    fn write_gaps(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        out: GapsMut<'_, Self::Scalar>,
    ) -> Result<(), Error> {
        let _ = (t, q);
        if out.gap.is_empty() { Ok(()) } else { Err(Error::LeftOut { function: "gaps" }) }
    }

    /// Per joint the force (N) and the moment about the first point of the hinge line (N m) by
    /// which the first body of the joint acts on the second, 6 per joint, in the joint's frame: x along
    /// the hinge, z normal to the flat sheet, fixed to the second body. The moment about x is that
    /// of spring, damper, torque and motor. Provided: the module was written without this function.
    ///
    /// # Errors
    ///
    /// [`Error::Length`], [`Error::LeftOut`].
    fn write_reactions(
        &self,
        at: Balance<'_, Self::Scalar>,
        out: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        let _ = (at, out);
        Err(Error::LeftOut { function: "reactions" })
    }

    /// The changes of f - M du/dt + J^T lambda, NU, and of gamma + J du/dt, C, in the direction of
    /// `change` at constant du/dt and lambda. Provided: the module was written without this function, and
    /// everything that needs derivatives fails.
    ///
    /// # Errors
    ///
    /// [`Error::Length`], [`Error::LeftOut`].
    fn write_tangent(
        &self,
        at: Balance<'_, Self::Scalar>,
        change: Change<'_, Self::Scalar>,
        forces: &mut [Self::Scalar],
        closure: &mut [Self::Scalar],
    ) -> Result<(), Error> {
        let _ = (at, change, forces, closure);
        Err(Error::LeftOut { function: "tangent" })
    }

    /// du/dt, NU, by elimination in straight-line code, without drives and without a decision on the
    /// rank. Provided: there is no such code.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_acceleration(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: &mut [Self::Scalar],
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        let _ = (t, q, u, out);
        Ok(None)
    }

    /// How far the loops are open, what is to be taken from q so that they close, to first order, and from u so that they stay
    /// closed: the least change weighted with M, or with that of whole bodies, in straight-line code as
    /// [`write_acceleration`](Self::write_acceleration). Provided: there is no such code.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_projection(
        &self,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: ProjectionMut<'_, Self::Scalar>,
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        let _ = (q, u, out);
        Ok(None)
    }

    /// How the speeds follow from independent ones, in place of straight-line code. Provided: they do not.
    fn reduction(&self) -> Option<Reduction<'_, Self::Scalar>> {
        None
    }

    /// du/dt and its derivatives, as [`write_acceleration`](Self::write_acceleration). Provided:
    /// there is no such code.
    ///
    /// # Errors
    ///
    /// [`Error::Length`].
    fn write_jacobian(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        out: JacobianMut<'_, Self::Scalar>,
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        let _ = (t, q, u, out);
        Ok(None)
    }

    /// du/dt (NU) and its derivative by the parameters (NU x NPARAMS), with the errors of
    /// [`write_jacobian`](Self::write_jacobian).
    fn write_jacobian_params(
        &self,
        t: Self::Scalar,
        q: &[Self::Scalar],
        u: &[Self::Scalar],
        acceleration: &mut [Self::Scalar],
        dp: &mut [Self::Scalar],
    ) -> Result<Option<Margin<Self::Scalar>>, Error> {
        let _ = (t, q, u, acceleration, dp);
        Ok(None)
    }

    /// The initial state with closed loops: assembled from the model's guess, the joints whose angles the
    /// model states pinned, and with speeds that the closure allows.
    ///
    /// # Errors
    ///
    /// As [`assemble`](crate::assemble) and [`project`](fn@crate::project).
    fn assembled(&self) -> Result<StateOf<Self>, Error> {
        let mut state = self.initial();
        let mut workspace = self.workspace();
        let is_pinned = |joint| self.is_pinned(joint);
        assemble_pinned(self, state.t, state.q.as_mut(), &is_pinned, workspace.as_mut())?;
        project(self, state.t, state.q.as_mut(), state.u.as_mut(), workspace.as_mut())?;
        Ok(state)
    }

    /// The state of rest downhill from [`assembled`](Self::assembled), at t = 0: gravity, springs,
    /// torques and forces in balance on closed loops.
    ///
    /// # Errors
    ///
    /// As [`assemble`](crate::assemble) and [`equilibrium`](fn@crate::equilibrium).
    fn settled(&self) -> Result<(StateOf<Self>, Equilibrium<Self::Scalar>), Error> {
        let mut state = self.assembled()?;
        state.u = self.speeds();
        let found = equilibrium(self, state.t, &mut state.q, self.workspace().as_mut())?;
        Ok((state, found))
    }

    /// du/dt, rad/s^2, with closed loops.
    ///
    /// # Errors
    ///
    /// As [`acceleration`](fn@crate::acceleration).
    fn acceleration(
        &self,
        t: Self::Scalar,
        q: &Self::Coordinates,
        u: &Self::Speeds,
    ) -> Result<Self::Speeds, Error> {
        let mut speeds = self.speeds();
        let (q, u, out) = (q.as_ref(), u.as_ref(), speeds.as_mut());
        without_workspace(self, (t, q, u), out)?;
        Ok(speeds)
    }

    /// Moves a state onto the closure, by the least change weighted with M.
    ///
    /// # Errors
    ///
    /// As [`project`](fn@crate::project); the state may then have moved.
    fn project(&self, state: &mut StateOf<Self>) -> Result<(), Error> {
        let (q, u) = (state.q.as_mut(), state.u.as_mut());
        project(self, state.t, q, u, self.workspace().as_mut()).map(|_| ())
    }

    /// Advances a state by `dt` (s) as [`Rk4::step`] does, with projection. For more than a step, an
    /// [`Rk4`] of one's own keeps its storage.
    ///
    /// # Errors
    ///
    /// As [`Rk4::step`]; the state is then unchanged.
    fn step(&self, state: &mut StateOf<Self>, dt: Self::Scalar) -> Result<(), Error> {
        Rk4::new(self).step(self, state, dt)
    }
}
