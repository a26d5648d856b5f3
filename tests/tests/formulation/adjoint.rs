//! Derivatives of motions in reverse mode against the integrators of the runtime in dual numbers.

use lamc::arithmetic::largest;
use lamc::pipeline::Compiled;
use lamc_runtime::{
    Integrator as _, Mechanism as _, Rk4, Rodas, SemiImplicitEuler, State, acceleration, project,
};
use lamc_tests::compare::keep_largest;
use lamc_tests::dual::{Dual, DualSystem};
use lamc_tests::{compile, compile_text, sheets, workspace};
use lamc_workbench::adjoint::{Course, Differentiated, Gradient, Method, Schedule, Slopes};
use lamc_workbench::execution::Jit;
use lamc_workbench::simulation::{Asked, start};
use nalgebra::{DMatrix, DVector};

/// Steps of the motions.
const STEPS: usize = 200;

/// Derivatives below this are zero, SI.
const SMALL: f64 = 1e-6;

/// What a motion may depend on.
#[derive(Clone, Copy, Debug)]
enum By {
    Q(usize),
    U(usize),
    Parameter(usize),
    Input(usize),
}

/// A direction in which the start, the parameters and the inputs change; loops stay closed.
struct Direction {
    q: Vec<f64>,
    u: Vec<f64>,
    parameters: Vec<f64>,
    inputs: Vec<f64>,
}

/// A mechanism with the start of a motion.
struct Case<'c> {
    compiled: &'c Compiled,
    system: Jit,
    start: State<Vec<f64>, f64>,
    method: Method,
    duration: f64,
}

fn lift(values: &[f64], changes: &[f64]) -> Vec<Dual> {
    values.iter().zip(changes).map(|(value, change)| Dual(*value, *change)).collect()
}

