//! [`Program`]: straight-line code in SSA form, with the verifier, the interpreter, and its bytes.
//!
//! A program is plain data: whoever has one needs neither the model's text nor the algebra to run it or to
//! write a module.

mod argument;
mod cost;
mod engine;
mod executable;
mod fact;
mod form;
mod interpreter;
mod ir;
mod op;
mod parts;
mod reduction;
mod section;
mod selection;
mod serial;
mod shape;
mod signature;
mod signatures;
mod text;
mod verify;

#[cfg(test)]
pub(crate) mod tests;

pub use crate::source::controllers::Pwm;
pub use argument::Argument;
pub use cost::Cost;
pub use engine::{Engine, UnknownName};
pub use executable::Executable;
pub use fact::{Fact, Quantity};
pub use form::Form;
pub use interpreter::{Interpretation, Interpreter};
pub use ir::*;
pub use parts::{Angle, Part, Parts, angles, is_read};
pub use reduction::{ReductionInfo, SparseRows};
pub use section::{Phase, Section, Subject};
pub use selection::{Selection, UnknownFunction};
pub use serial::{FORMAT_VERSION, ReadError};
pub use shape::{Array, Shape, Size};
pub use signature::*;
pub use signatures::SIGNATURES;
pub use verify::{VerifyError, verify, verify_function};
