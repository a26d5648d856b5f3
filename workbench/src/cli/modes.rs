//! `lamc modes MODEL`: small motions about an equilibrium.

use std::fmt::Write;

use clap::Args;
use lamc_runtime::State;
use lamc_workbench::execution::Jit;
use lamc_workbench::linear::{KinkReport, Linear, Mode, Stability};
use lamc_workbench::rest::Rest;
use serde::Serialize;

use super::equilibrium::at_rest;
use super::start::Start;
use super::{Outcome, fail, output};

/// Natural frequencies, damping and mode shapes about the equilibrium that is reached from the
/// initial configuration.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// Remove a force, or the torque and the drive of a joint
    #[arg(long, value_name = "NAME")]
    release: Vec<String>,
    /// Print JSON in SI units and radians, with the matrices of the linear system
    #[arg(long)]
    json: bool,
}

#[derive(Serialize)]
struct Report<'a> {
    model: &'a str,
    joints: Vec<&'a str>,
    #[serde(skip_serializing_if = "Vec::is_empty")]
    free_bodies: Vec<&'a str>,
    inputs: &'a [String],
    q: &'a [f64],
    #[serde(flatten)]
    stability: Stability,
    kinks: &'a [KinkReport],
    modes: &'a [Mode],
    /// Displacements that nothing opposes, by speed.
    neutral_directions: &'a [Vec<f64>],
    linear: &'a Linear,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let compiled = arguments.start.compile(&arguments.release)?;
    let system = arguments.start.system(&compiled)?;
    system.interface().without_controllers("small motions").map_err(fail)?;
    let state = arguments.start.assembled(&compiled, &system)?;
    let rest = at_rest(&compiled.topology.mechanism, system, state)?;
    let Rest { state, system: resting, motions, .. } = &rest;
    let system = &resting.system;
    let interface = system.interface();
    let neutral = motions.linear.neutral_directions();
    if arguments.json {
        let report = Report {
            model: &interface.name,
            joints: interface.joints.iter().map(|joint| joint.name.as_str()).collect(),
            free_bodies: interface.free.iter().map(|body| body.name.as_str()).collect(),
            inputs: &interface.inputs,
            q: &state.q,
            stability: motions.stability,
            kinks: &motions.kinks,
            modes: &motions.modes,
            neutral_directions: &neutral,
            linear: &motions.linear,
        };
        let json = serde_json::to_string_pretty(&report).map_err(fail)?;
        return output::print(&(json + "\n"));
    }
    let modes = table(system, state, &motions.modes, neutral.is_empty());
    output::print(&format!("{modes}{}{}", motions.lines(), neutral_table(system, &neutral)))
}

/// The neutral directions as columns, if there are any.
fn neutral_table(system: &Jit, directions: &[Vec<f64>]) -> String {
    let mut text = String::new();
    if directions.is_empty() {
        return text;
    }
    let count = directions.len();
    let _ =
        writeln!(text, "\nneutral directions, in which no force opposes a displacement: {count}");
    for (speed, (name, _)) in system.interface().speed_columns().enumerate() {
        let _ = write!(text, "{name:<33}");
        for direction in directions {
            // What rounds to zero has no sign.
            let shown = (direction[speed] * 1e4).round() / 1e4 + 0.0;
            let _ = write!(text, " {shown:>10.4}");
        }
        text.push('\n');
    }
    text
}

/// The modes as columns. Without any, either nothing moves or nothing brings back what does.
fn table(system: &Jit, state: &State<Vec<f64>, f64>, modes: &[Mode], is_held: bool) -> String {
    let mut text = format!("{:<20} {:>12}", "joint", "rest deg");
    for number in 1..=modes.len() {
        let _ = write!(text, " {:>10}", format!("mode {number}"));
    }
    text.push('\n');
    let interface = system.interface();
    for (speed, (name, _)) in interface.speed_columns().enumerate() {
        // The velocities and turns of free bodies have no coordinate of their own.
        let _ = match interface.joints.get(speed) {
            Some(_) => write!(text, "{name:<20} {:>12.5}", state.q[speed].to_degrees()),
            None => write!(text, "{name:<20} {:>12}", ""),
        };
        for mode in modes {
            let [re, im] = mode.shape[speed];
            let sign = if re < 0.0 { -1.0 } else { 1.0 };
            let _ = write!(text, " {:>10.4}", sign * re.hypot(im));
        }
        text.push('\n');
    }
    if modes.is_empty() {
        text.push_str(if is_held { "nothing can move\n" } else { "nothing swings or decays\n" });
        return text;
    }
    let mut line = |name: &str, value: &dyn Fn(&Mode) -> f64| {
        let _ = write!(text, "{name:<33}");
        for mode in modes {
            let _ = write!(text, " {:>10.4}", value(mode));
        }
        text.push('\n');
    };
    line("frequency Hz", &|mode| mode.frequency);
    line("damping ratio", &|mode| mode.damping_ratio);
    line("decay rate 1/s", &|mode| -mode.eigenvalue[0]);
    text
}
