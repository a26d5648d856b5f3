//! What the gradient of a motion costs: `cargo run -p lamc-tests --bin gradients`.
//!
//! The motion has 200 steps of the classical Runge-Kutta method. Its gradient is that of a function of the last state by the initial
//! state and all parameters. Times are medians of one run, in which motions and gradients take turns.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Instant;

use lamc::pipeline::Compiled;
use lamc_runtime::{Rk4, State};
use lamc_tests::{compile, compile_text, workspace};
use lamc_workbench::adjoint::{Course, Differentiated, Method, Schedule};
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::{Asked, start};

const STEPS: usize = 200;
const ROUNDS: usize = 201;

fn main() {
    println!(
        "{:24} {:>10} {:>10} {:>10} {:>7}",
        "200 steps", "parameters", "motion", "gradient", "ratio"
    );
    for name in ["pendulum", "triple_pendulum", "sixbar", "linkage"] {
        row(name, &compile(&workspace().join(format!("examples/{name}.yaml"))));
    }
    row("six-bar, 50 parameters", &compile_text(&sixbar()));
}

/// The six-bar with 50 parameters: springs, dampers, angles of rest, and two masses on each plate.
fn sixbar() -> String {
    let path = workspace().join("examples/sixbar.yaml");
    let mut text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{error}"));
    let mut parameters = String::from("parameters:\n");
    let fixed = "stiffness: 0.0114, damping: 3.5e-06";
    for joint in 0..6 {
        let torque = if joint < 2 { format!(", torque: t{joint}") } else { String::new() };
        let own = format!("stiffness: k{joint}, damping: b{joint}, rest: r{joint}{torque}");
        text = text.replacen(fixed, &own, 1);
        let _ = writeln!(parameters, "  k{joint}: 0.0114\n  b{joint}: 3.5e-6\n  r{joint}: 0.01");
        if joint < 2 {
            let _ = writeln!(parameters, "  t{joint}: 1e-5");
        }
    }
    for body in ["west", "south_west", "south", "south_east", "east"] {
        let mut masses = String::new();
        for index in 0..2 {
            let name = format!("{body}_{index}");
            let _ = write!(masses, "{{ mass: m_{name}, at: [x_{name}, y_{name}, 0] }}, ");
            let _ = writeln!(parameters, "  m_{name}: 1e-4\n  x_{name}: 0.01\n  y_{name}: -0.02");
        }
        let (before, after) =
            (format!("  {body}:\n"), format!("  {body}:\n    point_masses: [{masses}]\n"));
        assert!(text.contains(&before), "the six-bar has no body {body}");
        text = text.replacen(&before, &after, 1);
    }
    format!("{text}\n{parameters}")
}

fn row(name: &str, compiled: &Compiled) {
    let system = Jit::new(&compiled.program);
    let start = start(&compiled.topology, &system, &Asked::of(&system, &[]), |_| ());
    let start = start.unwrap_or_else(|error| panic!("{name}: {error}"));
    let differentiated = Differentiated::new(&compiled.program, system.clone());
    differentiated.compile();
    let duration = 0.02;
    let (nq, nu) = (start.q.len(), start.u.len());
    let weights = [vec![vec![0.0; nq + nu], vec![1.0; nq + nu]]];
    let samples = [duration];
    let schedule = Schedule { method: Method::Rk4, samples: &samples, steps: STEPS, inputs: &[] };
    let motion = |state: &State<Vec<f64>, f64>| {
        let mut state = state.clone();
        let mut rk4 = Rk4::new(&system);
        rk4.run(&system, &mut state, duration, duration / STEPS as f64, |_| ())
            .unwrap_or_else(|error| panic!("{name}: {error}"));
        state
    };
    let gradient = |state: &State<Vec<f64>, f64>| {
        Course::new(&differentiated, state.clone(), schedule)
            .and_then(|course| course.pull(&weights))
            .unwrap_or_else(|error| panic!("{name}: {}", error.describe(system.interface())))
    };
    let (mut motions, mut gradients) = (Vec::new(), Vec::new());
    for _ in 0..ROUNDS {
        let begin = Instant::now();
        black_box(motion(black_box(&start)));
        motions.push(begin.elapsed().as_secs_f64());
        let begin = Instant::now();
        black_box(gradient(black_box(&start)));
        gradients.push(begin.elapsed().as_secs_f64());
    }
    let [motion, gradient] = [motions, gradients].map(median);
    println!(
        "{name:24} {:10} {:7.1} us {:7.1} us {:7.2}",
        system.parameters().len(),
        1e6 * motion,
        1e6 * gradient,
        gradient / motion
    );
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
