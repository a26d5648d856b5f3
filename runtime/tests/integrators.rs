//! Integrators: closed-form periods, measured orders, energy, drift, dense output, stiffness.

mod common;

use common::compare::{keep_largest, largest};
use std::f64::consts::PI;

use common::Tree;
use common::designs::{ALL, PLACES, SIX, chain, four_vertex, planar, sixbar, two_loops};
use common::failing::Failing;
use common::planar::{FourBar, Pendulum};
use common::uniform::Random;
use lamc_runtime::constants::STEP_PIECES;
use lamc_runtime::{
    Dopri5, Error, Integrator, Mechanism, Rk4, Scalar, SemiImplicitEuler, Stabilisation, State,
    StateOf, assemble, project,
};

fn pendulum<S: Scalar>() -> Pendulum<S> {
    let of = S::from_f64;
    Pendulum { mass: of(0.3), length: of(0.5), gravity: of(9.81), initial: [of(2.0), S::ZERO] }
}

/// 4 sqrt(l / g) K(sin(theta / 2)) by the arithmetic-geometric mean.
fn period(length: f64, gravity: f64, amplitude: f64) -> f64 {
    let (mut a, mut b) = (1.0, (amplitude / 2.0).cos());
    for _ in 0..10 {
        (a, b) = ((a + b) / 2.0, (a * b).sqrt());
    }
    2.0 * PI * (length / gravity).sqrt() / a
}

fn total<Y: Mechanism>(system: &Y, state: &StateOf<Y>) -> f64 {
    let energy = system.energy(state.t, &state.q, &state.u).unwrap();
    (energy.kinetic + energy.potential).to_f64()
}

/// Largest residual over size, and largest closing speed over size (1/s).
fn drift<Y: Mechanism<Scalar = f64>>(system: &Y, state: &StateOf<Y>) -> (f64, f64) {
    let d = system.dimensions();
    let n = d.coordinates;
    let (mut residual, mut jacobian) = (vec![0.0; 9 * d.loops], vec![0.0; 9 * d.loops * n]);
    system.write_closure(state.q.as_ref(), &mut residual, &mut jacobian).unwrap();
    let most = |values: &mut dyn Iterator<Item = f64>| largest(values) / system.size();
    let mut speeds = jacobian
        .chunks(n)
        .map(|row| row.iter().zip(state.u.as_ref()).map(|(j, u)| j * u).sum::<f64>());
    (most(&mut residual.iter().copied()), most(&mut speeds))
}

/// A closed state of a tree with loops, at some speed.
fn closed_state(system: &Tree<f64>, seed: u64, speed: f64) -> StateOf<Tree<f64>> {
    let n = system.bodies.len();
    let mut random = Random::new(seed);
    let mut state = State { t: 0.0, q: random.normals(n, 0.6), u: random.normals(n, speed) };
    let mut workspace = system.workspace();
    assemble(system, 0.0, &mut state.q, &vec![false; n], &mut workspace).unwrap();
    project(system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
    state
}

#[test]
fn pendulum_returns_after_its_period() {
    let system = pendulum::<f64>();
    let end = period(0.5, 9.81, 2.0);
    let mut state = system.initial();
    let mut steps = 0;
    Dopri5::new(&system).run(&system, &mut state, end, |_| steps += 1).unwrap();
    assert_eq!(state.t, end);
    assert!((state.q[0] - 2.0).abs() < 1e-7 && state.u[0].abs() < 1e-6, "{state:?}");
    assert!((20..200).contains(&steps), "{steps} steps");

    let mut state = system.initial();
    Rk4::new(&system).run(&system, &mut state, end, 1e-3, |_| ()).unwrap();
    assert!((state.q[0] - 2.0).abs() < 1e-9 && state.u[0].abs() < 1e-9, "{state:?}");

    let system = pendulum::<f32>();
    let mut state = system.initial();
    Dopri5::new(&system).run(&system, &mut state, end as f32, |_| ()).unwrap();
    assert!((state.q[0] - 2.0).abs() < 2e-4 && state.u[0].abs() < 2e-3, "{state:?}");
    assert!((total(&system, &state) - total(&system, &system.initial())).abs() < 1e-4);
}

/// Advances a state by `steps` equal steps.
type March<'a, Y> = &'a dyn Fn(&Y, &mut StateOf<Y>, usize);

/// Order of convergence at a fixed end, from errors with `steps` and twice as many.
fn order<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    begin: &StateOf<Y>,
    reference: &StateOf<Y>,
    steps: usize,
    march: March<Y>,
) -> f64 {
    let error = |steps| {
        let mut state = begin.clone();
        march(system, &mut state, steps);
        let off =
            |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum() };
        let (q, u) = (state.q.as_ref(), state.u.as_ref());
        (off(q, reference.q.as_ref()) + off(u, reference.u.as_ref())).sqrt()
    };
    (error(steps) / error(2 * steps)).log2()
}

