//! `lamc modes MODEL`: small motions about a state of rest.

use std::f64::consts::TAU;
use std::fmt::Write;

use clap::Args;
use lamc::backend::jit::Jit;
use lamc_runtime::{LinearizationMut, State, Stopped, System, linearize};
use nalgebra::{Complex, DMatrix, DVector};
use serde::Serialize;

use super::equilibrium::{settle, stopped};
use super::start::{Start, describe};
use super::{Failed, Outcome, fail, output};

/// Natural frequencies, damping and shapes about the state of rest downhill from the initial one.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    start: Start,
    /// Take away a force, or what drives a joint
    #[arg(long, value_name = "NAME")]
    release: Vec<String>,
    /// Print JSON, SI and radians, with the matrices of the linear system
    #[arg(long)]
    json: bool,
}

/// dx/dt = A x + B i with x = (z, dz/dt) and q = q0 + T z.
#[derive(Serialize)]
struct Linear {
    /// T, N x d.
    basis: Vec<Vec<f64>>,
    /// A, 2 d x 2 d.
    a: Vec<Vec<f64>>,
    /// B, 2 d x inputs.
    b: Vec<Vec<f64>>,
}

#[derive(Serialize)]
struct Mode {
    /// Of the eigenvalue, 1/s; its imaginary part is not negative.
    eigenvalue: [f64; 2],
    /// Undamped, Hz.
    frequency: f64,
    /// 1: just no oscillation; more: two modes without; less than 0: it grows.
    damping_ratio: f64,
    /// Of the joints, the largest made 1: real and imaginary parts.
    shape: Vec<[f64; 2]>,
}

#[derive(Serialize)]
struct Report<'a> {
    model: &'a str,
    joints: Vec<&'a str>,
    inputs: &'a [String],
    q: &'a [f64],
    stable: bool,
    modes: &'a [Mode],
    linear: &'a Linear,
}

pub fn run(arguments: &Arguments) -> Outcome {
    let compiled = arguments.start.compile(&arguments.release)?;
    let system = arguments.start.system(&compiled)?;
    let mut state = arguments.start.assembled(&system)?;
    settle(&system, &mut state)?;
    let resting = stopped(system, &mut state)?;
    let linear = linear(&resting, &state)?;
    let system = &resting.system;
    let modes = modes(&linear);
    let interface = system.interface();
    // What neither grows nor fades is stable.
    let fastest = modes.iter().map(|mode| mode.frequency * TAU).fold(0.0, f64::max);
    let rounding = 1e-9 * fastest;
    if arguments.json {
        let report = Report {
            model: &interface.name,
            joints: interface.joints.iter().map(|joint| joint.name.as_str()).collect(),
            inputs: &interface.inputs,
            q: &state.q,
            stable: modes.iter().all(|mode| mode.eigenvalue[0] <= rounding),
            modes: &modes,
            linear: &linear,
        };
        let json = serde_json::to_string_pretty(&report).map_err(fail)?;
        return output::print(&(json + "\n"));
    }
    output::print(&table(system, &state, &modes))
}

