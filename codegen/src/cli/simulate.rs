//! `lamc simulate MODEL`: assemble or settle, integrate through the interpreter, show what happened.

use std::fmt::Write;
use std::time::Instant;

use clap::{Args, ValueEnum};
use lamc::laminate::{Mechanism, excursions};
use lamc::program::Interpreter;
use lamc_runtime::{Dopri5, Energy, Error, Rodas, State, Stopped, System, acceleration, project};

use super::equilibrium::settle;
use super::start::{Start, describe};
use super::{Failed, Outcome, fail, misused, output, plot, warn};

/// Explicit steps within which a motion must get on by a share of its duration.
const PATIENCE: (usize, f64) = (1000, 0.01);

/// More steps than any smooth motion takes.
const MOST_STEPS: usize = 2_000_000;

/// Simulate a model from its initial configuration.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// Begin at rest, where gravity, springs, torques and forces are in balance
    #[arg(long)]
    settle: bool,
    /// Settle, then take away a force, or what drives a joint
    #[arg(long, value_name = "NAME")]
    release: Vec<String>,
    /// Seconds to simulate
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    duration: f64,
    /// Samples per second in what is written
    #[arg(long, default_value_t = 100.0, value_name = "HERTZ")]
    rate: f64,
    /// Error allowed per step, relative and absolute
    #[arg(long, default_value_t = 1e-8)]
    tolerance: f64,
    /// How to integrate
    #[arg(long, value_enum, default_value_t)]
    integrator: Method,
    /// Share of its speed with which a joint leaves a stop, 0 to 1
    #[arg(long, default_value_t = 0.0, value_name = "SHARE")]
    restitution: f64,
    /// Write the motion as CSV; `-` writes standard output
    #[arg(long, value_name = "FILE")]
    csv: Option<String>,
    /// Draw the joint angles over time as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
}

#[derive(Clone, Copy, Default, PartialEq, Eq, ValueEnum)]
enum Method {
    /// Explicit, and implicit from where the motion turns out to be stiff
    #[default]
    Auto,
    /// Dormand and Prince's pair of order 5(4), explicit
    Dopri5,
    /// RODASP of order 4(3), implicit and L-stable
    Rodas,
}

/// A motion, sampled.
pub struct Motion {
    pub joints: Vec<String>,
    /// s.
    pub t: Vec<f64>,
    /// rad, by sample.
    pub q: Vec<Vec<f64>>,
    /// rad/s, by sample.
    pub u: Vec<Vec<f64>>,
    pub energy: Vec<Energy<f64>>,
    /// Largest closure residual, m, by sample.
    pub open: Vec<f64>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    for (name, value) in [
        ("--duration", arguments.duration),
        ("--rate", arguments.rate),
        ("--tolerance", arguments.tolerance),
    ] {
        if !(value.is_finite() && value > 0.0) {
            return Err(misused(format_args!("{name} must be a positive number")));
        }
    }
    if !(0.0..=1.0).contains(&arguments.restitution) {
        return Err(misused("--restitution must lie between 0 and 1"));
    }
    let samples = (arguments.duration * arguments.rate).ceil();
    if samples > 1e7 {
        return Err(misused("more than 10 million samples: lower --rate or --duration"));
    }
    let (mechanism, system, state) = begin(arguments)?;
    let begin = Instant::now();
    let mut run = Run::new(system, state, arguments);
    for sample in 1..=samples as usize {
        run.advance((sample as f64 / arguments.rate).min(arguments.duration))?;
    }
    let (motion, system) = (&run.motion, &run.system.system);
    let samples = motion.t.iter().copied().zip(motion.q.iter().map(Vec::as_slice));
    for excursion in excursions(&mechanism, system.parameters(), system.inputs(), samples) {
        warn(excursion);
    }
    if let Some(path) = &arguments.csv {
        output::write(path, &motion.csv())?;
    }
    if let Some(path) = &arguments.plot {
        let svg = plot::angles(&system.interface().name, motion).map_err(fail)?;
        output::write(path, &svg)?;
    }
    if arguments.csv.as_deref() == Some("-") || arguments.plot.as_deref() == Some("-") {
        return Ok(());
    }
    let seconds = begin.elapsed().as_secs_f64();
    let mut text = motion.summary(system.size());
    run.note_stops(&mut text);
    let methods: Vec<_> = [(run.explicit_steps, "Dormand-Prince"), (run.implicit_steps, "RODASP")]
        .into_iter()
        .filter(|(steps, _)| *steps > 0)
        .map(|(steps, name)| format!("{steps} steps of {name}"))
        .collect();
    let _ = writeln!(
        text,
        "{} in {seconds:.3} s: {:.1} times real time",
        methods.join(" and "),
        arguments.duration / seconds
    );
    output::print(&text)
}