fn check_orders<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    begin: &StateOf<Y>,
    end: f64,
    steps: usize,
) {
    let mut reference = begin.clone();
    let mut fine = Dopri5::new(system);
    (fine.relative, fine.absolute) = (1e-13, 1e-13);
    fine.run(system, &mut reference, end, |_| ()).unwrap();
    let step = |count: usize| end / count as f64;

    let found = order(system, begin, &reference, steps, &|system, state, count| {
        Rk4::new(system).run(system, state, end, step(count), |_| ()).unwrap();
    });
    assert!((found - 4.0).abs() < 0.35, "Rk4 has order {found}");
    let found = order(system, begin, &reference, 8 * steps, &|system, state, count| {
        SemiImplicitEuler::new(system).run(system, state, end, step(count), |_| ()).unwrap();
    });
    assert!((found - 1.0).abs() < 0.15, "SemiImplicitEuler has order {found}");
    let found = order(system, begin, &reference, steps, &|system, state, count| {
        // A tolerance that never rejects, and steps of the longest length.
        let mut integrator = Dopri5::new(system);
        integrator.absolute = 1e9;
        integrator.max_step = step(count);
        let mut taken = 0;
        integrator.run(system, state, step(count) / 4.0, |_| ()).unwrap();
        integrator.run(system, state, end, |_| taken += 1).unwrap();
        assert!(taken <= count + 4, "{taken} steps");
    });
    assert!((found - 5.0).abs() < 0.5, "Dopri5 has order {found}");
}

#[test]
fn orders_of_convergence_are_as_the_theory_has_them() {
    let system = pendulum::<f64>();
    check_orders(&system, &system.initial(), 1.0, 80);
    let system = FourBar::<f64>::example();
    check_orders(&system, &system.assembled().unwrap(), 0.1, 80);
}

#[test]
fn energy_of_conservative_mechanisms_is_kept() {
    let tree = chain::<f64>(3);
    let begin = State { t: 0.0, q: vec![0.5, -0.3, 0.8], u: vec![1.0, 2.0, -3.0] };
    let mut cases = vec![("chain", tree, begin, 0.0)];
    for (name, mut system, opening) in [
        ("sixbar", sixbar(&ALL), 1e-9),
        // These pass flat states, where for a moment fewer rows count for the speeds.
        ("planar", planar(PLACES, &ALL), 1e-4),
        ("two loops", two_loops(&SIX), 1e-4),
    ] {
        for body in &mut system.bodies {
            body.stiffness = 2e-4;
        }
        let state = closed_state(&system, 4, 3.0);
        cases.push((name, system, state, opening));
    }
    for (name, system, begin, opening) in cases {
        let before = total(&system, &begin);
        let scale = system.energy(0.0, &begin.q, &begin.u).unwrap().kinetic.abs() + before.abs();
        let mut state = begin.clone();
        let mut worst = (0.0_f64, 0.0_f64);
        let mut integrator = Dopri5::new(&system);
        integrator
            .run(&system, &mut state, 1.0, |state| {
                let (position, speed) = drift(&system, state);
                worst = (worst.0.max(position), worst.1.max(speed));
            })
            .unwrap();
        let change = (total(&system, &state) - before).abs() / scale;
        println!("{name}: energy {change:e}, drift {worst:?}");
        assert!(change < 1e-5, "{name}: energy changed by {change:e}");
        assert!(worst.0 < 1e-9, "{name}: open by {:e}", worst.0);
        assert!(worst.1 <= opening, "{name}: opens at {:e}", worst.1);
    }
}

