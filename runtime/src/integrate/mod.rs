//! Integrators, written once over [`Mechanism`](crate::Mechanism).
//!
//! Explicit methods integrate dq/dt as [`Mechanism::write_rates`](crate::Mechanism::write_rates) gives it,
//! in the NQ numbers of q, and bring q back to its condition at the end of a step. What is added to q along the
//! directions of u goes through [`Mechanism::advance`](crate::Mechanism::advance).
//!
//! By default each accepted step ends with a projection onto the closure, so that loops stay closed
//! without parameters to tune.

mod derivatives;
mod dopri5;
mod euler;
mod fixed;
mod integrator;
mod rigid;
mod rk4;
mod rodas;
pub mod rodasp;
mod steps;

pub use dopri5::Dopri5;
pub use euler::SemiImplicitEuler;
pub(crate) use fixed::is_forward;
pub use integrator::Integrator;
pub use rigid::Rigid;
pub use rk4::Rk4;
pub(crate) use rk4::Stages;
pub use rodas::Rodas;

use crate::acceleration::{acceleration_of_stage, not_finite};
use crate::projection::{project_stage, restore};
use crate::{Arithmetic, Error, Mechanism, StateOf, acceleration_in_motion, project};

/// How an explicit integrator keeps loops closed (and driven joints at their prescribed angles).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Stabilisation {
    /// Coordinates and speeds are projected after every step.
    #[default]
    Projection,
    /// du/dt gets a part that closes what has opened: r'' = -2 alpha r' - beta^2 r with
    /// alpha = beta = 1 / (2 h) for a step h, critically damped and as fast as the step can
    /// follow (J. Baumgarte, "Stabilization of constraints and integrals of motion in dynamical
    /// systems", 1972). Loops stay nearly closed.
    Baumgarte,
    /// Nothing: loops drift open.
    Off,
}

impl Stabilisation {
    /// After a step, whose numbers are finite then.
    #[inline]
    fn project<Y: Mechanism>(
        self,
        system: &Y,
        t: Y::Scalar,
        q: &mut Y::Coordinates,
        u: &mut Y::Speeds,
        workspace: &mut Y::Workspace,
    ) -> Result<(), Error> {
        match self {
            Self::Projection => {
                project(system, t, q.as_mut(), u.as_mut(), workspace.as_mut()).map(|_| ())
            }
            Self::Baumgarte | Self::Off => match not_finite(&[q.as_ref(), u.as_ref()]) {
                Some(joint) => Err(Error::NotFinite { joint }),
                None => Ok(()),
            },
        }
    }

    /// du/dt into a vector, in a step of length `step`; with projection and next to a singular state at
    /// the nearest closed state.
    #[inline]
    fn accelerate<Y: Mechanism>(
        self,
        system: &Y,
        step: Y::Scalar,
        (t, q, u): (Y::Scalar, &Y::Coordinates, &Y::Speeds),
        workspace: &mut Y::Workspace,
        out: &mut Y::Speeds,
    ) -> Result<(), Error> {
        let (workspace, out) = (workspace.as_mut(), out.as_mut());
        let closes = self == Self::Projection;
        let at = (t, q.as_ref(), u.as_ref());
        let found = acceleration_of_stage(system, at, closes, workspace, out)?;
        match self {
            Self::Projection if found.is_weak && !found.is_closed => {
                accelerate_beside(system, (t, q, u), workspace, out)
            }
            Self::Baumgarte if step != Y::Scalar::ZERO => {
                let gain = Y::Scalar::from_f64(0.5) / step;
                restore(system, t, q.as_ref(), u.as_ref(), gain, workspace, out)
            }
            _ => Ok(()),
        }
    }
}

/// du/dt at the nearest closed state: the error of a stage opens the loops a little, and next to a
/// singular state, division by a nearly lost constraint would make this error large. It is rarely
/// needed, so it is not inlined.
#[inline(never)]
pub(super) fn accelerate_beside<Y: Mechanism>(
    system: &Y,
    (t, q, u): (Y::Scalar, &Y::Coordinates, &Y::Speeds),
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<(), Error> {
    let (mut q, mut u) = (q.clone(), u.clone());
    project_stage(system, t, q.as_mut(), u.as_mut(), workspace)?;
    acceleration_in_motion(system, t, q.as_ref(), u.as_ref(), workspace, out).map(|_| ())
}

/// Returns whether two states are equal, number by number.
fn same<Y: Mechanism>(a: &StateOf<Y>, b: &StateOf<Y>) -> bool {
    a.t == b.t && a.q.as_ref() == b.q.as_ref() && a.u.as_ref() == b.u.as_ref()
}

/// Returns the squared deviation of driven joints from their prescribed angles, relative to the
/// tolerance. A projection would hide it if a prescribed angle has a kink within the step.
fn strayed<Y: Mechanism>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    allowed: [Y::Scalar; 2],
) -> Y::Scalar {
    let [relative, absolute] = allowed;
    let mut sum = Y::Scalar::ZERO;
    system.drives(t, |drive| {
        let error = (q[drive.joint] - drive.position)
            / (absolute + relative * drive.position.abs().max(q[drive.joint].abs()));
        sum += error * error;
    });
    sum
}