/// What moves, and the state it starts from.
type Beginning = (Mechanism, Interpreter, State<Vec<f64>, f64>);

/// The beginning of the motion: assembled or at rest.
fn begin(arguments: &Arguments) -> Result<Beginning, Failed> {
    let start = &arguments.start;
    let compiled = start.compile(&[])?;
    let system = start.system(&compiled)?;
    let mut state = start.assembled(&system)?;
    if !arguments.settle && arguments.release.is_empty() {
        return Ok((compiled.topology.mechanism, system, state));
    }
    settle(&system, &mut state)?;
    let system = match arguments.release.is_empty() {
        true => system,
        false => start.system(&start.compile(&arguments.release)?)?,
    };
    // Driven joints may set off at once.
    let workspace = &mut system.workspace();
    project(&system, 0.0, &mut state.q, &mut state.u, workspace)
        .map_err(|error| fail(describe(&error, system.interface())))?;
    Ok((compiled.topology.mechanism, system, state))
}

/// Whether the loops are loose in a direction more than they usually are, as in the flat state.
/// Which branch the motion leaves by is for the implicit method to find.
fn is_singular(system: &Stopped<Interpreter>, state: &State<Vec<f64>, f64>) -> bool {
    let d = system.dimensions();
    let mut rates = system.vector();
    let found =
        acceleration(system, state.t, &state.q, &state.u, &mut system.workspace(), &mut rates);
    let usual = system.system.interface().rank + d.drives;
    found.is_ok_and(|constraint| constraint.rank < usual.min(d.coordinates))
}

/// A motion on its way.
struct Run {
    system: Stopped<Interpreter>,
    state: State<Vec<f64>, f64>,
    explicit: Dopri5<Stopped<Interpreter>>,
    implicit: Rodas<Stopped<Interpreter>>,
    method: Method,
    /// Whether the implicit method is only to lead out of a singular state.
    leaves: bool,
    duration: f64,
    explicit_steps: usize,
    implicit_steps: usize,
    /// Steps and the time, s, when progress was last looked at.
    mark: (usize, f64),
    motion: Motion,
    /// Joints that were at a stop.
    stopped: Vec<bool>,
}

impl Run {
    fn new(system: Interpreter, state: State<Vec<f64>, f64>, arguments: &Arguments) -> Self {
        let mut motion = Motion::new(&system);
        motion.record(&system, &state);
        let stopped = vec![false; state.q.len()];
        let mut system = Stopped::new(system);
        system.restitution = arguments.restitution;
        let leaves = arguments.integrator == Method::Auto && is_singular(&system, &state);
        let method = if leaves { Method::Rodas } else { arguments.integrator };
        let (mut explicit, mut implicit) = (Dopri5::new(&system), Rodas::new(&system));
        (explicit.relative, explicit.absolute) = (arguments.tolerance, arguments.tolerance);
        (implicit.relative, implicit.absolute) = (arguments.tolerance, arguments.tolerance);
        Self {
            system,
            state,
            explicit,
            implicit,
            method,
            leaves,
            duration: arguments.duration,
            explicit_steps: 0,
            implicit_steps: 0,
            mark: (0, 0.0),
            motion,
            stopped,
        }
    }

    /// To a time, s, and records the state there.
    fn advance(&mut self, t: f64) -> Result<(), Failed> {
        while self.state.t < t {
            let outcome = match self.method {
                Method::Rodas => {
                    self.implicit_steps += 1;
                    self.system.step(&mut self.implicit, &mut self.state, t)
                }
                Method::Auto | Method::Dopri5 => {
                    self.explicit_steps += 1;
                    self.system.step(&mut self.explicit, &mut self.state, t)
                }
            };
            if self.is_hopeless() {
                return Err(fail(format_args!(
                    "gave up after {} steps, at t = {} s: the motion is not smooth there, or \
                     --tolerance asks for too much; out of a flat sheet, start from a folded guess \
                     (--initial)",
                    self.explicit_steps + self.implicit_steps,
                    self.state.t
                )));
            }
            if self.leaves && !is_singular(&self.system, &self.state) {
                (self.leaves, self.method) = (false, Method::Auto);
                self.mark = (self.explicit_steps + self.implicit_steps, self.state.t);
            }
            let gives_up = matches!(outcome, Err(Error::StepTooSmall { .. }));
            let stuck = self.explicit.is_stiff() || self.is_slow();
            if self.method == Method::Auto && (gives_up || stuck) {
                self.method = Method::Rodas;
                continue;
            }
            outcome.map_err(|error| self.explain(&error))?;
            for (stopped, &side) in self.stopped.iter_mut().zip(&self.system.sides) {
                *stopped |= side != 0.0;
            }
        }
        self.motion.record(&self.system.system, &self.state);
        Ok(())
    }

