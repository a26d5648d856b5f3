//! The number type of both firmware images.

#![no_std]
#![forbid(unsafe_code)]

/// The number type of this build.
#[cfg(feature = "double")]
pub type Real = f64;
/// The number type of this build.
#[cfg(not(feature = "double"))]
pub type Real = f32;
