//! Runtime of compiled mechanisms: `no_std`, no allocation, no unsafe code.
//!
//! The compiler writes, for each mechanism, a type that implements [`Mechanism`] and has the same methods,
//! with arrays, as its own. The algorithms here are written once, over that trait:
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
//! | controllers in discrete time | [`ControlLoop`], [`Controlled`] |
//! | motion with rigid contacts and stops, at fixed steps | [`Rigid`] |
//! | several designs or motions at once | [`Batch`] |
//!
//! Vectors are the caller's slices, temporaries live in a workspace of [`workspace_len`](plumbing::workspace_len) numbers.
//! Angles are in radians, everything else in SI units. A slice that is too short, a state that is
//! not finite, a loop that cannot be closed is an [`Error`] that names the joint or the loop:
//! nothing here panics as long as the `Mechanism` itself does not, and NaN never spreads silently.
//!
//! Sine and cosine are this crate's own ([`Arithmetic::sin_cos_all`]). The feature `std` takes the
//! other functions, such as the tangent, from the standard library instead of libm, and fuses
//! [products with sums](Arithmetic::mul_add) on targets with an instruction for that; without it
//! results are the same on every machine.
//!
//! # Example
//!
//! A pendulum, written by hand, swings for a second. (The compiler writes such an implementation, and inherent
//! methods that need no trait: `Sixbar::<f64>::default().assembled()?`.)
//!
//! ```
//! use lamc_runtime::plumbing::{Dimensions, EquationsMut, workspace_len};
//! use lamc_runtime::{Arithmetic, Dopri5, Energy, Error, Integrator, Mechanism, State};
//!
//! const DIMENSIONS: Dimensions = Dimensions { bodies: 1, ..Dimensions::of_joints(1) };
//!
//! /// A point mass of 1 kg, 1 m below its hinge.
//! struct Pendulum;
//!
//! impl Mechanism for Pendulum {
//!     type Scalar = f64;
//!     type Coordinates = [f64; 1];
//!     type Speeds = [f64; 1];
//!     type Matrix = [f64; 1];
//!     type Workspace = [f64; workspace_len(DIMENSIONS)];
//!     type Poses = [[f64; 12]; 1];
//!     type Points = [[f64; 3]; 0];
//!
//!     fn dimensions(&self) -> Dimensions { DIMENSIONS }
//!     fn speeds(&self) -> [f64; 1] { [0.0] }
//!     fn matrix(&self) -> [f64; 1] { [0.0] }
//!     fn workspace(&self) -> Self::Workspace { [0.0; workspace_len(DIMENSIONS)] }
//!     fn size(&self) -> f64 { 1.0 }
//!     fn limits(&self, _: usize) -> [f64; 2] { [f64::NEG_INFINITY, f64::INFINITY] }
//!     fn initial(&self) -> State<[f64; 1], f64> { State { t: 0.0, q: [0.5], u: [0.0] } }
//!     fn is_pinned(&self, _: usize) -> bool { true }
//!     fn energy(&self, _: f64, q: &[f64; 1], u: &[f64; 1]) -> Result<Energy<f64>, Error> {
//!         let potential = -9.81 * Arithmetic::sin_cos(q[0]).1;
//!         Ok(Energy { kinetic: u[0] * u[0] / 2.0, potential })
//!     }
//!     fn write_equations(
//!         &self, _: f64, q: &[f64], _: &[f64], out: EquationsMut<'_, f64>,
//!     ) -> Result<(), Error> {
//!         out.mass[0] = 1.0;
//!         out.forcing[0] = -9.81 * Arithmetic::sin_cos(q[0]).0;
//!         Ok(())
//!     }
//!     fn write_closure(&self, _: &[f64], _: &mut [f64], _: &mut [f64]) -> Result<(), Error> {
//!         Ok(())
//!     }
//! }
//!
//! # fn main() -> Result<(), Error> {
//! let pendulum = Pendulum;
//! let mut state = pendulum.assembled()?;
//! let before = pendulum.energy(state.t, &state.q, &state.u)?;
//! Dopri5::new(&pendulum).run(&pendulum, &mut state, 1.0, |state| {
//!     assert!(state.q[0].abs() <= 0.5 + 1e-6);
//! })?;
//! let after = pendulum.energy(state.t, &state.q, &state.u)?;
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
mod arrays;
mod assembly;
mod batch;
mod closure_rows;
pub mod constants;
mod control;
mod decomposition;
mod delegate;
mod energy;
mod equilibrium;
mod error;
pub mod free_body;
mod integrate;
mod jacobian;
#[cfg(feature = "simd")]
mod lanes;
mod linear;
mod linearised;
mod linearization;
pub mod loops;
mod mechanism;
mod names;
mod noise;
mod passage;
pub mod plumbing;
mod projection;
mod rank;
mod reduction;
mod rest;
mod scalar;
mod sin_cos;
mod state;
mod stops;
pub mod table;
mod trust;
mod unilateral;
mod workspace;

pub use acceleration::{Constraint, acceleration, acceleration_and_forces, acceleration_in_motion};
pub use arrays::{Closure, Equations, Forces, Jacobian, JacobianParams};
pub use assembly::{Assembly, assemble};
pub use batch::{Batch, LaneError, Lanes, StatesOf};
pub use control::{Clock, Control, ControlLoop, Controlled, Controller, Pwm};
pub use energy::{Energy, Momentum};
pub use equilibrium::{Equilibrium, equilibrium};
pub use error::Error;
pub use integrate::{Dopri5, Integrator, Rigid, Rk4, Rodas, SemiImplicitEuler, Stabilisation};
pub use jacobian::{Change, JacobianMut, derivatives_along, jacobian};
pub use lamc_runtime_macros::tables;
pub use linearization::{LinearizationMut, linearize};
pub use mechanism::Mechanism;
pub use names::{Body, Input, Joint, Parameter, Point};
pub use projection::{Projected, project};
pub use scalar::{Arithmetic, Scalar};
pub use sin_cos::sin_cos_unfused;
pub use state::{State, StateOf};
pub use stops::Stopped;
#[cfg(feature = "simd")]
pub use wide::{f32x8, f64x4};
