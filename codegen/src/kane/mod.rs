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
//! | F_r, F_r*, mass matrix, energies | `dynamics` |
//! | closure residual, J, gamma | `closure` |
//! | what is left at given du/dt and lambda, hinge reactions | `inverse` |
//! | torque and force expressions | `scalar` |

mod closure;
mod derivation;
mod dynamics;
mod equations;
mod frame;
mod inverse;
mod motion;
mod scalar;
mod vector;

#[cfg(test)]
mod tests;

pub use derivation::{DeriveError, derive};
pub use equations::*;
