//! `lamc derive MODEL -o FILE`: the compiled model as bytes.

use clap::Args;
use lamc::source::read_quantity;

use super::paths::Paths;
use super::start::Start;
use super::{Derivation, Outcome, misused, output};

/// Derive a model's equations and write them as bytes.
#[derive(Args)]
pub struct Arguments {
    /// The model; `-` reads standard input
    model: String,
    /// Where to write the bytes, which the same release of lamc reads; `-` writes standard output
    #[arg(short, long, value_name = "FILE")]
    output: String,
    /// Replace an input by an expression of t and the parameters; numbers without a unit are in SI
    /// units and radians: "motor=0.002*sin(2*pi*t)"
    #[arg(long, value_name = "NAME=VALUE")]
    input: Vec<String>,
    /// Hold a joint at an angle; a number without a unit is in the model's `units.angle` (radians by
    /// default): j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    lock: Vec<String>,
    #[command(flatten)]
    derivation: Derivation,
}

pub fn run(arguments: Arguments) -> Outcome {
    let Arguments { model, output: path, input, lock, derivation } = arguments;
    Paths::default().input("the model", [&model]).output("--output", [&path]).check()?;
    let is_number = |setting: &&String| {
        setting.split_once('=').is_some_and(|(_, text)| read_quantity(text.trim()).is_some())
    };
    if let Some(setting) = input.iter().find(is_number) {
        return Err(misused(format_args!(
            "`--input {setting}`: a number is given when the model runs (in Python to `simulate`); here an input can \
             become a formula"
        )));
    }
    output::probe(&path)?;
    let compiled = Start::of(model, input, lock, derivation).compile(&[])?;
    output::write(&path, &compiled.to_bytes())
}
