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

/// A plane loop of five joints with these limits, deg.
fn five_bar(limits: [Option<[f64; 2]>; 5]) -> String {
    let joints = [
        ("a", "[base, A]", "0", 0.0),
        ("b", "[A, B]", "0", 20.0),
        ("c", "[B, C]", "20", 40.0),
        ("d", "[C, D]", "40", 20.0),
        ("e", "[D, base]", "40", 0.0),
    ];
    let mut text =
        "units: { length: mm, angle: deg }\nbodies:\n  base: { fixed: true }\n".to_owned();
    for (body, x, z) in [("A", 0, 10), ("B", 10, 30), ("C", 30, 30), ("D", 40, 10)] {
        text += &format!(
            "  {body}: {{ mass: 1 g, com: [{x}, 5, {z}], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }}\n"
        );
    }
    text += "joints:\n";
    for ((name, bodies, x, z), limits) in joints.into_iter().zip(limits) {
        let limits =
            limits.map_or(String::new(), |[low, high]| format!(", limits: [{low}, {high}]"));
        text += &format!(
            "  {name}: {{ bodies: {bodies}, axis: [[{x}, 0], [{x}, 10]], z: {z}{limits} }}\n"
        );
    }
    text
}

/// Closed states are as near to the guess as limits allow: moved a little along the closure, in any direction, they are further from
/// it. Where all plates lie on each other, no small move shows what is near.
#[test]
fn no_closed_state_beside_is_nearer() {
    let limits = [
        [None; 5],
        [Some([-10.0, 60.0]), None, Some([-150.0, 10.0]), None, Some([-5.0, 20.0])],
        [Some([-30.0, 30.0]), Some([-40.0, 40.0]), None, Some([-40.0, 40.0]), Some([-30.0, 30.0])],
        [Some([-90.0, 5.0]), None, None, Some([-60.0, 60.0]), Some([-5.0, 90.0])],
    ];
    let mut models = vec![compile(&workspace().join("examples/sixbar.yaml"))];
    models.extend(limits.map(|limits| compile_text(&five_bar(limits))));
    for compiled in models {
        let system = Interpreter::new(&compiled.program);
        let ranges: Vec<[f64; 2]> = (0..system.dimensions().joints)
            .map(|joint| system.limits(joint))
            .map(|[low, high]| [low.max(-TAU / 2.0), high.min(TAU / 2.0)])
            .collect();
        let mut random = Random::new(89);
        let (mut compared, mut at_limits, mut not_nearest) = (0, 0, 0);
        for _ in 0..100 {
            let guess: Vec<f64> =
                ranges.iter().map(|&[low, high]| random.range(low, high)).collect();
            let mut q = guess.clone();
            let pinned = vec![false; q.len()];
            let Ok(found) = assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()) else {
                continue;
            };
            if q.iter().all(|q| q.sin().abs() < 0.01) {
                continue;
            }
            assert!(found.iterations < 2000, "{guess:?}: {found:?}");
            compared += 1;
            at_limits += usize::from(q.iter().zip(&ranges).any(|(q, ends)| ends.contains(q)));
            let distance = |q: &[f64]| square(q, &guess);
            let mut beside = || closed_beside(&system, &q, &ranges, &mut random);
            let nearer =
                (0..200).filter_map(|_| beside()).any(|it| distance(&it) < distance(&q) - 1e-6);
            not_nearest += usize::from(nearer);
        }
        println!("{compared}, {at_limits} with joints at limits, {not_nearest} not nearest");
        assert!(compared > 80 && at_limits > 20 && not_nearest == 0);
    }
}

/// The square of the distance of two states, rad^2.
fn square(q: &[f64], other: &[f64]) -> f64 {
    q.iter().zip(other).map(|(a, b)| (a - b).powi(2)).sum()
}

/// A closed state a little beside another one, if the limits allow it.
fn closed_beside(
    system: &Interpreter,
    q: &[f64],
    ranges: &[[f64; 2]],
    random: &mut Random,
) -> Option<Vec<f64>> {
    let reach = random.range(1e-3, 3e-2);
    let moved = q.iter().zip(ranges);
    let mut q: Vec<f64> =
        moved.map(|(q, &[low, high])| (q + reach * random.normal()).clamp(low, high)).collect();
    let mut u = vec![0.0; q.len()];
    project(system, 0.0, &mut q, &mut u, &mut system.workspace()).ok()?;
    let is_within = q.iter().zip(ranges).all(|(q, [low, high])| (low..=high).contains(&q));
    is_within.then_some(q)
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
