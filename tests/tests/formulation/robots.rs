//! The two robots of `examples/` that leave the bench, against what must hold of any motion: momentum,
//! energy, friction cones, and the geometry of a step. Laws of motors, bands and contacts are written here once more.

use lamc_runtime::{Integrator, Mechanism, Rodas, State};
use lamc_tests::compare::keep_largest;
use lamc_tests::{compile, dopri5, workspace};
use lamc_workbench::execution::Jit;

type Motion = State<Vec<f64>, f64>;

/// m/s^2.
const GRAVITY: f64 = 9.81;
/// The default share of the thickness by which one point that carries the whole weight sinks in.
const SINKS: f64 = 0.01 * 0.85e-3;

/// A robot of the examples at its start, and its mass, kg.
fn robot(name: &str) -> (Jit, Motion, f64) {
    let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
    let bodies = &compiled.topology.mechanism.bodies;
    let mass = bodies.iter().map(|body| body.mass_properties.mass).sum();
    let system = Jit::new(&compiled.program);
    let state = system.assembled().unwrap();
    (system, state, mass)
}

fn rodas(system: &Jit, tolerance: f64) -> Rodas<Jit> {
    let mut method = Rodas::new(system);
    (method.relative, method.absolute) = (tolerance, tolerance);
    method
}

/// A contact point: where it is, m, how it moves, m/s, the force on it, N.
struct Touch {
    at: [f64; 3],
    velocity: [f64; 3],
    force: [f64; 3],
}

/// Values of functions of q after and before a small step along u, and their rate.
fn rates(system: &Jit, state: &Motion, values: impl Fn(&[f64]) -> Vec<f64>) -> Vec<f64> {
    let h = 1e-6;
    let [ahead, behind] = [h, -h].map(|h| {
        let mut q = state.q.clone();
        let step: Vec<f64> = state.u.iter().map(|u| h * u).collect();
        system.advance(&mut q, &step);
        values(&q)
    });
    ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * h)).collect()
}

