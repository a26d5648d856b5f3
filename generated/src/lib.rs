//! Modules that `lamc` wrote for the mechanisms in `examples/`, kept equal to what it writes now.
//!
//! ```
//! use lamc_generated::sixbar::Sixbar;
//! use lamc_runtime::{Mechanism, Rk4};
//!
//! let robot = Sixbar::<f64>::default();
//! let mut state = robot.assembled()?;
//! let mut rk4 = Rk4::new(&robot);
//! for _ in 0..100 {
//!     rk4.step(&robot, &mut state, 1e-3)?;
//! }
//! # Ok::<(), lamc_runtime::Error>(())
//! ```

#![no_std]
#![forbid(unsafe_code)]

/// A crawler: a free body with two motors, and contacts with the ground.
#[rustfmt::skip]
pub mod crawler;

/// A four-bar: one planar loop, very stiff.
#[rustfmt::skip]
pub mod fourbar;

/// A jumper: a free body, a rubber band, and contacts with the ground.
#[rustfmt::skip]
pub mod jumper;

/// A four-bar whose lengths are parameters.
#[rustfmt::skip]
pub mod linkage;

/// A simple pendulum with a measured hinge.
#[rustfmt::skip]
pub mod pendulum;

/// An arm on a motor that a sampled controller drives.
#[rustfmt::skip]
pub mod servo;

/// A six-bar: one spherical loop.
#[rustfmt::skip]
pub mod sixbar;

/// A leg on a hinge, with the derivatives that an estimator needs.
#[rustfmt::skip]
pub mod swing;

/// A triple pendulum.
#[rustfmt::skip]
pub mod triple_pendulum;
