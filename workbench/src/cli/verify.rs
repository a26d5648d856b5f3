//! `lamc verify MODEL`: checks a model's equations against others and prints a table.

use std::fmt::Write;

use clap::Args;
use lamc_workbench::verify::{Check, Remark, Settings, verify};
use serde::Serialize;

use super::progress::Busy;
use super::{Derivation, Outcome, fail, load, misused, output};

/// Options of `lamc verify`.
#[derive(Args)]
pub struct Arguments {
    /// The model
    model: String,
    /// Random states at which the equations are compared
    #[arg(long, value_name = "NUMBER", default_value_t = 20)]
    states: usize,
    /// Which random states
    #[arg(long, value_name = "NUMBER", default_value_t = 1)]
    seed: u64,
    /// How long a motion is checked, s
    #[arg(long, value_name = "SECONDS", default_value_t = 1.0)]
    duration: f64,
    /// Print JSON
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    derivation: Derivation,
}

/// A line of the JSON report.
#[derive(Serialize)]
struct Line<'a> {
    check: &'a str,
    outcome: &'a str,
    cases: usize,
    error: Option<f64>,
    allowed: Option<f64>,
    remark: Option<&'a str>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let Arguments { states, seed, duration, .. } = *arguments;
    if !(duration > 0.0 && duration.is_finite()) {
        return Err(misused("--duration must be a positive number of seconds"));
    }
    if states == 0 {
        return Err(misused("--states must be at least 1"));
    }
    let compiled = load(&arguments.model, arguments.derivation)?;
    let busy = Busy::new("comparing");
    let checks = verify(&compiled, &Settings { states, seed, duration });
    drop(busy);
    output::print(&if arguments.json { json(&checks)? } else { table(&checks) })?;
    let failed: Vec<_> = checks.iter().filter(|check| check.failed()).collect();
    match failed.as_slice() {
        [] => Ok(()),
        failed => {
            let names: Vec<_> = failed.iter().map(|check| check.name).collect();
            Err(fail(format_args!("{} failed: {}", arguments.model, names.join(", "))))
        }
    }
}

fn outcome(check: &Check) -> &'static str {
    match check.remark {
        Some(Remark::NotChecked(_)) => "not checked",
        _ if check.failed() => "FAILED",
        _ => "passed",
    }
}

fn remark(check: &Check) -> Option<&str> {
    check.remark.as_ref().map(|(Remark::NotChecked(text) | Remark::Failed(text))| text.as_str())
}

fn table(checks: &[Check]) -> String {
    let mut text =
        format!("{:<17} {:<12} {:>6} {:>9} {:>9}\n", "check", "", "cases", "error", "allowed");
    for check in checks {
        // Writing to a string cannot fail.
        let _ = match remark(check) {
            Some(remark) => writeln!(text, "{:<17} {:<12} {remark}", check.name, outcome(check)),
            None => writeln!(
                text,
                "{:<17} {:<12} {:>6} {:>9.1e} {:>9.0e}",
                check.name,
                outcome(check),
                check.cases,
                check.error,
                check.allowed
            ),
        };
    }
    text
}

fn json(checks: &[Check]) -> Result<String, super::Failed> {
    let number = |value: f64| value.is_finite().then_some(value);
    let lines: Vec<Line> = checks
        .iter()
        .map(|check| Line {
            check: check.name,
            outcome: outcome(check),
            cases: check.cases,
            error: number(check.error),
            allowed: number(check.allowed),
            remark: remark(check),
        })
        .collect();
    serde_json::to_string_pretty(&lines).map(|text| text + "\n").map_err(fail)
}
