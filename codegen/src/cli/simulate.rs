//! `lamc simulate MODEL`: assemble, integrate through the interpreter, show what happened.

use std::fmt::Write;
use std::time::Instant;

use clap::Args;
use lamc::program::Interpreter;
use lamc::source::{read_angle, read_quantity};
use lamc_runtime::{Dopri5, Energy, Integrator, State, System, assemble, project};

use super::{Failed, Outcome, fail, load, output, plot};

/// Simulate a model from its initial configuration.
#[derive(Args)]
pub struct Arguments {
    /// The model
    model: String,
    /// Set a parameter: k=0.02, k=11.4mN*m/rad
    #[arg(long, value_name = "NAME=VALUE")]
    set: Vec<String>,
    /// Start from another angle: j0=30deg
    #[arg(long, value_name = "JOINT=ANGLE")]
    initial: Vec<String>,
    /// Seconds to simulate
    #[arg(long, default_value_t = 2.0, value_name = "SECONDS")]
    duration: f64,
    /// Samples per second in what is written
    #[arg(long, default_value_t = 100.0, value_name = "HERTZ")]
    rate: f64,
    /// Error allowed per step, relative and absolute
    #[arg(long, default_value_t = 1e-8)]
    tolerance: f64,
    /// Write the motion as CSV; `-` writes standard output
    #[arg(long, value_name = "FILE")]
    csv: Option<String>,
    /// Draw the joint angles over time as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
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
            return Err(fail(format_args!("{name} must be a positive number")));
        }
    }
    let samples = (arguments.duration * arguments.rate).ceil();
    if samples > 1e7 {
        return Err(fail("more than 10 million samples: lower --rate or --duration"));
    }
    let compiled = load(&arguments.model)?;
    let mut system = Interpreter::new(&compiled.program);
    for setting in &arguments.set {
        let (name, value) = pair(setting, "--set k=0.02", read_quantity)?;
        system.set_parameter(name, value).map_err(fail)?;
    }
    let begin = Instant::now();
    let mut state = start(&system, arguments)?;
    let mut integrator = Dopri5::new(&system);
    integrator.relative = arguments.tolerance;
    integrator.absolute = arguments.tolerance;
    let mut steps = 0_usize;
    let mut motion = Motion::new(&system);
    motion.record(&system, &state);
    for sample in 1..=samples as usize {
        let t = (sample as f64 / arguments.rate).min(arguments.duration);
        integrator.run(&system, &mut state, t, |_| steps += 1).map_err(fail)?;
        motion.record(&system, &state);
    }
    if let Some(path) = &arguments.csv {
        output::write(path, &motion.csv())?;
    }
    if let Some(path) = &arguments.plot {
        let svg = plot::angles(&system.interface().name, &motion).map_err(fail)?;
        output::write(path, &svg)?;
    }
    if arguments.csv.as_deref() == Some("-") || arguments.plot.as_deref() == Some("-") {
        return Ok(());
    }
    let seconds = begin.elapsed().as_secs_f64();
    let mut text = motion.summary(system.size());
    let _ = writeln!(
        text,
        "{steps} steps of the Dormand-Prince method in {:.3} s: {:.1} times real time",
        seconds,
        arguments.duration / seconds
    );
    output::print(&text)
}

/// Splits `name=value`.
fn pair<'a>(
    text: &'a str,
    example: &str,
    read: impl Fn(&str) -> Option<f64>,
) -> Result<(&'a str, f64), Failed> {
    let parts = text.split_once('=').and_then(|(name, value)| Some((name.trim(), read(value)?)));
    parts.ok_or_else(|| fail(format_args!("`{text}` is not of the form `{example}`")))
}

/// The closed configuration nearest to the guess, at consistent rates.
fn start(system: &Interpreter, arguments: &Arguments) -> Result<State<Vec<f64>, f64>, Failed> {
    let mut state = State::initial(system);
    let n = state.q.len();
    let mut pinned: Vec<bool> = (0..n).map(|joint| system.is_given(joint)).collect();
    let joints = &system.interface().joints;
    if !arguments.initial.is_empty() {
        pinned.fill(false);
    }
    for setting in &arguments.initial {
        let (name, angle) = pair(setting, "--initial j0=30deg", read_angle)?;
        let Some(joint) = joints.iter().position(|joint| joint.name == name) else {
            let names: Vec<_> = joints.iter().map(|joint| joint.name.as_str()).collect();
            return Err(fail(format_args!("no joint `{name}`; there are {}", names.join(", "))));
        };
        let [least, greatest] = joints[joint].limits;
        if angle < least || angle > greatest {
            return Err(fail(format_args!("`{setting}` is outside the limits of `{name}`")));
        }
        state.q[joint] = angle;
        pinned[joint] = true;
    }
    let mut workspace = system.workspace();
    assemble(system, 0.0, &mut state.q, &pinned, &mut workspace).map_err(|error| {
        let named = match error {
            lamc_runtime::Error::NotClosed { joint: Some(joint), .. } => {
                format!(" (`{}`)", joints[joint].name)
            }
            _ => String::new(),
        };
        fail(format_args!("no closed configuration near the initial one: {error}{named}"))
    })?;
    project(system, 0.0, &mut state.q, &mut state.u, &mut workspace).map_err(fail)?;
    Ok(state)
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
