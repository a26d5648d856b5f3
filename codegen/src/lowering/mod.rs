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
mod drawing;
mod eliminate;
mod facts;
mod fold;
mod functions;
mod independent;
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
use drawing::Drawing;
use solution::Choice;

/// The program of a mechanism. `source_name` (no folders) and `source_text` identify the input in
/// the generated header.
pub fn lower(equations: &Equations, source_name: &str, source_text: &str) -> Program {
    let mut interface = interface::interface(equations, source_name, source_text);
    let mut drawing = Drawing::default();
    let mut hoist = |interface: &mut Interface, function: Function| match equations.is_parametric {
        true => {
            let function = drawing.hoist(function);
            interface.drawn = drawing.len();
            function
        }
        false => function,
    };
    let functions = functions::functions(equations, &interface);
    let functions = functions.into_iter().map(|function| hoist(&mut interface, function)).collect();
    let passes = Passes { interface: &interface };
    let mut functions = each(functions, |function| passes.optimise(function));
    let tangent = &functions[FunctionKind::Tangent as usize];
    let choices = solution::choices(equations, tangent).into_iter();
    // What follows from the parameters alone must not count where eliminations are compared.
    let choices = choices.map(|choice| choice.map(|it| hoist(&mut interface, fold::fold(it))));
    let choices: Vec<Choice> = choices.collect();
    let passes = Passes { interface: &interface };
    let choices = each(choices, |choice| choice.map(|function| passes.optimise(function)));
    let best = |choice: Choice| choice.map(|function| hoist(&mut interface, function)).best();
    functions.extend(choices.into_iter().map(best));
    constants::snap(&mut functions);
    let functions = functions.into_iter().map(|function| hoist(&mut interface, function));
    let functions: Vec<Function> = functions.collect();
    let functions = functions.into_iter().map(|function| drawing.sign(function));
    let mut functions: Vec<Function> = functions.collect();
    let table = drawing.finish(&mut functions);
    interface.drawn = table.outputs.first().map_or(0, |numbers| numbers.rows);
    functions.push(table);
    let passes = Passes { interface: &interface };
    let finished = |function| check(&interface, sections::sections(passes.reduce(function)));
    let functions = each(functions, finished);
    Program { interface, facts: facts::facts(equations), functions }
}

/// Passes that belong together.
struct Passes<'a> {
    interface: &'a Interface,
}

impl Passes<'_> {
    fn reduce(&self, function: Function) -> Function {
        let function = check(self.interface, fold::fold(function));
        let function = check(self.interface, number::number(function));
        check(self.interface, dead::dead(function))
    }

    fn optimise(&self, function: Function) -> Function {
        let function = check(self.interface, like_terms::merge(self.reduce(function)));
        let function = check(self.interface, balance::balance(self.reduce(function)));
        // Terms have met that cancel, and values that were not known to be the same.
        self.reduce(function)
    }
}

/// Applies passes to all functions, to each in a thread of its own.
fn each<T: Send>(functions: Vec<T>, passes: impl Fn(T) -> T + Sync) -> Vec<T> {
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
