//! Projections of speeds onto the closure against the least change by dense matrices: weighted with M and, in straight-line code, with
//! the mass of whole plates, whose velocities are taken from their poses alone.

use lamc::pipeline::Compiled;
use lamc::program::{Interpreter, Selection};
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism, assemble, project};
use lamc_tests::compare::{keep_largest, largest_difference};
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile_text, relative_error};
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

/// Random speeds, rad/s and m/s.
const SPEED: f64 = 3.0;
/// Distance of the states whose differences are velocities, s.
const STEP: f64 = 1e-3;
/// Speed of a driven joint, rad/s.
const RATE: f64 = 0.7;

type Pose = (Matrix3<f64>, Vector3<f64>);

/// The motion of the plates at unit speed of a joint, in numbers whose squares add up to twice the kinetic energy: of each plate
/// the velocity of its centre of mass and the rate of R, times the roots of its mass and of its second moments.
fn motion(compiled: &Compiled, system: &Interpreter, q: &[f64], speed: usize) -> Vec<f64> {
    let at = |s: f64| -> Vec<Pose> {
        let mut q = q.to_vec();
        let step: Vec<f64> = (0..system.dimensions().speeds)
            .map(|place| if place == speed { s * STEP } else { 0.0 })
            .collect();
        system.advance(&mut q, &step);
        let pose =
            |x: &[f64; 12]| (Matrix3::from_row_slice(&x[..9]), Vector3::from_row_slice(&x[9..]));
        system.poses(&q).unwrap().iter().map(pose).collect()
    };
    let [far_before, before, after, far_after] = [-2.0, -1.0, 1.0, 2.0].map(at);
    let mut numbers = Vec::new();
    for (i, body) in compiled.topology.mechanism.bodies.iter().enumerate() {
        let properties = &body.mass_properties;
        let [far_before, before, after, far_after] =
            [&far_before[i], &before[i], &after[i], &far_after[i]];
        let turn = ((after.0 - before.0) * 8.0 - far_after.0 + far_before.0) / (12.0 * STEP);
        let shift = ((after.1 - before.1) * 8.0 - far_after.1 + far_before.1) / (12.0 * STEP);
        numbers.extend(&((turn * properties.com + shift) * properties.mass.sqrt()));
        // int |dR/dt x|^2 dm = |dR/dt S^(1/2)|^2 with S = int x x^T dm = tr(I) / 2 - I.
        let inertia = properties.inertia;
        let second = Matrix3::identity() * (0.5 * inertia.trace()) - inertia;
        let eigen = second.symmetric_eigen();
        // A plate without thickness has none across; rounding may be below zero.
        let root = eigen.eigenvalues.map(|square| square.abs().sqrt());
        numbers.extend(&(turn * eigen.eigenvectors * Matrix3::from_diagonal(&root)));
    }
    numbers
}

/// The mass matrix of whole plates, each of which moves with one side of the tree only.
fn of_whole_plates(compiled: &Compiled, system: &Interpreter, q: &[f64]) -> DMatrix<f64> {
    let columns: Vec<_> = (0..system.dimensions().speeds)
        .map(|speed| DVector::from_vec(motion(compiled, system, q, speed)))
        .collect();
    let motions = DMatrix::from_columns(&columns);
    motions.tr_mul(&motions)
}

fn of_equations(system: &Interpreter, q: &[f64], u: &[f64]) -> DMatrix<f64> {
    let (n, c) = (u.len(), system.dimensions().rows);
    let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut jacobian, mut gamma) = (vec![0.0; c * n], vec![0.0; c]);
    let out = EquationsMut {
        mass: &mut mass,
        forcing: &mut forcing,
        jacobian: &mut jacobian,
        gamma: &mut gamma,
    };
    system.write_equations(0.0, q, u, out).unwrap();
    DMatrix::from_row_slice(n, n, &mass)
}

/// The speeds with J u = b that are nearest to the given ones in the metric of mass; so many rows are independent.
fn nearest(
    mass: &DMatrix<f64>,
    jacobian: &DMatrix<f64>,
    (b, rank): (&DVector<f64>, usize),
    given: &DVector<f64>,
) -> DVector<f64> {
    let svd = jacobian.clone().svd(true, true);
    let (left, right) = (svd.u.unwrap(), svd.v_t.unwrap());
    let (kept, along) = (right.rows(0, rank), right.rows_range(rank..).transpose());
    let shares = left.columns(0, rank).tr_mul(&(b - jacobian * given));
    let change = kept.tr_mul(&shares.component_div(&svd.singular_values.rows(0, rank)));
    if along.is_empty() {
        return given + change;
    }
    let weighted = along.tr_mul(mass);
    let back = (&weighted * &along).lu().solve(&(weighted * &change)).unwrap();
    given + change - along * back
}

