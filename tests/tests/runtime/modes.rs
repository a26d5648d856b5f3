//! Small motions about rest against textbooks and against the full motion.

use lamc_tests::compare::{keep_largest, largest};
use std::f64::consts::TAU;

use lamc::program::{Function, FunctionKind, Interpreter};
use lamc_runtime::{
    Integrator, LinearizationMut, Mechanism, State, assemble, equilibrium, linearize, project,
};
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile, compile_text, dopri5, workspace};
use nalgebra::{DMatrix, DVector};

/// K, D, B and the basis about a state of rest.
struct Linear {
    basis: DMatrix<f64>,
    stiffness: DMatrix<f64>,
    damping: DMatrix<f64>,
    inputs: DMatrix<f64>,
}

fn linear(system: &Interpreter, q: &[f64]) -> Linear {
    let (n, inputs) = (q.len(), system.dimensions().inputs);
    let (mut t, mut k, mut d) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n * n]);
    let mut b = vec![0.0; n * inputs];
    let out =
        LinearizationMut { basis: &mut t, stiffness: &mut k, damping: &mut d, inputs: &mut b };
    let m = linearize(system, 0.0, q, &mut system.workspace(), out).unwrap();
    Linear {
        basis: DMatrix::from_row_slice(m, n, &t[..m * n]).transpose(),
        stiffness: DMatrix::from_row_slice(m, m, &k[..m * m]),
        damping: DMatrix::from_row_slice(m, m, &d[..m * m]),
        inputs: DMatrix::from_row_slice(m, inputs, &b[..m * inputs]),
    }
}

fn rest(system: &Interpreter) -> Vec<f64> {
    let n = system.dimensions().coordinates;
    let mut q = system.initial().q;
    let pinned: Vec<bool> = (0..n).map(|joint| system.is_pinned(joint)).collect();
    assemble(system, 0.0, &mut q, &pinned, &mut system.workspace()).unwrap();
    assert!(equilibrium(system, 0.0, &mut q, &mut system.workspace()).unwrap().stable);
    q
}

/// Two equal point masses on strings of 0.2 m: frequencies sqrt((2 -+ sqrt 2) g / l).
const DOUBLE: &str = "
gravity: [0, -9.81, 0]
bodies:
  base: { fixed: true }
  upper: { mass: 0.3, com: [0, -0.2, 0], inertia: [[1e-12, 0, 0], [0, 1e-12, 0], [0, 0, 1e-12]] }
  lower: { mass: 0.3, com: [0, -0.4, 0], inertia: [[1e-12, 0, 0], [0, 1e-12, 0], [0, 0, 1e-12]] }
inputs: [push]
joints:
  j0: { bodies: [base, upper], axis: [[0, 0], [1, 0]] }
  j1: { bodies: [upper, lower], axis: [[0, -0.2], [1, -0.2]], torque: push }
";

#[test]
fn a_double_pendulum() {
    let compiled = compile_text(DOUBLE);
    let system = Interpreter::new(&compiled.program);
    let q = rest(&system);
    assert!(q.iter().all(|q| q.abs() < 1e-12));
    let linear = linear(&system, &q);
    let mut squares: Vec<f64> = linear.stiffness.symmetric_eigenvalues().iter().copied().collect();
    squares.sort_by(f64::total_cmp);
    for (square, factor) in squares.iter().zip([2.0 - 2.0_f64.sqrt(), 2.0 + 2.0_f64.sqrt()]) {
        let expected = factor * 9.81 / 0.2;
        assert!((square - expected).abs() < 1e-8 * expected, "{square} is not {expected}");
    }
    assert!(largest(&linear.damping) < 1e-12);
    // T^T M T = 1 and B = T^T e_1: a torque between the two.
    // m l^2 (5, 2; 2, 1) in relative angles.
    let mass = DMatrix::from_row_slice(2, 2, &[5.0, 2.0, 2.0, 1.0]) * (0.3 * 0.2 * 0.2);
    let unit = linear.basis.transpose() * mass * &linear.basis;
    assert!(largest(&(unit - DMatrix::identity(2, 2))) < 1e-8);
    let column = linear.basis.transpose() * DVector::from_vec(vec![0.0, 1.0]);
    assert!(largest(&(linear.inputs.column(0) - column)) < 1e-9);
}

/// exp(A t) x for dx/dt = A x.
fn propagate(linear: &Linear, z: &DVector<f64>, t: f64) -> DVector<f64> {
    let d = z.len();
    let mut a = DMatrix::zeros(2 * d, 2 * d);
    a.view_mut((0, d), (d, d)).copy_from(&DMatrix::identity(d, d));
    a.view_mut((d, 0), (d, d)).copy_from(&-&linear.stiffness);
    a.view_mut((d, d), (d, d)).copy_from(&-&linear.damping);
    let mut x = DVector::zeros(2 * d);
    x.rows_mut(0, d).copy_from(z);
    ((a * t).exp() * x).rows(0, d).into_owned()
}

