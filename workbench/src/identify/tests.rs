//! Derivatives of a closed-loop motion, by parameters and by where it starts, against differences of
//! motions.

use crate::compare::keep_largest;
use lamc_runtime::{Mechanism, assemble};

use super::start::Start;
use super::trajectory::{Direction, enough_steps, integrate};
use crate::execution::Jit;
use lamc::pipeline;
use lamc::source::SourceFile;

/// The paper's six-bar, folded, with tunable hinges.
fn six_bar() -> (Jit, Vec<f64>) {
    let mut text = include_str!("../../../examples/sixbar.yaml").to_owned();
    text.push_str("tunable: [stiffness, damping]\n");
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

#[test]
fn sensitivities_are_those_of_differences() {
    let (system, near) = six_bar();
    let start = Start::near(&system, 0.0, &near).unwrap();
    let times: Vec<f64> = (0..=40).map(|k| f64::from(k) / 400.0).collect();
    // Stiffness and damping of a joint, then coordinates and speeds.
    let free = [2, 8];
    let mut nominal: Vec<f64> = free.iter().map(|&k| system.parameters()[k]).collect();
    nominal.extend(start.independent.iter().map(|&j| near[j]));
    nominal.extend([3.0, -4.0, 2.0]);
    let names: Vec<String> =
        free.iter().map(|&k| system.interface().parameters[k].name.clone()).collect();
    let motion = |x: &[f64], directions: &[Direction]| {
        let mut system = system.clone();
        for (name, value) in names.iter().zip(x) {
            system.set_parameter(name, *value).unwrap();
        }
        let begun = start.at(&system, 0.0, &near, &x[2..5], &x[5..]).unwrap();
        integrate(&system, &times, (&begun.q, &begun.u), directions, 4).unwrap()
    };
    let parameters = system.parameters().len();
    let of = |q: &[f64], u: &[f64], free: Option<usize>| Direction {
        q: q.to_vec(),
        u: u.to_vec(),
        parameters: (0..parameters).map(|k| f64::from(u8::from(Some(k) == free))).collect(),
    };
    let begun = start.at(&system, 0.0, &near, &nominal[2..5], &nominal[5..]).unwrap();
    let mut directions: Vec<Direction> =
        free.iter().map(|&k| of(&[0.0; 6], &[0.0; 6], Some(k))).collect();
    directions.extend(begun.directions.iter().map(|(q, u)| of(q, u, None)));
    let own = motion(&nominal, &directions);
    for (column, size) in [1e-2, 1e-3, 1.0, 1.0, 1.0, 10.0, 10.0, 10.0].into_iter().enumerate() {
        let h = 1e-4 * size;
        let shifted = |by: f64| {
            let mut x = nominal.clone();
            x[column] += by;
            motion(&x, &[]).q
        };
        let (before, after) = (shifted(-h), shifted(h));
        let (mut worst, mut scale) = (0.0_f64, 0.0_f64);
        for sample in 0..times.len() {
            for joint in 0..6 {
                let expected = (after[sample][joint] - before[sample][joint]) / (2.0 * h);
                let found = own.derivatives[sample][6 * column + joint];
                worst = keep_largest(worst, (found - expected).abs());
                scale = keep_largest(scale, expected.abs());
            }
        }
        println!("direction {column}: {worst:e} of {scale:e}");
        assert!(worst < 1e-5 * scale, "direction {column}: {worst:e} of {scale:e}");
    }
}