/// All contact points. Their velocities come from their positions.
fn touches(system: &Jit, state: &Motion) -> Vec<Touch> {
    let found = |q: &[f64]| {
        let mut out = vec![0.0; 6 * system.dimensions().contacts];
        system.write_contacts(state.t, q, &state.u, &mut out).unwrap();
        out
    };
    let (now, moving) = (found(&state.q), rates(system, state, found));
    let three = |x: &[f64]| [x[0], x[1], x[2]];
    let pairs = now.chunks_exact(6).zip(moving.chunks_exact(6));
    let touch = |(now, moving): (&[f64], &[f64])| Touch {
        at: three(now),
        velocity: three(moving),
        force: three(&now[3..]),
    };
    pairs.map(touch).collect()
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.into_iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Kinetic and potential energy without that of the contact springs, J.
fn energy(system: &Jit, state: &Motion, mass: f64) -> f64 {
    let stiffness = mass * GRAVITY / SINKS;
    let depths = touches(system, state).into_iter().map(|touch| touch.at[2].min(0.0));
    let pressed: f64 = depths.map(|depth| 0.5 * stiffness * depth * depth).sum();
    let energy = system.energy(state.t, &state.q, &state.u).unwrap();
    energy.kinetic + energy.potential - pressed
}

/// Linear momentum that contacts give per second, N, and their power, W.
fn given(system: &Jit, state: &Motion) -> [f64; 4] {
    let mut sum = [0.0; 4];
    for touch in touches(system, state) {
        (0..3).for_each(|k| sum[k] += touch.force[k]);
        sum[3] += dot(touch.force, touch.velocity);
    }
    sum
}

/// Follows a motion and integrates, by Simpson's rule over each step, what contacts and `others` give: linear
/// momentum, N s, and work, J. `seen` is shown every state.
fn follow(
    (system, state): (&Jit, &mut Motion),
    t_end: f64,
    others: impl Fn(&Motion) -> f64,
    mut seen: impl FnMut(&Motion),
) -> [f64; 4] {
    let mut method = dopri5(system, 1e-9);
    // Short enough for Simpson's rule across the corners of the laws.
    method.max_step = 2e-5;
    let mut sum = [0.0; 4];
    let rate = |state: &Motion| {
        let mut rate = given(system, state);
        rate[3] += others(state);
        rate
    };
    let mut before = rate(state);
    while state.t < t_end {
        let begin = state.t;
        method.step(system, state, t_end).unwrap();
        let middle = method.between(system, 0.5 * (begin + state.t)).unwrap();
        let (middle, after) = (rate(&middle), rate(state));
        for (k, sum) in sum.iter_mut().enumerate() {
            *sum += (state.t - begin) / 6.0 * (before[k] + 4.0 * middle[k] + after[k]);
        }
        before = after;
        seen(state);
    }
    sum
}

/// Compares what a motion gained with what it was given; returns the errors as shares of all impulses, and of the
/// largest energy.
fn balance(
    (system, mass): (&Jit, f64),
    [start, end]: [&Motion; 2],
    given: [f64; 4],
    largest: f64,
) -> [f64; 2] {
    let [before, after] = [start, end].map(|s| system.momentum(&s.q, &s.u).unwrap().linear);
    let duration = end.t - start.t;
    let weight = [0.0, 0.0, -mass * GRAVITY];
    let mut impulse = 0.0;
    for k in 0..3 {
        let gained = after[k] - before[k];
        impulse = keep_largest(impulse, (gained - (given[k] + weight[k] * duration)).abs());
    }
    let gained = energy(system, end, mass) - energy(system, start, mass);
    [impulse / (mass * GRAVITY * duration), (gained - given[3]).abs() / largest]
}

/// The largest share of its friction cone that a contact point with a force uses.
fn cone(touches: &[Touch], friction: impl Fn(usize) -> f64) -> f64 {
    let mut worst = 0.0;
    for (k, touch) in touches.iter().enumerate() {
        let [x, y, z] = touch.force;
        assert!(z >= 0.0, "the ground pulls at point {k}: {z} N");
        if z > 0.0 {
            worst = keep_largest(worst, x.hypot(y) / (friction(k) * z));
        }
    }
    worst
}

/// Power of the crawler's motors and hinge dampers, W, by the numbers of its file.
fn crawler_power(state: &Motion) -> f64 {
    let phase = 2.0 * std::f64::consts::PI * 1.5 * state.t;
    let [lift, swing, press] = [55.0_f64, 17.0, 14.0].map(f64::to_radians);
    let shoulder = lift + swing * phase.sin();
    let fade = (state.t / 0.5).min(1.0);
    let wanted = [fade * shoulder, fade * (-2.0 * shoulder - press * phase.cos())];
    let mut power = 0.0;
    for ((wanted, q), u) in wanted.into_iter().zip(&state.q).zip(&state.u) {
        let volts = (10.0 * (wanted - q)).clamp(-3.7, 3.7);
        let current = (volts - 100.0 * 1.5e-3 * u) / 12.0;
        power += 100.0 * 1.5e-3 * current * u - 2e-5 * u * u;
    }
    power
}

#[test]
fn the_crawler_gains_what_motors_and_ground_give() {
    let (system, mut state, mass) = robot("crawler");
    let (start, mut largest, mut worst) = (state.clone(), 0.0, 0.0);
    let names = system.interface().contacts.clone();
    let friction = |k: usize| if names[k].starts_with("pads") { 0.8 } else { 0.25 };
    let given = follow((&system, &mut state), 2.0, crawler_power, |state| {
        worst = keep_largest(worst, cone(&touches(&system, state), friction));
        largest = keep_largest(largest, energy(&system, state, mass));
    });
    let errors = balance((&system, mass), [&start, &state], given, largest);
    println!("momentum and energy: {errors:?}; {worst} of the friction cone");
    assert!(errors[0] <= 1e-6 && errors[1] <= 1e-5, "{errors:?}");
    // Regularised friction comes near to Coulomb's limit while it slides, and never to it.
    assert!(worst > 0.9 && worst < 1.0, "{worst}");
}

#[test]
fn the_crawler_walks_as_far_as_its_foot_reaches() {
    let (system, start, _) = robot("crawler");
    // Steady steps, from 2 s to 4 s, are three; how far the foot is from the shoulder while it carries weight.
    let feet =
        |state: &Motion| touches(&system, state)[4..].iter().map(|t| t.force[2]).sum::<f64>();
    let (mut state, mut reach) = (start.clone(), [f64::INFINITY, f64::NEG_INFINITY]);
    let mut method = dopri5(&system, 1e-8);
    method.run(&system, &mut state, 2.0, |_| ()).unwrap();
    let before = state.clone();
    let observe = |state: &Motion| {
        let distance = 0.035 * (state.q[0].cos() + (state.q[0] + state.q[1]).cos());
        if feet(state) > 0.02 {
            reach = [reach[0].min(distance), reach[1].max(distance)];
        }
    };
    method.run(&system, &mut state, 4.0, observe).unwrap();
    let step = (state.q[2] - before.q[2]) / 3.0;
    let share = step / (reach[1] - reach[0]);
    println!("steps of {step} m are {share} of the reach");
    assert!(share > 0.85 && share < 1.0, "{step} {reach:?}");
    assert!(state.q[2] > 0.14, "less than a body length in four seconds: {}", state.q[2]);
    // It walks straight, and each step is the same.
    assert!(state.q[3].abs() < 1e-6, "{}", state.q[3]);
    let [first, last] = [&before, &state].map(|s| [s.q[0], s.q[1], s.q[4], s.u[2]]);
    let change =
        first.iter().zip(last).fold(0.0, |worst, (a, b)| keep_largest(worst, (a - b).abs()));
    assert!(change < 1e-5, "{change}");
    // The implicit method goes the same way.
    let mut other = start;
    rodas(&system, 1e-6).run(&system, &mut other, 4.0, |_| ()).unwrap();
    let difference = (other.q[2] - state.q[2]).abs();
    println!("{difference:e} m between both methods after {} m", state.q[2]);
    assert!(difference < 1e-5, "{difference:e}");
}

/// Power of the dampers of the jumper's ridge and band, W, by the numbers of its file.
fn jumper_power(system: &Jit, state: &Motion) -> f64 {
    let length = |q: &[f64]| {
        let points = system.points(&q.to_vec()).unwrap();
        let [a, b] = [points[4], points[5]];
        let d: [f64; 3] = std::array::from_fn(|k| b[k] - a[k]);
        vec![dot(d, d).sqrt()]
    };
    let [stretch, rate] = [length(&state.q)[0] - 0.05, rates(system, state, length)[0]];
    // Damping makes a stretched band slack, but never push.
    let damping = if stretch > 0.0 { (0.02 * rate).max(-60.0 * stretch) } else { 0.0 };
    -2e-5 * state.u[0] * state.u[0] - damping * rate
}

#[test]
fn the_jumper_gains_what_the_ground_gives() {
    let (system, mut state, mass) = robot("jumper");
    let (start, mut worst) = (state.clone(), 0.0);
    let largest = energy(&system, &start, mass);
    let others = |state: &Motion| jumper_power(&system, state);
    let given = follow((&system, &mut state), 1.0, others, |state| {
        worst = keep_largest(worst, cone(&touches(&system, state), |_| 0.3));
    });
    let errors = balance((&system, mass), [&start, &state], given, largest);
    println!("momentum and energy: {errors:?}; {worst} of the friction cone");
    assert!(errors[0] <= 1e-6 && errors[1] <= 1e-5, "{errors:?}");
    assert!(worst > 0.99 && worst < 1.0, "{worst}");
    // It rests: the ground carries its weight, and its feet creep slower than they slip.
    let carried: f64 = touches(&system, &state).iter().map(|touch| touch.force[2]).sum();
    assert!((carried / (mass * GRAVITY) - 1.0).abs() < 1e-6, "{carried} N");
    let fastest = state.u.iter().fold(0.0, |worst, u| keep_largest(worst, u.abs()));
    assert!(fastest < 1e-4, "{:?}", state.u);
}

#[test]
fn the_jumper_flies_as_high_as_its_momentum_carries_it() {
    let (system, mut state, mass) = robot("jumper");
    let is_in_the_air =
        |state: &Motion| touches(&system, state).iter().all(|touch| touch.force == [0.0; 3]);
    let mut method = dopri5(&system, 1e-12);
    let momentum = |state: &Motion| system.momentum(&state.q, &state.u).unwrap();
    method.run(&system, &mut state, 0.03, |_| ()).unwrap();
    assert!(is_in_the_air(&state));
    let before = momentum(&state);
    let speed = before.linear[2] / mass;
    let rise = speed / GRAVITY;
    let watch = |state: &Motion| {
        assert!(is_in_the_air(state), "it touches the ground at {} s", state.t);
    };
    let start = state.t;
    method.run(&system, &mut state, start + rise, watch).unwrap();
    let apex = momentum(&state);
    let expected = before.centre[2] + speed * speed / (2.0 * GRAVITY);
    println!("{} mm high, {rise} s after {speed} m/s", 1e3 * expected);
    assert!((apex.centre[2] - expected).abs() <= 1e-10);
    assert!(apex.linear[2].abs() <= 1e-9 * before.linear[2]);
    assert!(expected > 0.12, "a poor jump: {expected} m");
    method.run(&system, &mut state, start + 1.8 * rise, watch).unwrap();
    let after = momentum(&state);
    let fallen = expected - 0.5 * GRAVITY * (0.8 * rise) * (0.8 * rise);
    assert!((after.centre[2] - fallen).abs() <= 1e-10);
    let turned = (0..3)
        .fold(0.0, |worst, k| keep_largest(worst, (after.angular[k] - before.angular[k]).abs()));
    assert!(turned <= 1e-12, "{turned:e} kg m^2/s");
    // The implicit method jumps as high.
    let (_, mut other, _) = robot("jumper");
    rodas(&system, 1e-8).run(&system, &mut other, start + rise, |_| ()).unwrap();
    let difference = (momentum(&other).centre[2] - expected).abs();
    println!("{difference:e} m between both methods");
    assert!(difference <= 1e-6, "{difference:e}");
}
