//! What the gradient of a motion costs.
//!
//! ```text
//! cargo run -p lamc-tests --bin gradients                       a table of mechanisms
//! cargo run -p lamc-tests --bin gradients -- MODEL EXPORT       one model from the first state of `peers export`, as JSON
//! ```
//!
//! The motion has 200 steps of the classical Runge-Kutta method. Its gradient is that of the sum of the last q and u by the initial
//! state and all parameters. Times are medians of one run, in which motions and gradients take turns.

use std::fmt::Write as _;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use lamc::pipeline::Compiled;
use lamc_runtime::{Rk4, State};
use lamc_tests::{compile, compile_text, workspace};
use lamc_workbench::adjoint::{Course, Differentiated, Gradient, Method, Schedule, Slopes};
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::{Asked, start};
use serde_json::{Value, json};

const STEPS: usize = 200;
const ROUNDS: usize = 201;

/// The length of the motions, s.
const DURATION: f64 = 0.02;

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    match arguments.iter().map(String::as_str).collect::<Vec<_>>()[..] {
        [] => table(),
        [model, export] => println!("{}", one(Path::new(model), Path::new(export))),
        _ => {
            eprintln!("usage: gradients [MODEL EXPORT]");
            std::process::exit(2)
        }
    }
}

fn table() {
    println!(
        "{:24} {:>10} {:>10} {:>10} {:>7}",
        "200 steps", "parameters", "motion", "gradient", "ratio"
    );
    for name in ["pendulum", "triple_pendulum", "sixbar", "linkage"] {
        row(name, &compile(&workspace().join(format!("examples/{name}.yaml"))));
    }
    row("six-bar, 50 parameters", &compile_text(&sixbar()));
}

/// Times, the last state and the gradient of a model's motion.
fn one(model: &Path, export: &Path) -> Value {
    let compiled = compile(model);
    let text = std::fs::read_to_string(export).unwrap_or_else(|error| panic!("{error}"));
    let export: Value = serde_json::from_str(&text).unwrap_or_else(|error| panic!("{error}"));
    let numbers = |key: &str| -> Vec<f64> {
        let values = export["states"][0][key].as_array();
        values.into_iter().flatten().filter_map(Value::as_f64).collect()
    };
    let system = Jit::new(&compiled.program);
    let case = Case::new(&compiled, &system, State { t: 0.0, q: numbers("q"), u: numbers("u") });
    let [motion, gradient] = case.times();
    let State { q, u, .. } = case.motion();
    let Gradient { parameters, q: by_q, u: by_u, .. } = case.gradient();
    json!({
        "motion": motion, "gradient": gradient, "duration": DURATION, "steps": STEPS, "q": q, "u": u,
        "by_parameters": parameters, "by_q": by_q, "by_u": by_u,
    })
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
    let [motion, gradient] = Case::new(compiled, &system, start).times();
    println!(
        "{name:24} {:10} {:7.1} us {:7.1} us {:7.2}",
        system.parameters().len(),
        1e6 * motion,
        1e6 * gradient,
        gradient / motion
    );
}

/// A motion and its gradient.
struct Case<'s> {
    system: &'s Jit,
    differentiated: Differentiated,
    start: State<Vec<f64>, f64>,
}

impl<'s> Case<'s> {
    fn new(compiled: &Compiled, system: &'s Jit, start: State<Vec<f64>, f64>) -> Self {
        let differentiated = Differentiated::new(&compiled.program, system.clone());
        differentiated.compile();
        Self { system, differentiated, start }
    }

    /// The last state of the motion as the runtime integrates it.
    fn motion(&self) -> State<Vec<f64>, f64> {
        let mut state = black_box(&self.start).clone();
        Rk4::new(self.system)
            .run(self.system, &mut state, DURATION, DURATION / STEPS as f64, |_| ())
            .unwrap_or_else(|error| panic!("{error}"));
        state
    }

    /// The gradient, with the motion that it needs.
    fn gradient(&self) -> Gradient {
        let ends = vec![1.0; self.start.q.len() + self.start.u.len()];
        let slopes = Slopes { states: vec![vec![0.0; ends.len()], ends], ..Slopes::default() };
        let schedule =
            Schedule { method: Method::Rk4, samples: &[DURATION], steps: STEPS, inputs: &[] };
        Course::new(&self.differentiated, black_box(&self.start).clone(), schedule)
            .and_then(|course| course.pull(&[slopes]))
            .unwrap_or_else(|error| panic!("{}", error.describe(self.system.interface())))
            .remove(0)
    }

    /// The median times of the motion and of the gradient, s.
    fn times(&self) -> [f64; 2] {
        let (mut motions, mut gradients) = (Vec::new(), Vec::new());
        for _ in 0..ROUNDS {
            let begin = Instant::now();
            black_box(self.motion());
            motions.push(begin.elapsed().as_secs_f64());
            let begin = Instant::now();
            black_box(self.gradient());
            gradients.push(begin.elapsed().as_secs_f64());
        }
        [motions, gradients].map(median)
    }
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
