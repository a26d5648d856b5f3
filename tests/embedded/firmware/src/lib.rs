//! What both firmwares share.

#![no_std]
#![forbid(unsafe_code)]

/// The number type of this build.
#[cfg(feature = "double")]
pub type Real = f64;
/// The number type of this build.
#[cfg(not(feature = "double"))]
pub type Real = f32;
