//! One run: from the values of a plan to the cells of a row.

use std::borrow::Cow;

use lamc::arithmetic::{larger, largest};
use lamc::laminate::{Mechanism, excursions, verdicts};
use lamc::pipeline::Compiled;
use lamc::program::Interface;
use lamc::source::Severity;
use lamc::topology::Topology;
use lamc_runtime::free_body::extent;
use lamc_runtime::{Error, Mechanism as _, State};

use super::plan::{Quantity, Simulate, Target, Task};
use super::table::{Cell, Column};
use crate::execution::Jit;
use crate::rest::{Rest, settle};
use crate::simulation::{
    Asked, Reached, Simulation, allowed, describe, sample_times, start, unfold,
};

/// A state of a motion.
type Sample = State<Vec<f64>, f64>;

/// What came of a run.
pub struct Run {
    /// One cell for each of [`columns`]; or why there are none.
    pub outcome: Result<Vec<Cell>, String>,
    /// What the command `simulate` would warn of.
    pub warnings: Vec<String>,
}

/// Runs with these values of the quantities, from a copy of the system. `None`: interrupted.
pub fn run<'q>(
    compiled: &Compiled,
    mut system: Jit,
    guess: &[(usize, f64)],
    task: &Task,
    values: impl Iterator<Item = (&'q Quantity, f64)>,
    is_interrupted: &dyn Fn() -> bool,
) -> Option<Run> {
    let mut warnings = Vec::new();
    let warn = &mut |warning| warnings.push(warning);
    let begun = set(compiled, &mut system, guess, values, warn).and_then(|(topology, guess)| {
        let state = start(&topology, &system, &Asked::of(&system, &guess), warn)?;
        Ok((topology, state))
    });
    let (topology, begun) = match begun {
        Ok((topology, state)) => (topology, Ok(state)),
        Err(reason) => (Cow::Borrowed(&compiled.topology), Err(reason)),
    };
    let mechanism = &topology.mechanism;
    let outcome = match (begun, task) {
        (Err(reason), _) => Err(reason),
        (Ok(state), Task::Equilibrium { end, energy, frequencies }) => {
            let recorded = [*end, *energy, *frequencies];
            at_rest(mechanism, system, state, recorded, &mut warnings)
                .map_err(|error| describe(&error, &compiled.program.interface))
        }
        (Ok(state), Task::Simulate(task)) => {
            match simulate(mechanism, system, state, task, &mut warnings, is_interrupted) {
                Ok(cells) => Ok(cells?),
                Err(reason) => Err(reason),
            }
        }
    };
    Some(Run { outcome, warnings })
}

/// The columns of a task, in the order of the cells of [`Run::outcome`].
pub fn columns(task: &Task, interface: &Interface) -> Vec<Column> {
    let coordinates = || interface.coordinate_columns();
    let speeds = || interface.speed_columns();
    let number =
        |symbol: &'static str| move |(name, unit)| Column::number(format!("{symbol}.{name}"), unit);
    let series = |symbol: &'static str| {
        move |(name, unit)| Column::series(format!("motion.{symbol}.{name}"), unit)
    };
    let mut columns = Vec::new();
    match task {
        Task::Equilibrium { end, energy, frequencies } => {
            if *end {
                columns.extend(coordinates().map(number("q")));
                columns.extend(points(interface));
            }
            columns.push(Column::flag("stable"));
            columns.push(Column::number("force", "N m"));
            if *energy {
                columns.push(Column::number("potential", "J"));
            }
            if *frequencies {
                columns.push(Column::series("frequencies", "Hz"));
                columns.push(Column::series("damping_ratios", "1"));
            }
        }
        Task::Simulate(task) => {
            if task.end {
                columns.extend(coordinates().map(number("q")));
                columns.extend(speeds().map(number("u")));
            }
            if task.extremes {
                columns.extend(coordinates().map(number("q_min")));
                columns.extend(coordinates().map(number("q_max")));
                columns.extend(speeds().map(number("u_max")));
            }
            if task.end {
                columns.extend(points(interface));
            }
            if task.settling {
                columns.push(Column::number("settling_time", "s"));
            }
            if task.energy {
                for name in ["kinetic_start", "potential_start", "kinetic", "potential"] {
                    columns.push(Column::number(name, "J"));
                }
            }
            if task.motion {
                columns.push(Column::series("motion.t", "s"));
                columns.extend(coordinates().map(series("q")));
                columns.extend(speeds().map(series("u")));
            }
            columns.push(Column::number("steps", "1"));
        }
    }
    columns
}

