//! `lamc equilibrium MODEL`: finds an equilibrium and its stability.

use std::fmt::Write;

use clap::Args;
use lamc::laminate::Mechanism;
use lamc_runtime::{Error, Mechanism as _, State, project};
use lamc_workbench::execution::Jit;
use lamc_workbench::linear::{KinkReport, Stability};
use lamc_workbench::reading::{Configuration, configurations};
use lamc_workbench::rest::{Rest, settle};
use lamc_workbench::simulation::describe;
use serde::Serialize;

use super::paths::Paths;
use super::start::Start;

use super::{Failed, Outcome, fail, output, read_numbers, warn};

/// Find the equilibrium of a model under gravity, springs, torques and forces.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// Remove a force, or the torque and the drive of a joint
    #[arg(long, value_name = "NAME")]
    release: Vec<String>,
    /// Print JSON in SI units and radians
    #[arg(long)]
    json: bool,
    /// Compare with other angles: CSV with a header; the first column holds names, the others
    /// joints (`j0`: rad, `j0 [deg]`: degrees)
    #[arg(long, value_name = "FILE", conflicts_with = "json")]
    compare: Option<String>,
}

#[derive(Serialize)]
struct Report<'a> {
    model: &'a str,
    joints: Vec<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    free_bodies: Vec<&'a str>,
    q: &'a [f64],
    #[serde(flatten)]
    stability: Stability,
    kinks: &'a [KinkReport],
    generalized_force: f64,
    closure_residual: f64,
    potential_energy: f64,
    iterations: usize,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let paths = Paths::default().input("the model", [&arguments.start.model]);
    paths.input("--compare", &arguments.compare).check()?;
    let compiled = arguments.start.compile(&arguments.release)?;
    let system = arguments.start.system(&compiled)?;
    system.interface().without_controllers("states of rest").map_err(fail)?;
    let mut rows = match &arguments.compare {
        Some(path) => {
            let joints = system.interface().joints.iter().map(|joint| &*joint.name);
            let joints: Vec<&str> = joints.collect();
            read_numbers(path, |text| configurations(text, &joints))?
        }
        None => Vec::new(),
    };
    let state = arguments.start.assembled(&compiled, &system)?;
    let rest = at_rest(&compiled.topology.mechanism, system, state)?;
    let Rest { found, state, potential, system: resting, motions } = &rest;
    let (q, system) = (&state.q, &resting.system);
    // Tables of angles say nothing of free bodies: these lie as here.
    rows.iter_mut().for_each(|row| row.q.extend_from_slice(&q[row.q.len()..]));
    let open = opening(system, q);
    let interface = system.interface();
    if arguments.json {
        let report = Report {
            model: &interface.name,
            joints: interface.joints.iter().map(|joint| joint.name.as_str()).collect(),
            free_bodies: interface.free.iter().map(|body| body.name.as_str()).collect(),
            q,
            stability: motions.stability,
            kinks: &motions.kinks,
            generalized_force: found.force,
            closure_residual: open,
            potential_energy: *potential,
            iterations: found.iterations,
        };
        let json = serde_json::to_string_pretty(&report).map_err(fail)?;
        return output::print(&(json + "\n"));
    }
    let mut text = table(system, q, &rows);
    let joints = interface.joints.iter().zip(&resting.sides);
    for (joint, _) in joints.filter(|(_, side)| **side != 0.0) {
        let _ = writeln!(text, "`{}` rests on its stop", joint.name);
    }
    text.push_str(&motions.lines());
    let kind = match motions.stability {
        Stability { stable: true, .. } => "stable",
        Stability { neutral: true, .. } => "neutral",
        _ => "not stable",
    };
    let _ = writeln!(
        text,
        "{kind}; residual torque {:.1e} N m after {} steps; loops closed within {open:.1e} m, \
         size {:.1} mm; potential energy {:.6e} J",
        found.force,
        found.iterations,
        system.size() * 1e3,
        potential
    );
    output::print(&text)
}

/// Why no state of rest was found.
fn unrest(system: &Jit, error: &Error) -> Failed {
    fail(format_args!("no equilibrium was found: {}", describe(error, system.interface())))
}

/// Moves an assembled state to rest.
pub fn settled(system: &Jit, state: &mut State<Vec<f64>, f64>) -> Outcome {
    settle(system, state).map(|_| ()).map_err(|error| unrest(system, &error))
}

/// The state of rest that is reached from an assembled state; reports the warnings of the small motions.
pub fn at_rest(
    mechanism: &Mechanism,
    system: Jit,
    state: State<Vec<f64>, f64>,
) -> Result<Rest, Failed> {
    let rest =
        Rest::new(mechanism, system.clone(), state).map_err(|error| unrest(&system, &error))?;
    rest.motions.warnings.iter().for_each(warn);
    Ok(rest)
}

/// Largest closure residual, m.
fn opening(system: &Jit, q: &[f64]) -> f64 {
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) =
        (vec![0.0; rows], vec![0.0; rows * system.dimensions().speeds]);
    if system.write_closure(q, &mut residual, &mut jacobian).is_err() {
        return f64::NAN;
    }
    lamc::arithmetic::largest(&residual)
}

/// Angles in degrees: ours, then the others with how far they are from closing.
fn table(system: &Jit, q: &[f64], rows: &[Configuration]) -> String {
    let mut text = format!("{:<20} {:>12}", "joint", "deg");
    for row in rows {
        let _ = write!(text, " {:>12}", row.name);
    }
    text.push('\n');
    for (index, (name, unit)) in system.interface().coordinate_columns().enumerate() {
        let (label, number) = output::shown(&name, unit, q[index]);
        let _ = write!(text, "{label:<20} {number:>12.5}");
        for row in rows {
            let _ = write!(text, " {:>12.5}", output::shown(&name, unit, row.q[index]).1);
        }
        text.push('\n');
    }
    if rows.is_empty() {
        return text;
    }
    let all = || std::iter::once(q).chain(rows.iter().map(|row| row.q.as_slice()));
    let _ = write!(text, "{:<20}", "open by mm");
    for q in all() {
        let _ = write!(text, " {:>12.2e}", opening(system, q) * 1e3);
    }
    let _ = write!(text, "\n{:<20}", "closes after rad");
    for q in all() {
        let mut closed = q.to_vec();
        let mut rest = system.speeds();
        match project(system, 0.0, &mut closed, &mut rest, &mut system.workspace()) {
            Ok(_) => {
                let square: f64 = closed.iter().zip(q).map(|(a, b)| (a - b) * (a - b)).sum();
                let _ = write!(text, " {:>12.2e}", square.sqrt());
            }
            Err(_) => {
                let _ = write!(text, " {:>12}", "never");
            }
        }
    }
    text.push('\n');
    text
}
