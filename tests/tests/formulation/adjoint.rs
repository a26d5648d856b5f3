//! Derivatives of motions in reverse mode against the integrators of the runtime in dual numbers.

use lamc::pipeline::Compiled;
use lamc_runtime::{Mechanism as _, Rk4, SemiImplicitEuler, State};
use lamc_tests::compare::keep_largest;
use lamc_tests::dual::{Dual, DualSystem};
use lamc_tests::{compile, compile_text, linkages, sheets, workspace};
use lamc_workbench::adjoint::{Course, Differentiated, Gradient, Method};
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::{Asked, start};

/// Steps of the motions.
const STEPS: usize = 200;

/// What a motion may depend on.
#[derive(Clone, Copy, Debug)]
enum By {
    Q(usize),
    U(usize),
    Parameter(usize),
    Input(usize),
}

/// The state at the end, in dual numbers.
fn end(
    compiled: &Compiled,
    system: &Jit,
    start: &State<Vec<f64>, f64>,
    (method, duration): (Method, f64),
    by: By,
) -> (Vec<Dual>, Vec<Dual>) {
    let lift = |values: &[f64], varied: Option<usize>| -> Vec<Dual> {
        let share = |index| f64::from(u8::from(varied == Some(index)));
        values.iter().enumerate().map(|(index, value)| Dual(*value, share(index))).collect()
    };
    let of = |by: Option<usize>| by;
    let (q, u, p, i) = match by {
        By::Q(index) => (of(Some(index)), None, None, None),
        By::U(index) => (None, Some(index), None, None),
        By::Parameter(index) => (None, None, Some(index), None),
        By::Input(index) => (None, None, None, Some(index)),
    };
    let dual =
        DualSystem::new(&compiled.program, lift(system.parameters(), p), lift(system.inputs(), i));
    let mut state =
        State { t: Dual(start.t, 0.0), q: lift(&start.q, q), u: lift(&start.u, u) };
    let length = Dual(duration / STEPS as f64, 0.0);
    let until = Dual(start.t + duration, 0.0);
    match method {
        Method::Rk4 => Rk4::new(&dual).run(&dual, &mut state, until, length, |_| ()),
        Method::Euler => SemiImplicitEuler::new(&dual).run(&dual, &mut state, until, length, |_| ()),
    }
    .unwrap();
    (state.q, state.u)
}

/// The entry of a gradient.
fn entry(gradient: &Gradient, by: By) -> f64 {
    match by {
        By::Q(index) => gradient.q[index],
        By::U(index) => gradient.u[index],
        By::Parameter(index) => gradient.parameters[index],
        By::Input(index) => gradient.inputs[index],
    }
}

/// Compares the derivatives of a weighted sum of the last state, each relative to the largest of its kind.
fn check(name: &str, compiled: &Compiled, method: Method, duration: f64) {
    let mut system = Jit::new(&compiled.program);
    let inputs: Vec<f64> = (0..system.inputs().len()).map(|i| 1e-4 * (1.0 + i as f64)).collect();
    system.set_inputs(&inputs);
    let start = start(&compiled.topology, &system, &Asked::of(&system, &[]), |_| ()).unwrap();
    let differentiated = Differentiated::new(&compiled.program, system.clone());
    let times: Vec<f64> = (1..=4).map(|part| duration * f64::from(part) / 4.0).collect();
    let course = Course::new(&differentiated, method, start.clone(), &times, STEPS / 4);
    let course = course.unwrap_or_else(|error| panic!("{name}: {}", error.describe(system.interface())));
    let (nq, nu) = (start.q.len(), start.u.len());
    let weights: Vec<f64> = (0..nq + nu).map(|k| (1.0 + 3.0 * k as f64).sin()).collect();
    let mut by_samples = vec![vec![0.0; nq + nu]; times.len() + 1];
    by_samples[times.len()].copy_from_slice(&weights);
    let gradient = course.pull(&by_samples).unwrap();
    let interface = system.interface();
    let kinds: [Vec<By>; 4] = [
        (0..nq).map(By::Q).collect(),
        (0..nu).map(By::U).collect(),
        (0..interface.parameters.len()).map(By::Parameter).collect(),
        (0..interface.inputs.len()).map(By::Input).collect(),
    ];
    let mut worst = 0.0_f64;
    for kind in kinds {
        let expected: Vec<f64> = kind
            .iter()
            .map(|by| {
                let (q, u) = end(compiled, &system, &start, (method, duration), *by);
                let last = course.samples.last().unwrap();
                for (dual, own) in q.iter().chain(&u).zip(last.q.iter().chain(&last.u)) {
                    let error = (dual.0 - own).abs();
                    assert!(error <= 1e-9 * (1.0 + own.abs()), "{name}: {} is not {own}", dual.0);
                }
                q.iter().chain(&u).zip(&weights).map(|(value, weight)| value.1 * weight).sum()
            })
            .collect();
        for (by, expected) in kind.iter().zip(&expected) {
            // Each by itself: parameters have different units.
            let scale = expected.abs().max(1e-9);
            let error = (entry(&gradient, *by) - expected).abs() / scale;
            if error > 1e-9 {
                println!("{name}: {by:?}: {} is not {expected}", entry(&gradient, *by));
            }
            worst = keep_largest(worst, error);
        }
    }
    println!("{name}, {method:?}: {worst:e}");
    assert!(worst < 1e-9, "{name}: {worst:e}");
}

#[test]
fn motions_of_the_examples() {
    for (name, duration) in [("pendulum", 0.4), ("triple_pendulum", 0.2), ("sixbar", 0.2), ("fourbar", 0.1)] {
        let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
        check(name, &compiled, Method::Rk4, duration);
        check(name, &compiled, Method::Euler, duration);
    }
}
