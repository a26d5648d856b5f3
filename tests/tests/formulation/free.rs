//! Free bodies: against closed forms, conserved momenta, maximal coordinates and differences.

use std::f64::consts::PI;

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::{Integrator, JacobianMut, Mechanism, State, acceleration, jacobian, project};
use lamc_tests::compare::keep_largest;
use lamc_tests::random::Random;
use lamc_tests::{compile_text, dopri5, linkages};
use lamc_workbench::verify::{Settings, at_states};

/// A box whose middle moment of inertia is about y.
const BOOK: &str = "
gravity: [0, 0, 0]
bodies:
  book: { free: true, mass: 0.3, com: [0.4, -0.2, 0.1],
          inertia: [[1e-4, 0, 0], [0, 2e-4, 0], [0, 0, 2.7e-4]] }
initial:
  bodies:
    book: { position: [0.1, 0.2, 0.3], turn: [0.3, -0.2, 0.5], velocity: [0.2, 0.1, -0.3],
            angular_velocity: [0.01, 6.3, 0.02] }
";

type Motion = State<Vec<f64>, f64>;

fn system(text: &str) -> Interpreter {
    Interpreter::new(&compile_text(text).program)
}

/// Integrates to a time, s, and shows the states on the way.
fn run(system: &Interpreter, state: &mut Motion, t: f64, mut observe: impl FnMut(&Motion)) {
    let mut method = dopri5(system, 1e-12);
    method.run(system, state, t, |state| observe(state)).unwrap();
}

