//! Runtime of compiled mechanisms: `no_std`, no allocation, no unsafe code.
//!
//! The compiler writes, for each mechanism, a type that implements [`System`] (and its fixed-size
//! front, [`Mechanism`]). The algorithms here are written once, over `System`:
//!
//! | what | function |
//! |---|---|
//! | du/dt with closed loops | [`acceleration()`], [`acceleration_and_forces`], [`acceleration_in_motion`] |
//! | from a rough guess to closed loops | [`assemble`], [`Mechanism::assembled`] |
//! | back onto closed loops | [`project`] |
//! | a state of rest | [`equilibrium()`], [`Mechanism::settled`] |
//! | derivatives of du/dt, linear motion about rest | [`jacobian()`], [`derivatives_along`], [`linearize`] |
//! | motion | [`Dopri5`] (adaptive), [`Rodas`] (adaptive, for stiff hinges), [`Rk4`], [`SemiImplicitEuler`] |
//! | motion between stops | [`Stopped`] |
//! | several designs or motions at once | [`Batch`] |
//!
//! Vectors are the caller's slices, temporaries live in a workspace of [`workspace_len`] numbers.
//! Angles are in radians, everything else in SI units. A slice that is too short, a state that is
//! not finite, a loop that cannot be closed is an [`Error`] that names the joint or the loop:
//! nothing here panics as long as the `System` itself does not, and NaN never spreads silently.
//!
//! Sine and cosine are this crate's own ([`Arithmetic::sin_cos_all`]). The feature `std` takes the
//! other functions, such as the tangent, from the standard library instead of libm, and fuses
//! [products with sums](Arithmetic::mul_add) on targets with an instruction for that; without it
//! results are the same on every machine.
//!
//! # Example
//!
//! A pendulum, as the compiler would write it, swings for a second:
//!
//! ```
//! use lamc_runtime::{
//!     Arithmetic, Dimensions, Dopri5, Energy, EquationsMut, Error, Integrator, Mechanism, State,
//!     StraightLine, System, workspace_len,
//! };
//!
//! const N: usize = 1;
//! const C: usize = 0;
//! const DIMENSIONS: Dimensions =
//!     Dimensions { coordinates: N, rows: C, bodies: 1, points: 1, ..Dimensions::ZERO };
//!
//! /// A point mass of 1 kg, 1 m below its hinge.
//! struct Pendulum;
//!
//! impl StraightLine for Pendulum {
//!     type Number = f64;
//! }
//!
//! impl System for Pendulum {
//!     type Scalar = f64;
//!     type Vector = [f64; N];
//!     type Matrix = [f64; N * N];
//!     type Workspace = [f64; workspace_len(DIMENSIONS)];
//!
//!     fn dimensions(&self) -> Dimensions { DIMENSIONS }
//!     fn vector(&self) -> Self::Vector { [0.0; N] }
//!     fn matrix(&self) -> Self::Matrix { [0.0; N * N] }
//!     fn workspace(&self) -> Self::Workspace { [0.0; workspace_len(DIMENSIONS)] }
//!     fn size(&self) -> f64 { 1.0 }
//!     fn limits(&self, _: usize) -> [f64; 2] { [f64::NEG_INFINITY, f64::INFINITY] }
//!     fn initial_position(&self, _: usize) -> f64 { 0.5 }
//!     fn initial_speed(&self, _: usize) -> f64 { 0.0 }
//!     fn is_pinned(&self, _: usize) -> bool { true }
//!     fn write_equations(&self, _: f64, q: &[f64], _: &[f64], out: EquationsMut<'_, f64>) {
//!         out.mass[0] = 1.0;
//!         out.forcing[0] = -9.81 * Arithmetic::sin_cos(q[0]).0;
//!     }
//!     fn write_closure(&self, _: &[f64], _: &mut [f64], _: &mut [f64]) {}
//!     fn energy(&self, _: f64, q: &[f64], u: &[f64]) -> Energy<f64> {
//!         let potential = -9.81 * Arithmetic::sin_cos(q[0]).1;
//!         Energy { kinetic: u[0] * u[0] / 2.0, potential }
//!     }
//!     fn write_poses(&self, q: &[f64], out: &mut [f64]) {
//!         let (s, c) = Arithmetic::sin_cos(q[0]);
//!         out.copy_from_slice(&[c, -s, 0.0, s, c, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]);
//!     }
//!     fn write_points(&self, q: &[f64], out: &mut [f64]) {
//!         let (s, c) = Arithmetic::sin_cos(q[0]);
//!         out.copy_from_slice(&[s, -c, 0.0]);
//!     }
//! }
//!
//! impl Mechanism<f64, N, C> for Pendulum {
//!     type Residual = [f64; 0];
//!     type ResidualJacobian = [[f64; N]; 0];
//!     type Poses = [[f64; 12]; 1];
//!     type Points = [[f64; 3]; 1];
//! }
//!
//! # fn main() -> Result<(), Error> {
//! let pendulum = Pendulum;
//! let mut state = pendulum.assembled()?;
//! let before = pendulum.energy(state.t, &state.q, &state.u);
//! Dopri5::new(&pendulum).run(&pendulum, &mut state, 1.0, |state| {
//!     assert!(state.q[0].abs() <= 0.5 + 1e-6);
//! })?;
//! let after = pendulum.energy(state.t, &state.q, &state.u);
//! let change = after.kinetic + after.potential - before.kinetic - before.potential;
//! assert!(change.abs() < 1e-6);
//! # Ok(())
//! # }
//! ```

#![forbid(unsafe_code)]
#![cfg_attr(not(any(test, feature = "std")), no_std)]
#![allow(clippy::neg_cmp_op_on_partial_ord, reason = "`!(a > b)` is how NaN is meant to fail")]
#![allow(clippy::needless_range_loop, reason = "one index runs through several slices at once")]

mod acceleration;
mod assembly;
mod batch;
mod closure_rows;
pub mod constants;
mod equilibrium;
mod error;
mod integrate;
mod jacobian;
#[cfg(feature = "simd")]
mod lanes;
mod linear;
mod linearised;
mod linearization;
mod mechanism;
mod passage;
mod projection;
mod rank;
mod scalar;
mod sin_cos;
mod state;
mod stops;
mod system;
mod workspace;

pub use acceleration::{Constraint, acceleration, acceleration_and_forces, acceleration_in_motion};
pub use assembly::{Assembly, assemble};
pub use batch::{Batch, LaneError, Lanes};
pub use equilibrium::{Equilibrium, equilibrium};
pub use error::Error;
pub use integrate::{Dopri5, Integrator, Rk4, Rodas, SemiImplicitEuler, Stabilisation};
pub use jacobian::{JacobianMut, derivatives_along, jacobian};
pub use linearization::{LinearizationMut, linearize};
pub use mechanism::{Closure, Equations, Forces, Jacobian, Mechanism, Storage};
pub use projection::{Projected, project};
pub use scalar::{Arithmetic, Scalar};
pub use sin_cos::sin_cos_unfused;
pub use state::{State, StateOf};
pub use stops::Stopped;
pub use system::{
    Balance, Change, Dimensions, Drive, Energy, EquationsMut, Margin, ProjectionMut, StraightLine,
    System,
};
#[cfg(feature = "simd")]
pub use wide::{f32x8, f64x4};
pub use workspace::workspace_len;