impl Case<'_> {
    fn dual(&self, direction: &Direction) -> DualSystem<'_> {
        DualSystem::new(
            &self.compiled.program,
            lift(self.system.parameters(), &direction.parameters),
            lift(self.system.inputs(), &direction.inputs),
        )
    }

    /// The change of the residuals of the closure and of driven joints; their Jacobian, and its change.
    fn closure(&self, direction: &Direction) -> (DVector<f64>, [DMatrix<f64>; 2]) {
        let dual = self.dual(direction);
        let (n, loops) = (self.start.u.len(), self.compiled.program.interface.loops.len());
        let mut residual = vec![Dual::default(); 9 * loops];
        let mut jacobian = vec![Dual::default(); 9 * loops * n];
        let q = lift(&self.start.q, &direction.q);
        dual.write_closure(&q, &mut residual, &mut jacobian).unwrap();
        let size = dual.size();
        dual.drives(Dual(self.start.t, 0.0), |drive| {
            residual.push(size * (q[drive.joint] - drive.position));
            let row = |joint: usize| if joint == drive.joint { size } else { Dual::default() };
            jacobian.extend((0..n).map(row));
        });
        let rows = residual.len();
        let part =
            |f: fn(&Dual) -> f64| DMatrix::from_row_iterator(rows, n, jacobian.iter().map(f));
        let residual = DVector::from_iterator(rows, residual.iter().map(|it| it.1));
        (residual, [part(|it| it.0), part(|it| it.1)])
    }

    fn is_driven(&self) -> bool {
        !self.compiled.program.interface.driven().is_empty()
    }

    /// The direction of a change, and q as it follows on the nearest way that keeps loops closed and driven joints where they
    /// should be.
    fn closed(&self, by: By) -> Direction {
        let unit = |length: usize, index: Option<usize>| -> Vec<f64> {
            (0..length).map(|k| f64::from(u8::from(index == Some(k)))).collect()
        };
        let (nq, nu) = (self.start.q.len(), self.start.u.len());
        let (np, ni) = (self.system.parameters().len(), self.system.inputs().len());
        let [q, u, p, i] = match by {
            By::Q(index) => [Some(index), None, None, None],
            By::U(index) => [None, Some(index), None, None],
            By::Parameter(index) => [None, None, Some(index), None],
            By::Input(index) => [None, None, None, Some(index)],
        };
        let mut direction = Direction {
            q: unit(nq, q),
            u: unit(nu, u),
            parameters: unit(np, p),
            inputs: unit(ni, i),
        };
        let (residual, [jacobian, _]) = self.closure(&direction);
        if residual.is_empty() {
            return direction;
        }
        let inverse = jacobian.clone().pseudo_inverse(1e-7 * jacobian.norm()).unwrap();
        // Coordinates of free bodies are not in loops here.
        let step = &inverse * residual;
        direction.q.iter_mut().zip(&step).for_each(|(q, step)| *q -= step);
        if self.is_driven() {
            // Speeds that are right but for rounding are left as they are, with their derivatives: by hand.
            let (_, [_, change]) = self.closure(&direction);
            let speeds = DVector::from_column_slice(&self.start.u);
            let mut rates = jacobian * DVector::from_column_slice(&direction.u) + change * speeds;
            let mut row = 9 * self.compiled.program.interface.loops.len();
            let dual = self.dual(&direction);
            dual.drives(Dual(self.start.t, 0.0), |drive| {
                rates[row] -= dual.size().0 * drive.speed.1;
                row += 1;
            });
            let step = inverse * rates;
            direction.u.iter_mut().zip(&step).for_each(|(u, step)| *u -= step);
        }
        direction
    }

    /// The state at the end, in dual numbers.
    fn end(&self, direction: &Direction) -> Vec<Dual> {
        let dual = self.dual(direction);
        let (t, duration) = (self.start.t, self.duration);
        let mut state = State {
            t: Dual(t, 0.0),
            q: lift(&self.start.q, &direction.q),
            u: lift(&self.start.u, &direction.u),
        };
        if !self.is_driven() {
            project(&dual, state.t, &mut state.q, &mut state.u, &mut dual.workspace()).unwrap();
        }
        let length = Dual(duration / STEPS as f64, 0.0);
        let until = Dual(t + duration, 0.0);
        match self.method {
            Method::Rk4 => Rk4::new(&dual).run(&dual, &mut state, until, length, |_| ()),
            Method::Euler => {
                SemiImplicitEuler::new(&dual).run(&dual, &mut state, until, length, |_| ())
            }
            Method::Rodas => {
                let mut rodas = Rodas::new(&dual);
                // Every step is accepted.
                (rodas.relative, rodas.absolute) = (Dual(1e9, 0.0), Dual(1e9, 0.0));
                (rodas.max_step, rodas.min_step) = (length, Dual(0.999 * length.0, 0.0));
                (1..=STEPS).try_for_each(|step| {
                    let until = t + duration * step as f64 / STEPS as f64;
                    rodas.run(&dual, &mut state, Dual(until, 0.0), |_| ())
                })
            }
        }
        .unwrap();
        state.q.into_iter().chain(state.u).collect()
    }
}

/// The derivative along a direction.
fn along(gradient: &Gradient, direction: &Direction) -> f64 {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    dot(&gradient.q, &direction.q)
        + dot(&gradient.u, &direction.u)
        + dot(&gradient.parameters, &direction.parameters)
        + gradient.inputs.iter().map(|row| dot(row, &direction.inputs)).sum::<f64>()
}

