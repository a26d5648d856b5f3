//! Parameters from measurements: stiffness, damping and others that make a simulated motion the
//! recorded one.
//!
//! ```text
//! record (CSV) -> start (where the motion may begin) -> trajectory (motion and its derivatives)
//!              -> fit (least squares, standard errors)
//! ```
//!
//! [`swing`] is the pendulum of DETC2018-86359, with the paper's own way beside it: derivatives of a
//! [`fourier`] series, and a linear fit. [`family`] makes polynomials of a table of such hinges.

mod candidate;
pub mod family;
mod fit;
pub mod fourier;
mod record;
mod start;
pub mod swing;
#[cfg(test)]
mod tests;
mod trajectory;

pub use fit::{Estimate, Fit, FitError, NEAR, Problem};
pub use record::{Record, RecordError};
