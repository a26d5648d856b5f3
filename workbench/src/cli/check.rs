//! `lamc check MODEL`: what the compiler understood.

use std::fmt::Write;

use lamc::laminate::excursions;
use lamc::pipeline::Compiled;
use lamc::program::{FunctionKind, Interpreter};
use lamc_runtime::{State, Stopped, System, assemble, equilibrium, project};
use lamc_workbench::execution::Jit;

use super::linear::linear;
use super::start::warn_of_moves;
use super::{Outcome, Size, load, output, warn};

pub fn run(model: &str, size: Size) -> Outcome {
    let compiled = load(model, size)?;
    warn_of_start(&compiled);
    output::print(&report(&compiled))
}

/// With more joints the state of rest takes longer than the rest of the report.
const MOST_AT_REST: usize = 60;

/// The longest stable step of the classical Runge-Kutta method at the state of rest, s; none where
/// there is no such state, or nothing swings.
fn longest_step(compiled: &Compiled) -> Option<f64> {
    let system = Jit::new(&compiled.program);
    let mut state = State::initial(&system);
    if state.q.len() > MOST_AT_REST {
        return None;
    }
    let pinned: Vec<bool> = (0..state.q.len()).map(|joint| system.is_pinned(joint)).collect();
    let room = &mut system.workspace();
    assemble(&system, 0.0, &mut state.q, &pinned, room).ok()?;
    project(&system, 0.0, &mut state.q, &mut state.u, room).ok()?;
    state.u.fill(0.0);
    equilibrium(&system, 0.0, &mut state.q, room).ok()?;
    let mut resting = Stopped::new(system);
    resting.resolve_impacts(&mut state).ok()?;
    linear(&resting, &state).ok()?.longest_rk4_step()
}

/// Warns of where the motion starts: joints that are not where they were asked to be, hinges bent
/// beyond their linear range.
fn warn_of_start(compiled: &Compiled) {
    let system = Interpreter::new(&compiled.program);
    let mut q = State::initial(&system).q;
    let pinned: Vec<bool> = (0..q.len()).map(|joint| system.is_pinned(joint)).collect();
    // What cannot be assembled is told by the commands that need it.
    let asked = q.clone();
    if assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()).is_ok() {
        warn_of_moves(system.interface(), &pinned, &asked, &q);
        let (parameters, inputs) = (system.parameters(), system.inputs());
        let start = std::iter::once((0.0, q.as_slice()));
        excursions(&compiled.topology.mechanism, parameters, inputs, start).iter().for_each(warn);
    }
}

fn report(compiled: &Compiled) -> String {
    let topology = &compiled.topology;
    let mechanism = &topology.mechanism;
    let mut text = format!("{}\n\n", mechanism.name);
    let line = |text: &mut String, line: std::fmt::Arguments<'_>| {
        // Writing to a String cannot fail.
        let _ = text.write_fmt(line);
        text.push('\n');
    };
    line(
        &mut text,
        format_args!(
            "mobility {}: {} joints, {} independent closure equations",
            topology.mobility,
            mechanism.joints.len(),
            topology.rank
        ),
    );
    let driven: Vec<_> = mechanism
        .joints
        .iter()
        .filter(|joint| joint.drive.is_some())
        .map(|joint| format!("`{}`", joint.name))
        .collect();
    if !driven.is_empty() {
        line(&mut text, format_args!("  driven: {}", driven.join(", ")));
    }
    for summary in topology.summary_lines() {
        line(&mut text, format_args!("  {summary}"));
    }
    line(
        &mut text,
        format_args!(
            "\n{:<16} {:>12} {:>34} {:>40}",
            "body", "mass g", "centre of mass mm", "principal moments g mm^2"
        ),
    );
    for body in &mechanism.bodies {
        let properties = &body.mass_properties;
        let [x, y, z] = (properties.com * 1e3).into();
        let mut moments = properties.inertia.symmetric_eigenvalues() * 1e9;
        moments.as_mut_slice().sort_by(f64::total_cmp);
        let [a, b, c] = moments.into();
        let mass = properties.mass * 1e3;
        let fixed = if body.fixed { " (fixed)" } else { "" };
        line(
            &mut text,
            format_args!(
                "{:<16} {mass:>12.5} {:>34} {:>40}",
                format!("{}{fixed}", body.name),
                format!("{x:.4} {y:.4} {z:.4}"),
                format!("{a:.4} {b:.4} {c:.4}"),
            ),
        );
    }
    let linear: Vec<_> =
        mechanism.joints.iter().filter(|joint| joint.linear_range.is_finite()).collect();
    if !linear.is_empty() {
        line(&mut text, format_args!("\n{:<16} {:>22}", "hinge", "linear within deg"));
    }
    for joint in linear {
        let degrees = joint.linear_range.to_degrees();
        line(&mut text, format_args!("{:<16} {degrees:>22.3}", joint.name));
    }
    if let Some(step) = longest_step(compiled) {
        line(&mut text, format_args!("\nlongest stable step of RK4 at rest: {step:.3e} s"));
    }
    text.push_str("\noperations per evaluation\n");
    for function in &compiled.program.functions {
        let name = function.kind.name();
        line(&mut text, format_args!("  {name:<12} {}", function.cost()));
    }
    let program = &compiled.program;
    let acceleration = program.function_of(FunctionKind::Acceleration);
    if !acceleration.outputs.is_empty() {
        text.push_str("\noperations of the acceleration\n");
    }
    for (subject, cost) in acceleration.costs() {
        let name = subject.name(&program.interface.nodes);
        line(&mut text, format_args!("  {name:<16} {cost}"));
    }
    text
}
