//! `lamc simulate MODEL`: assemble or settle, integrate, write the requested files, and print a
//! summary.

use std::fmt::Write;
use std::time::Instant;

use clap::{Args, ValueEnum};
use lamc::arithmetic::largest;
use lamc::laminate::{Mechanism, excursions};
use lamc_runtime::{Mechanism as _, State, project};
use lamc_workbench::execution::Jit;
use lamc_workbench::motion::{Motion, Work};
use lamc_workbench::simulation::{
    Method, Settings, Simulation, SimulationError, Steps, TOLERANCE, describe, sample_times, unfold,
};

use super::equilibrium::settled;
use super::interrupt::{self, EXIT_INTERRUPTED};
use super::notes::transgressions;
use super::paths::Paths;
use super::pictures::Pictures;
use super::plot::{self, Panel};
use super::progress;
use super::shapes::Shapes;
use super::start::Start;

use super::{Failed, Outcome, fail, misused, output, warn};

/// Simulate a model from its initial configuration.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// Begin at the equilibrium of gravity, springs, torques and forces
    #[arg(long)]
    settle: bool,
    /// Begin at the equilibrium, then remove a force, or the torque and the drive of a joint
    #[arg(long, value_name = "NAME")]
    release: Vec<String>,
    /// Seconds to simulate
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    duration: f64,
    /// Samples per second in the output
    #[arg(long, default_value_t = 100.0, value_name = "HERTZ")]
    rate: f64,
    /// Error allowed per step, relative and absolute
    #[arg(long, default_value_t = TOLERANCE)]
    tolerance: f64,
    /// Integration method
    #[arg(long, value_enum, default_value_t)]
    integrator: Integrator,
    /// Length of a step of `--integrator rigid`; 1e-4 if left out
    #[arg(long, value_name = "SECONDS")]
    step: Option<f64>,
    /// Coefficient of restitution at the stops, 0 to 1; of rigid contacts, too
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    restitution: f64,
    #[command(flatten)]
    files: Files,
}

/// How to integrate.
#[derive(Clone, Copy, Default, ValueEnum)]
enum Integrator {
    /// Explicit at first, implicit as soon as the motion is stiff
    #[default]
    Auto,
    /// Dormand and Prince's pair of order 5(4), explicit
    Dopri5,
    /// RODASP of order 4(3), implicit and L-stable
    Rodas,
    /// Rigid contacts and stops at steps of fixed length, of order 1
    Rigid,
}

/// The length of steps unless another is chosen, s.
const STEP: f64 = 1e-4;

/// What to write.
#[derive(Args)]
#[command(next_help_heading = "Files")]
struct Files {
    /// Write the motion as CSV; `-` writes standard output
    #[arg(long, value_name = "FILE")]
    csv: Option<String>,
    /// Write the motion with all poses as a NumPy archive
    #[arg(long, value_name = "FILE")]
    npz: Option<String>,
    /// Draw the motion: FILE.svg or FILE.png; `-` writes SVG to standard output
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
    /// What to draw, one above the other
    #[arg(long, value_enum, value_delimiter = ',', default_value = "angles,rates")]
    panels: Vec<Panel>,
    /// Draw angles in radians instead of degrees
    #[arg(long)]
    radians: bool,
    #[command(flatten)]
    shapes: Shapes,
    #[command(flatten)]
    pictures: Pictures,
}

impl Arguments {
    fn check(&self) -> Outcome {
        for (name, value) in
            [("--duration", self.duration), ("--rate", self.rate), ("--tolerance", self.tolerance)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(misused(format_args!("{name} must be a positive number")));
            }
        }
        match (self.step, self.integrator) {
            (None, _) => {}
            (Some(step), Integrator::Rigid) if step.is_finite() && step > 0.0 => {}
            (Some(_), Integrator::Rigid) => {
                return Err(misused("--step must be a positive number"));
            }
            (Some(_), _) => return Err(misused("--step belongs to `--integrator rigid`")),
        }
        if !(0.0..=1.0).contains(&self.restitution) {
            return Err(misused("--restitution must lie between 0 and 1"));
        }
        self.files.check()?;
        self.files.paths().input("the model", [&self.start.model]).check()
    }

    fn settings(&self) -> Settings {
        Settings {
            method: match self.integrator {
                Integrator::Auto => Method::Auto,
                Integrator::Dopri5 => Method::Dopri5,
                Integrator::Rodas => Method::Rodas,
                Integrator::Rigid => Method::Rigid { step: self.step.unwrap_or(STEP) },
            },
            duration: self.duration,
            tolerance: self.tolerance,
            restitution: self.restitution,
        }
    }
}

