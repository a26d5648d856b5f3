//! Compares the Rust and C modules of random mechanisms, as rustc and a C compiler make them, with Newton's and
//! Euler's equations in maximal coordinates, and the Rust module with the interpreter bit by bit.
//!
//! ```text
//! cargo run -q -p lamc-tests --bin modules -- --count 20 [--seed 1] [--keep FOLDER]
//! ```
//!
//! The exit code is 1 if anything failed.

use std::process::ExitCode;

use lamc::pipeline::compile;
use lamc::program::Interpreter;
use lamc::source::SourceFile;
use lamc_runtime::{Mechanism, acceleration};
use lamc_tests::campaign;
use lamc_tests::compare::keep_largest;
use lamc_tests::modules::{Answer, Workshop};
use lamc_tests::varied::mechanism;
use lamc_workbench::verify::{
    ACCELERATION, Check, ENERGY, Settings, Solution, Values, closed_states,
};

/// States compared for each mechanism.
const STATES: usize = 4;

fn main() -> ExitCode {
    let workshop = match Workshop::new() {
        Ok(workshop) => workshop,
        Err(error) => {
            eprintln!("{error}");
            return ExitCode::FAILURE;
        }
    };
    campaign::run("modules", 20, &mechanism, &|text| checks(&workshop, text))
}

fn checks(workshop: &Workshop, text: &str) -> Result<Vec<Check>, String> {
    let file = SourceFile { path: "varied.yaml".into(), text: text.to_owned() };
    let settings = Settings { states: STATES, seed: 1, duration: 0.1 };
    let compiled = compile(&file).map_err(|error| error.to_string())?;
    let states = match closed_states(&compiled, &settings) {
        Ok(states) => states,
        Err(remark) => return Ok(vec![Check::without("rust acceleration", remark)]),
    };
    let (values, expected): (Vec<Values>, Vec<Solution>) = states.into_iter().unzip();
    let interpreted: Vec<Answer> = values
        .iter()
        .map(|values| interpreted(Interpreter::new(&compiled.program), values))
        .collect();
    let mut checks = Vec::new();
    let names = [["rust acceleration", "rust energy"], ["C acceleration", "C energy"]];
    for (names, answers) in
        names.into_iter().zip([workshop.rust(&compiled, &values)?, workshop.c(&compiled, &values)?])
    {
        let mut worst = [0.0; 2];
        for (answer, expected) in answers.iter().zip(&expected) {
            let errors = errors(answer, expected);
            worst[0] = keep_largest(worst[0], errors[0] / expected.condition());
            worst[1] = keep_largest(worst[1], errors[1]);
        }
        let cases = answers.len();
        checks.push(Check::new(names[0], cases, worst[0], ACCELERATION));
        checks.push(Check::new(names[1], cases, worst[1], ENERGY));
        if names[0].starts_with("rust") {
            let differ = usize::from(!same_bits(&answers, &interpreted));
            checks.push(Check::new("rust bits", cases, differ as f64, 0.0));
        }
    }
    Ok(checks)
}

/// Relative errors of du/dt and of the energies, NaN where there is no answer.
fn errors(answer: &Answer, expected: &Solution) -> [f64; 2] {
    let Ok(numbers) = answer else { return [f64::NAN; 2] };
    let n = expected.acceleration.len();
    if numbers.len() != n + 2 {
        return [f64::NAN; 2];
    }
    let (rates, energies) = numbers.split_at(n);
    let energy = [expected.kinetic_energy, expected.potential_energy];
    let total = energy[0].abs() + energy[1].abs();
    let off = keep_largest((energies[0] - energy[0]).abs(), (energies[1] - energy[1]).abs());
    let share = if off == 0.0 { 0.0 } else { off / total };
    [expected.relative_error(rates), share]
}

/// What the interpreter answers.
fn interpreted(mut system: Interpreter, values: &Values) -> Answer {
    let interface = system.interface().clone();
    for (parameter, &value) in interface.parameters.iter().zip(&values.parameters) {
        system.set_parameter(&parameter.name, value).map_err(|error| error.to_string())?;
    }
    for (name, &value) in interface.inputs.iter().zip(&values.inputs) {
        system.set_input(name, value).map_err(|error| error.to_string())?;
    }
    let (mut rates, mut workspace) = (system.speeds(), system.workspace());
    let (t, q, u) = (values.t, &values.q, &values.u);
    acceleration(&system, t, q, u, &mut workspace, &mut rates)
        .map_err(|error| error.to_string())?;
    let energy = system.energy(t, q, u).map_err(|error| error.to_string())?;
    rates.extend([energy.kinetic, energy.potential]);
    Ok(rates)
}

/// Whether all numbers are the same to the last bit. On processors that fuse products in the runtime, only
/// the interpreter's process may do so.
fn same_bits(found: &[Answer], expected: &[Answer]) -> bool {
    let bits = |answer: &Answer| {
        answer
            .as_ref()
            .map(|numbers| numbers.iter().map(|number| number.to_bits()).collect::<Vec<_>>())
            .map_err(Clone::clone)
    };
    found.iter().map(bits).eq(expected.iter().map(bits))
}
