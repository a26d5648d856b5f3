//! The fixed-size front of a compiled mechanism: arrays in, arrays out.

use crate::acceleration::direct;
use crate::{
    Arithmetic, Balance, EquationsMut, Equilibrium, Error, JacobianMut, Scalar, State, StateOf,
    System, acceleration, acceleration_and_forces, assemble, equilibrium, jacobian, project,
};

/// Arrays (of arrays) of numbers whose length only their type knows.
pub trait Storage: Clone {
    /// Filled with zeros.
    fn zeros() -> Self;
}

impl<S: Arithmetic> Storage for S {
    fn zeros() -> Self {
        S::ZERO
    }
}

impl<T: Storage, const K: usize> Storage for [T; K] {
    fn zeros() -> Self {
        core::array::from_fn(|_| T::zeros())
    }
}

/// M du/dt = f + J^T lambda, J du/dt = -gamma at a state.
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

/// What holds the constraints at a state.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Forces<S, const N: usize, const C: usize> {
    /// du/dt, rad/s^2.
    pub acceleration: [S; N],
    /// lambda, N: J^T lambda acts on the coordinates. Of redundant rows the smallest that does.
    pub closure: [S; C],
    /// Torque of each driven joint's motor on its second body, N m; 0 for other joints.
    pub motor: [S; N],
    /// Force (N) and moment (N m) of each hinge, as of [`System::write_reactions`].
    pub reactions: [[S; 6]; N],
}

/// du/dt and its derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jacobian<S, const N: usize> {
    /// a = du/dt, rad/s^2.
    pub acceleration: [S; N],
    /// da/dq, 1/s^2.
    pub dq: [[S; N]; N],
    /// da/du, 1/s.
    pub du: [[S; N]; N],
    /// da/dt, rad/s^3.
    pub dt: [S; N],
}

/// All nine closure equations of every loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Closure<R, J> {
    /// Residuals, 9 L, m.
    pub residual: R,
    /// Their Jacobian by q, 9 L x N, m.
    pub jacobian: J,
}

