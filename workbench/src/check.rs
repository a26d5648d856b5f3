//! A report on a model: mobility, method, masses, operations; and what its start gives rise to.

mod contacts;
mod controllers;

use std::fmt::{self, Write};

use lamc::laminate::{Mechanism, excursions};
use lamc::pipeline::Compiled;
use lamc::program::Phase;
use lamc::program::{Form, FunctionKind, Program};
use lamc::topology::{Comparison, Topology};
use lamc_runtime::{Mechanism as _, State, Stopped, assemble, equilibrium, project};

use crate::execution::Jit;
use crate::inertia::Digits;
use crate::linear::linear;
use crate::simulation::{lost_fold, moves};

/// Largest number of joints for which the equilibrium is computed. With more joints it takes longer
/// than the rest of the report.
const MOST_AT_REST: usize = 60;

/// A model, and the state in which it starts.
pub struct Check<'c> {
    compiled: &'c Compiled,
    system: Jit,
    /// With closed loops; `None` if they do not close.
    start: Option<State<Vec<f64>, f64>>,
    /// How many digits accelerations have there.
    digits: Option<Digits>,
}

impl<'c> Check<'c> {
    /// Assembles the model. A start that does not close is no error: commands that need one report it.
    pub fn new(compiled: &'c Compiled) -> Self {
        let system = Jit::new(&compiled.program);
        let mut state = system.initial();
        let pinned = pinned(&system);
        let closed = assemble(&system, 0.0, &mut state.q, &pinned, &mut system.workspace());
        let start = closed.is_ok().then_some(state);
        let digits =
            start.as_ref().and_then(|start| Digits::at(&system, system.interface(), start));
        Self { compiled, system, start, digits }
    }

    /// Warnings of the initial state: joints that do not start at the requested angle, hinges bent beyond their linear
    /// range, accelerations with few digits.
    pub fn warnings(&self) -> Vec<String> {
        let Self { compiled, system, digits, .. } = self;
        let Some(start) = &self.start else { return Vec::new() };
        let (asked, pinned) = (system.initial().q, pinned(system));
        let mut warnings = moves(system.interface(), &pinned, &asked, &start.q);
        warnings.extend(lost_fold(system.interface(), &pinned, &asked, &start.q));
        warnings.extend(digits.as_ref().and_then(Digits::warning));
        let (parameters, inputs) = (system.parameters(), system.inputs());
        let start = std::iter::once((0.0, start.q.as_slice()));
        let beyond = excursions(&compiled.topology.mechanism, parameters, inputs, start);
        warnings.extend(beyond.iter().map(ToString::to_string));
        warnings
    }

    /// The longest stable step of the classical Runge-Kutta method at the equilibrium, s; `None` if there is no
    /// equilibrium or nothing oscillates.
    fn longest_step(&self) -> Option<f64> {
        let mut state = self.start.clone()?;
        if state.q.len() > MOST_AT_REST {
            return None;
        }
        let (system, room) = (self.system.clone(), &mut self.system.workspace());
        project(&system, 0.0, &mut state.q, &mut state.u, room).ok()?;
        state.u.fill(0.0);
        equilibrium(&system, 0.0, &mut state.q, room).ok()?;
        let mut resting = Stopped::new(system);
        resting.resolve_impacts(&mut state).ok()?;
        linear(&resting, &state).ok()?.longest_rk4_step()
    }

    /// Mobility and loops, the method of the acceleration, masses, linear ranges, the longest stable step, and
    /// operations.
    pub fn report(&self) -> String {
        let compiled = self.compiled;
        let mut text = format!("{}\n\n", compiled.topology.mechanism.name);
        // Writing to a String cannot fail.
        let _ = write_mobility(&mut text, &compiled.topology);
        let _ = write_method(&mut text, compiled);
        if let Some(digits) = &self.digits {
            let _ = writeln!(
                text,
                "mass matrix at the start: condition number {:.2e} if scaled, which costs accelerations up to {} digits",
                digits.condition,
                digits.lost(),
            );
        }
        let _ = write_form(&mut text, &compiled.program);
        let _ = write_bodies(&mut text, &compiled.topology.mechanism);
        let _ = contacts::write(&mut text, &compiled.topology.mechanism);
        let _ = controllers::write(&mut text, &compiled.topology.mechanism);
        let _ = write_linear_ranges(&mut text, &compiled.topology.mechanism);
        if let Some(step) = self.longest_step() {
            let _ = writeln!(text, "\nlongest stable step of RK4 at rest: {step:.3e} s");
        }
        let _ = write_operations(&mut text, &compiled.program);
        text
    }
}

