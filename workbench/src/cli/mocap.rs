//! `lamc mocap quats.csv --model MODEL`: joint angles from the quaternions of bodies.

use std::fmt::Write;

use clap::Args;
use lamc::laminate::Mechanism;
use lamc::program::Interpreter;
use lamc::source::read_angle;
use lamc_runtime::{Dopri5, Integrator, Mechanism as _, State, assemble};
use lamc_workbench::mocap::{JointMotion, Quaternions, angles, write};
use lamc_workbench::simulation::describe;
use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{RngCore, SeedableRng};
use rand_distr::{Distribution, Normal};

use super::curves::{self, Curve};
use super::paths::Paths;
use super::{Derivation, Failed, Outcome, fail, load, misused, output, read_numbers, warn};

/// An axis this far from the drawn one, rad, may as well be the opposite one of frames that are
/// farther off.
const DOUBTFUL: f64 = std::f64::consts::FRAC_PI_4;

/// Joint angles from motion capture: unit quaternions of the bodies over time.
#[derive(Args)]
pub struct Arguments {
    /// `t [s]` and, per body, `<body>.w`, `.x`, `.y`, `.z`: Hamilton's quaternions from the body to
    /// the world, CSV; `-` reads standard input
    quaternions: String,
    /// The model with these bodies
    #[arg(long, value_name = "MODEL")]
    model: String,
    /// Time at which the sheet lies flat, seconds: the bodies' frames are made parallel there
    #[arg(long, value_name = "SECONDS")]
    flat_at: Option<f64>,
    /// Write angles and rates as CSV, as `lamc fit` reads them; `-` writes standard output
    #[arg(short, long, value_name = "FILE")]
    output: Option<String>,
    /// Draw the angles as SVG, with a simulation from the first of them, at rest, on top
    #[arg(long, value_name = "FILE")]
    plot: Option<String>,
    /// Draw these joints only
    #[arg(long, value_delimiter = ',', value_name = "JOINT,..", requires = "plot")]
    joints: Vec<String>,
    /// Write QUATERNIONS instead of reading: synthetic data of a simulated motion this long
    #[arg(long, value_name = "SECONDS", conflicts_with_all = ["flat_at", "output", "plot"])]
    synthesize: Option<f64>,
    /// Samples per second of synthetic data
    #[arg(long, default_value_t = 360.0, value_name = "HERTZ", requires = "synthesize")]
    rate: f64,
    /// Noise of synthetic data about each axis, standard deviation: 0.1deg
    #[arg(long, value_parser = angle, default_value = "0", value_name = "ANGLE", requires = "synthesize")]
    noise: f64,
    /// Of the noise
    #[arg(long, default_value_t = 0, value_name = "NUMBER", requires = "synthesize")]
    seed: u64,
    #[command(flatten)]
    derivation: Derivation,
}

fn angle(text: &str) -> Result<f64, String> {
    let angle = read_angle(text).filter(|angle| *angle >= 0.0);
    angle.ok_or_else(|| "expected an angle, as in `0.1deg`".into())
}

