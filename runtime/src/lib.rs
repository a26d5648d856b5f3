//! Runtime of compiled mechanisms: `no_std`, no allocation, no unsafe code.

#![cfg_attr(not(any(test, feature = "std")), no_std)]

mod scalar;
mod system;

pub use scalar::Scalar;
pub use system::{Dimensions, Energy, EquationsMut, System};
