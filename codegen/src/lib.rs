//! `lamc`: the compiler for the motion of laminate robots.
//!
//! Data flows one way, and each stage imports only the stages before it:
//!
//! ```text
//! source -> laminate -> topology -> kane -> program -> backend
//! (YAML)    (physics)   (tree+loops) (symbolic) (straight line)  (Rust)
//! ```
//!
//! [`pipeline::compile`] names every stage in order.

#![cfg_attr(
    test,
    allow(clippy::disallowed_methods, reason = "tests compare with the standard library")
)]

pub mod arithmetic;
pub mod backend;
#[cfg(test)]
#[allow(dead_code, reason = "a part of it serves here")]
#[path = "../../tests/src/compare.rs"]
mod compare;
mod config;
pub mod files;
pub mod kane;
pub mod laminate;
pub mod pipeline;
pub mod program;
pub mod sealed;
pub mod source;
pub mod symbolic;
pub mod topology;

pub use config::{BuildError, Config, Precision};
pub use source::Tunable;

#[cfg(test)]
#[allow(dead_code, reason = "a part of it serves here")]
#[path = "../../tests/src/uniform.rs"]
mod uniform;
