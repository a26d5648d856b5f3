//! Stage 4: [`Topology`](crate::topology::Topology) -> [`Equations`]: Kane's method and the three-point closure.
//!
//! For generalized speeds u = dq/dt, Kane's equations F_r + F_r* = 0 of the tree (paper, eq. 1-6)
//! are linear in du/dt:
//!
//! ```text
//! F_r  = sum_B  dv_B/du_r . R_B  + dw_B/du_r . T_B          active forces
//! F_r* = sum_B -dv_B/du_r . m a_B - dw_B/du_r . (I alpha + w x I w)
//! M du/dt = f,  J du/dt = -gamma                            closure
//! ```
//!
//! Each phase is a type that is built from the phases that it needs; `derive` runs them in order.
//!
//! | phase | quantities | where |
//! |---|---|---|
//! | spatial inertia | minimal inertial parameters | `inertia` |
//! | kinematics | placements, w, v, alpha, a, partial velocities | `kinematics`, of `frame`, `link`, `free`, `placement`, `motion` |
//! | loads | gravity, forces, air, joint torques, bias forces | `loads` |
//! | force elements | springs between points and bodies, tendons, motors | `elements` |
//! | contacts | forces between points and planes | `contact`, of `touch` |
//! | generalized forces | f | `forces` |
//! | mass matrix | composite inertia, M | `mass` |
//! | energies | kinetic and potential energy | `energy` |
//! | momentum | of all bodies together | `momentum` |
//! | closure | residual, J, gamma | `closure` |
//! | outputs | poses, points, drives | `outputs` |
//! | inverse dynamics | residuals at given du/dt and lambda, hinge reactions | `inverse` |
//! | articulated bodies | M du/dt = b body by body | `articulated`, `floating`, `unit_rows` |
//! | independent speeds | du/dt = N y + p without closure forces | `independent`, of `composite` for free bodies |
//!
//! Modules that the phases share: `binder` names intermediates, `section` says where they belong and
//! holds the equation of every phase, `fact` names the model's numbers, `formula` evaluates the model's
//! expressions, `vector`, `wrench` and `turn` are the algebra of vectors, forces and changes of frame.

mod articulated;
mod binder;
mod closure;
mod composite;
mod contact;
mod derive;
mod elements;
mod energy;
mod equations;
mod facts;
mod floating;
mod forces;
mod formula;
mod frame;
mod free;
mod independent;
mod inertia;
mod inverse;
mod kinematics;
mod link;
mod loads;
mod mass;
mod momentum;
mod motion;
mod outputs;
mod placement;
mod touch;
mod turn;
mod unit_rows;
mod vector;
mod wrench;

#[cfg(test)]
mod tests;

pub use derive::{DeriveError, derive};
pub use equations::*;
