//! Derivatives of a closed-loop motion, by parameters and by where it starts, against differences of
//! motions.

use crate::compare::keep_largest;
use lamc_runtime::{Mechanism, assemble};

use super::start::{Begun, Start};
use super::tangent::{deviation_rate, write_deviation};
use super::trajectory::{Direction, Trajectory, enough_steps, integrate};
use crate::execution::Jit;
use lamc::pipeline;
use lamc::source::SourceFile;

/// The paper's six-bar, folded, with tunable hinges.
fn six_bar() -> (Jit, Vec<f64>) {
    folded(include_str!("../../../examples/sixbar.yaml"))
}

/// A six-bar with tunable hinges, folded.
fn folded(text: &str) -> (Jit, Vec<f64>) {
    let text = format!("{text}tunable: [stiffness, damping]\n");
    let file = SourceFile { path: "sixbar.yaml".into(), text };
    let system = Jit::new(&pipeline::compile(&file).unwrap().program);
    let mut q = system.initial().q;
    let pinned: Vec<bool> = (0..6).map(|joint| system.is_pinned(joint)).collect();
    assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()).unwrap();
    (system, q)
}

#[test]
fn a_start_is_closed_and_moves_along_the_closure() {
    let (system, near) = six_bar();
    let start = Start::near(&system, 0.0, &near).unwrap();
    assert_eq!(start.independent.len(), 3);
    let coordinates: Vec<f64> = start.independent.iter().map(|&j| near[j] + 0.1).collect();
    let begun = start.at(&system, 0.0, &near, &coordinates, &[1.0, -2.0, 0.5]).unwrap();
    let (mut residual, mut jacobian) = (vec![0.0; 9], vec![0.0; 54]);
    system.write_closure(&begun.q, &mut residual, &mut jacobian).unwrap();
    assert!(residual.iter().all(|r| r.abs() < 1e-12 * system.size()), "{residual:?}");
    for row in jacobian.chunks(6) {
        let rate: f64 = row.iter().zip(&begun.u).map(|(j, u)| j * u).sum();
        assert!(rate.abs() < 1e-11 * system.size(), "{rate:e}");
    }
    for (&joint, value) in start.independent.iter().zip(&coordinates) {
        assert_eq!(begun.q[joint], *value);
    }
}

#[test]
fn no_number_of_steps_is_enough_for_motions_that_are_no_numbers() {
    let (system, near) = six_bar();
    let times = [0.0, 0.01];
    assert_eq!(enough_steps(&system, &times, (&near, &[0.0; 6]), 1.0), Some(1));
    assert_eq!(enough_steps(&system, &times, (&near, &[f64::NAN; 6]), 1.0), None);
}

/// The derivatives of motions by some numbers, against central differences: `directions` are those at the start, and
/// `motion` is that of other numbers.
fn check_sensitivities(
    system: &Jit,
    own: &Trajectory,
    motion: &dyn Fn(usize, f64) -> Trajectory,
    steps: &[f64],
    tolerance: f64,
) {
    let n = system.dimensions().speeds;
    let mut step = vec![f64::NAN; n];
    for (column, &h) in steps.iter().enumerate() {
        let (before, after) = (motion(column, -h), motion(column, h));
        let (mut worst, mut scale) = (0.0_f64, 0.0_f64);
        for sample in 0..own.q.len() {
            system.write_difference(&before.q[sample], &after.q[sample], &mut step);
            for (k, step) in step.iter().enumerate() {
                let expected = step / (2.0 * h);
                let found = own.derivatives[sample][n * column + k];
                worst = keep_largest(worst, (found - expected).abs());
                scale = keep_largest(scale, expected.abs());
            }
        }
        println!("direction {column}: {worst:e} of {scale:e}");
        assert!(worst < tolerance * scale, "direction {column}: {worst:e} of {scale:e}");
    }
}

/// Directions by some parameters, then those of a start.
fn directions(system: &Jit, free: &[usize], begun: &Begun) -> Vec<Direction> {
    let (n, parameters) = (begun.u.len(), system.parameters().len());
    let of = |q: &[f64], u: &[f64], free: Option<usize>| Direction {
        q: q.to_vec(),
        u: u.to_vec(),
        parameters: (0..parameters).map(|k| f64::from(u8::from(Some(k) == free))).collect(),
    };
    let still = vec![0.0; n];
    let by_parameter = free.iter().map(|&k| of(&still, &still, Some(k)));
    by_parameter.chain(begun.directions.iter().map(|(q, u)| of(q, u, None))).collect()
}

/// Free parameters, independent coordinates and speeds, and the motion from them.
fn check_start(
    system: &Jit,
    near: &[f64],
    free: &[usize],
    start: &[f64],
    steps: &[f64],
    fine: (usize, f64),
) {
    let independent = Start::near(system, 0.0, near).unwrap();
    let times: Vec<f64> = (0..=40).map(|k| f64::from(k) / 400.0).collect();
    let mut nominal: Vec<f64> = free.iter().map(|&k| system.parameters()[k]).collect();
    nominal.extend(start);
    let freedoms = independent.independent.len();
    let names: Vec<String> =
        free.iter().map(|&k| system.interface().parameters[k].name.clone()).collect();
    let begun = |system: &Jit, x: &[f64]| {
        let (coordinates, speeds) = x[free.len()..].split_at(freedoms);
        independent.at(system, 0.0, near, coordinates, speeds).unwrap()
    };
    let motion = |column: usize, by: f64| {
        let mut x = nominal.clone();
        x[column] += by;
        let mut system = system.clone();
        for (name, value) in names.iter().zip(&x) {
            system.set_parameter(name, *value).unwrap();
        }
        let begun = begun(&system, &x);
        integrate(&system, &times, (&begun.q, &begun.u), &[], fine.0).unwrap()
    };
    let begun = begun(system, &nominal);
    let along = directions(system, free, &begun);
    let own = integrate(system, &times, (&begun.q, &begun.u), &along, fine.0).unwrap();
    check_sensitivities(system, &own, &motion, steps, fine.1);
}