/// Which joints start at a given angle.
fn pinned(system: &Jit) -> Vec<bool> {
    (0..system.dimensions().joints).map(|joint| system.is_pinned(joint)).collect()
}

fn write_mobility(text: &mut String, topology: &Topology) -> fmt::Result {
    let joints = &topology.mechanism.joints;
    writeln!(
        text,
        "mobility {}: {} joints, {} independent closure equations",
        topology.mobility,
        joints.len(),
        topology.rank
    )?;
    let driven = joints.iter().filter(|joint| joint.drive.is_some());
    let driven: Vec<_> = driven.map(|joint| format!("`{}`", joint.name)).collect();
    if !driven.is_empty() {
        writeln!(text, "  driven: {}", driven.join(", "))?;
    }
    topology.summary_lines().into_iter().try_for_each(|line| writeln!(text, "  {line}"))?;
    write_tree(text, topology)
}

/// Most cuts that are named.
const MOST_CUTS: usize = 12;

/// Writes where the loops are cut, and why there.
fn write_tree(text: &mut String, topology: &Topology) -> fmt::Result {
    if topology.loops.is_empty() {
        return Ok(());
    }
    let joints = &topology.mechanism.joints;
    let cuts = topology.loops.iter().map(|closed| &joints[closed.joint.index()].name);
    let cuts: Vec<_> = cuts.map(|name| format!("`{name}`")).collect();
    match cuts.get(MOST_CUTS..).map_or(0, <[_]>::len) {
        0 => writeln!(text, "spanning tree: cut at {}", cuts.join(", "))?,
        more => {
            writeln!(
                text,
                "spanning tree: cut at {} and {more} more",
                cuts[..MOST_CUTS].join(", ")
            )?;
        }
    }
    match topology.comparison {
        Some(Comparison { derived, chosen, plain }) => writeln!(
            text,
            "  the cheapest of {derived} trees that were compared: {chosen} operations, the breadth-first one {plain}"
        ),
        None => Ok(()),
    }
}

/// Whether accelerations are the work of the runtime's elimination. Beside straight-line code that solves them, it only serves next to
/// singular states.
fn is_reduced(program: &Program) -> bool {
    program.reduction().is_some() && !program.solves()
}

/// Writes which method the compiler chose for the accelerations: the one with the fewest operations of those
/// that suit the loops.
fn write_method(text: &mut String, compiled: &Compiled) -> fmt::Result {
    let topology = &compiled.topology;
    let acceleration = compiled.program.function_of(FunctionKind::Acceleration);
    let has = |phase| acceleration.instructions.iter().any(|step| step.section.phase == phase);
    let in_loops = is_reduced(&compiled.program);
    match &topology.reduction {
        Some(reduction) if in_loops || has(Phase::IndependentAcceleration) => {
            let joints = &topology.mechanism.joints;
            let chosen = reduction.independent.iter().map(|joint| &joints[joint.index()].name);
            let chosen: Vec<_> = chosen.map(|name| format!("`{name}`")).collect();
            let rows: usize = topology.loops.iter().map(|closed| closed.rows.len()).sum();
            let pivots = reduction.pivots.len();
            let how = if in_loops { ", whose matrices the runtime forms" } else { "" };
            writeln!(text, "acceleration: by independent speeds{how}")?;
            writeln!(text, "  independent: {}", chosen.join(", "))?;
            writeln!(
                text,
                "  {pivots} of {rows} closure equations determine the other speeds; {} follow from them",
                rows - pivots
            )
        }
        _ if has(Phase::ArticulatedInertia) || has(Phase::FreeElimination) => {
            writeln!(text, "acceleration: by articulated inertias, body by body")
        }
        // The mass matrix of a single body is constant, and so is its factor.
        _ if !acceleration.outputs.is_empty() => {
            writeln!(text, "acceleration: by a factor of the mass matrix")
        }
        _ => writeln!(text, "acceleration: solved by the runtime, without straight-line code"),
    }
}