/// Compares the derivatives of a weighted sum of the last state, each relative to itself.
fn check(name: &str, compiled: &Compiled, method: Method, duration: f64) {
    let mut system = Jit::new(&compiled.program);
    let inputs: Vec<f64> = (0..system.inputs().len()).map(|i| 1e-4 * (1.0 + i as f64)).collect();
    system.set_inputs(&inputs);
    let start = start(&compiled.topology, &system, &Asked::of(&system, &[]), |_| ()).unwrap();
    let differentiated = Differentiated::new(&compiled.program, system.clone());
    let times: Vec<f64> = (1..=4).map(|part| duration * f64::from(part) / 4.0).collect();
    let schedule = Schedule { method, samples: &times, steps: STEPS / 4, inputs: &[] };
    let course = Course::new(&differentiated, start.clone(), schedule);
    let course =
        course.unwrap_or_else(|error| panic!("{name}: {}", error.describe(system.interface())));
    let (nq, nu) = (start.q.len(), start.u.len());
    let weights: Vec<f64> = (0..nq + nu).map(|k| (1.0 + 3.0 * k as f64).sin()).collect();
    let mut by_samples = vec![vec![0.0; nq + nu]; times.len() + 1];
    by_samples[times.len()].copy_from_slice(&weights);
    let gradient = &course.pull(&[Slopes { states: by_samples, ..Slopes::default() }]).unwrap()[0];
    // Without pins, assembly moves a state by the shortest way, as the directions here do.
    let pinned = vec![false; system.interface().joints.len()];
    let whole = differentiated.assembled(&start, &pinned, gradient).unwrap();
    let interface = system.interface();
    let directions = (0..nq)
        .map(By::Q)
        .chain((0..nu).map(By::U))
        .chain((0..interface.parameters.len()).map(By::Parameter))
        .chain((0..interface.inputs.len()).map(By::Input));
    let last = course.samples.last().unwrap();
    let case = Case { compiled, system: system.clone(), start, method, duration };
    let mut worst = 0.0_f64;
    for by in directions {
        let direction = case.closed(by);
        let end = case.end(&direction);
        for (dual, own) in end.iter().zip(last.q.iter().chain(&last.u)) {
            let error = (dual.0 - own).abs();
            assert!(error <= 1e-9 * (1.0 + own.abs()), "{name}: {} is not {own}", dual.0);
        }
        let parts: Vec<f64> = end.iter().zip(&weights).map(|(it, weight)| it.1 * weight).collect();
        let expected: f64 = parts.iter().sum();
        let scale = largest(&parts).max(SMALL);
        let entry = match by {
            By::Q(index) => whole.q[index],
            By::U(index) => whole.u[index],
            By::Parameter(index) => whole.parameters[index],
            By::Input(index) => whole.inputs.iter().map(|row| row[index]).sum(),
        };
        let entry = (!case.is_driven()).then_some(entry);
        for found in [Some(along(gradient, &direction)), entry].into_iter().flatten() {
            let error = (found - expected).abs() / scale;
            if error > 1e-9 {
                println!("{name}: {by:?}: {found} is not {expected}");
            }
            worst = keep_largest(worst, error);
        }
    }
    println!("{name}, {method:?}: {worst:e}");
    assert!(worst < 1e-9, "{name}: {worst:e}");
}

#[test]
fn motions_of_the_examples() {
    for (name, duration) in
        [("pendulum", 0.4), ("triple_pendulum", 0.2), ("sixbar", 0.2), ("fourbar", 0.02)]
    {
        let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
        check(name, &compiled, Method::Rk4, duration);
        check(name, &compiled, Method::Euler, duration);
        check(name, &compiled, Method::Rodas, duration);
    }
}

#[test]
fn sheets_and_free_bodies() {
    for (name, text) in
        [("Miura 3x3", sheets::miura(3, 3)), ("Yoshimura 2x3", sheets::yoshimura(2, 3))]
    {
        check(name, &compile_text(&text), Method::Rk4, 0.02);
    }
    for name in ["crawler", "jumper"] {
        let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
        check(name, &compiled, Method::Rk4, 0.01);
        check(name, &compiled, Method::Euler, 0.01);
    }
}

/// Numbers of the drawing that follow from parameters.
#[test]
fn a_drawing_with_parameters() {
    let compiled = compile(&workspace().join("examples/linkage.yaml"));
    check("linkage", &compiled, Method::Rk4, 0.02);
    check("linkage", &compiled, Method::Rodas, 0.02);
}

