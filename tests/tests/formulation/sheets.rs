//! Sheets of many loops: the solution for independent speeds against the dense pseudo-inverse, far from the flat
//! state and near it, and how its operations grow.

use lamc::pipeline::Compiled;
use lamc::program::{FunctionKind, Interpreter};
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism, acceleration, assemble, project};
use lamc_tests::compare::{keep_largest, largest};
use lamc_tests::nine_rows::nine_rows;
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::udwadia::{Equations, cut};
use lamc_tests::{compile_text, relative_error};
use nalgebra::{DMatrix, DVector};

/// Shares of the angles at the start, 40 degrees: down to 2 degrees.
const FOLDS: [f64; 4] = [1.0, 1.4, 0.3, 0.05];

/// Random speeds, rad/s.
const SPEED: f64 = 3.0;

/// A closed state with speeds along the closure, at this share of the start's angles.
fn state(system: &Interpreter, fold: f64, random: &mut Random) -> (Vec<f64>, Vec<f64>) {
    let mut q: Vec<f64> = system.initial().q.iter().map(|q| fold * q).collect();
    let mut u: Vec<f64> = q.iter().map(|_| random.range(-SPEED, SPEED)).collect();
    let mut workspace = system.workspace();
    let pinned = vec![false; q.len()];
    assemble(system, 0.0, &mut q, &pinned, &mut workspace).unwrap();
    project(system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
    (q, u)
}

/// du/dt by M, f and rows of J of lamc, gamma of independent kinematics, and the pseudo-inverse.
fn expected(compiled: &Compiled, system: &Interpreter, q: &[f64], u: &[f64]) -> DVector<f64> {
    let (n, c, l) = (q.len(), system.dimensions().rows, system.dimensions().loops);
    let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut rows, mut gamma) = (vec![0.0; c * n], vec![0.0; c]);
    let out = EquationsMut {
        mass: &mut mass,
        forcing: &mut forcing,
        jacobian: &mut rows,
        gamma: &mut gamma,
    };
    system.write_equations(0.0, q, u, out).unwrap();
    let (mut residual, mut jacobian) = (vec![0.0; 9 * l], vec![0.0; 9 * l * n]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    let nine = nine_rows(&compiled.topology, q, u);
    let openness = (largest(&residual) / system.size()).max(4.0 * f64::EPSILON);
    let equations = Equations {
        mass: DMatrix::from_row_slice(n, n, &mass),
        forcing: DVector::from_vec(forcing),
        jacobian: &nine.selection * DMatrix::from_row_slice(9 * l, n, &jacobian),
        gamma: &nine.selection * nine.gamma,
    };
    let solution = equations.solve(cut(openness));
    assert_eq!(solution.rank, compiled.topology.rank);
    solution.acceleration
}

fn check(name: &str, text: &str, folds: &[f64]) {
    let compiled = compile_text(text);
    let system = Interpreter::new(&compiled.program);
    let reduction = compiled.topology.reduction.as_ref().expect("pivots for the sheet");
    assert_eq!(reduction.independent.len(), compiled.topology.mobility, "{name}");
    assert_eq!(reduction.pivots.len(), compiled.topology.rank, "{name}");
    let mut random = Random::new(3);
    let mut worst = 0.0_f64;
    for &fold in folds {
        let (q, u) = state(&system, fold, &mut random);
        let mut direct = vec![0.0; q.len()];
        let margin = system.write_acceleration(0.0, &q, &u, &mut direct).unwrap();
        let margin = margin.expect("straight-line code");
        assert!(margin.conditioning > 1e-4, "{name} at {fold}: {margin:?}");
        let (mut found, mut workspace) = (system.speeds(), system.workspace());
        let constraint = acceleration(&system, 0.0, &q, &u, &mut workspace, &mut found).unwrap();
        assert_eq!((constraint.rank, constraint.is_weak), (compiled.topology.rank, false));
        assert_eq!(found, direct, "{name} at {fold}: not by straight-line code");
        let expected = expected(&compiled, &system, &q, &u);
        worst = keep_largest(worst, relative_error(&found, expected.as_slice()));
    }
    println!("{name}: {worst:.1e}");
    assert!(worst < 1e-9, "{name}: {worst:e}");
}

#[test]
fn accelerations_of_miura_sheets_are_those_of_the_pseudo_inverse() {
    check("miura 3x3", &miura(3, 3), &FOLDS);
    check("miura 4x5", &miura(4, 5), &FOLDS);
    check("miura 6x6", &miura(6, 6), &FOLDS[..3]);
    check("miura 8x8", &miura(8, 8), &FOLDS[..1]);
}

#[test]
fn accelerations_of_yoshimura_sheets_are_those_of_the_pseudo_inverse() {
    check("yoshimura 3x3", &yoshimura(3, 3), &FOLDS);
    check("yoshimura 4x5", &yoshimura(4, 5), &FOLDS[..2]);
}

/// Operations of an acceleration per hinge hardly depend on the size of a Miura sheet.
#[test]
fn operations_grow_as_the_number_of_hinges() {
    let per_hinge = |n: usize| {
        let compiled = compile_text(&miura(n, n));
        let function = compiled.program.function_of(FunctionKind::Acceleration);
        function.cost().total() as f64 / compiled.topology.mechanism.joints.len() as f64
    };
    let [small, large] = [4, 10].map(per_hinge);
    println!("operations per hinge: {small:.0} of 24 hinges, {large:.0} of 180 hinges");
    assert!(large < 1.2 * small, "{large} per hinge instead of {small}");
}
