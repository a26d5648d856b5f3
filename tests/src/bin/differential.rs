//! Compares random mechanisms with Newton's and Euler's equations in maximal coordinates, through machine
//! code and interpreter, in `f64` and `f32`: what `lamc verify` does, on models that nobody wrote. What was compiled is
//! also written as bytes and read again.
//!
//! ```text
//! cargo run -q -p lamc-tests --bin differential -- --count 150 [--seed 1] [--keep FOLDER]
//! ```
//!
//! A failure prints the seed, what failed, and the shortest model found that still fails; with `--keep` it is
//! written to a folder. The exit code is 1 if anything failed.

use std::ops::Range;
use std::process::ExitCode;

use lamc::laminate::Mechanism;
use lamc::pipeline::{Compiled, compile};
use lamc::source::SourceFile;
use lamc_tests::varied::mechanism;
use lamc_tests::{campaign, largest};
use lamc_workbench::verify::{Check, Settings, at_states};

/// States compared for each mechanism.
const STATES: usize = 4;

/// Sizes, m, at which masses and inertias are numbers of single precision: outside, products of inertias are
/// below 1e-38 or above 1e38.
const SIZES: Range<f64> = 1e-3..1e2;

/// The heaviest over the lightest body up to which single precision is compared: further apart, the digits of
/// the light one are lost in sums.
const MASSES: f64 = 1e4;

/// The same where a body is free: a light one is moved by the difference of what heavy ones do to it.
const FREE_MASSES: f64 = 1e2;

fn main() -> ExitCode {
    campaign::run("differential", 150, &mechanism, &checks)
}

fn checks(text: &str) -> Result<Vec<Check>, String> {
    let file = SourceFile { path: "random.yaml".into(), text: text.to_owned() };
    let settings = Settings { states: STATES, seed: 1, duration: 0.1 };
    let compiled = compile(&file).map_err(|error| error.to_string())?;
    let mut checks = at_states(&compiled, &settings);
    let mechanism = &compiled.topology.mechanism;
    let is_free = !compiled.program.interface.free.is_empty();
    let masses = if is_free { FREE_MASSES } else { MASSES };
    if !SIZES.contains(&mechanism.size) || mass_ratio(mechanism) > masses {
        checks.retain(|check| check.name != "single precision");
    }
    let read = Compiled::from_bytes(&compiled.to_bytes()).map_err(|error| error.to_string())?;
    let differs = format!("{read:?}") != format!("{compiled:?}");
    checks.push(Check::new("serialised", 1, f64::from(u8::from(differs)), 0.0));
    Ok(checks)
}

/// The largest over the smallest mass of the bodies that move.
fn mass_ratio(mechanism: &Mechanism) -> f64 {
    let moving = mechanism.bodies.iter().filter(|body| !body.fixed);
    let masses: Vec<f64> = moving.map(|body| body.mass_properties.mass).collect();
    largest(&masses) / masses.iter().copied().fold(f64::INFINITY, f64::min)
}