/// A prescribed angle that depends on a parameter, in a loop and without.
#[test]
fn driven_joints() {
    let text = std::fs::read_to_string(workspace().join("examples/sixbar.yaml")).unwrap();
    let joint = "axis: [[9.3319, -29.3065], [44.3319, -89.9283]], z: 3.075,";
    assert!(text.contains(joint));
    let drive = format!("{joint} drive: \"angle + rise*sin(40*t)\",");
    let text = text.replace(joint, &drive);
    let text = format!("{text}\nparameters: {{ angle: 0.3, rise: 0.2 }}\n");
    check("driven six-bar", &compile_text(&text), Method::Rk4, 0.05);
    check("driven six-bar", &compile_text(&text), Method::Euler, 0.05);
}

/// Next to the flat state, some 0.01 rad from it, where elimination does not serve. The runtime leaves speeds there that are
/// right to within what the angles are uncertain by, so that its own derivatives are only good to 1e-7. Instead: a
/// motion that begins later is the same motion later, and the derivative by a stiffness against differences.
#[test]
fn next_to_the_flat_state() {
    let text = std::fs::read_to_string(workspace().join("examples/fourbar.yaml")).unwrap();
    let stiffness = "stiffness: 10.0,";
    assert!(text.contains(stiffness));
    let text = text.replace(stiffness, "stiffness: k,") + "\nparameters: { k: 10 }\n";
    let compiled = compile_text(&text);
    let system = Jit::new(&compiled.program);
    let mut state = start(&compiled.topology, &system, &Asked::of(&system, &[]), |_| ()).unwrap();
    Rk4::new(&system).run(&system, &mut state, 0.028, 1e-4, |_| ()).unwrap();
    let end = state.t + 0.002;
    let course = |k: f64| {
        let mut system = system.clone();
        system.set_parameter("k", k).unwrap();
        let differentiated = Differentiated::new(&compiled.program, system.clone());
        let schedule = Schedule { method: Method::Rk4, samples: &[end], steps: STEPS, inputs: &[] };
        let course = Course::new(&differentiated, state.clone(), schedule);
        let course = course.unwrap();
        let n = state.q.len();
        let weights: Vec<f64> = (0..2 * n).map(|k| (1.0 + 3.0 * k as f64).sin()).collect();
        let gradient = course
            .pull(&[Slopes {
                states: vec![vec![0.0; 2 * n], weights.clone()],
                ..Slopes::default()
            }])
            .unwrap()
            .remove(0);
        let sum = |q: &[f64], u: &[f64]| -> f64 {
            q.iter().chain(u).zip(&weights).map(|(x, weight)| x * weight).sum()
        };
        let rate = |state: &State<Vec<f64>, f64>| {
            let mut rate = vec![0.0; n];
            let workspace = &mut system.workspace();
            acceleration(&system, state.t, &state.q, &state.u, workspace, &mut rate).unwrap();
            rate
        };
        let [first, last] = [&course.samples[0], &course.samples[1]];
        let later = sum(&last.u, &rate(last));
        let moved =
            Direction { q: first.u.clone(), u: rate(first), parameters: vec![0.0], inputs: vec![] };
        (sum(&last.q, &last.u), gradient.parameters[0], later, along(&gradient, &moved))
    };
    let (_, by_stiffness, later, moved) = course(10.0);
    println!("{later} {moved} {by_stiffness}");
    assert!(later.abs() > 1.0 && by_stiffness.abs() > 1e-6);
    assert!((later - moved).abs() <= 1e-9 * later.abs(), "{moved} is not {later}");
    // Large, because the motion is nearly linear in the stiffness, and its numbers have rounding errors of 1e-13.
    let h = 0.5;
    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| course(10.0 + k * h).0);
    let expected = (a - 8.0 * b + 8.0 * c - d) / (12.0 * h);
    let error = (by_stiffness - expected).abs() / expected.abs();
    assert!(error < 1e-9, "{by_stiffness} is not {expected}");
}
