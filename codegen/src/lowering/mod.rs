//! Stage 5: [`Equations`] -> [`Program`]: the passes that make straight-line code of expressions.
//!
//! [`lower`] names every pass in order. Each pass takes a [`Function`] and returns one that
//! computes the same, up to rounding, with its stated postcondition; the verifier runs after each
//! in debug builds and tests.

mod balance;
mod closure_factor;
mod code;
mod constants;
mod dead;
mod differentiate;
mod eliminate;
mod facts;
mod fold;
mod functions;
mod interface;
mod labels;
mod like_terms;
mod number;
mod sections;
mod solution;

#[cfg(test)]
mod tests;

use crate::kane::Equations;
use crate::program::{Function, FunctionKind, Interface, Program, verify_function};

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
        functions::functions(equations, &interface).into_iter().map(optimise).collect();
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
    debug_assert_eq!(verify_function(interface, &function), Ok(()));
    function
}