pub fn run(arguments: &Arguments) -> Outcome {
    output::has_extension(arguments.plot.as_ref(), "svg")?;
    let paths = Paths::default()
        .input("the model", [&arguments.model])
        .output("--output", &arguments.output)
        .output("--plot", &arguments.plot);
    let paths = match arguments.synthesize {
        Some(_) => paths.output("the quaternions", [&arguments.quaternions]),
        None => paths.input("the quaternions", [&arguments.quaternions]),
    };
    paths.check()?;
    let compiled = load(&arguments.model, arguments.derivation)?;
    let mechanism = &compiled.topology.mechanism;
    let system = Interpreter::new(&compiled.program);
    if let Some(seconds) = arguments.synthesize {
        return synthesize(arguments, mechanism, &system, seconds);
    }
    let path = &arguments.quaternions;
    let bodies: Vec<_> =
        mechanism.bodies.iter().map(|body| (body.name.as_str(), body.fixed)).collect();
    let mut measured = read_numbers(path, |text| Quaternions::read(text, &bodies))?;
    measured.notes.iter().for_each(warn);
    if let Some(t) = arguments.flat_at {
        let fixed: Vec<bool> = bodies.iter().map(|(_, fixed)| *fixed).collect();
        let located = |error| fail(format_args!("{path}: {error}"));
        measured.flatten(t, &fixed).map_err(located)?;
    }
    let joints = angles(mechanism, &measured);
    if joints.iter().all(Option::is_none) {
        let reason = "there is no joint for which both bodies were measured";
        return Err(fail(format_args!("{path}: {reason}")));
    }
    for motion in joints.iter().flatten().filter(|motion| motion.misalignment > DOUBTFUL) {
        warn(format_args!(
            "the axis of `{}` is {:.0} deg off the drawn one: its angle may have the wrong sign; \
             the frames must be aligned with the drawing (--flat-at makes them parallel to the \
             ground's)",
            motion.name,
            motion.misalignment.to_degrees()
        ));
    }
    // All or nothing: what is drawn may fail.
    let drawn = arguments.plot.as_ref().map(|plot| {
        let curves = overlay(arguments, &system, &measured.t, &joints)?;
        let svg = curves::draw(&format!("{}: measured, simulated", mechanism.name), &curves);
        Ok((plot, svg.map_err(fail)?))
    });
    let drawn = drawn.transpose()?;
    if let Some(output) = &arguments.output {
        output::write(output, &csv(&measured.t, &joints))?;
    }
    if let Some((plot, svg)) = drawn {
        output::write(plot, &svg)?;
    }
    if paths.is_printed() {
        return Ok(());
    }
    output::print(&table(mechanism, &joints))
}

fn table(mechanism: &Mechanism, joints: &[Option<JointMotion>]) -> String {
    let mut text = format!(
        "{:<24} {:>9} {:>9} {:>6} {:>13} {:>8}\n",
        "joint", "least deg", "most deg", "gaps", "axis off deg", "wobble"
    );
    for (joint, motion) in mechanism.joints.iter().zip(joints) {
        let name = &joint.name;
        let Some(motion) = motion else {
            let _ = writeln!(text, "{name:<24} not measured");
            continue;
        };
        let seen = || motion.angle.iter().filter(|angle| !angle.is_nan()).map(|q| q.to_degrees());
        let (low, high) =
            (seen().fold(f64::INFINITY, f64::min), seen().fold(f64::NEG_INFINITY, f64::max));
        let gaps = motion.angle.len() - seen().count();
        let off = match motion.axis {
            Some(_) => format!("{:.4}", motion.misalignment.to_degrees()),
            None => "as drawn".into(),
        };
        let wobble = motion.wobble;
        let _ =
            writeln!(text, "{name:<24} {low:>9.3} {high:>9.3} {gaps:>6} {off:>13} {wobble:>8.1e}");
    }
    text
}

fn csv(t: &[f64], joints: &[Option<JointMotion>]) -> String {
    let seen: Vec<&JointMotion> = joints.iter().flatten().collect();
    let mut text = "t [s]".to_owned();
    for (symbol, unit) in [("q", "rad"), ("u", "rad/s")] {
        for joint in &seen {
            let _ = write!(text, ",{symbol}.{} [{unit}]", joint.name);
        }
    }
    text.push('\n');
    for (sample, t) in t.iter().enumerate() {
        let _ = write!(text, "{t:?}");
        let numbers = seen.iter().map(|joint| joint.angle[sample]);
        for number in numbers.chain(seen.iter().map(|joint| joint.rate[sample])) {
            // What was not seen stays empty.
            let _ = if number.is_nan() { write!(text, ",") } else { write!(text, ",{number:?}") };
        }
        text.push('\n');
    }
    text
}