/// A [`System`] whose sizes are constants, with results as arrays.
///
/// Everything is provided; an implementation only spells out the arrays whose lengths are neither
/// N nor C, as the example of the [crate] does:
///
/// ```text
/// impl<S: Scalar> Mechanism<S, N, C> for Sixbar<S> {
///     type Residual = [S; 9];
///     type ResidualJacobian = [[S; N]; 9];
///     type Poses = [[S; 12]; B];
///     type Points = [[S; 3]; P];
/// }
/// ```
pub trait Mechanism<S: Scalar, const N: usize, const C: usize>:
    System<Scalar = S, Vector = [S; N]> + Sized
{
    /// `[S; 9 * L]`.
    type Residual: Storage + AsMut<[S]>;
    /// `[[S; N]; 9 * L]`.
    type ResidualJacobian: Storage + AsMut<[[S; N]]>;
    /// `[[S; 12]; B]`.
    type Poses: Storage + AsMut<[[S; 12]]>;
    /// `[[S; 3]; P]`.
    type Points: Storage + AsMut<[[S; 3]]>;

    /// M, f, J and gamma at a state.
    fn equations(&self, t: S, q: &[S; N], u: &[S; N]) -> Equations<S, N, C> {
        let mut equations = Equations {
            mass: Storage::zeros(),
            forcing: Storage::zeros(),
            jacobian: Storage::zeros(),
            gamma: Storage::zeros(),
        };
        self.write_equations(
            t,
            q,
            u,
            EquationsMut {
                mass: equations.mass.as_flattened_mut(),
                forcing: &mut equations.forcing,
                jacobian: equations.jacobian.as_flattened_mut(),
                gamma: &mut equations.gamma,
            },
        );
        equations
    }

    /// du/dt, rad/s^2, with closed loops.
    ///
    /// # Errors
    ///
    /// As [`acceleration`](fn@crate::acceleration).
    fn acceleration(&self, t: S, q: &[S; N], u: &[S; N]) -> Result<[S; N], Error> {
        let mut out = [S::ZERO; N];
        // Most states need no workspace.
        if direct(self, (t, q, u), &mut out).is_none() {
            acceleration(self, t, q, u, self.workspace().as_mut(), &mut out)?;
        }
        Ok(out)
    }

    /// du/dt and what holds the constraints: closure forces, motor torques, and what each hinge
    /// carries.
    ///
    /// # Errors
    ///
    /// As [`acceleration`](fn@crate::acceleration).
    fn forces(&self, t: S, q: &[S; N], u: &[S; N]) -> Result<Forces<S, N, C>, Error> {
        let d = self.dimensions();
        let mut forces = Forces {
            acceleration: Storage::zeros(),
            closure: Storage::zeros(),
            motor: Storage::zeros(),
            reactions: Storage::zeros(),
        };
        // The second workspace holds the multipliers.
        let (mut workspace, mut storage) = (self.workspace(), self.workspace());
        let lambda = &mut storage.as_mut()[..d.rows + d.drives];
        let out = &mut forces.acceleration;
        acceleration_and_forces(self, t, q, u, workspace.as_mut(), out, lambda)?;
        forces.closure.copy_from_slice(&lambda[..d.rows]);
        let mut torques = lambda[d.rows..].iter();
        self.drives(t, |drive| {
            if let Some(&torque) = torques.next() {
                forces.motor[drive.joint] = torque;
            }
        });
        let (acceleration, multipliers) = (&forces.acceleration[..], &forces.closure[..]);
        let at = Balance { t, q, u, acceleration, multipliers };
        self.write_reactions(at, forces.reactions.as_flattened_mut());
        Ok(forces)
    }

    /// du/dt and its derivatives by q, u and t.
    ///
    /// # Errors
    ///
    /// As [`jacobian`](fn@crate::jacobian).
    fn jacobian(&self, t: S, q: &[S; N], u: &[S; N]) -> Result<Jacobian<S, N>, Error> {
        let mut out = Jacobian {
            acceleration: Storage::zeros(),
            dq: Storage::zeros(),
            du: Storage::zeros(),
            dt: Storage::zeros(),
        };
        let slices = JacobianMut {
            acceleration: &mut out.acceleration,
            dq: out.dq.as_flattened_mut(),
            du: out.du.as_flattened_mut(),
            dt: &mut out.dt,
        };
        jacobian(self, t, q, u, self.workspace().as_mut(), slices)?;
        Ok(out)
    }

    /// Nine residuals per loop, and their Jacobian.
    fn closure(&self, q: &[S; N]) -> Closure<Self::Residual, Self::ResidualJacobian> {
        let mut closure = Closure {
            residual: Self::Residual::zeros(),
            jacobian: Self::ResidualJacobian::zeros(),
        };
        self.write_closure(
            q,
            closure.residual.as_mut(),
            closure.jacobian.as_mut().as_flattened_mut(),
        );
        closure
    }

    /// Poses of the bodies: R row-major, then p, m.
    fn poses(&self, q: &[S; N]) -> Self::Poses {
        let mut poses = Self::Poses::zeros();
        self.write_poses(q, poses.as_mut().as_flattened_mut());
        poses
    }

    /// Positions of the points in the base frame, m.
    fn points(&self, q: &[S; N]) -> Self::Points {
        let mut points = Self::Points::zeros();
        self.write_points(q, points.as_mut().as_flattened_mut());
        points
    }

    /// The initial state with closed loops: assembled from the model's guess, the joints the user
    /// gave pinned, and with speeds that the closure allows.
    ///
    /// # Errors
    ///
    /// As [`assemble`] and [`project`].
    fn assembled(&self) -> Result<State<[S; N], S>, Error> {
        let mut state = State::initial(self);
        let pinned: [bool; N] = core::array::from_fn(|joint| self.is_pinned(joint));
        let mut workspace = self.workspace();
        assemble(self, state.t, &mut state.q, &pinned, workspace.as_mut())?;
        project(self, state.t, &mut state.q, &mut state.u, workspace.as_mut())?;
        Ok(state)
    }

    /// The state of rest downhill from [`assembled`](Self::assembled), at t = 0: gravity, springs,
    /// torques and forces in balance on closed loops.
    ///
    /// # Errors
    ///
    /// As [`assemble`] and [`equilibrium`](fn@crate::equilibrium).
    fn settled(&self) -> Result<(StateOf<Self>, Equilibrium<S>), Error> {
        let mut state = self.assembled()?;
        state.u = [S::ZERO; N];
        let found = equilibrium(self, state.t, &mut state.q, self.workspace().as_mut())?;
        Ok((state, found))
    }
}