#[test]
fn sensitivities_are_those_of_differences() {
    let (system, near) = six_bar();
    let independent = Start::near(&system, 0.0, &near).unwrap().independent;
    let mut start: Vec<f64> = independent.iter().map(|&j| near[j]).collect();
    start.extend([3.0, -4.0, 2.0]);
    // Stiffness and damping of a joint, then coordinates and speeds.
    let steps = [1e-2, 1e-3, 1.0, 1.0, 1.0, 10.0, 10.0, 10.0].map(|size| 1e-4 * size);
    check_start(&system, &near, &[2, 8], &start, &steps, (4, 1e-5));
}

/// The same without a base: its loop closes wherever the free body is.
#[test]
fn sensitivities_of_a_tumbling_loop_are_those_of_differences() {
    let text = include_str!("../../../examples/sixbar.yaml").replace("fixed: true", "free: true");
    let (system, near) = folded(&text);
    let independent = Start::near(&system, 0.0, &near).unwrap().independent;
    assert_eq!(independent[3..], [6, 7, 8, 9, 10, 11]);
    let mut start: Vec<f64> = independent[..3].iter().map(|&j| near[j]).collect();
    start.extend([0.01, -0.02, 0.03, 0.5, -0.9, 0.7]);
    start.extend([3.0, -4.0, 2.0, 0.5, -0.3, 0.8, 4.0, -2.0, 3.0]);
    let of_joints = |size: f64| [1e-4 * size; 3];
    let of_body = [1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4];
    let steps = [
        &[1e-6, 1e-7][..],
        &of_joints(1.0)[..],
        &of_body[..],
        &of_joints(10.0)[..],
        &of_body.map(|h| 10.0 * h)[..],
    ];
    check_start(&system, &near, &[2, 8], &start, &steps.concat(), (16, 1e-5));
}

/// Two plates with a hinge, in the air.
fn plates() -> Jit {
    let text = "
units: { length: mm }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
air: { density: 1.2, drag: 1.2 }
tunable: [stiffness, damping]
bodies:
  hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  wing: { outline: [[40, 0], [80, 0], [80, 20], [40, 20]] }
joints:
  hinge: { bodies: [hull, wing], axis: [[40, 0], [40, 20]], stiffness: 1e-4, damping: 1e-7, rest: 0.6 }
initial: { bodies: { hull: { position: [0, 0, 500], turn: [0, 30 deg, 0] } } }
";
    let file = SourceFile { path: "plates.yaml".into(), text: text.to_owned() };
    Jit::new(&pipeline::compile(&file).unwrap().program)
}

/// Far from and near to where a body is measured, by the differences of the runtime.
#[test]
fn deviations_change_as_their_differences() {
    let (system, h) = (plates(), 1e-5);
    let from = system.initial().q;
    for turn in [[0.5, -2.0, 1.1], [0.004, -0.003, 0.006], [0.0, 0.0, 0.0]] {
        let mut to = from.clone();
        system.advance(&mut to, &[&[0.2, 0.01, -0.3, 0.02][..], &turn].concat());
        let deviation = |to: &[f64]| {
            let mut out = system.speeds();
            write_deviation(&system, &from, to, &mut out);
            out
        };
        for moved in 0..7 {
            let direction: Vec<f64> = (0..7).map(|k| f64::from(u8::from(k == moved))).collect();
            let at = |h: f64| {
                let mut to = to.clone();
                system.advance(&mut to, &direction.iter().map(|d| h * d).collect::<Vec<_>>());
                deviation(&to)
            };
            let (before, after) = (at(-h), at(h));
            for k in 0..7 {
                let expected = (after[k] - before[k]) / (2.0 * h);
                let found = deviation_rate(&system, &deviation(&to), &direction, k);
                assert!(
                    (found - expected).abs() < 1e-8,
                    "{turn:?} {moved} {k}: {found} {expected}"
                );
            }
        }
    }
}

/// Far from where the free plate is given.
#[test]
fn sensitivities_of_tumbling_plates_are_those_of_differences() {
    let system = plates();
    let near = system.initial().q;
    let start = [
        [0.4, 0.01, -0.02, 0.03, 0.5, -0.9, 0.7].as_slice(),
        [3.0, 0.5, -0.3, 0.8, 7.0, -4.0, 9.0].as_slice(),
    ]
    .concat();
    let steps = [
        [1e-8, 1e-10, 1e-4, 1e-5, 1e-5, 1e-5, 1e-4, 1e-4, 1e-4].as_slice(),
        [1e-3, 1e-4, 1e-4, 1e-4, 1e-3, 1e-3, 1e-3].as_slice(),
    ]
    .concat();
    check_start(&system, &near, &[0, 1], &start, &steps, (8, 1e-7));
}
