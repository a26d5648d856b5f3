//! Hinge models: stiffness, damping and linear range of a flexure from its material and shape.

mod beam;
mod hull;
pub mod sharifzadeh2018;

pub use beam::{Beam, LinearRange};
pub use hull::contains;