/// Writes in which form modules have their functions, where it is not straight-line code.
fn write_form(text: &mut String, program: &Program) -> fmt::Result {
    let kinds = match is_reduced(program) {
        true => [FunctionKind::Reduction, FunctionKind::ProjectionReduction],
        false => [FunctionKind::Acceleration, FunctionKind::Projection],
    };
    let [acceleration, projection] = kinds.map(|kind| program.form(kind));
    let words = |form| match form {
        Form::Loops => "loops over equal parts",
        _ => "straight-line code",
    };
    match acceleration {
        Form::StraightLine => Ok(()),
        _ if acceleration == projection => {
            let words = words(acceleration);
            writeln!(text, "modules: tables; acceleration and projection are {words}")
        }
        _ => {
            let [acceleration, projection] = [acceleration, projection].map(words);
            writeln!(
                text,
                "modules: tables; the acceleration is {acceleration}, the projection {projection}"
            )
        }
    }
}

fn write_bodies(text: &mut String, mechanism: &Mechanism) -> fmt::Result {
    let [body, mass, centre, moments] =
        ["body", "mass g", "centre of mass mm", "principal moments g mm^2"];
    writeln!(text, "\n{body:<16} {mass:>12} {centre:>34} {moments:>40}")?;
    for body in &mechanism.bodies {
        let properties = &body.mass_properties;
        let [x, y, z] = (properties.com * 1e3).into();
        let mut moments = properties.inertia.symmetric_eigenvalues() * 1e9;
        moments.as_mut_slice().sort_by(f64::total_cmp);
        let [a, b, c] = moments.into();
        let mass = properties.mass * 1e3;
        let name = format!("{}{}", body.name, if body.fixed { " (fixed)" } else { "" });
        let size = mechanism.size * 1e3;
        let centre = [x, y, z].map(|length| decimals(length, size, 4)).join(" ");
        let moments = [a, b, c].map(|moment| decimals(moment, c, 4)).join(" ");
        let mass = decimals(mass, mass, 5);
        writeln!(text, "{name:<16} {mass:>12} {centre:>34} {moments:>40}")?;
    }
    Ok(())
}

/// Returns a number with this many decimals. If decimals do not suit numbers as large as `scale`, which is the
/// largest of its kind, it is written with an exponent.
fn decimals(value: f64, scale: f64, decimals: usize) -> String {
    /// Scales at which decimals suit.
    const PLAIN: std::ops::Range<f64> = 1e-2..1e6;
    /// Numbers below this share of the scale are rounding errors.
    const ROUNDING: f64 = 1e-12;
    match PLAIN.contains(&scale.abs()) || scale == 0.0 {
        true => format!("{value:.decimals$}"),
        false if value.abs() < ROUNDING * scale.abs() => "0".to_owned(),
        false => format!("{value:.3e}"),
    }
}

/// Of the hinges that have one.
fn write_linear_ranges(text: &mut String, mechanism: &Mechanism) -> fmt::Result {
    let mut joints =
        mechanism.joints.iter().filter(|joint| joint.linear_range.is_finite()).peekable();
    if joints.peek().is_some() {
        writeln!(text, "\n{:<16} {:>22}", "hinge", "linear within deg")?;
    }
    joints.try_for_each(|joint| {
        writeln!(text, "{:<16} {:>22.3}", joint.name, joint.linear_range.to_degrees())
    })
}

fn write_operations(text: &mut String, program: &Program) -> fmt::Result {
    writeln!(text, "\noperations per evaluation")?;
    let solution = match is_reduced(program) {
        true => FunctionKind::Reduction,
        false => FunctionKind::Acceleration,
    };
    let of_reductions = [FunctionKind::Reduction, FunctionKind::ProjectionReduction];
    let is_listed = |kind| solution == FunctionKind::Reduction || !of_reductions.contains(&kind);
    for function in program.functions.iter().filter(|function| is_listed(function.kind)) {
        writeln!(text, "  {:<12} {}", function.kind.name(), function.cost())?;
    }
    let acceleration = program.function_of(solution);
    if !acceleration.outputs.is_empty() {
        writeln!(text, "\noperations of the acceleration")?;
    }
    for (subject, cost) in acceleration.costs() {
        writeln!(text, "  {:<16} {cost}", subject.name(&program.interface.nodes))?;
    }
    Ok(())
}
