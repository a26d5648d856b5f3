//! Runtime of compiled mechanisms: `no_std`, no allocation, no unsafe code.
//!
//! A mechanism is a [`System`]: a module that `lamc` wrote, or its interpreter. Everything here
//! works on any of them:
//!
//! ```
//! use lamc_runtime::{Rk4, State, System, assemble};
//! # use lamc_runtime::{Dimensions, Energy, EquationsMut, workspace_len};
//! # /// A pendulum of unit mass and length.
//! # struct Pendulum;
//! # impl System for Pendulum {
//! #     type Scalar = f64;
//! #     type Vector = [f64; 1];
//! #     type Workspace = [f64; 6];
//! #     fn dimensions(&self) -> Dimensions {
//! #         Dimensions { coordinates: 1, rows: 0, loops: 0, bodies: 1, points: 0 }
//! #     }
//! #     fn vector(&self) -> [f64; 1] { [0.0] }
//! #     fn workspace(&self) -> [f64; 6] { [0.0; 6] }
//! #     fn size(&self) -> f64 { 1.0 }
//! #     fn limits(&self, _: usize) -> [f64; 2] { [f64::NEG_INFINITY, f64::INFINITY] }
//! #     fn initial_position(&self, _: usize) -> f64 { 0.5 }
//! #     fn initial_speed(&self, _: usize) -> f64 { 0.0 }
//! #     fn is_given(&self, _: usize) -> bool { true }
//! #     fn write_equations(&self, _: f64, q: &[f64], _: &[f64], out: EquationsMut<'_, f64>) {
//! #         out.mass[0] = 1.0;
//! #         out.forcing[0] = -9.81 * q[0].sin();
//! #     }
//! #     fn write_closure(&self, _: &[f64], _: &mut [f64], _: &mut [f64]) {}
//! #     fn write_poses(&self, _: &[f64], _: &mut [f64]) {}
//! #     fn write_points(&self, _: &[f64], _: &mut [f64]) {}
//! #     fn energy(&self, _: f64, q: &[f64], u: &[f64]) -> Energy<f64> {
//! #         Energy { kinetic: 0.5 * u[0] * u[0], potential: -9.81 * q[0].cos() }
//! #     }
//! # }
//! # let pendulum = Pendulum;
//! # assert!(workspace_len(pendulum.dimensions()) <= 6);
//! let mut state = State::initial(&pendulum);
//! assemble(&pendulum, &mut state.q, &[], &mut pendulum.workspace())?;
//! let before = pendulum.energy(state.t, &state.q, &state.u);
//! let mut rk4 = Rk4::new(&pendulum);
//! for _ in 0..1000 {
//!     rk4.step(&pendulum, &mut state, 1e-3)?;
//! }
//! let after = pendulum.energy(state.t, &state.q, &state.u);
//! let change = (after.kinetic + after.potential) - (before.kinetic + before.potential);
//! assert!(change.abs() < 1e-10);
//! # Ok::<(), lamc_runtime::Error>(())
//! ```

#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![forbid(unsafe_code)]

mod acceleration;
mod assembly;
mod dopri5;
mod error;
mod linear;
mod mechanism;
mod projection;
mod rk4;
mod scalar;
mod system;
mod workspace;

pub use acceleration::{RANK_TOLERANCE, acceleration};
pub use assembly::{Assembly, assemble};
pub use dopri5::{Dopri5, Statistics};
pub use error::Error;
pub use mechanism::{Closure, Equations, Mechanism, Pose};
pub use projection::project;
pub use rk4::{Projection, Rk4, SemiImplicitEuler};
pub use scalar::Scalar;
pub use system::{Dimensions, Energy, EquationsMut, State, System};
pub use workspace::workspace_len;
