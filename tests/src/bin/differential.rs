//! Compares random mechanisms with Newton's and Euler's equations in maximal coordinates, through machine
//! code and interpreter, in `f64` and `f32`: what `lamc verify` does, on models that nobody wrote.
//!
//! ```text
//! cargo run -q -p lamc-tests --bin differential -- --count 150 [--seed 1] [--keep FOLDER]
//! ```
//!
//! A failure prints the seed, what failed, and the shortest model found that still fails; with `--keep` it is
//! written to a folder. The exit code is 1 if anything failed.

use std::process::ExitCode;

use lamc::pipeline::compile;
use lamc::source::SourceFile;
use lamc_tests::campaign;
use lamc_tests::random::mechanism;
use lamc_workbench::verify::{Check, Settings, at_states};

/// States compared for each mechanism.
const STATES: usize = 4;

fn main() -> ExitCode {
    campaign::run("differential", 150, &mechanism, &checks)
}

fn checks(text: &str) -> Result<Vec<Check>, String> {
    let file = SourceFile { path: "random.yaml".into(), text: text.to_owned() };
    let settings = Settings { states: STATES, seed: 1, duration: 0.1 };
    let compiled = compile(&file).map_err(|error| error.to_string())?;
    Ok(at_states(&compiled, &settings))
}