/// The six-bar, let go a hair's breadth beside its rest, moves as its linear system says; and so
/// does the Miura sheet, with 23 closure equations and one freedom.
#[test]
fn motions_near_rest() {
    for name in ["sixbar", "miura"] {
        let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
        let system = Interpreter::new(&compiled.program);
        let q = rest(&system);
        let linear = linear(&system, &q);
        let d = linear.basis.ncols();
        assert_eq!(d, compiled.topology.mobility, "{name}");
        let z = DVector::from_fn(d, |i, _| (1.0 + i as f64).sin());
        let step = &linear.basis * &z;
        let scale = 1e-5 / largest(&step);
        let mut state = State { t: 0.0, q: q.clone(), u: vec![0.0; q.len()] };
        for (q, s) in state.q.iter_mut().zip(step.iter()) {
            *q += scale * s;
        }
        let mut workspace = system.workspace();
        project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
        let mut integrator = dopri5(&system, 1e-12);
        let mut worst = 0.0_f64;
        for sample in 1..=10 {
            let t = 0.02 * f64::from(sample);
            integrator.run(&system, &mut state, t, |_| ()).unwrap();
            let expected = &linear.basis * propagate(&linear, &(&z * scale), t);
            for i in 0..q.len() {
                worst = keep_largest(worst, (state.q[i] - q[i] - expected[i]).abs());
            }
        }
        println!("{name}: {worst:e} rad of 1e-5");
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}

/// The stiffness of sheets is the curvature of the potential energy along the closure, by differences, and each hinge
/// adds its damper.
#[test]
fn sheets_about_rest() {
    const DAMPER: f64 = 2e-6;
    let mut random = Random::new(5);
    for (name, text) in [("miura 6x6", miura(6, 6)), ("yoshimura 4x5", yoshimura(4, 5))] {
        let compiled = compile_text(&text);
        let system = Interpreter::new(&compiled.program);
        let q = rest(&system);
        let linear = linear(&system, &q);
        let d = linear.basis.ncols();
        assert_eq!(d, compiled.topology.mobility, "{name}");
        let expected = linear.basis.transpose() * &linear.basis * DAMPER;
        let error = largest(&(&linear.damping - &expected)) / largest(&expected);
        assert!(error < 1e-9, "{name}: {error:e}");
        // From state to state along the closure, by steps of a thousandth of a radian.
        let potential = |step: &DVector<f64>| {
            let mut moved: Vec<f64> = q.iter().zip(step).map(|(q, step)| q + step).collect();
            let mut u = vec![0.0; q.len()];
            project(&system, 0.0, &mut moved, &mut u, &mut system.workspace()).unwrap();
            system.energy(0.0, &moved, &u).unwrap().potential
        };
        for _ in 0..10 {
            let z = DVector::from_fn(d, |_, _| random.range(-1.0, 1.0));
            let step = &linear.basis * &z;
            let scale = 1e-3 / largest(&step);
            let at = |k: f64| potential(&(&step * (k * scale)));
            let second = -at(2.0) + 16.0 * at(1.0) - 30.0 * at(0.0) + 16.0 * at(-1.0) - at(-2.0);
            let curvature = second / (12.0 * scale * scale);
            let stiffness = (z.transpose() * &linear.stiffness * &z)[0];
            let error = (stiffness - curvature).abs() / curvature;
            assert!(error < 1e-6, "{name}: {stiffness} is not {curvature} ({error:e})");
        }
    }
}

/// Folded, and not at rest, where forces and the closure's own change with each other: elimination finds the directions and the forces
/// along them that a decomposition finds. The directions themselves may be others, T R with an orthogonal R.
#[test]
fn elimination_and_decomposition_agree_away_from_rest() {
    for (name, text) in [("miura 6x6", miura(6, 6)), ("yoshimura 4x5", yoshimura(4, 5))] {
        let compiled = compile_text(&text);
        let system = Interpreter::new(&compiled.program);
        let mut decomposed = compiled.program.clone();
        for kind in [FunctionKind::Reduction, FunctionKind::ProjectionReduction] {
            decomposed.functions[kind as usize] = Function::none(kind);
        }
        let decomposed = Interpreter::new(&decomposed);
        let mut q = system.initial().q;
        let pinned = vec![false; q.len()];
        assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()).unwrap();
        let all = |system: &Interpreter| {
            let Linear { basis, stiffness, damping, .. } = linear(system, &q);
            [&basis * stiffness * basis.transpose(), &basis * damping * basis.transpose()]
        };
        for (found, expected) in all(&system).iter().zip(&all(&decomposed)) {
            let error = largest(&(found - expected)) / largest(expected);
            println!("{name}: {error:.1e}");
            assert!(error < 1e-10, "{name}: {error:e}");
        }
    }
}

#[test]
fn a_damped_swing_by_hand() {
    // I = 3e-7 + m l^2 = 1.1e-6 kg m^2; k + m g l cos q at rest.
    let text = "
gravity: [0, -9.81, 0]
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints: { hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: 1e-3, damping: 4e-6 } }
";
    let compiled = compile_text(text);
    let system = Interpreter::new(&compiled.program);
    let q = rest(&system);
    let linear = linear(&system, &q);
    let inertia = 3e-7 + 0.002 * 0.02 * 0.02;
    let stiffness = (1e-3 + 0.002 * 9.81 * 0.02 * q[0].cos()) / inertia;
    assert!((linear.stiffness[0] - stiffness).abs() < 1e-9 * stiffness);
    assert!((linear.damping[0] - 4e-6 / inertia).abs() < 1e-9);
    let period = TAU / (stiffness - (2e-6 / inertia).powi(2)).sqrt();
    let z = DVector::from_vec(vec![1.0]);
    // After a period it is where the damping leaves it.
    let there = propagate(&linear, &z, period)[0];
    assert!((there - (-2e-6 / inertia * period).exp()).abs() < 1e-9);
}
