//! Derivatives of the acceleration: those of the program against dual numbers in the compiled
//! modules and against finite differences.

use lamc_tests::compare::keep_largest;

use lamc::program::Interpreter;
use lamc_generated::{fourbar::Fourbar, sixbar::Sixbar, triple_pendulum::TriplePendulum};
use lamc_runtime::{
    Arithmetic as _, Change, JacobianMut, Mechanism, acceleration, assemble, derivatives_along,
    jacobian, project,
};
use lamc_tests::dual::Dual;
use lamc_tests::random::Random;
use lamc_tests::{compile, compile_text, linkages, relative_error, workspace};

/// The Jacobian in `f64` against one dual evaluation per column, at closed states.
fn check<M, D, const N: usize>(name: &str, model: &M, dual: &D)
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; N], Speeds = [f64; N]>,
    D: Mechanism<Scalar = Dual, Coordinates = [Dual; N], Speeds = [Dual; N]>,
{
    let mut random = Random::new(7);
    let mut worst = 0.0_f64;
    for _ in 0..20 {
        let mut q: [f64; N] = std::array::from_fn(|_| random.range(-0.7, 0.7));
        let mut u: [f64; N] = std::array::from_fn(|_| random.range(-5.0, 5.0));
        let mut workspace = model.workspace();
        assemble(model, 0.0, &mut q, &[false; N], workspace.as_mut()).unwrap();
        project(model, 0.0, &mut q, &mut u, workspace.as_mut()).unwrap();
        let own = lamc_runtime::plumbing::jacobian::<M, N>(model, 0.0, &q, &u).unwrap();
        let column = |by_speed: bool, joint: usize| {
            let lift = |x: &[f64; N], moves: bool| -> [Dual; N] {
                std::array::from_fn(|i| Dual(x[i], f64::from(u8::from(moves && i == joint))))
            };
            dual.acceleration(Dual::ZERO, &lift(&q, !by_speed), &lift(&u, by_speed)).unwrap()
        };
        for (matrix, by_speed) in [(&own.dq, false), (&own.du, true)] {
            let columns: Vec<[Dual; N]> = (0..N).map(|joint| column(by_speed, joint)).collect();
            let entry = |i: usize| columns[i % N][i / N].1;
            let expected: Vec<f64> = (0..N * N).map(entry).collect();
            let error = relative_error(matrix.as_flattened(), &expected);
            worst = keep_largest(worst, error);
        }
    }
    println!("{name}: {worst:e}");
    assert!(worst < 1e-9, "{name}: {worst:e}");
}

#[test]
fn dual_numbers_through_the_compiled_modules() {
    check("six-bar", &Sixbar::<f64>::default(), &Sixbar::<Dual>::default());
    check("four-bar", &Fourbar::<f64>::default(), &Fourbar::<Dual>::default());
    let (model, dual) = (TriplePendulum::<f64>::default(), TriplePendulum::<Dual>::default());
    check("triple pendulum", &model, &dual);
}

/// Every function of the language, smooth and not, in the model's own laws.
const LAWS: &str = "
bodies:
  base: { fixed: true }
  arm: { mass: 2 g, com: [0.01, 0.002, 0], inertia: [[2e-8, 1e-9, 0], [1e-9, 3e-8, 0], [0, 0, 4e-8]] }
  hand: { mass: 1 g, com: [0.03, 0, 0.004], inertia: [[1e-8, 0, 0], [0, 2e-8, 0], [0, 0, 2e-8]] }
parameters: { k: 2e-4, p: 1.5 }
inputs: [motor]
joints:
  j0:
    bodies: [base, arm]
    axis: [[0, 0], [0.004, 0.02]]
    stiffness: k*(1 + 0.3*sin(t))
    damping: 1e-6*exp(-t)
    rest: 0.1*cos(3*t)
    torque: 1e-5*(abs(u.j1)*q.j0 + max(q.j1, u.j0) - min(q.j0, 0.2) + tanh(u.j0) + sqrt(2 + q.j1))
  j1:
    bodies: [arm, hand]
    axis: [[0.02, 0], [0.02, 0.02]]
    stiffness: k
    torque: 1e-5*((2 + q.j0)^p + (2 + u.j0)^(1 + q.j1) + tan(q.j0) + motor*q.j1/(2 + t) + 2^u.j1
            + atan2(u.j0, q.j1 - 2) + asin(q.j0*q.j1) - acos(q.j0) + atan(u.j1*t) + log(3 + u.j0)
            + sign(u.j1)*q.j1 + step(q.j0 - 0.2)*u.j0)
points: { tip: { body: hand, at: [0.05, 0.01, 0] } }
forces: { pull: { point: tip, force: [1e-4*t, 2e-4*q.j0, 3e-4*sin(u.j1)] } }
";

/// Fourth-order central differences of the acceleration along a direction.
fn difference(f: impl Fn(f64) -> Vec<f64>) -> Vec<f64> {
    let h = 2.5e-4;
    let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(|k| f(k * h));
    (0..a.len()).map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h)).collect()
}

