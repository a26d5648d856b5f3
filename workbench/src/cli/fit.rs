//! `lamc fit MODEL --data run.csv --free stiffness,damping`: parameters from measured joint angles
//! and poses of free bodies.

use std::fmt::Write;

use clap::Args;
use lamc::laminate::Mechanism;
use lamc::program::{Interface, JointInfo, ParameterInfo};
use lamc::source::free::{COORDINATE_NAMES, SPEEDS};
use lamc::source::{SpeedId, Tunable};
use lamc_workbench::identify::{Fit, NEAR, Problem, Record, prescribes};

use super::curves::Curve;
use super::paths::Paths;
use super::start::Start;
use super::{Failed, Outcome, curves, fail, output, read_numbers, warn};

/// Identify parameters from a measured motion.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// Measured angles as CSV: `t [s]` and `q.<joint> [rad]` or `<joint> [deg]`, and `q.<body>.x [m]`
    /// to `q.<body>.qz [1]` of free bodies; `-` reads standard input
    #[arg(long, value_name = "FILE")]
    data: String,
    /// What to identify: parameters, or `stiffness`, `damping`, `rest`, `mass` of every joint
    /// (body), or of one: `stiffness_<joint>`
    #[arg(long, value_delimiter = ',', required = true, value_name = "NAME,..")]
    free: Vec<String>,
    /// The motion starts from rest; without this option the initial speeds are identified too
    #[arg(long)]
    from_rest: bool,
    #[command(flatten)]
    report: Report,
}

/// Where a fit's residuals go.
#[derive(Args)]
pub struct Report {
    /// Draw the residuals of the angles as SVG
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
    /// Write the fitted angles as CSV
    #[arg(long, value_name = "FILE")]
    csv: Option<String>,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let model = Paths::default().input("the model", [&arguments.start.model]);
    arguments.report.check(model.input("--data", [&arguments.data]))?;
    let kind = |name: &str| {
        Tunable::ALL.into_iter().find(|kind| {
            name.strip_prefix(kind.name())
                .is_some_and(|rest| rest.is_empty() || rest.starts_with('_'))
        })
    };
    let compiled = arguments.start.compile_changed(&[], |model| {
        for name in &arguments.free {
            let declared = model.parameters.iter().any(|parameter| parameter.name.value == *name);
            if let Some(kind) = kind(name).filter(|_| !declared) {
                model.tune(kind);
            }
        }
    })?;
    let mut system = arguments.start.system(&compiled)?;
    system.interface().without_controllers("fits").map_err(fail)?;
    let parameters = system.interface().parameters.clone();
    let free = free_parameters(&arguments.free, &parameters)?;
    refuse_prescribed(&compiled.topology.mechanism, &parameters, &free)?;
    let joints: Vec<&str> = compiled.program.interface.joints.iter().map(|j| &*j.name).collect();
    let bodies: Vec<&str> = compiled.program.interface.free.iter().map(|b| &*b.name).collect();
    let record = read(&arguments.data, &joints, &bodies)?;
    for (joint, angle) in arguments.start.guess(&compiled, &compiled.program.interface)? {
        if !record.q[0][joint].is_nan() {
            return Err(fail(format_args!(
                "--initial has no effect on `{}`: {} determines its initial angle",
                joints[joint], arguments.data
            )));
        }
        system.set_initial(joint, angle);
    }
    warn_of_unknown_start(system.interface(), &record);
    let fit = Problem {
        system: system.clone(),
        record: &record,
        free,
        from_rest: arguments.from_rest,
        tolerance: 1e-9,
    };
    let fit = fit.solve().map_err(fail)?;
    arguments.report.write(&record, &fit, system.interface())?;
    output::print(&format!("{}{}", summary(&fit), about_free_bodies(system.interface(), &fit.kept)))
}

/// The indices of the parameters that are named, one by one or by their kind.
fn free_parameters(names: &[String], parameters: &[ParameterInfo]) -> Result<Vec<usize>, Failed> {
    let mut free = Vec::new();
    for name in names {
        let prefix = Tunable::ALL.into_iter().find(|kind| kind.name() == name);
        let is_meant = |parameter: &str| match prefix {
            Some(kind) => {
                parameter.strip_prefix(kind.name()).is_some_and(|rest| rest.starts_with('_'))
            }
            None => parameter == name,
        };
        let found = parameters.iter().enumerate().filter(|(_, p)| is_meant(&p.name));
        let found: Vec<usize> = found.map(|(index, _)| index).collect();
        if found.is_empty() {
            let names: Vec<_> = parameters.iter().map(|p| format!("`{}`", p.name)).collect();
            return Err(fail(format_args!(
                "there is no parameter or constant `{name}`; there are {}",
                names.join(", ")
            )));
        }
        free.extend(found.into_iter().filter(|index| !free.contains(index)).collect::<Vec<_>>());
    }
    Ok(free)
}

/// Refuses free parameters on which a prescribed angle depends.
fn refuse_prescribed(
    mechanism: &Mechanism,
    parameters: &[ParameterInfo],
    free: &[usize],
) -> Outcome {
    match free.iter().find(|&&k| prescribes(mechanism, k)) {
        Some(&k) => Err(fail(format_args!(
            "`{}` cannot be free: a prescribed angle depends on it",
            parameters[k].name
        ))),
        None => Ok(()),
    }
}