fn points(interface: &Interface) -> impl Iterator<Item = Column> {
    let named = |point: &String, axis| Column::number(format!("{point}.{axis}"), "m");
    interface.points.iter().flat_map(move |point| ["x", "y", "z"].map(|axis| named(point, axis)))
}

/// The topology at the values of a run, and the joints whose guess is given, rad.
type Begun<'c> = (Cow<'c, Topology>, Vec<(usize, f64)>);

/// Sets the values.
fn set<'q, 'c>(
    compiled: &'c Compiled,
    system: &mut Jit,
    guess: &[(usize, f64)],
    values: impl Iterator<Item = (&'q Quantity, f64)>,
    warn: &mut dyn FnMut(String),
) -> Result<Begun<'c>, String> {
    let interface = &compiled.program.interface;
    let known = verdicts(&compiled.topology.mechanism, system.parameters());
    let mut inputs = system.inputs().to_vec();
    let mut guess = guess.to_vec();
    for (quantity, value) in values {
        match quantity.target {
            Target::Parameter(_) => {
                system.set_parameter(&quantity.name, value).map_err(|error| error.to_string())?;
            }
            Target::Input(input) => inputs[input] = value,
            Target::Initial(joint) => {
                allowed(&interface.joints[joint], value)?;
                guess.retain(|(other, _)| *other != joint);
                guess.push((joint, value));
            }
        }
    }
    system.set_inputs(&inputs);
    let topology = compiled.topology_at(system.parameters()).map_err(|error| error.to_string())?;
    for verdict in verdicts(&topology.mechanism, system.parameters()) {
        match verdict.severity {
            Severity::Error => return Err(verdict.to_string()),
            Severity::Warning if !known.contains(&verdict) => warn(verdict.to_string()),
            Severity::Warning | Severity::Note => {}
        }
    }
    Ok((topology, guess))
}

/// The states of a motion at its samples.
struct Course {
    samples: Vec<Sample>,
    steps: usize,
}

fn simulate(
    mechanism: &Mechanism,
    system: Jit,
    mut state: Sample,
    task: &Simulate,
    warnings: &mut Vec<String>,
    is_interrupted: &dyn Fn() -> bool,
) -> Result<Option<Vec<Cell>>, String> {
    let interface = system.interface().clone();
    let failure = |error: &Error| describe(error, &interface);
    let times = sample_times(&system, task.settings.duration, task.rate);
    let times = times.map_err(|error| error.to_string())?;
    warnings.extend(unfold(&system, &mut state).map(|fold| fold.warning("an initial angle")));
    let simulation = Simulation::new(system.clone(), state, None, &task.settings);
    let mut simulation = simulation.map_err(|error| failure(&error))?;
    let mut samples = Vec::new();
    for t in times {
        match simulation.reach(t, is_interrupted).map_err(|error| error.to_string())? {
            Reached::Interrupted => return Ok(None),
            _ => samples.push(simulation.state().clone()),
        }
    }
    let steps = simulation.steps();
    let course = Course { samples, steps: steps.explicit + steps.implicit };
    let moved = course.samples.iter().map(|sample| (sample.t, sample.q.as_slice()));
    let beyond = excursions(mechanism, system.parameters(), system.inputs(), moved);
    warnings.extend(beyond.iter().map(ToString::to_string));
    course.cells(&system, task).map(Some).map_err(|error| failure(&error))
}

