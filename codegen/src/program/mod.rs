//! Stage 5: [`Equations`] -> [`Program`]: straight-line code in SSA form.
//!
//! [`lower`] names every pass in order. Each pass takes a [`Function`] and returns one that
//! computes the same, up to rounding, with its stated postcondition; the verifier runs after each
//! in debug builds and tests.

mod balance;
mod closure_factor;
mod code;
mod constants;
mod cost;
mod dead;
mod differentiate;
mod eliminate;
mod executable;
mod facts;
mod fold;
mod form;
mod interface;
mod interpreter;
mod ir;
mod labels;
mod like_terms;
mod lowering;
mod number;
mod op;
mod parts;
mod sections;
mod selection;
mod serial;
mod shape;
mod signature;
mod solution;
mod text;
mod verify;

#[cfg(test)]
mod tests;

pub use constants::is_same;
pub use cost::Cost;
pub use executable::{Engine, Executable, UnknownName};
pub use form::Form;
pub use interpreter::{Interpretation, Interpreter};
pub use ir::*;
pub use parts::{Angle, Part, Parts, angles, is_read};
pub use selection::{Selection, UnknownFunction};
pub use serial::{FORMAT_VERSION, ReadError};
pub use shape::{Array, Shape, Size};
pub use signature::*;
pub use verify::{VerifyError, verify};

use crate::kane::Equations;

/// The program of a mechanism. `source_name` (no folders) and `source_text` identify the input in
/// the generated header.
pub fn lower(equations: &Equations, source_name: &str, source_text: &str) -> Program {
    let interface = interface::interface(equations, source_name, source_text);
    let reduce = |function: Function| {
        let function = check(&interface, fold::fold(function));
        let function = check(&interface, number::number(function));
        check(&interface, dead::dead(function))
    };
    let optimise = |function: Function| -> Function {
        let function = check(&interface, like_terms::merge(reduce(function)));
        let function = check(&interface, balance::balance(reduce(function)));
        // Terms have met that cancel, and values that were not known to be the same.
        reduce(function)
    };
    let mut functions: Vec<Function> =
        lowering::functions(equations, &interface).into_iter().map(optimise).collect();
    let tangent = &functions[FunctionKind::Tangent as usize];
    let solved = solution::functions(equations, tangent, optimise);
    functions.extend(solved);
    constants::snap(&mut functions);
    let finished = |function| check(&interface, sections::sections(reduce(function)));
    let functions = functions.into_iter().map(finished).collect();
    Program { interface, facts: facts::facts(equations), functions }
}

/// Passes a function through, after the verifier has seen it.
fn check(interface: &Interface, function: Function) -> Function {
    debug_assert_eq!(verify::function(interface, &function), Ok(()));
    function
}