/// The motion about a state of rest.
fn linear(system: &Stopped<Jit>, state: &State<Vec<f64>, f64>) -> Result<Linear, Failed> {
    let dimensions = system.dimensions();
    let n = dimensions.coordinates;
    let (mut basis, mut stiffness, mut damping) =
        (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
    let mut inputs = vec![0.0; n * dimensions.inputs];
    let out = LinearizationMut {
        basis: &mut basis,
        stiffness: &mut stiffness,
        damping: &mut damping,
        inputs: &mut inputs,
    };
    let d = linearize(system, state.t, &state.q, &mut system.workspace(), out)
        .map_err(|error| fail(describe(&error, system.system.interface())))?;
    let below = |matrix: &[f64], row: usize| matrix[row * d..(row + 1) * d].to_vec();
    let negative = |row: Vec<f64>| row.into_iter().map(|x| -x).collect::<Vec<_>>();
    let mut a = Vec::new();
    for row in 0..d {
        let unit = (0..d).map(|k| f64::from(u8::from(k == row)));
        a.push(vec![0.0; d].into_iter().chain(unit).collect());
    }
    for row in 0..d {
        let mut line = negative(below(&stiffness, row));
        line.extend(negative(below(&damping, row)));
        a.push(line);
    }
    let mut b = vec![vec![0.0; dimensions.inputs]; d];
    b.extend(
        (0..d).map(|row| inputs[row * dimensions.inputs..(row + 1) * dimensions.inputs].to_vec()),
    );
    let basis = (0..n).map(|joint| (0..d).map(|k| basis[k * n + joint]).collect()).collect();
    Ok(Linear { basis, a, b })
}

/// Eigenvalues of A with their shapes, slowest first; of a conjugate pair the upper one.
fn modes(linear: &Linear) -> Vec<Mode> {
    let size = linear.a.len();
    if size == 0 {
        return Vec::new();
    }
    let a = DMatrix::from_fn(size, size, |i, k| linear.a[i][k]);
    let mut values: Vec<Complex<f64>> =
        balanced_eigenvalues(&a).into_iter().filter(|value| value.im >= 0.0).collect();
    values.sort_by(|x, y| x.norm().total_cmp(&y.norm()));
    values
        .into_iter()
        .map(|value| {
            let norm = value.norm();
            Mode {
                eigenvalue: [value.re, value.im],
                frequency: norm / TAU,
                damping_ratio: if norm > 0.0 { -value.re / norm } else { 0.0 },
                shape: shape(&a, value, linear),
            }
        })
        .collect()
}

/// Eigenvalues of a matrix scaled so that z and dz/dt weigh alike.
fn balanced_eigenvalues(a: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let d = a.nrows() / 2;
    let stiffness = a.view((d, 0), (d, d)).norm().sqrt();
    let rate = if stiffness > 0.0 { stiffness } else { 1.0 };
    // z in units of dz/dt / rate.
    let scaled = DMatrix::from_fn(2 * d, 2 * d, |i, k| match (i < d, k < d) {
        (true, false) => a[(i, k)] * rate,
        (false, true) => a[(i, k)] / rate,
        _ => a[(i, k)],
    });
    scaled.complex_eigenvalues().iter().copied().collect()
}

/// The joints' part in a mode, by inverse iteration.
fn shape(a: &DMatrix<f64>, value: Complex<f64>, linear: &Linear) -> Vec<[f64; 2]> {
    let size = a.nrows();
    let scale = a.norm().max(f64::MIN_POSITIVE);
    let shift = value + Complex::new(scale, scale) * 1e-12;
    let matrix = DMatrix::from_fn(size, size, |i, k| {
        let diagonal = if i == k { shift } else { Complex::ZERO };
        Complex::new(a[(i, k)], 0.0) - diagonal
    });
    let factors = matrix.lu();
    let mut vector = DVector::from_fn(size, |i, _| Complex::new(1.0 + i as f64, 0.5));
    for _ in 0..4 {
        if let Some(next) = factors.solve(&vector) {
            let norm = next.norm();
            if norm.is_finite() && norm > 0.0 {
                vector = next / Complex::new(norm, 0.0);
            }
        }
    }
    let joints: Vec<Complex<f64>> = linear
        .basis
        .iter()
        .map(|row| row.iter().zip(vector.iter()).map(|(&t, &z)| z * t).sum())
        .collect();
    let largest = joints.iter().copied().max_by(|x, y| x.norm().total_cmp(&y.norm()));
    match largest.filter(|largest| largest.norm() > 0.0) {
        Some(largest) => joints.iter().map(|x| x / largest).map(|x| [x.re, x.im]).collect(),
        None => joints.iter().map(|_| [0.0, 0.0]).collect(),
    }
}

fn table(system: &Jit, state: &State<Vec<f64>, f64>, modes: &[Mode]) -> String {
    let mut text = format!("{:<20} {:>12}", "joint", "rest deg");
    for number in 1..=modes.len() {
        let _ = write!(text, " {:>10}", format!("mode {number}"));
    }
    text.push('\n');
    for (joint, info) in system.interface().joints.iter().enumerate() {
        let _ = write!(text, "{:<20} {:>12.5}", info.name, state.q[joint].to_degrees());
        for mode in modes {
            let [re, im] = mode.shape[joint];
            let sign = if re < 0.0 { -1.0 } else { 1.0 };
            let _ = write!(text, " {:>10.4}", sign * re.hypot(im));
        }
        text.push('\n');
    }
    if modes.is_empty() {
        text.push_str("nothing can move\n");
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