fn norm(x: &[f64]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

fn distance(a: &[f64], b: &[f64]) -> f64 {
    norm(&a.iter().zip(b).map(|(a, b)| a - b).collect::<Vec<_>>())
}

/// The rotation of the coordinates of the only free body, applied to a vector.
fn rotated(q: &[f64], x: [f64; 3]) -> [f64; 3] {
    let v = [q[q.len() - 3], q[q.len() - 2], q[q.len() - 1]];
    let cross = |a: [f64; 3], b: [f64; 3]| {
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    };
    let (once, w) = (cross(v, x), q[q.len() - 4]);
    let twice = cross(v, once);
    std::array::from_fn(|k| x[k] + 2.0 * (w * once[k] + twice[k]))
}

/// A hundred seconds and a hundred turns about the unstable axis, with its flips (L. Poinsot, 1834).
#[test]
fn a_spinning_book_keeps_its_energy_and_angular_momentum() {
    let book = system(BOOK);
    let mut state = book.assembled().unwrap();
    let start = state.clone();
    let energy = |s: &Motion| book.energy(s.t, &s.q, &s.u).unwrap().kinetic;
    let before = book.momentum(&start.q, &start.u).unwrap();
    // I w in the frame, turned into the base frame: written apart from the generated code.
    let [wx, wy, wz] = [3, 4, 5].map(|k| start.u[k]);
    let expected = rotated(&start.q, [1e-4 * wx, 2e-4 * wy, 2.7e-4 * wz]);
    assert!(distance(&before.angular, &expected) <= 1e-15 * norm(&expected));
    assert!(distance(&before.linear, &[0.06, 0.03, -0.09]) <= 1e-16);
    let (first, mut worst, mut flips, mut turns) = (energy(&start), [0.0; 3], 0, 0.0);
    let (mut last, mut sign) = (0.0, 1.0);
    run(&book, &mut state, 100.0, |s| {
        let now = book.momentum(&s.q, &s.u).unwrap();
        worst[0] = keep_largest(worst[0], (energy(s) / first - 1.0).abs());
        worst[1] =
            keep_largest(worst[1], distance(&now.angular, &before.angular) / norm(&before.angular));
        worst[2] = keep_largest(worst[2], (norm(&s.q[3..]) - 1.0).abs());
        turns += (s.t - last) * norm(&s.u[3..]) / (2.0 * PI);
        last = s.t;
        if s.u[4] * sign < 0.0 {
            (flips, sign) = (flips + 1, -sign);
        }
    });
    assert!(worst.iter().all(|worst| *worst <= 1e-9), "{worst:?}");
    assert!(turns > 95.0 && flips >= 4, "{turns} turns, {flips} flips");
    let centre = book.momentum(&state.q, &state.u).unwrap().centre;
    let expected = [0.5 + 20.0, 0.0 + 10.0, 0.4 - 30.0];
    assert!(distance(&centre, &expected) <= 1e-10, "{centre:?}");
}

/// The axis of a symmetric top goes around the angular momentum at |L| / I (L. D. Landau, E. M. Lifshitz,
/// Mechanics, 1976, section 33).
#[test]
fn a_symmetric_top_precesses_as_the_closed_form_says() {
    let text = "
gravity: [0, 0, 0]
bodies: { top: { free: true, mass: 1, com: [0, 0, 0], inertia: [[2, 0, 0], [0, 2, 0], [0, 0, 3]] } }
initial: { bodies: { top: { angular_velocity: [0.7, 0, 2] } } }
";
    let top = system(text);
    let mut state = top.assembled().unwrap();
    let momentum = [1.4, 0.0, 6.0];
    let (size, t) = (norm(&momentum), 5.0);
    let axis = momentum.map(|x| x / size);
    run(&top, &mut state, t, |_| {});
    let along = axis[2];
    let across: [f64; 3] = std::array::from_fn(|k| [0.0, 0.0, 1.0][k] - along * axis[k]);
    let aside = [
        axis[1] * across[2] - axis[2] * across[1],
        axis[2] * across[0] - axis[0] * across[2],
        axis[0] * across[1] - axis[1] * across[0],
    ];
    let (sine, cosine) = (size / 2.0 * t).sin_cos();
    let expected: [f64; 3] =
        std::array::from_fn(|k| along * axis[k] + cosine * across[k] + sine * aside[k]);
    let found = rotated(&state.q, [0.0, 0.0, 1.0]);
    assert!(distance(&found, &expected) <= 1e-10, "{found:?} {expected:?}");
}

/// The published examples with their fixed body free.
fn freed() -> impl Iterator<Item = (&'static str, Compiled)> {
    ["pendulum", "fourbar", "sixbar"].into_iter().map(|name| {
        let path = lamc_tests::workspace().join(format!("examples/{name}.yaml"));
        let text = std::fs::read_to_string(path).unwrap();
        (name, compile_text(&text.replacen("fixed: true", "free: true", 1)))
    })
}

/// Under gravity the centre of mass of any free mechanism follows a parabola.
#[test]
fn a_falling_six_bar_follows_a_parabola() {
    for (name, compiled) in freed() {
        let system = Interpreter::new(&compiled.program);
        let mut state = system.assembled().unwrap();
        let speeds = [0.3, -0.2, 0.5, 4.0, -3.0, 5.0];
        let joints = state.u.len() - 6;
        state.u[joints..].copy_from_slice(&speeds);
        project(&system, 0.0, &mut state.q, &mut state.u, &mut system.workspace()).unwrap();
        let before = system.momentum(&state.q, &state.u).unwrap();
        let g = compiled.topology.mechanism.gravity.clone();
        let g = g.map(|g| g.at(&[]).unwrap());
        let bodies = &compiled.topology.mechanism.bodies;
        let mass: f64 = bodies.iter().map(|body| body.mass_properties.mass).sum();
        let t = 0.5;
        run(&system, &mut state, t, |_| {});
        let after = system.momentum(&state.q, &state.u).unwrap();
        for (k, g) in g.into_iter().enumerate() {
            let velocity = before.linear[k] / mass;
            let expected = before.centre[k] + velocity * t + 0.5 * g * t * t;
            let error = (after.centre[k] - expected).abs();
            assert!(error <= 1e-10, "{name} {k}: {error:e}");
        }
        let error = distance(&after.angular, &before.angular) / norm(&before.angular);
        assert!(error <= 1e-8, "{name}: {error:e}");
    }
}

/// Newton's and Euler's equations in maximal coordinates know nothing of the elimination.
#[test]
fn free_mechanisms_agree_with_maximal_coordinates() {
    let failures = |compiled: &Compiled| -> Vec<&'static str> {
        let checks = at_states(compiled, &Settings { states: 4, seed: 5, duration: 0.1 });
        checks.iter().filter(|check| check.failed()).map(|check| check.name).collect()
    };
    for (name, compiled) in freed() {
        assert_eq!(failures(&compiled), Vec::<&str>::new(), "{name}");
    }
    let base = "free: true, mass: 2e-3, com: [0.01, 0.02, 0.003], \
                inertia: [[3e-7, 1e-8, 0], [1e-8, 4e-7, 2e-8], [0, 2e-8, 5e-7]]";
    for linkage in [
        linkages::spherical("spherical_six_bar", &[0.0, 50.0, 140.0, 180.0, 220.0, 290.0]),
        linkages::planar_four_bar(),
        linkages::spatial_seven_bar(),
        linkages::watt(),
        linkages::miura(3),
    ] {
        for seed in 1..4 {
            let text = linkage.text(seed).replacen("fixed: true", base, 1);
            // A second body that nothing connects with the first.
            let ball = "bodies:\n  ball: { free: true, mass: 1e-3, com: [0, 0, 1], \
                        inertia: [[1e-7, 0, 0], [0, 2e-7, 0], [0, 0, 2.5e-7]] }\n";
            let text = text.replacen("bodies:\n", ball, 1);
            let compiled = compile_text(&text);
            assert_eq!(compiled.topology.mobility, linkage.mobility + 12, "{}", linkage.name);
            assert_eq!(failures(&compiled), Vec::<&str>::new(), "{} {seed}", linkage.name);
        }
    }
}