impl Files {
    /// The check comes before the simulation, not after it.
    fn check(&self) -> Outcome {
        if let Some(path) = &self.plot {
            plot::format(path).map_err(misused)?;
        }
        self.shapes.check()?;
        self.pictures.check()
    }

    /// Where.
    fn paths(&self) -> Paths<'_> {
        let paths = Paths::default()
            .output("--csv", &self.csv)
            .output("--npz", &self.npz)
            .output("--plot", &self.plot);
        self.pictures.paths(self.shapes.paths(paths))
    }

    fn write(&self, mechanism: &Mechanism, motion: &Motion) -> Outcome {
        if let Some(path) = &self.csv {
            output::write(path, &motion.to_csv())?;
        }
        if let Some(path) = &self.npz {
            output::write(path, &motion.to_npz().map_err(fail)?)?;
        }
        if let Some(path) = &self.plot {
            let picture = plot::draw(motion, &self.panels, self.radians, path);
            output::write(path, &picture.map_err(fail)?)?;
        }
        self.shapes.write(mechanism, motion)?;
        self.pictures.write(mechanism, motion)
    }
}

pub fn run(arguments: &Arguments) -> Outcome {
    arguments.check()?;
    let Beginning { mechanism, system, state } = begin(arguments)?;
    let times = sample_times(&system, arguments.duration, arguments.rate)
        .map_err(|error| misused(format_args!("{error}: lower --rate or --duration")))?;
    // Only from here on is there something to keep; before, an interrupt ends the process.
    interrupt::listen()?;
    let (parameters, inputs) = (system.parameters().to_vec(), system.inputs().to_vec());
    let work = Work::new(&mechanism, &parameters, &inputs);
    let begin = Instant::now();
    let simulation = Simulation::new(system, state, work, &arguments.settings());
    let mut simulation = simulation.map_err(fail)?;
    simulation.record_tensions(&mechanism);
    simulation.record_inputs();
    let progress = progress::bar(times.len() - 1);
    let outcome = simulation.run(times, interrupt::is_asked_for, |done| {
        progress.set_position(done.saturating_sub(1) as u64);
    });
    progress.finish_and_clear();
    // What was recorded until then is good, whatever ended it. From here on another interrupt ends
    // the drawing of pictures.
    let interrupted = interrupt::take();
    let motion = simulation.motion();
    let moved = motion.samples.iter().map(|sample| (sample.t, sample.q.as_slice()));
    excursions(&mechanism, &parameters, &inputs, moved).into_iter().for_each(warn);
    transgressions(&mechanism, motion).into_iter().for_each(warn);
    let Steps { rigid, unsolved, .. } = simulation.steps();
    if unsolved > 0 {
        warn(format_args!(
            "in {unsolved} of {rigid} steps no forces were found that fulfil all laws of rigid contact: what sticks may \
             slide, or the reverse. Coefficients of friction from 0.5 on at many points can have no solution; \
             `--integrator auto` always has one"
        ));
    }
    let seconds = begin.elapsed().as_secs_f64();
    let outcome = outcome.map_err(explain);
    if motion.samples.is_empty() {
        return outcome;
    }
    arguments.files.write(&mechanism, motion)?;
    if !arguments.files.paths().is_printed() {
        output::print(&summary(&simulation, seconds, interrupted))?;
    }
    match interrupted {
        true => Err(Failed(EXIT_INTERRUPTED)),
        false => outcome,
    }
}