    /// Whether the implicit method, too, hardly gets on: at this pace it would take far more steps
    /// than any smooth motion.
    fn is_hopeless(&mut self) -> bool {
        let steps = self.explicit_steps + self.implicit_steps;
        if self.method != Method::Rodas || steps - self.mark.0 < PATIENCE.0 {
            return steps >= MOST_STEPS;
        }
        let gone = self.state.t - self.mark.1;
        let pace = (steps - self.mark.0) as f64 / gone;
        self.mark = (steps, self.state.t);
        pace * self.duration > MOST_STEPS as f64
    }

    /// Whether the explicit method hardly gets on, as between the ranks of a singular state.
    fn is_slow(&mut self) -> bool {
        let (steps, share) = PATIENCE;
        let now = self.explicit_steps + self.implicit_steps;
        if self.method == Method::Rodas || now - self.mark.0 < steps {
            return false;
        }
        let gone = self.state.t - self.mark.1;
        self.mark = (now, self.state.t);
        gone < share * self.duration
    }

    /// An error with the joints that were at a stop.
    fn explain(&self, error: &Error) -> Failed {
        let interface = self.system.system.interface();
        let reason = describe(error, interface);
        let held =
            interface.joints.iter().zip(&self.system.sides).filter(|(_, side)| **side != 0.0);
        let names: Vec<_> = held.map(|(joint, _)| format!("`{}`", joint.name)).collect();
        match names.is_empty() {
            true => fail(format_args!("{reason}, at t = {} s", self.state.t)),
            false => {
                let names = names.join(", ");
                fail(format_args!("{reason}, at t = {} s with {names} at a stop", self.state.t))
            }
        }
    }

    fn note_stops(&self, text: &mut String) {
        let joints = &self.system.system.interface().joints;
        let resting = joints.iter().zip(&self.stopped).filter(|(_, stopped)| **stopped);
        let names: Vec<_> = resting.map(|(joint, _)| format!("`{}`", joint.name)).collect();
        if !names.is_empty() {
            let _ = writeln!(text, "at a stop for a while: {}", names.join(", "));
        }
    }
}

impl Motion {
    fn new(system: &Interpreter) -> Self {
        Self {
            joints: system.interface().joints.iter().map(|joint| joint.name.clone()).collect(),
            t: Vec::new(),
            q: Vec::new(),
            u: Vec::new(),
            energy: Vec::new(),
            open: Vec::new(),
        }
    }

    fn record(&mut self, system: &Interpreter, state: &State<Vec<f64>, f64>) {
        let rows = 9 * system.dimensions().loops;
        let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * state.q.len()]);
        system.write_closure(&state.q, &mut residual, &mut jacobian);
        self.t.push(state.t);
        self.q.push(state.q.clone());
        self.u.push(state.u.clone());
        self.energy.push(system.energy(state.t, &state.q, &state.u));
        self.open.push(residual.iter().fold(0.0, |most, x| x.abs().max(most)));
    }

    fn csv(&self) -> String {
        let mut text = "t [s]".to_owned();
        for (symbol, unit) in [("q", "rad"), ("u", "rad/s")] {
            for joint in &self.joints {
                let _ = write!(text, ",{symbol}.{joint} [{unit}]");
            }
        }
        text.push_str(",kinetic [J],potential [J],closure [m]\n");
        for (index, t) in self.t.iter().enumerate() {
            let _ = write!(text, "{t:?}");
            for number in self.q[index].iter().chain(&self.u[index]) {
                let _ = write!(text, ",{number:?}");
            }
            let Energy { kinetic, potential } = self.energy[index];
            let _ = writeln!(text, ",{kinetic:?},{potential:?},{:?}", self.open[index]);
        }
        text
    }

    fn summary(&self, size: f64) -> String {
        let mut text = String::new();
        let (first, last) = (0, self.t.len() - 1);
        let _ = writeln!(text, "{:<16} {:>10} {:>10}", "joint", "start deg", "end deg");
        for (joint, name) in self.joints.iter().enumerate() {
            let [start, end] = [first, last].map(|sample| self.q[sample][joint].to_degrees());
            let _ = writeln!(text, "{name:<16} {start:>10.3} {end:>10.3}");
        }
        let total = |sample: usize| self.energy[sample].kinetic + self.energy[sample].potential;
        let _ =
            writeln!(text, "energy: {:.6e} J at start, {:.6e} J at end", total(first), total(last));
        let open = self.open.iter().copied().fold(0.0, f64::max);
        let _ = writeln!(text, "closure: within {open:.1e} m of {:.1} mm", size * 1e3);
        text
    }
}
