//! What both firmware images do, and its number type.

#![no_std]
#![forbid(unsafe_code)]

#[cfg(not(feature = "estimate"))]
use lamc_embedded_motion::Motion;

/// The number type of this build.
#[cfg(feature = "double")]
pub type Real = f64;
/// The number type of this build.
#[cfg(not(feature = "double"))]
pub type Real = f32;

/// What this build does.
#[cfg(not(any(feature = "jumper", feature = "estimate")))]
pub type Work = Motion<lamc_generated::sixbar::Sixbar<Real>>;
/// What this build does.
#[cfg(feature = "jumper")]
pub type Work = Motion<lamc_generated::jumper::Jumper<Real>>;
/// What this build does.
#[cfg(feature = "estimate")]
pub type Work = lamc_embedded_motion::Estimation<Real>;
