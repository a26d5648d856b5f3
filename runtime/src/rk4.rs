//! Fixed steps: the classical Runge-Kutta method, and semi-implicit Euler.

use crate::linear::add_scaled;
use crate::{Error, Scalar, State, System, acceleration, project};

/// Whether a step ends with q and u back on the closed loops.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// After every step (the default).
    #[default]
    EveryStep,
    /// Never: closure drifts.
    Off,
}

/// The classical fourth-order Runge-Kutta method with fixed steps.
#[derive(Clone, Debug)]
pub struct Rk4<M: System> {
    /// Projection after every step, or none.
    pub projection: Projection,
    workspace: M::Workspace,
    stage_q: M::Vector,
    stage_u: M::Vector,
    rate: M::Vector,
    sum_q: M::Vector,
    sum_u: M::Vector,
}

impl<M: System> Rk4<M> {
    /// Memory for one system.
    pub fn new(system: &M) -> Self {
        Self {
            projection: Projection::default(),
            workspace: system.workspace(),
            stage_q: system.vector(),
            stage_u: system.vector(),
            rate: system.vector(),
            sum_q: system.vector(),
            sum_u: system.vector(),
        }
    }

    /// One step of `dt` seconds.
    ///
    /// # Errors
    /// As [`acceleration`] and [`project`]; the state is then unchanged.
    pub fn step(
        &mut self,
        system: &M,
        state: &mut State<M::Vector, M::Scalar>,
        dt: M::Scalar,
    ) -> Result<(), Error> {
        let half = M::Scalar::from_f64(0.5);
        let third = M::Scalar::from_f64(1.0 / 3.0);
        let sixth = M::Scalar::from_f64(1.0 / 6.0);
        let (q, u) = (state.q.as_ref(), state.u.as_ref());
        if q.len() != self.rate.as_ref().len() || u.len() != q.len() {
            return Err(Error::Workspace);
        }
        self.stage_q.as_mut().copy_from_slice(q);
        self.stage_u.as_mut().copy_from_slice(u);
        self.sum_q.as_mut().copy_from_slice(q);
        self.sum_u.as_mut().copy_from_slice(u);
        let stages = [
            (M::Scalar::ZERO, sixth, half),
            (half, third, half),
            (half, third, M::Scalar::ONE),
            (M::Scalar::ONE, sixth, M::Scalar::ZERO),
        ];
        for (at, weight, ahead) in stages {
            let (stage_q, stage_u) = (self.stage_q.as_mut(), self.stage_u.as_mut());
            let rate = self.rate.as_mut();
            let t = state.t + at * dt;
            acceleration(system, t, stage_q, stage_u, self.workspace.as_mut(), rate)?;
            add_scaled(self.sum_q.as_mut(), weight * dt, stage_u);
            add_scaled(self.sum_u.as_mut(), weight * dt, rate);
            stage_q.copy_from_slice(q);
            add_scaled(stage_q, ahead * dt, stage_u);
            stage_u.copy_from_slice(u);
            add_scaled(stage_u, ahead * dt, rate);
        }
        let t = state.t + dt;
        let (sum_q, sum_u) = (self.sum_q.as_mut(), self.sum_u.as_mut());
        if self.projection == Projection::EveryStep {
            project(system, t, sum_q, sum_u, self.workspace.as_mut())?;
        }
        state.q.as_mut().copy_from_slice(sum_q);
        state.u.as_mut().copy_from_slice(sum_u);
        state.t = t;
        Ok(())
    }
}

/// Semi-implicit Euler with fixed steps: u from the acceleration, then q from the new u. First
/// order; one evaluation per step.
#[derive(Clone, Debug)]
pub struct SemiImplicitEuler<M: System> {
    /// Projection after every step, or none.
    pub projection: Projection,
    workspace: M::Workspace,
    rate: M::Vector,
    q: M::Vector,
    u: M::Vector,
}

impl<M: System> SemiImplicitEuler<M> {
    /// Memory for one system.
    pub fn new(system: &M) -> Self {
        Self {
            projection: Projection::default(),
            workspace: system.workspace(),
            rate: system.vector(),
            q: system.vector(),
            u: system.vector(),
        }
    }

    /// One step of `dt` seconds.
    ///
    /// # Errors
    /// As [`acceleration`] and [`project`]; the state is then unchanged.
    pub fn step(
        &mut self,
        system: &M,
        state: &mut State<M::Vector, M::Scalar>,
        dt: M::Scalar,
    ) -> Result<(), Error> {
        let workspace = self.workspace.as_mut();
        let (q, u, rate) = (self.q.as_mut(), self.u.as_mut(), self.rate.as_mut());
        if state.q.as_ref().len() != q.len() || state.u.as_ref().len() != u.len() {
            return Err(Error::Workspace);
        }
        q.copy_from_slice(state.q.as_ref());
        u.copy_from_slice(state.u.as_ref());
        acceleration(system, state.t, q, u, workspace, rate)?;
        add_scaled(u, dt, rate);
        add_scaled(q, dt, u);
        let t = state.t + dt;
        if self.projection == Projection::EveryStep {
            project(system, t, q, u, workspace)?;
        }
        state.q.as_mut().copy_from_slice(q);
        state.u.as_mut().copy_from_slice(u);
        state.t = t;
        Ok(())
    }
}