#[test]
fn projection_stops_the_drift_that_is_there_without_it() {
    let system = FourBar::<f64>::example();
    let begin = system.assembled().unwrap();
    for (projection, low, high) in
        [(Stabilisation::Projection, 0.0, 1e-9), (Stabilisation::Off, 1e-9, 1.0)]
    {
        let mut rk4 = Rk4::new(&system);
        rk4.stabilisation = projection;
        let mut state = begin;
        rk4.run(&system, &mut state, 1.0, 2e-3, |_| ()).unwrap();
        let found = drift(&system, &state).0;
        assert!(found >= low && found < high, "{projection:?}: {found:e}");
    }
    let mut euler = SemiImplicitEuler::new(&system);
    let (mut state, before) = (begin, total(&system, &begin));
    euler.run(&system, &mut state, 1.0, 1e-4, |_| ()).unwrap();
    assert!(drift(&system, &state).0 < 1e-9);
    assert!((total(&system, &state) - before).abs() < 2e-2 * before.abs());
}

#[test]
fn samples_lie_on_the_motion_and_on_the_closure() {
    let system = FourBar::<f64>::example();
    let begin = system.assembled().unwrap();
    let times: Vec<f64> = (0..=50).map(|i| f64::from(i) * 0.004).collect();
    let mut count = 0;
    let mut state = begin;
    let mut integrator = Dopri5::new(&system);
    let check = |sample: &StateOf<FourBar<f64>>| {
        assert_eq!(sample.t, times[count]);
        count += 1;
        let found = drift(&system, sample);
        assert!(found.0 < 1e-9 && found.1 < 1e-9, "{found:?} at {}", sample.t);
        let mut exact = begin;
        let mut fine = Dopri5::new(&system);
        (fine.relative, fine.absolute) = (1e-12, 1e-12);
        fine.run(&system, &mut exact, sample.t, |_| ()).unwrap();
        for (a, b) in sample.q.iter().zip(exact.q).chain(sample.u.iter().zip(exact.u)) {
            assert!((a - b).abs() < 1e-5 * b.abs().max(1.0), "{a} is not {b} at {}", sample.t);
        }
    };
    integrator.sample(&system, &mut state, 0.2, times.iter().copied(), check).unwrap();
    assert_eq!(count, 51);
    assert_eq!(state.t, 0.2);
}

#[test]
fn closed_loops_move_in_single_precision() {
    let (single, double) = (FourBar::<f32>::example(), FourBar::<f64>::example());
    let mut exact = double.assembled().unwrap();
    Dopri5::new(&double).run(&double, &mut exact, 0.2, |_| ()).unwrap();
    let begin = single.assembled().unwrap();
    let (mut adaptive, mut fixed) = (begin, begin);
    let mut steps = 0;
    Dopri5::new(&single).run(&single, &mut adaptive, 0.2, |_| steps += 1).unwrap();
    Rk4::new(&single).run(&single, &mut fixed, 0.2, 1e-3, |_| ()).unwrap();
    assert!(steps < 1000, "{steps} steps");
    for state in [adaptive, fixed] {
        let mut residual = [0.0; 9];
        single.write_closure(&state.q, &mut residual, &mut [0.0; 36]).unwrap();
        assert!(residual.iter().all(|r| r.abs() < 1e-5 * single.size()), "{residual:?}");
        for (a, b) in state.q.iter().zip(exact.q) {
            assert!((f64::from(*a) - b).abs() < 1e-2, "{a} is not {b}");
        }
    }
}

#[test]
fn a_stiff_design_takes_many_small_steps_and_stays_closed() {
    let mut system = sixbar::<f64>(&[4, 5, 8]);
    for body in &mut system.bodies {
        (body.stiffness, body.damping) = (10.0, 1e-3);
    }
    let mut state = closed_state(&system, 6, 0.0);
    let before = total(&system, &state);
    let mut steps = 0;
    let mut integrator = Dopri5::new(&system);
    (integrator.relative, integrator.absolute) = (1e-6, 1e-8);
    integrator.run(&system, &mut state, 0.01, |_| steps += 1).unwrap();
    assert!((1000..200_000).contains(&steps), "{steps} steps");
    assert!(drift(&system, &state).0 < 1e-9);
    assert!(total(&system, &state) < before);
}