/// Measured angles as points and simulated ones as lines.
fn overlay(
    arguments: &Arguments,
    system: &Interpreter,
    t: &[f64],
    joints: &[Option<JointMotion>],
) -> Result<Vec<Curve>, Failed> {
    let names: Vec<&str> = system.interface().joints.iter().map(|j| j.name.as_str()).collect();
    if let Some(unknown) = arguments.joints.iter().find(|name| !names.contains(&name.as_str())) {
        return Err(fail(format_args!(
            "there is no joint `{unknown}`; there are {}",
            names.join(", ")
        )));
    }
    let first = |joint: &Option<JointMotion>| {
        joint.as_ref().map(|joint| joint.angle[0]).filter(|angle| !angle.is_nan())
    };
    let mut state = system.initial();
    state.t = t[0];
    let mut pinned = vec![false; names.len()];
    for (k, joint) in joints.iter().enumerate() {
        if let Some(angle) = first(joint) {
            (state.q[k], pinned[k]) = (angle, true);
        }
    }
    state.u.fill(0.0);
    let message = |error| fail(describe(&error, system.interface()));
    assemble(system, t[0], &mut state.q, &pinned, &mut system.workspace()).map_err(message)?;
    let simulated = sampled(system, state, t).map_err(message)?;
    let mut curves = Vec::new();
    for (k, name) in names.iter().enumerate() {
        if !arguments.joints.is_empty() && !arguments.joints.iter().any(|wanted| wanted == name) {
            continue;
        }
        if let Some(joint) = &joints[k] {
            let samples = t.iter().zip(&joint.angle).map(|(t, q)| (*t, q.to_degrees()));
            let samples = samples.filter(|(_, q)| !q.is_nan()).collect();
            curves.push(Curve::points(&format!("{name}, measured"), k, samples));
        }
        let samples = t.iter().zip(&simulated).map(|(t, q)| (*t, q[k].to_degrees()));
        curves.push(Curve::line(&format!("{name}, simulated"), k, samples.collect()));
    }
    Ok(curves)
}

/// Angles of a motion at some times.
fn sampled(
    system: &Interpreter,
    mut state: State<Vec<f64>, f64>,
    t: &[f64],
) -> Result<Vec<Vec<f64>>, lamc_runtime::Error> {
    let mut q = Vec::new();
    let end = t.last().copied().unwrap_or(state.t);
    let times = t.iter().copied();
    Dopri5::new(system).sample(system, &mut state, end, times, |state| q.push(state.q.clone()))?;
    Ok(q)
}

/// Writes the quaternions of a simulated motion from the model's initial state: with noise, and
/// each of either sign at random.
fn synthesize(
    arguments: &Arguments,
    mechanism: &Mechanism,
    system: &Interpreter,
    seconds: f64,
) -> Outcome {
    let count = (seconds * arguments.rate).floor();
    if !(1.0..=1e6).contains(&count) {
        return Err(misused("--synthesize and --rate must give from one to a million samples"));
    }
    let mut state = system.initial();
    let message = |error| fail(describe(&error, system.interface()));
    let joints = 0..system.dimensions().joints;
    let pinned: Vec<bool> = joints.map(|joint| system.is_pinned(joint)).collect();
    assemble(system, 0.0, &mut state.q, &pinned, &mut system.workspace()).map_err(message)?;
    let t: Vec<f64> = (0..=count as u32).map(|k| f64::from(k) / arguments.rate).collect();
    let motion = sampled(system, state, &t).map_err(message)?;
    let mut random = ChaCha8Rng::seed_from_u64(arguments.seed);
    let normal = Normal::new(0.0, arguments.noise).map_err(fail)?;
    let mut rotations: Vec<Vec<Quaternion<f64>>> = Vec::new();
    for q in &motion {
        let poses = system.poses(q).map_err(message)?;
        let turned = poses.iter().map(|pose| {
            let matrix = Rotation3::from_matrix_unchecked(Matrix3::from_row_slice(&pose[..9]));
            let noise = Vector3::from_fn(|_, _| normal.sample(&mut random));
            let rotation =
                UnitQuaternion::from_rotation_matrix(&matrix) * UnitQuaternion::new(noise);
            let sign = if random.next_u32() % 2 == 0 { 1.0 } else { -1.0 };
            rotation.into_inner() * sign
        });
        rotations.push(turned.collect());
    }
    let names: Vec<&str> = mechanism.bodies.iter().map(|body| body.name.as_str()).collect();
    let head = format!("# synthetic: simulated motion of {}\n", mechanism.name);
    output::write(&arguments.quaternions, &format!("{head}{}", write(&names, &t, &rotations)))
}
