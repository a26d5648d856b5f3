//! Identification: the stiffness, damping and other parameters with which a simulated motion agrees with a
//! recorded one.
//!
//! ```text
//! record (CSV) -> start (possible initial states) -> trajectory (motion and its derivatives)
//!              -> fit (least squares, standard errors)
//! ```
//!
//! [`swing`] is the pendulum of DETC2018-86359, with the method of the paper for comparison: derivatives of a
//! [`fourier`] series, and a linear fit. [`family`] fits polynomials to a table of such hinges.

mod candidate;
pub mod family;
mod fit;
pub mod fourier;
mod record;
mod start;
pub mod swing;
mod tangent;
#[cfg(test)]
mod tests;
mod trajectory;

pub use fit::{Estimate, Fit, FitError, NEAR, Problem, prescribes};
pub use record::Record;