/// Reports why a simulation ended early, with the options that may help.
fn explain(error: SimulationError) -> Failed {
    let options = match &error {
        SimulationError::NotSmooth { started_flat: false, .. } => " (--tolerance)",
        SimulationError::NotSmooth { .. } => " (--tolerance, --initial)",
        SimulationError::StaysSingular { .. }
        | SimulationError::EnergyGain { .. }
        | SimulationError::BreaksOff { started_flat: true, .. } => " (--initial)",
        _ => "",
    };
    fail(format_args!("{error}{options}"))
}

/// What moves, and from where: assembled or at rest.
struct Beginning {
    mechanism: Mechanism,
    system: Jit,
    state: State<Vec<f64>, f64>,
}

fn begin(arguments: &Arguments) -> Result<Beginning, Failed> {
    let start = &arguments.start;
    let mut compiled = start.compile(&[])?;
    let mut system = start.system(&compiled)?;
    let mut state = start.assembled(&compiled, &system)?;
    if arguments.settle || !arguments.release.is_empty() {
        settled(&system, &mut state)?;
        if !arguments.release.is_empty() {
            compiled = start.compile(&arguments.release)?;
            system = start.system(&compiled)?;
        }
        // Driven joints may set off at once.
        let workspace = &mut system.workspace();
        project(&system, 0.0, &mut state.q, &mut state.u, workspace)
            .map_err(|error| fail(describe(&error, system.interface())))?;
    } else if let Some(fold) = unfold(&system, &mut state) {
        warn(fold.warning("--initial"));
    }
    Ok(Beginning { mechanism: compiled.topology.mechanism, system, state })
}

/// Prints a summary.
fn summary(simulation: &Simulation, seconds: f64, interrupted: bool) -> String {
    let mut text = String::new();
    let motion = simulation.motion();
    let ([first, ..], [.., last]) = (motion.samples.as_slice(), motion.samples.as_slice()) else {
        return text;
    };
    let _ = writeln!(text, "{:<20} {:>10} {:>10}", "joint", "start deg", "end deg");
    for (index, (name, unit)) in simulation.system().interface().coordinate_columns().enumerate() {
        let [(label, start), (_, end)] =
            [first, last].map(|sample| output::shown(&name, unit, sample.q[index]));
        let _ = writeln!(text, "{label:<20} {start:>10.3} {end:>10.3}");
    }
    let [start, end] = [first, last].map(|sample| sample.energy.kinetic + sample.energy.potential);
    let _ = writeln!(text, "energy: {start:.6e} J at start, {end:.6e} J at end");
    // A motion that broke off leaves steps that were counted and not recorded.
    if let Some(work) = simulation.work().filter(|_| motion.complete) {
        let off = (end - start - work.total).abs();
        let _ = match work.exchanged > 0.0 {
            true => writeln!(
                text,
                "balance: the work of torques and dampers is {:.6e} J; {off:.1e} J unaccounted \
                 for",
                work.total
            ),
            false => writeln!(text, "balance: energy is conserved; {off:.1e} J drift"),
        };
    }
    let open = largest(motion.samples.iter().map(|sample| &sample.closure));
    let _ = writeln!(text, "closure: within {open:.1e} m, size {:.1} mm", motion.size * 1e3);
    let joints = motion.joints.iter().zip(simulation.stopped()).filter(|(_, stopped)| **stopped);
    let stopped: Vec<_> = joints.map(|(name, _)| format!("`{name}`")).collect();
    if !stopped.is_empty() {
        let _ = writeln!(text, "at a stop for a while: {}", stopped.join(", "));
    }
    let steps = simulation.steps();
    let methods = [
        (steps.explicit, "Dormand-Prince"),
        (steps.implicit, "RODASP"),
        (steps.rigid, "rigid time stepping"),
    ];
    let methods: Vec<_> = methods
        .into_iter()
        .filter(|(steps, _)| *steps > 0)
        .map(|(steps, name)| format!("{steps} steps of {name}"))
        .collect();
    let _ = writeln!(
        text,
        "{} in {seconds:.3} s: {:.1} times real time",
        methods.join(" and "),
        last.t / seconds
    );
    if !motion.complete {
        let why = if interrupted { "interrupted" } else { "failed" };
        let _ = writeln!(text, "{why}: what was written ends at t = {} s", last.t);
    }
    text
}
