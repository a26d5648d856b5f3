//! Sheets of many loops: the solution for independent speeds, and the runtime's general way, which serves where that
//! does not hold, against the dense pseudo-inverse, far from the flat state and near it; and how operations grow.

use lamc::pipeline::Compiled;
use lamc::program::{FunctionKind, Interpreter, Selection};
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism, acceleration, acceleration_and_forces, assemble, project};
use lamc_tests::compare::{keep_largest, largest};
use lamc_tests::nine_rows::nine_rows;
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::udwadia::{Constrained, Equations, cut};
use lamc_tests::{compile_text, relative_error};
use lamc_workbench::check::Check;
use nalgebra::{DMatrix, DVector};

/// Shares of the angles at the start, 40 degrees: down to 2 degrees.
const FOLDS: [f64; 4] = [1.0, 1.4, 0.3, 0.05];

/// Random speeds, rad/s.
const SPEED: f64 = 3.0;

/// States of a sheet that is folded at random.
const CRUMPLED: usize = 60;

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
fn expected(compiled: &Compiled, system: &Interpreter, q: &[f64], u: &[f64]) -> Constrained {
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
    solution
}

/// du/dt without elimination.
fn generally(compiled: &Compiled, q: &[f64], u: &[f64]) -> Vec<f64> {
    let system = without_elimination(compiled);
    let (mut found, mut workspace) = (system.speeds(), system.workspace());
    acceleration(&system, 0.0, q, u, &mut workspace, &mut found).unwrap();
    found
}

fn without_elimination(compiled: &Compiled) -> Interpreter {
    let without = Selection::named(["none"]).unwrap();
    Interpreter::new(&compiled.program.only(without))
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
        let (mut found, mut workspace) = (system.speeds(), system.workspace());
        let constraint = acceleration(&system, 0.0, &q, &u, &mut workspace, &mut found).unwrap();
        assert_eq!((constraint.rank, constraint.is_weak), (compiled.topology.rank, false));
        let mut direct = vec![0.0; q.len()];
        match system.write_acceleration(0.0, &q, &u, &mut direct).unwrap() {
            Some(margin) => {
                assert!(margin.conditioning > 1e-4, "{name} at {fold}: {margin:?}");
                assert_eq!(found, direct, "{name} at {fold}: not by straight-line code");
            }
            None => {
                assert_ne!(
                    found,
                    generally(&compiled, &q, &u),
                    "{name} at {fold}: the general way"
                );
            }
        }
        let expected = expected(&compiled, &system, &q, &u).acceleration;
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
    check("yoshimura 6x6", &yoshimura(6, 6), &FOLDS[..2]);
    check("yoshimura 8x8", &yoshimura(8, 8), &FOLDS[..1]);
}

