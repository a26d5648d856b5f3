//! Stage 4: [`Topology`](crate::topology::Topology) -> [`Equations`]: Kane's method and the three-point closure.
//!
//! For generalised speeds u = dq/dt, Kane's equations F_r + F_r* = 0 of the tree (paper, eq. 1-6)
//! are linear in du/dt:
//!
//! ```text
//! F_r  = sum_B  dv_B/du_r . R_B  + domega_B/du_r . T_B     active forces      [dynamics]
//! F_r* = sum_B -dv_B/du_r . m a_B - domega_B/du_r . (I alpha + omega x I omega)
//! M du/dt = f,  J du/dt = -gamma                            closure            [closure]
//! ```
//!
//! | quantity | where |
//! |---|---|
//! | frames, origins | `frame` |
//! | omega, v, alpha, a, partial velocities | `motion` |
//! | minimal inertial parameters | `inertia` |
//! | F_r, F_r*, mass matrix, energies | `dynamics` |
//! | changes of frame of tensors | `turn` |
//! | M du/dt = b body by body | `articulated` |
//! | closure residual, J, gamma | `closure` |
//! | what is left at given du/dt and lambda, hinge reactions | `inverse` |
//! | torque and force expressions | `scalar` |

mod articulated;
mod closure;
mod derivation;
mod dynamics;
mod equations;
mod frame;
mod inertia;
mod inverse;
mod motion;
mod scalar;
mod section;
mod turn;
mod vector;

#[cfg(test)]
mod tests;

pub use derivation::{DeriveError, derive};
pub use equations::*;
pub use section::{Phase, Section, Subject};