/// Warns if neither the first sample nor a guess determines how the mechanism is folded.
fn warn_of_unknown_start(interface: &Interface, record: &Record) {
    let joints = interface.joints.iter().zip(&record.q[0]);
    let is_unknown =
        |(joint, seen): &(&JointInfo, &f64)| seen.is_nan() && !joint.initial_given && !joint.driven;
    let unknown: Vec<_> = joints.filter(is_unknown).map(|(joint, _)| &*joint.name).collect();
    let hinged = interface.mobility.saturating_sub(SPEEDS * interface.free.len());
    if interface.joints.len() - unknown.len() < hinged {
        let names: Vec<_> = unknown.iter().map(|name| format!("`{name}`")).collect();
        warn(format_args!(
            "the first sample does not determine the initial angles of {}, and the fit begins \
             with 0: a rough guess may be needed (`--initial {}=ANGLE`, or `initial` in the \
             model)",
            names.join(", "),
            unknown[0]
        ));
    }
}

/// Reads measured angles of these joints and coordinates of these free bodies.
pub fn read(path: &str, joints: &[&str], bodies: &[&str]) -> Result<Record, Failed> {
    read_numbers(path, |text| Record::read(text, joints, bodies))
}

/// Says how displacements count, and what started as the model says (indices of u).
fn about_free_bodies(interface: &Interface, kept: &[usize]) -> String {
    let mut text = String::new();
    if interface.free.is_empty() {
        return text;
    }
    let size = 1e3 * interface.size;
    let _ = writeln!(text, "displacements count as angles: they are divided by {size:.4} mm");
    let names: Vec<String> = kept.iter().map(|&k| interface.speed_name(SpeedId(k))).collect();
    if !names.is_empty() {
        let names = names.join(", ");
        let _ = writeln!(text, "not in the record, so that the model tells their start: {names}");
    }
    text
}

/// Prints estimates, standard errors and residuals.
pub fn summary(fit: &Fit) -> String {
    let mut text = format!("{:<24} {:>14} {:>14} {:>9}\n", "parameter", "SI", "std. error", "%");
    for estimate in &fit.estimates {
        let share = 100.0 * estimate.standard_error / estimate.value.abs();
        let _ = writeln!(
            text,
            "{:<24} {:>14.6e} {:>14.2e} {share:>9.3}",
            estimate.name, estimate.value, estimate.standard_error
        );
    }
    if fit.share > NEAR {
        let percent = 100.0 * fit.share;
        warn(format_args!(
            "the model does not move as measured: the residuals are {percent:.0} % of the motion"
        ));
    }
    let n = fit.estimates.len();
    let pairs = (0..n).flat_map(|i| (0..i).map(move |j| (i, j)));
    let size = |(i, j): &(usize, usize)| fit.correlations[i * n + j].abs();
    if let Some((i, j)) = pairs.max_by(|a, b| size(a).total_cmp(&size(b))) {
        let [first, second] = [j, i].map(|k| &fit.estimates[k].name);
        let correlation = fit.correlations[i * n + j];
        let _ = writeln!(text, "largest correlation: {correlation:.3} of {first} and {second}");
    }
    let _ = writeln!(
        text,
        "residual: {:.4} deg root mean square, after {} motions",
        fit.rms.to_degrees(),
        fit.evaluations
    );
    text
}

impl Report {
    /// Refuses outputs that cannot be, beside what is read.
    pub fn check(&self, read: Paths<'_>) -> Outcome {
        output::has_extension(self.plot.as_ref(), "svg")?;
        read.output("--csv", &self.csv).output("--plot", &self.plot).check()
    }

    /// Writes what was asked for.
    pub fn write(&self, record: &Record, fit: &Fit, interface: &Interface) -> Outcome {
        if let Some(path) = &self.csv {
            let mut text = "t [s]".to_owned();
            interface.coordinate_columns().for_each(|(name, unit)| {
                let _ = write!(text, ",q.{name} [{unit}]");
            });
            text.push('\n');
            for (t, q) in record.t.iter().zip(&fit.q) {
                let _ = write!(text, "{t:?}");
                q.iter().for_each(|q| {
                    let _ = write!(text, ",{q:?}");
                });
                text.push('\n');
            }
            output::write(path, &text)?;
        }
        if let Some(path) = &self.plot {
            let left = |k: usize| -> Vec<(f64, f64)> {
                let samples = record.t.iter().zip(&fit.residuals);
                let left = samples.map(|(t, left)| (*t, left[k].to_degrees()));
                left.filter(|(_, left)| !left.is_nan()).collect()
            };
            let curves: Vec<Curve> = (0..interface.speeds())
                .map(|k| Curve::points(&residual_name(interface, k), k, left(k)))
                .filter(|curve| !curve.samples.is_empty())
                .collect();
            let svg = curves::draw("measured minus fitted", &curves).map_err(fail)?;
            output::write(path, &svg)?;
        }
        Ok(())
    }
}

/// The name of a component of the residuals in a plot.
fn residual_name(interface: &Interface, k: usize) -> String {
    let Some(beyond) = k.checked_sub(interface.joints.len()) else {
        return interface.joints[k].name.clone();
    };
    let body = &interface.free[beyond / SPEEDS].name;
    let axis = COORDINATE_NAMES[beyond % 3];
    match beyond % SPEEDS < 3 {
        true => format!("{body}.{axis} / size"),
        false => format!("{body} about {axis}"),
    }
}