/// Random speeds of a sheet at some share of its angles, free or with its first joint driven.
fn check(name: &str, text: &str, folds: &[f64], is_driven: bool) {
    let compiled = compile_text(text);
    let system = Interpreter::new(&compiled.program);
    let (n, l, size) = (system.dimensions().speeds, system.dimensions().loops, system.size());
    let mut random = Random::new(7);
    let mut worst = [0.0; 2];
    for fold in folds {
        // Joints come before the coordinates of free bodies.
        let joints = compiled.topology.mechanism.joints.len();
        let mut q = system.initial().q;
        q[..joints].iter_mut().for_each(|q| *q *= fold);
        let mut workspace = system.workspace();
        assemble(&system, 0.0, &mut q, &vec![false; joints], &mut workspace).unwrap();
        project(&system, 0.0, &mut q, &mut vec![0.0; n], &mut workspace).unwrap();
        let given = DVector::from_fn(n, |_, _| random.range(-SPEED, SPEED));

        let (mut residual, mut rows) = (vec![0.0; 9 * l], vec![0.0; 9 * l * n]);
        system.write_closure(&q, &mut residual, &mut rows).unwrap();
        let (mut b, mut rank) = (vec![0.0; 9 * l], compiled.topology.rank);
        let mut with_drive = None;
        if is_driven {
            rows.extend((0..n).map(|joint| if joint == 0 { size } else { 0.0 }));
            b.push(size * RATE);
            rank += 1;
            let drive = format!(" drive: \"{:?} + {RATE}*t\", stiffness:", q[0]);
            with_drive = Some(compile_text(&text.replacen(" stiffness:", &drive, 1)));
        }
        let program = &with_drive.as_ref().unwrap_or(&compiled).program;
        let jacobian = DMatrix::from_row_slice(b.len(), n, &rows);
        let b = DVector::from_vec(b);

        let without_elimination = program.only(Selection::named(["none"]).unwrap());
        let mass = of_equations(&system, &q, given.as_slice());
        let own = match program.solves() && !is_driven {
            true => of_whole_plates(&compiled, &system, &q),
            false => mass.clone(),
        };
        let ways =
            [(Interpreter::new(program), own), (Interpreter::new(&without_elimination), mass)];
        for ((system, mass), worst) in ways.iter().zip(&mut worst) {
            let expected = nearest(mass, &jacobian, (&b, rank), &given);
            let (mut at, mut found) = (q.clone(), given.as_slice().to_vec());
            project(system, 0.0, &mut at, &mut found, &mut system.workspace()).unwrap();
            let moved = largest_difference(&at, &q);
            assert!(moved <= 1e-9, "{name}: a closed state moves by {moved:e}");
            *worst = keep_largest(*worst, relative_error(&found, expected.as_slice()));
        }
    }
    let [by_elimination, generally] = worst;
    println!("{name}: {by_elimination:.1e} by independent speeds, {generally:.1e} generally");
    assert!(by_elimination < 1e-9, "{name}: {by_elimination:e}");
    assert!(generally < 1e-9, "{name}: {generally:e}");
}

#[test]
fn projections_change_speeds_the_least() {
    let folds = [1.0, 0.3, 0.05, 0.005];
    let free = miura(3, 4).replace("f0: { fixed: true", "f0: { free: true");
    check("miura 2x3", &miura(2, 3), &folds, false);
    check("miura 4x4", &miura(4, 4), &folds, false);
    check("free miura 3x4", &free, &folds, false);
    check("yoshimura 3x3", &yoshimura(3, 3), &folds, false);
    check("yoshimura 4x5", &yoshimura(4, 5), &folds, false);
    check("driven miura 4x5", &miura(4, 5), &folds, true);
    check("driven yoshimura 3x3", &yoshimura(3, 3), &folds, true);
    check("driven yoshimura 4x5", &yoshimura(4, 5), &folds, true);
}
