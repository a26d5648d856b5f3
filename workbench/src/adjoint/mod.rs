//! Derivatives of motions by everything, in reverse mode: the discrete adjoint.
//!
//! A number J that depends on states of a motion has derivatives by the initial state, the parameters and the inputs. One
//! pass back over the steps gives all of them, for a few times what the motion costs, however many there are:
//!
//! ```text
//! y_n+1 = F(y_n, p):   y_n' = F_y^T y_n+1' + dJ/dy_n,   p' = sum of F_p^T y_n+1'
//! ```
//!
//! with the adjoint y' of y. They are the derivatives of the numbers that the integrator computed, exact to rounding (A.
//! Griewank and A. Walther, "Evaluating Derivatives", 2008, chapters 3 and 12). A long motion is kept as states at some of its
//! steps, from which the pass back repeats one piece at a time.

mod constrained;
mod differentiated;
mod general;
mod implicit;
mod motion;
mod orientation;
mod reverse;
mod saddle;
mod start;
mod steps;
mod tape;
#[cfg(test)]
mod tests;

pub use differentiated::{Adjoints, Differentiated, Undifferentiable};
pub use motion::{Course, Gradient, Sample, Schedule, Slopes};
pub use reverse::Layout;
pub use steps::Method;
