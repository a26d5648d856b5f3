//! Prints the tables of docs/ACCURACY.md: the errors of accelerations next to the flat state.
//!
//! ```text
//! cargo run -q -p lamc-tests --bin accuracy
//! ```

use lamc::backend::rust::ScalarChoice;
use lamc_runtime::{Mechanism, acceleration};
use lamc_tests::near_flat::{NearFlat, NearFlatState};
use lamc_tests::package::Package;
use lamc_tests::{compile, relative_error, workspace};

/// An error and whether the rank is the true one.
type Outcome = (f64, bool);

fn main() {
    let models = NearFlat::read();
    let mut package = Package::new();
    let mut double = Vec::new();
    for model in &models {
        let compiled = compile(&workspace().join(&model.model));
        let system = lamc::program::Interpreter::new(&compiled.program);
        package.add(model.name(), &compiled, ScalarChoice::F32);
        for state in &model.states {
            let mut out = vec![0.0; state.q.len()];
            let mut workspace = system.workspace();
            let found = acceleration(&system, 0.0, &state.q, &state.u, &mut workspace, &mut out);
            double.push(outcome(state, &out, found.map_or(usize::MAX, |found| found.rank)));
            for kind in ["acceleration", "rank"] {
                package.ask(model.name(), kind, &[&state.q, &state.u]);
            }
        }
    }
    let mut answers = package.answers();
    let mut next = || answers.next().unwrap_or_default();
    let single: Vec<Outcome> = models
        .iter()
        .flat_map(|model| &model.states)
        .map(|state| {
            let (rates, rank) = (next(), next());
            outcome(state, &rates[..state.q.len()], rank[0] as usize)
        })
        .collect();
    println!("`f64`:\n");
    print(&models, &double);
    println!("\n`f32`:\n");
    print(&models, &single);
}

fn outcome(state: &NearFlatState, rates: &[f64], rank: usize) -> Outcome {
    (relative_error(rates, &state.acceleration), rank == state.rank)
}

/// A row for each model, at rest and moving; a column for each distance.
fn print(models: &[NearFlat], outcomes: &[Outcome]) {
    let mut outcomes = outcomes;
    for (index, model) in models.iter().enumerate() {
        let (mine, rest) = outcomes.split_at(model.states.len());
        outcomes = rest;
        let pairs: Vec<_> = model.states.iter().zip(mine).collect();
        if index == 0 {
            let far = pairs.iter().step_by(2);
            let distances: Vec<_> =
                far.map(|(state, _)| format!("{:e} rad", state.distance)).collect();
            println!("| model | | {} |", distances.join(" | "));
            println!("|---|---{}|", "|---:".repeat(distances.len()));
        }
        for (motion, at_rest) in [("at rest", true), ("moving", false)] {
            let cells: Vec<_> = pairs
                .iter()
                .filter(|(state, _)| state.is_at_rest() == at_rest)
                .map(|(_, (error, is_true))| {
                    let mark = if *is_true { "" } else { " *" };
                    format!("{error:.0e}{mark}")
                })
                .collect();
            println!("| {} | {motion} | {} |", model.name(), cells.join(" | "));
        }
    }
}
