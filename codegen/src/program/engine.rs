//! What evaluates the functions of a program.

use super::ir::{Program, Slot};
use super::signature::FunctionKind;

/// An interpreter or machine code: it evaluates the functions of a program.
pub trait Engine: Sized {
    /// An engine for the functions of a program.
    fn new(program: &Program) -> Self;

    /// Evaluates a function: `load` returns the value of a slot that it reads, `out` receives its outputs in order.
    fn run(&self, kind: FunctionKind, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]);
}

/// No parameter or input has this name.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("no parameter or input is called `{0}`")]
pub struct UnknownName(pub String);
