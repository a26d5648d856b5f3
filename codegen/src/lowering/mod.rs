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

use std::{panic, thread};

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
    let mut functions = each(functions::functions(equations, &interface), optimise);
    let tangent = &functions[FunctionKind::Tangent as usize];
    let solved = solution::functions(equations, tangent, optimise);
    functions.extend(solved);
    constants::snap(&mut functions);
    let finished = |function| check(&interface, sections::sections(reduce(function)));
    let functions = each(functions, finished);
    Program { interface, facts: facts::facts(equations), functions }
}

/// Applies passes to all functions, to each in a thread of its own.
fn each(functions: Vec<Function>, passes: impl Fn(Function) -> Function + Sync) -> Vec<Function> {
    let passes = &passes;
    thread::scope(|scope| {
        let spawn = |function| scope.spawn(move || passes(function));
        let threads: Vec<_> = functions.into_iter().map(spawn).collect();
        let joined = threads.into_iter().map(thread::ScopedJoinHandle::join);
        joined.map(|done| done.unwrap_or_else(|panic| panic::resume_unwind(panic))).collect()
    })
}

/// Passes a function through, after the verifier has seen it.
fn check(interface: &Interface, function: Function) -> Function {
    debug_assert_eq!(verify_function(interface, &function), Ok(()));
    function
}
