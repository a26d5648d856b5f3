//! Prints the random mechanism of a seed, or closed states of it with what Newton's and Euler's equations in
//! maximal coordinates say there:
//!
//! ```text
//! cargo run -q -p lamc-tests --bin varied -- 7 > varied7.yaml
//! cargo run -q -p lamc-tests --bin varied -- 7 --states 4 > states.json
//! ```

use std::env;
use std::process::ExitCode;

use lamc::pipeline::compile;
use lamc::source::SourceFile;
use lamc_tests::varied::mechanism;
use lamc_workbench::verify::{Settings, Solution, Values, closed_states};
use serde_json::{Value, json};

fn main() -> ExitCode {
    let words: Vec<String> = env::args().skip(1).collect();
    let (seed, states) = match words.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [seed] => (seed.parse().ok(), Some(0)),
        [seed, "--states", count] => (seed.parse().ok(), count.parse().ok()),
        _ => (None, None),
    };
    match (seed, states) {
        (Some(seed), Some(0)) => print!("{}", mechanism(seed)),
        (Some(seed), Some(count)) => match solved(&mechanism(seed), count) {
            Ok(states) => println!("{states}"),
            Err(reason) => {
                eprintln!("{reason}");
                return ExitCode::FAILURE;
            }
        },
        _ => {
            eprintln!("usage: varied SEED [--states COUNT]");
            return ExitCode::from(2);
        }
    }
    ExitCode::SUCCESS
}

/// Closed states of a model, or why there are none.
fn solved(text: &str, count: usize) -> Result<Value, String> {
    let file = SourceFile { path: "varied.yaml".into(), text: text.to_owned() };
    let compiled = compile(&file).map_err(|error| error.to_string())?;
    let settings = Settings { states: count, seed: 1, duration: 0.0 };
    let states = closed_states(&compiled, &settings).map_err(|remark| format!("{remark:?}"))?;
    let names = &compiled.program.interface.inputs;
    let state = |(values, expected): &(Values, Solution)| {
        let inputs: serde_json::Map<String, Value> =
            names.iter().cloned().zip(values.inputs.iter().map(|&value| json!(value))).collect();
        json!({
            "t": values.t,
            "q": values.q,
            "u": values.u,
            "inputs": inputs,
            "acceleration": expected.acceleration,
            "magnitude": expected.magnitude,
            "condition": expected.condition(),
            "energies": [expected.kinetic_energy, expected.potential_energy],
        })
    };
    Ok(states.iter().map(state).collect())
}