/// Where vertices are folded in other ways than where the independent joints were chosen, others would suit better: entries of N
/// are large, and the results are refined.
#[test]
fn crumpled_sheets_are_eliminated_too() {
    let compiled = compile_text(&yoshimura(4, 5));
    let system = Interpreter::new(&compiled.program);
    let mut random = Random::new(11);
    let (mut worst, mut eliminated) = (0.0_f64, 0);
    for _ in 0..CRUMPLED {
        let joints = system.initial().q.len();
        let mut q: Vec<f64> = (0..joints).map(|_| random.range(-1.6, 1.6)).collect();
        let mut u: Vec<f64> = (0..joints).map(|_| random.range(-SPEED, SPEED)).collect();
        let mut workspace = system.workspace();
        assemble(&system, 0.0, &mut q, &vec![false; joints], &mut workspace).unwrap();
        project(&system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
        let mut found = system.speeds();
        let constraint = acceleration(&system, 0.0, &q, &u, &mut workspace, &mut found).unwrap();
        assert_eq!(constraint.rank, compiled.topology.rank);
        eliminated += usize::from(found != generally(&compiled, &q, &u));
        let expected = expected(&compiled, &system, &q, &u).acceleration;
        worst = keep_largest(worst, relative_error(&found, expected.as_slice()));
    }
    println!("{eliminated} of {CRUMPLED} states eliminated: {worst:.1e}");
    assert!(worst < 1e-9, "{worst:e}");
    assert!(10 * eliminated > 9 * CRUMPLED, "only {eliminated} of {CRUMPLED} states");
}

/// Vertices that are nearly flat, in a sheet folded at random: of each, three hinges are held at some `angle`.
fn with_flat_vertices(
    compiled: &Compiled,
    system: &Interpreter,
    vertices: &[usize],
    angle: f64,
    random: &mut Random,
) -> Option<(Vec<f64>, Vec<f64>)> {
    let joints = system.initial().q.len();
    let mut q: Vec<f64> = (0..joints).map(|_| random.range(-1.0, 1.0)).collect();
    let mut u: Vec<f64> = (0..joints).map(|_| random.range(-SLOW, SLOW)).collect();
    let mut held = vec![false; joints];
    for &vertex in vertices {
        let hinges = &compiled.topology.loops[vertex].joints;
        hinges.iter().for_each(|hinge| q[hinge.index()] = angle * random.range(0.5, 1.0));
        hinges.iter().step_by(2).for_each(|hinge| held[hinge.index()] = true);
    }
    let mut workspace = system.workspace();
    assemble(system, 0.0, &mut q, &held, &mut workspace).ok()?;
    let flat = |&vertex: &usize| {
        let hinges = &compiled.topology.loops[vertex].joints;
        hinges.iter().all(|hinge| q[hinge.index()].abs() < 10.0 * angle)
    };
    if !vertices.iter().all(flat) {
        return None;
    }
    project(system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
    Some((q, u))
}

/// Speeds with which rounding of a state says nothing, rad/s.
const SLOW: f64 = 1e-4;

/// A vertex that is nearly flat has a row of J that fades, which does not stop the elimination, unless the rest of the sheet is folded
/// too far from where its pivots were chosen. What rounding leaves of that row is left of the acceleration.
#[test]
fn sheets_with_flat_vertices_are_eliminated_too() {
    let compiled = compile_text(&yoshimura(4, 5));
    let system = Interpreter::new(&compiled.program);
    let mut random = Random::new(5);
    let (mut states, mut eliminated) = (0, 0);
    for exponent in 3..6 {
        let angle = 10.0_f64.powi(-exponent);
        let mut worst = 0.0_f64;
        for try_ in 0..40 {
            let vertices: &[usize] = if try_ % 2 == 0 { &[5] } else { &[0, 5, 9] };
            let Some((q, u)) = with_flat_vertices(&compiled, &system, vertices, angle, &mut random)
            else {
                continue;
            };
            let (mut found, mut workspace) = (system.speeds(), system.workspace());
            let constraint =
                acceleration(&system, 0.0, &q, &u, &mut workspace, &mut found).unwrap();
            assert_eq!((constraint.rank, constraint.is_weak), (compiled.topology.rank, true));
            states += 1;
            eliminated += usize::from(found != generally(&compiled, &q, &u));
            let expected = expected(&compiled, &system, &q, &u).acceleration;
            worst = keep_largest(worst, relative_error(&found, expected.as_slice()));
        }
        println!("vertices flat to {angle:e} rad: {worst:.1e}");
        assert!(worst < 1e-13 / angle, "{angle:e}: {worst:e}");
    }
    println!("{eliminated} of {states} states eliminated");
    assert!(states > 40, "only {states} states");
    assert!(3 * eliminated > 2 * states, "only {eliminated} of {states} states");
}

/// A sheet whose first joints follow prescribed angles from those of a state on.
fn driven(text: &str, joints: &[String], q: &[f64]) -> String {
    let mut text = text.to_owned();
    for (index, (name, angle)) in joints.iter().zip(q).enumerate() {
        let rate = 0.7 - 0.4 * index as f64;
        let drive = format!("drive: \"{angle:?} + {rate}*t + {CURVE}*t^2\", stiffness:");
        let at = text.find(&format!("  {name}: {{")).unwrap();
        let rest = text.split_off(at).replacen("stiffness:", &drive, 1);
        text.push_str(&rest);
    }
    text
}

/// Half the acceleration of driven joints, rad/s^2.
const CURVE: f64 = 5.0;

/// Accelerations where the joints of these places are driven.
fn check_driven(name: &str, text: &str, places: &[usize], folds: &[f64]) {
    let compiled = compile_text(text);
    let system = Interpreter::new(&compiled.program);
    let size = system.size();
    let joints = &compiled.topology.mechanism.joints;
    let names: Vec<String> = places.iter().map(|&place| joints[place].name.clone()).collect();
    let mut random = Random::new(11);
    let mut worst = 0.0_f64;
    for &fold in folds {
        let (q, _) = state(&system, fold, &mut random);
        let angles: Vec<f64> = places.iter().map(|&place| q[place]).collect();
        let with_drives = compile_text(&driven(text, &names, &angles));
        let driven = Interpreter::new(&with_drives.program);
        assert!(driven.reduction().is_some(), "{name}");
        let mut at = q.clone();
        let mut u: Vec<f64> = q.iter().map(|_| random.range(-SPEED, SPEED)).collect();
        project(&driven, 0.0, &mut at, &mut u, &mut driven.workspace()).unwrap();
        let solution = expected(&compiled, &system, &at, &u);
        let Equations { mass, forcing, jacobian, gamma } = solution.equations;
        let rows = jacobian.nrows();
        let mut jacobian = jacobian.insert_rows(rows, places.len(), 0.0);
        let gamma = gamma.insert_rows(rows, places.len(), -2.0 * CURVE * size);
        places.iter().enumerate().for_each(|(k, &place)| jacobian[(rows + k, place)] = size);
        let equations = Equations { mass, forcing, jacobian, gamma };
        let solution = equations.solve(cut(4.0 * f64::EPSILON));
        let (mut found, mut workspace) = (driven.speeds(), driven.workspace());
        let constraint = acceleration(&driven, 0.0, &at, &u, &mut workspace, &mut found).unwrap();
        assert_eq!(constraint.rank, solution.rank, "{name} at {fold}");
        assert_ne!(found, generally(&with_drives, &at, &u), "{name} at {fold}: the general way");
        worst = keep_largest(worst, relative_error(&found, solution.acceleration.as_slice()));
    }
    println!("{name}: {worst:.1e}");
    assert!(worst < 1e-9, "{name}: {worst:e}");
}

#[test]
fn accelerations_of_driven_sheets_are_those_of_the_pseudo_inverse() {
    check_driven("miura 3x3", &miura(3, 3), &[4], &FOLDS);
    check_driven("miura 6x6", &miura(6, 6), &[0], &FOLDS[..3]);
    check_driven("yoshimura 3x3", &yoshimura(3, 3), &[0, 7], &FOLDS[..3]);
    check_driven("yoshimura 6x6", &yoshimura(6, 6), &[3, 20, 41], &FOLDS[..2]);
}

/// Closure forces, which independent speeds do not give, with the acceleration that the pseudo-inverse asks for.
fn check_generally(name: &str, text: &str, folds: &[f64]) {
    let compiled = compile_text(text);
    let system = Interpreter::new(&compiled.program);
    let (n, c) = (system.dimensions().speeds, system.dimensions().rows);
    let mut random = Random::new(5);
    let (mut worst, mut worst_balance) = (0.0_f64, 0.0_f64);
    for &fold in folds {
        let (q, u) = state(&system, fold, &mut random);
        let solution = expected(&compiled, &system, &q, &u);
        let (mut found, mut lambda) = (system.speeds(), vec![0.0; c]);
        let mut workspace = system.workspace();
        let constraint =
            acceleration_and_forces(&system, 0.0, &q, &u, &mut workspace, &mut found, &mut lambda);
        assert_eq!(constraint.unwrap().rank, compiled.topology.rank, "{name} at {fold}");
        let acceleration = DVector::from_column_slice(&found);
        let off = solution.length(&(&acceleration - &solution.acceleration));
        worst = keep_largest(worst, off / solution.by_rounding(&u));

        // M a = f + J^T lambda, with lamc's own rows, to which lambda belongs.
        let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
        let (mut rows, mut gamma) = (vec![0.0; c * n], vec![0.0; c]);
        let out = EquationsMut {
            mass: &mut mass,
            forcing: &mut forcing,
            jacobian: &mut rows,
            gamma: &mut gamma,
        };
        system.write_equations(0.0, &q, &u, out).unwrap();
        let (mass, rows) =
            (DMatrix::from_row_slice(n, n, &mass), DMatrix::from_row_slice(c, n, &rows));
        let pushed = rows.tr_mul(&DVector::from_vec(lambda)) + DVector::from_vec(forcing);
        let balance = &mass * &acceleration;
        // The smallest lambda takes singular values of J squared.
        let weakest = solution.spectrum[solution.rank - 1];
        let off = largest(&(&pushed - &balance)) / largest(&balance);
        worst_balance = keep_largest(worst_balance, off * weakest * weakest);
    }
    println!("{name}: {worst:.1e} of rounding, balance {worst_balance:.1e}");
    assert!(worst <= 1.0, "{name}: {worst:e}");
    assert!(worst_balance < 1e-13, "{name}: {worst_balance:e}");
}

#[test]
fn the_general_way_is_the_pseudo_inverse_too() {
    let folds = [1.0, 0.3, 0.05, 0.005];
    check_generally("miura 4x5", &miura(4, 5), &folds);
    check_generally("yoshimura 3x3", &yoshimura(3, 3), &folds);
    check_generally("yoshimura 4x5", &yoshimura(4, 5), &folds);
}

#[test]
fn the_report_says_what_solves_a_sheet() {
    for (sheet, how) in [(miura(5, 5), ""), (yoshimura(4, 5), ", whose matrices the runtime forms")]
    {
        let report = Check::new(&compile_text(&sheet)).report();
        assert!(
            report.contains(&format!("acceleration: by independent speeds{how}\n")),
            "{report}"
        );
        assert_eq!(report.contains("\n  reduction "), !how.is_empty(), "{report}");
    }
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