#[test]
fn every_law_of_the_language_is_differentiated() {
    let compiled = compile_text(LAWS);
    let mut system = Interpreter::new(&compiled.program);
    system.set_input("motor", 0.7).unwrap();
    let mut random = Random::new(3);
    for _ in 0..20 {
        let t = random.range(0.0, 2.0);
        let q: Vec<f64> = (0..2).map(|_| random.range(-0.5, 0.5)).collect();
        let u: Vec<f64> = (0..2).map(|_| random.range(-1.5, 1.5)).collect();
        let at = |t: f64, q: &[f64], u: &[f64]| {
            let mut out = vec![0.0; 2];
            acceleration(&system, t, q, u, &mut system.workspace(), &mut out).unwrap();
            out
        };
        let (mut a, mut dq, mut du, mut dt) = ([0.0; 2], [0.0; 4], [0.0; 4], [0.0; 2]);
        let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
        jacobian(&system, t, &q, &u, &mut system.workspace(), out).unwrap();
        assert!(relative_error(&a, &at(t, &q, &u)) < 1e-12);
        let shifted = |x: &[f64], joint: usize, h: f64| -> Vec<f64> {
            x.iter().enumerate().map(|(i, x)| if i == joint { x + h } else { *x }).collect()
        };
        // Corners of abs, max and min and steps nearby say nothing about derivatives.
        let corners = [u[1], q[1] - u[0], q[0] - 0.2];
        if corners.iter().any(|x| x.abs() < 0.01) {
            continue;
        }
        let by_time = difference(|h| at(t + h, &q, &u));
        assert!(relative_error(&dt, &by_time) < 1e-8, "{dt:?} is not {by_time:?}");
        for joint in 0..2 {
            let by_position = difference(|h| at(t, &shifted(&q, joint, h), &u));
            let by_speed = difference(|h| at(t, &q, &shifted(&u, joint, h)));
            for (matrix, expected) in [(dq, by_position), (du, by_speed)] {
                let column = [matrix[joint], matrix[2 + joint]];
                let error = relative_error(&column, &expected);
                assert!(error < 1e-7, "{error:e}: {column:?} is not {expected:?}");
            }
        }
    }
}

/// Redundant closure rows: along the closure, against differences between closed states.
#[test]
fn derivatives_along_closures_of_every_rank() {
    for linkage in [linkages::bennett(), linkages::spatial_seven_bar(), linkages::watt()] {
        let compiled = compile_text(&linkage.text(2));
        let system = Interpreter::new(&compiled.program);
        let n = linkage.hinges.len();
        let mut random = Random::new(11);
        let mut workspace = system.workspace();
        let (mut tried, mut worst) = (0, 0.0_f64);
        while tried < 5 {
            let mut q: Vec<f64> =
                linkage.folded.iter().map(|q| q + random.range(-0.8, 0.8)).collect();
            if assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace).is_err() {
                continue;
            }
            tried += 1;
            // A closed curve through q: the direction, and states along it, projected.
            let mut direction: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
            project(&system, 0.0, &mut q, &mut direction, &mut workspace).unwrap();
            let length = direction.iter().map(|x| x * x).sum::<f64>().sqrt();
            direction.iter_mut().for_each(|x| *x /= length);
            let at = |h: f64| {
                let mut state: Vec<f64> =
                    q.iter().zip(&direction).map(|(q, d)| q + h * d).collect();
                let mut rest = vec![0.0; n];
                let mut workspace = system.workspace();
                project(&system, 0.0, &mut state, &mut rest, &mut workspace).unwrap();
                let mut out = vec![0.0; n];
                acceleration(&system, 0.0, &state, &rest, &mut workspace, &mut out).unwrap();
                out
            };
            let expected = difference(at);
            let (mut a, mut dt) = (vec![0.0; n], vec![0.0; n]);
            let (mut dq, mut du) = (vec![0.0; n * n], vec![0.0; n * n]);
            let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
            jacobian(&system, 0.0, &q, &vec![0.0; n], &mut workspace, out).unwrap();
            let along: Vec<f64> = dq
                .chunks(n)
                .map(|row| row.iter().zip(&direction).map(|(a, d)| a * d).sum())
                .collect();
            worst = keep_largest(worst, relative_error(&along, &expected));
            let rest = vec![0.0; n];
            let changes = [&direction, &rest].map(|q| Change {
                t: 0.0,
                q,
                u: &rest,
                parameters: &[],
                inputs: &[],
            });
            let mut out = vec![f64::NAN; 3 * n];
            let changes = changes.into_iter();
            derivatives_along(&system, 0.0, &q, &rest, changes, &mut workspace, &mut out).unwrap();
            assert!(relative_error(&out[..n], &a) < 1e-12, "{}", linkage.name);
            assert!(relative_error(&out[n..2 * n], &along) < 1e-9, "{}", linkage.name);
            assert!(out[2 * n..].iter().all(|slope| *slope == 0.0), "{}: {out:?}", linkage.name);
        }
        println!("{}: {worst:e}", linkage.name);
        assert!(worst < 1e-6, "{}: {worst:e}", linkage.name);
    }
}

/// The interpreter and the compiled module give the same derivatives.
#[test]
fn interpreter_and_module_agree() {
    let compiled = compile(&workspace().join("examples/sixbar.yaml"));
    let system = Interpreter::new(&compiled.program);
    let model = Sixbar::<f64>::default();
    let state = model.assembled().unwrap();
    let own = model.jacobian(0.0, &state.q, &state.u).unwrap();
    let (mut a, mut dq, mut du, mut dt) = ([0.0; 6], [0.0; 36], [0.0; 36], [0.0; 6]);
    let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
    jacobian(&system, 0.0, &state.q, &state.u, &mut system.workspace(), out).unwrap();
    assert!(relative_error(&dq, own.dq.as_flattened()) < 1e-12);
    assert!(relative_error(&du, own.du.as_flattened()) < 1e-12);
    assert_eq!(dt, [0.0; 6]);
}
