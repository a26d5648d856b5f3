//! Integrators, written once over [`System`](crate::System).
//!
//! Each accepted step ends with a projection onto the closure, so that loops stay closed without
//! a stabilisation to tune.

mod dopri5;
mod euler;
mod fixed;
mod integrator;
mod rk4;
mod rodas;
mod steps;

pub use dopri5::Dopri5;
pub use euler::SemiImplicitEuler;
pub use integrator::Integrator;
pub use rk4::Rk4;
pub use rodas::Rodas;

use crate::{Error, StateOf, System, acceleration, project};

/// Whether an integrator projects onto the closure.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Projection {
    /// Coordinates and speeds, after every step.
    #[default]
    EveryStep,
    /// Never: loops drift open.
    Off,
}

impl Projection {
    fn apply<Y: System>(
        self,
        system: &Y,
        t: Y::Scalar,
        q: &mut Y::Vector,
        u: &mut Y::Vector,
        workspace: &mut Y::Workspace,
    ) -> Result<(), Error> {
        match self {
            Self::EveryStep => {
                project(system, t, q.as_mut(), u.as_mut(), workspace.as_mut()).map(|_| ())
            }
            Self::Off => Ok(()),
        }
    }
}

/// du/dt into a vector.
fn accelerate<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &Y::Vector,
    u: &Y::Vector,
    workspace: &mut Y::Workspace,
    out: &mut Y::Vector,
) -> Result<(), Error> {
    acceleration(system, t, q.as_ref(), u.as_ref(), workspace.as_mut(), out.as_mut()).map(|_| ())
}

/// Whether two states are the same, number by number.
fn same<Y: System>(a: &StateOf<Y>, b: &StateOf<Y>) -> bool {
    a.t == b.t && a.q.as_ref() == b.q.as_ref() && a.u.as_ref() == b.u.as_ref()
}
