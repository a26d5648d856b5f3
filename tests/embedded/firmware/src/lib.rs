//! The robot of both firmware images, and its number type.

#![no_std]
#![forbid(unsafe_code)]

/// The number type of this build.
#[cfg(feature = "double")]
pub type Real = f64;
/// The number type of this build.
#[cfg(not(feature = "double"))]
pub type Real = f32;

/// The robot of this build.
#[cfg(not(feature = "jumper"))]
pub type Robot = lamc_generated::sixbar::Sixbar<Real>;
/// The robot of this build.
#[cfg(feature = "jumper")]
pub type Robot = lamc_generated::jumper::Jumper<Real>;
