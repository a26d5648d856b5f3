//! Assembly from rough guesses: a thousand for each example, each published mechanism and each
//! drawing, every joint normally distributed with 0.5 rad.

use std::f64::consts::TAU;

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::{Error, Mechanism, assemble, project};
use lamc_tests::random::Random;
use lamc_tests::sheets::miura;
use lamc_tests::{EXAMPLES, compile, compile_text, designs, largest, workspace};

const GUESSES: usize = 1000;

fn check(name: &str, compiled: &Compiled) {
    let system = Interpreter::new(&compiled.program);
    let n = system.dimensions().coordinates;
    let rows = 9 * system.dimensions().loops;
    let mut random = Random::new(2026);
    let mut workspace = system.workspace();
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * n]);
    let (mut closed, mut signs) = (0, 0);
    for _ in 0..GUESSES {
        let guess: Vec<f64> = (0..n).map(|_| 0.5 * random.normal()).collect();
        let mut q = guess.clone();
        if assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace).is_err() {
            continue;
        }
        system.write_closure(&q, &mut residual, &mut jacobian).unwrap();
        let open = largest(&residual);
        let inside = q.iter().enumerate().all(|(joint, &q)| {
            let [least, greatest] = system.limits(joint);
            q >= least && q <= greatest && q.abs() <= TAU / 2.0
        });
        closed += usize::from(open < 1e-12 * system.size() && inside);
        signs += usize::from(guess.iter().zip(&q).all(|(guess, q)| guess * q > 0.0));
    }
    println!("{name}: {closed} of {GUESSES} closed within the limits, {signs} with all signs kept");
    assert!(closed * 100 >= GUESSES * 99, "{name}: {closed} of {GUESSES}");
}

#[test]
fn of_the_examples() {
    for name in EXAMPLES {
        check(name, &compile(&workspace().join(format!("examples/{name}.yaml"))));
    }
}

#[test]
fn of_the_designs() {
    for design in designs() {
        check(design.name, &design.compiled);
    }
}

/// Closed states are as near to the guess as joints within half a turn allow: moved a little along the closure, in any direction,
/// they are further from it. Where all plates lie on each other, no small move shows what is near.
#[test]
fn no_closed_state_beside_is_nearer() {
    let system = Interpreter::new(&compile(&workspace().join("examples/sixbar.yaml")).program);
    let (n, half_turn) = (system.dimensions().coordinates, TAU / 2.0);
    let mut workspace = system.workspace();
    let mut random = Random::new(89);
    let (mut compared, mut at_ends) = (0, 0);
    for _ in 0..100 {
        let guess: Vec<f64> = (0..n).map(|_| random.range(-half_turn, half_turn)).collect();
        let distance = |q: &[f64]| q.iter().zip(&guess).map(|(q, g)| (q - g).powi(2)).sum::<f64>();
        let mut q = guess.clone();
        let Ok(found) = assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace) else {
            continue;
        };
        if q.iter().all(|q| q.sin().abs() < 0.01) {
            continue;
        }
        assert!(found.iterations < 500, "{guess:?}: {found:?}");
        compared += 1;
        at_ends += usize::from(q.iter().any(|q| q.abs() >= half_turn));
        for reach in [1e-1, 1e-2, 1e-3].repeat(30) {
            let mut beside: Vec<f64> = q.iter().map(|q| q + reach * random.normal()).collect();
            let mut u = vec![0.0; n];
            if project(&system, 0.0, &mut beside, &mut u, &mut workspace).is_err()
                || beside.iter().any(|q| q.abs() > half_turn)
            {
                continue;
            }
            let nearer = distance(&q) - distance(&beside);
            assert!(nearer < 1e-6, "{guess:?}: {q:?}, {beside:?} is nearer by {nearer:e}");
        }
    }
    println!("{compared}, {at_ends} of them with joints at half a turn");
    assert!(compared > 90 && at_ends > 30);
}

/// A four-bar of unequal lengths whose limits leave no room: the loop, how far it stays open, and
/// a joint that ran into its limit.
#[test]
fn failure_names_loop_residual_and_joint() {
    let bar = |name: &str, x: f64| {
        format!(
            "  {name}: {{ mass: 1 g, com: [{x}, 0.01, 0], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }}\n"
        )
    };
    let text = format!(
        "bodies:\n  base: {{ fixed: true }}\n{}{}{}joints:
  j0: {{ bodies: [base, crank], axis: [[0, 0], [0, 0.1]], limits: [0.5, 1] }}
  j1: {{ bodies: [crank, coupler], axis: [[0.1, 0], [0.1, 0.1]], limits: [-0.1, 0.1] }}
  j2: {{ bodies: [coupler, rocker], axis: [[0.4, 0], [0.4, 0.1]], limits: [-0.1, 0.1] }}
  j3: {{ bodies: [rocker, base], axis: [[0.05, 0], [0.05, 0.1]], limits: [-0.1, 0.1] }}
",
        bar("crank", 0.05),
        bar("coupler", 0.2),
        bar("rocker", 0.3)
    );
    let compiled = compile_text(&text);
    let system = Interpreter::new(&compiled.program);
    let mut q = vec![0.7, 0.0, 0.0, 0.0];
    let error =
        assemble(&system, 0.0, &mut q, &[true, false, false, false], &mut system.workspace());
    let Err(Error::NotClosed { loop_index: 0, residual, joint: Some(_) }) = error else {
        panic!("{error:?}");
    };
    assert!(residual > 1e-3, "{residual:e}");
    assert_eq!(q, [0.7, 0.0, 0.0, 0.0], "a failure leaves the guess");
}

/// Of a vertex of four creases, two angles are given that agree but for rounding: both are kept but for that, wherever the others
/// begin.
#[test]
fn given_angles_that_nearly_agree_are_kept() {
    let system = Interpreter::new(&compile_text(&miura(2, 2)).program);
    let mut workspace = system.workspace();
    let mut assembled = |guess: &[f64; 4], pinned: [usize; 2]| {
        let pinned = [0, 1, 2, 3].map(|joint| pinned.contains(&joint));
        let mut q = *guess;
        assemble(&system, 0.0, &mut q, &pinned, &mut workspace).unwrap();
        q
    };
    for fold in [0.3, 0.8, 1.3] {
        for other in 1..4 {
            let closed = assembled(&[fold, 0.1, 0.1, 0.1], [0, 0]);
            assert!((closed[0] - fold).abs() < 1e-12 && closed[other].abs() > 0.05, "{closed:?}");
            let mut given = [fold, 0.0, 0.0, 0.0];
            given[other] = (closed[other] * 1e3).round() / 1e3;
            let q = assembled(&given, [0, other]);
            let off = [0, other].map(|joint| q[joint] - given[joint]);
            assert!(largest(off) < 2e-3, "{given:?} becomes {q:?}");
        }
    }
}
