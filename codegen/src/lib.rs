//! `lamc`: the compiler for the motion of laminate robots.
//!
//! Data flows one way:
//!
//! ```text
//! source -> laminate -> topology -> kane -> lowering -> program -> backend
//! (YAML)    (physics)   (tree+loops) (symbolic)         (straight line)  (Rust)
//! ```
//!
//! A stage imports the stages before it, and `program`: as plain data this is the common ground of those that make
//! programs and of those that use them. The module `pipeline` calls every stage in order. The feature `derive`, on by default, is what needs the symbolic
//! engine.

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
#[cfg(feature = "derive")]
mod config;
pub mod files;
#[cfg(feature = "derive")]
pub mod kane;
pub mod laminate;
#[cfg(feature = "derive")]
pub mod lowering;
pub mod pipeline;
pub mod program;
pub mod sealed;
pub mod source;
#[cfg(feature = "derive")]
pub mod symbolic;
pub mod topology;

#[cfg(feature = "derive")]
pub use config::{BuildError, Config, Precision};
pub use source::Tunable;

#[cfg(test)]
#[allow(dead_code, reason = "a part of it serves here")]
#[path = "../../tests/src/uniform.rs"]
mod uniform;