/// Derivatives by q are those along the directions of u.
#[test]
fn derivatives_agree_with_differences_along_the_speeds() {
    for (name, compiled) in freed() {
        let system = Interpreter::new(&compiled.program);
        let mut random = Random::new(7);
        let mut state = system.assembled().unwrap();
        let n = state.u.len();
        let step: Vec<f64> =
            (0..n).map(|k| if k + 6 < n { 0.0 } else { random.range(-1.0, 1.0) }).collect();
        system.advance(&mut state.q, &step);
        state.u.iter_mut().for_each(|u| *u = random.range(-2.0, 2.0));
        project(&system, 0.0, &mut state.q, &mut state.u, &mut system.workspace()).unwrap();
        let (mut a, mut dt) = (vec![0.0; n], vec![0.0; n]);
        let (mut dq, mut du) = (vec![0.0; n * n], vec![0.0; n * n]);
        let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
        jacobian(&system, 0.0, &state.q, &state.u, &mut system.workspace(), out).unwrap();
        let at = |q: &[f64], u: &[f64]| {
            let mut out = vec![f64::NAN; n];
            acceleration(&system, 0.0, q, u, &mut system.workspace(), &mut out).unwrap();
            out
        };
        // Along the speeds of the free body, the loops stay closed.
        for column in n - 6..n {
            let h = 1e-4;
            let moved = |k: f64| {
                let (mut q, mut step) = (state.q.clone(), vec![0.0; n]);
                step[column] = k * h;
                system.advance(&mut q, &step);
                at(&q, &state.u)
            };
            let faster = |k: f64| {
                let mut u = state.u.clone();
                u[column] += k * h;
                at(&state.q, &u)
            };
            let slope = |f: &dyn Fn(f64) -> Vec<f64>| -> Vec<f64> {
                let [a, b, c, d] = [-2.0, -1.0, 1.0, 2.0].map(f);
                (0..n).map(|i| (a[i] - 8.0 * b[i] + 8.0 * c[i] - d[i]) / (12.0 * h)).collect()
            };
            let scale = 1.0 + norm(&a);
            for (matrix, expected) in [(&dq, slope(&moved)), (&du, slope(&faster))] {
                let found: Vec<f64> = (0..n).map(|row| matrix[row * n + column]).collect();
                let error = distance(&found, &expected) / scale;
                assert!(error <= 1e-7, "{name} column {column}: {error:e}");
            }
        }
    }
}