impl Course {
    fn cells(&self, system: &Jit, task: &Simulate) -> Result<Vec<Cell>, Error> {
        let ([first, ..], [.., last]) = (self.samples.as_slice(), self.samples.as_slice()) else {
            return Ok(Vec::new());
        };
        let mut cells = Vec::new();
        let (coordinates, speeds) = (0..first.q.len(), 0..first.u.len());
        if task.end {
            cells.extend(last.q.iter().chain(&last.u).copied().map(Cell::number));
        }
        if task.extremes {
            let all = |pick: &dyn Fn(&Sample) -> f64| {
                self.samples.iter().map(pick).reduce(larger).unwrap_or(f64::NAN)
            };
            cells.extend(coordinates.clone().map(|k| Cell::number(-all(&|sample| -sample.q[k]))));
            cells.extend(coordinates.clone().map(|k| Cell::number(all(&|sample| sample.q[k]))));
            cells.extend(speeds.clone().map(|k| Cell::number(all(&|sample| sample.u[k].abs()))));
        }
        if task.end {
            let points = system.points(&last.q)?;
            cells.extend(points.as_flattened().iter().copied().map(Cell::number));
        }
        if task.settling {
            cells.push(Cell::Number(self.settling_time(system, task.settling_band)));
        }
        if task.energy {
            for State { t, q, u } in [first, last] {
                let energy = system.energy(*t, q, u)?;
                cells.extend([energy.kinetic, energy.potential].map(Cell::number));
            }
        }
        if task.motion {
            let series = |pick: &dyn Fn(&Sample) -> f64| {
                Cell::Series(Some(self.samples.iter().map(pick).collect()))
            };
            cells.push(series(&|sample| sample.t));
            cells.extend(coordinates.map(|k| series(&|sample| sample.q[k])));
            cells.extend(speeds.map(|k| series(&|sample| sample.u[k])));
        }
        cells.push(Cell::number(self.steps as f64));
        Ok(cells)
    }

    /// The first sample from which on every joint and free body stays within the band about the equilibrium near the last state. `None`
    /// if the last speeds are not within the same share of the largest: the motion only passes by.
    fn settling_time(&self, system: &Jit, band: f64) -> Option<f64> {
        let last = self.samples.last()?;
        let size = |of_speeds: &[f64]| extent(of_speeds, system.dimensions().joints, system.size());
        let fastest = largest(self.samples.iter().map(|sample| size(&sample.u)));
        if size(&last.u) > band * fastest {
            return None;
        }
        let mut rest = last.clone();
        settle(system, &mut rest).ok()?;
        let away = |sample: &Sample| {
            let mut path = system.speeds();
            system.write_difference(&sample.q, &rest.q, &mut path);
            size(&path)
        };
        let distances: Vec<f64> = self.samples.iter().map(away).collect();
        let allowed = band * largest(&distances);
        let outside = distances.iter().rposition(|distance| *distance > allowed);
        let settled = self.samples.get(outside.map_or(0, |last| last + 1))?;
        Some(settled.t)
    }
}

/// The cells of a state of rest.
fn at_rest(
    mechanism: &Mechanism,
    system: Jit,
    state: Sample,
    [end, energy, frequencies]: [bool; 3],
    warnings: &mut Vec<String>,
) -> Result<Vec<Cell>, Error> {
    let rest = Rest::new(mechanism, system, state)?;
    warnings.extend(rest.motions.warnings.iter().cloned());
    let mut cells = Vec::new();
    if end {
        let points = rest.system.system.points(&rest.state.q)?;
        let numbers = rest.state.q.iter().chain(points.as_flattened());
        cells.extend(numbers.copied().map(Cell::number));
    }
    cells.push(Cell::Flag(Some(rest.motions.stability.stable)));
    cells.push(Cell::number(rest.found.force));
    if energy {
        cells.push(Cell::number(rest.potential));
    }
    if frequencies {
        let modes = &rest.motions.modes;
        cells.push(Cell::Series(Some(modes.iter().map(|mode| mode.frequency).collect())));
        cells.push(Cell::Series(Some(modes.iter().map(|mode| mode.damping_ratio).collect())));
    }
    Ok(cells)
}
