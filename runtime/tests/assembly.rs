//! Assembly from rough guesses: nearly always closes, keeps limits, pins and signs.

mod common;

use common::compare::largest;
use std::f64::consts::PI;

use common::Tree;
use common::designs::{ALL, PLACES, four_vertex, planar, sixbar, two_loops};
use common::uniform::Random;
use lamc_runtime::{Error, Mechanism, assemble};

fn residual(system: &Tree<f64>, q: &[f64]) -> f64 {
    let (n, r) = (q.len(), 9 * system.loops.len());
    let (mut residual, mut jacobian) = (vec![0.0; r], vec![0.0; r * n]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    largest(&residual)
}

/// How many of `count` random guesses close.
fn closing(system: &Tree<f64>, sigma: f64, count: usize) -> usize {
    let mut random = Random::new(7);
    let n = system.bodies.len();
    let mut closed = 0;
    let mut iterations = 0;
    for _ in 0..count {
        let mut q = random.normals(n, sigma);
        let result = assemble(system, 0.0, &mut q, &vec![false; n], &mut system.workspace());
        if let Ok(assembly) = result {
            assert!(residual(system, &q) <= 1e-12 * system.size);
            assert!(q.iter().all(|q| q.abs() <= PI));
            closed += 1;
            iterations += assembly.iterations;
        }
    }
    println!("{closed} of {count} closed, {} steps each", iterations / closed.max(1));
    closed
}

#[test]
fn random_guesses_close() {
    for (name, system) in [
        ("sixbar", sixbar(&ALL)),
        ("four vertex", four_vertex(&ALL)),
        ("planar", planar(PLACES, &ALL)),
        ("two loops", two_loops(&ALL)),
    ] {
        for (sigma, count) in [(0.5, 1000), (1.5, 100)] {
            let closed = closing(&system, sigma, count);
            assert!(100 * closed >= 99 * count, "{name}, sigma {sigma}: {closed} of {count}");
        }
    }
}

#[test]
fn a_nudge_unfolds_the_flat_state_and_stays() {
    for (name, system) in [
        ("sixbar", sixbar::<f64>(&ALL)),
        ("four vertex", four_vertex(&ALL)),
        ("planar", planar(PLACES, &ALL)),
        ("two loops", two_loops(&ALL)),
    ] {
        for nudge in [0.4, -0.4, 0.01] {
            let n = system.bodies.len();
            let (mut q, mut pinned) = (vec![0.0; n], vec![false; n]);
            (q[0], pinned[0]) = (nudge, true);
            assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()).expect(name);
            assert_eq!(q[0], nudge, "{name}");
            assert!(residual(&system, &q) <= 1e-12 * system.size);
        }
    }
}

#[test]
fn single_precision_unfolds_too() {
    for (name, system) in [
        ("sixbar", sixbar::<f32>(&ALL)),
        ("planar", planar(PLACES, &ALL)),
        ("two loops", two_loops(&ALL)),
    ] {
        let n = system.bodies.len();
        let mut random = Random::new(3);
        for _ in 0..100 {
            let mut q: Vec<f32> = random.normals(n, 0.5).iter().map(|&q| q as f32).collect();
            let assembly = assemble(&system, 0.0, &mut q, &vec![false; n], &mut system.workspace());
            assert!(assembly.expect(name).residual <= 2e-6 * system.size as f32);
        }
    }
}

#[test]
fn the_signs_of_the_guess_choose_the_branch() {
    let system = four_vertex::<f64>(&ALL);
    let mut seen = Vec::new();
    for other in [0.3, -0.3] {
        let mut q = [0.5, 0.0, other, 0.0];
        let pinned = [true, false, false, false];
        if assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()).is_ok() {
            assert_eq!(q[0], 0.5);
            assert!(q[2] * other > 0.0, "{q:?}");
            seen.push(q);
        }
    }
    assert_eq!(seen.len(), 2);
    // The mirror image of the guess leads to the mirror image of the result.
    for q in seen {
        let mut mirrored = q.map(|q| -q);
        mirrored[1] -= 0.1;
        let mut image = mirrored.map(|q| -q);
        assemble(&system, 0.0, &mut mirrored, &[false; 4], &mut system.workspace()).unwrap();
        assemble(&system, 0.0, &mut image, &[false; 4], &mut system.workspace()).unwrap();
        for (a, b) in mirrored.iter().zip(image) {
            assert!((a + b).abs() < 1e-6, "{mirrored:?} {image:?}");
        }
    }
}