#[test]
fn a_mechanism_passes_through_its_flat_singular_state() {
    let mut system = four_vertex::<f64>(&SIX);
    system.gravity *= 0.0;
    for body in &mut system.bodies {
        body.stiffness = 1e-4;
    }
    let mut state = State { t: 0.0, q: vec![0.5, 0.3, 0.0, 0.0], u: vec![0.0; 4] };
    let pinned = [true, false, false, false];
    assemble(&system, 0.0, &mut state.q, &pinned, &mut system.workspace()).unwrap();
    let before = total(&system, &state);
    let mut crossings = 0;
    let mut last = state.q[0];
    let mut worst = 0.0_f64;
    Dopri5::new(&system)
        .run(&system, &mut state, 0.5, |state| {
            crossings += usize::from(state.q[0] * last < 0.0);
            last = state.q[0];
            worst = keep_largest(worst, drift(&system, state).0);
        })
        .unwrap();
    println!("{crossings} crossings, drift {worst:e}, energy {before} {}", total(&system, &state));
    assert!(crossings > 0);
    assert!(worst < 1e-9, "{worst:e}");
    assert!(total(&system, &state) <= before * (1.0 + 1e-6));
}

#[test]
fn steps_that_fail_are_shortened_and_then_named() {
    let system = Failing::without_force_from(0.25);
    let mut state = system.initial();
    let error = Dopri5::new(&system).run(&system, &mut state, 1.0, |_| ()).unwrap_err();
    let Error::StepTooSmall { t } = error else { panic!("{error}") };
    assert!(t <= 0.25 && t > 0.249, "{t}");
    assert_eq!(state.t as f32, t);
    assert!(state.q[0].is_finite());

    let mut state = system.initial();
    let mut rk4 = Rk4::new(&system);
    let error = rk4.run(&system, &mut state, 1.0, 0.1, |_| ()).unwrap_err();
    assert_eq!(error, Error::NotFinite { joint: 0 });
    assert!((state.t - 0.2).abs() < 1e-12 && state.q[0].is_finite());

    assert_eq!(rk4.step(&system, &mut state, f64::NAN), Err(Error::Time));
    assert_eq!(rk4.run(&system, &mut state, 1.0, 0.0, |_| ()), Err(Error::Time));
    let mut dopri5 = Dopri5::new(&system);
    assert_eq!(dopri5.run(&system, &mut state, f64::INFINITY, |_| ()), Err(Error::Time));
    let before = state;
    dopri5.run(&system, &mut state, 0.0, |_| ()).unwrap();
    assert_eq!(state, before);
}

#[test]
fn the_retries_of_a_step_are_bounded() {
    // The last stage of RK4 is at the end of the step: every attempt fails as late as it can.
    let system = Failing::without_force_from(1.0 - 1e-9);
    let mut state = system.initial();
    let before = state;
    let outcome = Rk4::new(&system).step(&system, &mut state, 1.0);
    assert_eq!((outcome, state), (Err(Error::NotFinite { joint: 0 }), before));
    assert_eq!(system.evaluations.get(), 4 * (2 * STEP_PIECES as u64 - 1));

    // A mechanism that always fails does so at the first evaluation of every attempt.
    let system = Failing::without_force_from(-1.0);
    let outcome = SemiImplicitEuler::new(&system).step(&system, &mut state, 1.0);
    assert_eq!((outcome, state), (Err(Error::NotFinite { joint: 0 }), before));
    assert_eq!(system.evaluations.get(), u64::from(STEP_PIECES.ilog2()) + 1);

    // Where shorter pieces help, there are as few as possible: two attempts fail here.
    let system = Failing { longest: 0.2, ..Failing::without_force_from(2.0) };
    Rk4::new(&system).step(&system, &mut state, 1.0).unwrap();
    assert_eq!(state.t, 1.0);
    assert_eq!(system.evaluations.get(), 2 + 2 + 4 * 4);
}

#[test]
fn only_values_that_are_not_finite_are_worth_a_retry() {
    let system = Failing { mass: 0.0, ..Failing::without_force_from(2.0) };
    let mut state = system.initial();
    let error = Rk4::new(&system).step(&system, &mut state, 1.0).unwrap_err();
    assert_eq!(error, Error::MassMatrix { joint: 0 });
    assert_eq!(system.evaluations.get(), 1);
}
