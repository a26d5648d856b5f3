//! Optimisations: goals as they are read, derivatives, and linkages whose best design is known.

mod derivatives;
mod endings;
mod linkages;
mod numbers;
mod reading;
mod rests;
mod yields;

use lamc::pipeline::{self, Compiled};
use lamc::source::SourceFile;

use super::*;
use crate::execution::Jit;

fn file(text: &str) -> SourceFile {
    SourceFile { path: "goals.yaml".to_owned(), text: text.to_owned() }
}

fn compiled(model: &str) -> Compiled {
    pipeline::compile(&file(model)).unwrap_or_else(|error| panic!("{error}"))
}

fn problem<'c>(compiled: &'c Compiled, goals: &str) -> Problem<'c> {
    let file = file(goals);
    let goals = Goals::read(&file, compiled)
        .unwrap_or_else(|problems| panic!("{}", problems.render(&file, false)));
    Problem::new(compiled, Jit::new(&compiled.program), goals)
}

fn optimised(problem: &Problem<'_>) -> Outcome {
    problem.optimise(2, &|| false, &|| ()).unwrap_or_else(|failure| panic!("{failure}"))
}