#[test]
fn the_result_is_the_nearest_closed_configuration() {
    let system = four_vertex::<f64>(&ALL);
    let guess = [0.6, 0.3, 0.5, 0.5];
    let distance = |q: &[f64]| -> f64 { q.iter().zip(guess).map(|(q, g)| (q - g).powi(2)).sum() };
    let mut q = guess;
    assemble(&system, 0.0, &mut q, &[false; 4], &mut system.workspace()).unwrap();
    // The whole curve, by pinning its first angle.
    for k in -300..=300 {
        let mut other = guess;
        other[0] = f64::from(k) * 0.01;
        let pinned = [true, false, false, false];
        if assemble(&system, 0.0, &mut other, &pinned, &mut system.workspace()).is_ok() {
            assert!(distance(&q) <= distance(&other) + 1e-9, "{q:?} {other:?}");
        }
    }
}

#[test]
fn a_pinned_joint_moves_only_if_it_must() {
    // The shortest crank of a four-bar that is not Grashof's cannot reach half a turn.
    let system = planar::<f64>([0.0, 0.03, 0.045, 0.025], &ALL);
    let mut q = [3.0, 0.0, 0.0, 0.0];
    assemble(&system, 0.0, &mut q, &[true, false, false, false], &mut system.workspace()).unwrap();
    assert!(residual(&system, &q) <= 1e-12 * system.size);
    let pinned = [true, false, false, false];
    let mut reachable = q;
    let kept = reachable[0];
    assemble(&system, 0.0, &mut reachable, &pinned, &mut system.workspace()).unwrap();
    assert_eq!(reachable[0], kept);
}

#[test]
fn limits_hold_and_turns_are_taken_off() {
    let mut system = sixbar::<f64>(&ALL);
    let mut random = Random::new(5);
    for body in &mut system.bodies {
        body.limits = [-0.7, 0.7];
    }
    for _ in 0..100 {
        let mut q = random.normals(6, 1.0);
        assemble(&system, 0.0, &mut q, &[false; 6], &mut system.workspace()).unwrap();
        assert!(q.iter().all(|q| q.abs() <= 0.7), "{q:?}");
    }

    let system = sixbar::<f64>(&ALL);
    let guess = random.normals(6, 0.5);
    let (mut plain, mut wound) = (guess.clone(), guess);
    wound[2] += 4.0 * PI;
    assemble(&system, 0.0, &mut plain, &[false; 6], &mut system.workspace()).unwrap();
    assemble(&system, 0.0, &mut wound, &[false; 6], &mut system.workspace()).unwrap();
    for (plain, wound) in plain.iter().zip(wound) {
        assert!((plain - wound).abs() < 1e-9, "{:e}", plain - wound);
    }
}

#[test]
fn failure_names_the_loop_and_the_limit_and_changes_nothing() {
    // A flat sheet cannot fold all hinges of a vertex to the same side.
    let mut system = sixbar::<f64>(&ALL);
    for body in &mut system.bodies {
        body.limits = [0.3, 1.0];
    }
    let mut q = [0.5; 6];
    let result = assemble(&system, 0.0, &mut q, &[false; 6], &mut system.workspace());
    let Err(Error::NotClosed { loop_index: 0, residual, joint: Some(joint) }) = result else {
        panic!("{result:?}");
    };
    assert!(residual > 1e-4 && residual < 0.03 && joint < 6);
    assert_eq!(q, [0.5; 6]);

    q[4] = f64::NAN;
    let result = assemble(&system, 0.0, &mut q, &[false; 6], &mut system.workspace());
    assert_eq!(result, Err(Error::NotFinite { joint: 4 }));
    let result = assemble(&system, 0.0, &mut [0.5; 6], &[false; 5], &mut system.workspace());
    assert_eq!(result, Err(Error::Length { expected: 6, given: 5 }));
}
