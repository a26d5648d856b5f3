//! `lamc equilibrium MODEL`: finds an equilibrium and its stability.

use std::fmt::Write;

use clap::Args;
use lamc::laminate::Mechanism;
use lamc_runtime::{Equilibrium, Mechanism as _, State, Stopped, equilibrium, project};
use lamc_workbench::execution::Jit;
use lamc_workbench::linear::{KinkReport, Motions, Stability};
use lamc_workbench::reading::{Configuration, configurations};
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
    let rows = match &arguments.compare {
        Some(path) => {
            let joints = system.interface().joints.iter().map(|joint| &*joint.name);
            let joints: Vec<&str> = joints.collect();
            read_numbers(path, |text| configurations(text, &joints))?
        }
        None => Vec::new(),
    };
    let mut state = arguments.start.assembled(&compiled, &system)?;
    let found = settle(&system, &mut state)?;
    let energy = system
        .energy(state.t, &state.q, &state.u)
        .map_err(|error| fail(describe(&error, system.interface())))?;
    let open = opening(&system, &state.q);
    let q = state.q.clone();
    let resting = stopped(system, &mut state)?;
    let mechanism = &compiled.topology.mechanism;
    let motions = about(mechanism, &resting, &state, found.stable)?;
    let system = &resting.system;
    let interface = system.interface();
    if arguments.json {
        let report = Report {
            model: &interface.name,
            joints: interface.joints.iter().map(|joint| joint.name.as_str()).collect(),
            q: &q,
            stability: motions.stability,
            kinks: &motions.kinks,
            generalized_force: found.force,
            closure_residual: open,
            potential_energy: energy.potential,
            iterations: found.iterations,
        };
        let json = serde_json::to_string_pretty(&report).map_err(fail)?;
        return output::print(&(json + "\n"));
    }
    let mut text = table(system, &q, &rows);
    let joints = interface.joints.iter().zip(&resting.sides);
    for (joint, _) in joints.filter(|(_, side)| **side != 0.0) {
        let _ = writeln!(text, "`{}` rests on its stop", joint.name);
    }
    text.push_str(&motions.lines());
    let kind = if motions.stability.stable { "stable" } else { "not stable" };
    let _ = writeln!(
        text,
        "{kind}; residual torque {:.1e} N m after {} steps; loops closed within {open:.1e} m, \
         size {:.1} mm; potential energy {:.6e} J",
        found.force,
        found.iterations,
        system.size() * 1e3,
        energy.potential
    );
    output::print(&text)
}

/// Finds the equilibrium from an assembled state.
pub fn settle(system: &Jit, state: &mut State<Vec<f64>, f64>) -> Result<Equilibrium<f64>, Failed> {
    system.interface().without_free("equilibria and modes").map_err(fail)?;
    state.u.fill(0.0);
    equilibrium(system, state.t, &mut state.q, &mut system.workspace()).map_err(|error| {
        let reason = describe(&error, system.interface());
        fail(format_args!("no equilibrium was found: {reason}"))
    })
}

/// The system at rest, its joints held at the stops they rest on.
pub fn stopped(system: Jit, state: &mut State<Vec<f64>, f64>) -> Result<Stopped<Jit>, Failed> {
    let mut resting = Stopped::new(system);
    match resting.resolve_impacts(state) {
        Ok(_) => Ok(resting),
        Err(error) => Err(fail(describe(&error, resting.system.interface()))),
    }
}

/// The small motions about a state of rest; reports their warnings.
pub fn about(
    mechanism: &Mechanism,
    resting: &Stopped<Jit>,
    state: &State<Vec<f64>, f64>,
    is_minimum: bool,
) -> Result<Motions, Failed> {
    let motions = Motions::about(mechanism, resting, state, is_minimum)
        .map_err(|error| fail(describe(&error, resting.system.interface())))?;
    motions.warnings.iter().for_each(warn);
    Ok(motions)
}

/// Largest closure residual, m.
fn opening(system: &Jit, q: &[f64]) -> f64 {
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * q.len()]);
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
    for (joint, info) in system.interface().joints.iter().enumerate() {
        let _ = write!(text, "{:<20} {:>12.5}", info.name, q[joint].to_degrees());
        for row in rows {
            let _ = write!(text, " {:>12.5}", row.q[joint].to_degrees());
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
        let mut rest = vec![0.0; q.len()];
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
