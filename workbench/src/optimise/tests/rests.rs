//! Numbers of states of rest and of motions that come to rest, with derivatives by the variables.

use lamc_runtime::Mechanism as _;

use super::*;
use crate::compare::largest;

/// Between the five points of the differences that derivatives are compared with, in shares of ranges: their error is about its
/// fourth power.
const STEP: f64 = 3e-4;

/// The derivatives of all goals at a design against differences, relative to the largest of each goal.
fn check(problem: &Problem<'_>, x: &[f64], step: f64, allowed: f64) {
    let numbers = |x: &[f64]| -> Vec<Number> {
        let at = problem.evaluate(x).unwrap_or_else(|reason| panic!("{reason}"));
        at.goals.into_iter().flat_map(|it| it.errors).flatten().collect()
    };
    let found = numbers(x);
    let moved: Vec<[Vec<Number>; 4]> = (0..x.len())
        .map(|variable| {
            [-2.0, -1.0, 1.0, 2.0].map(|steps| {
                let mut x = x.to_vec();
                x[variable] += steps * step;
                numbers(&x)
            })
        })
        .collect();
    for (goal, number) in found.iter().enumerate() {
        let slopes = moved.iter().map(|at| {
            let [a, b, c, d] = at.each_ref().map(|numbers| numbers[goal].value);
            (a - 8.0 * b + 8.0 * c - d) / (12.0 * step)
        });
        let size = largest(&number.slope);
        assert!(size > 0.0, "goal {goal}");
        for (variable, slope) in slopes.enumerate() {
            let error = (number.slope[variable] - slope).abs() / size;
            assert!(error < allowed, "goal {goal}, variable {variable}: {error}");
        }
    }
}

const LINKAGE: &str = include_str!("../../../../examples/linkage.yaml");

#[test]
fn small_motions_of_a_closed_loop_have_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    let goals = "
        parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
        goals:
          pitch: { frequency: 1, target: 10 Hz }
          hard: { stiffness: pen.x, target: 1 N/m }
    ";
    check(&problem(&compiled, goals), &[0.3, 0.6, 0.45, 0.7], STEP, 1e-9);
}

/// A sheet whose nine loops depend on each other, whose springs are relaxed at a fold that is a parameter; at 0.7 rad, and at 0.02 rad.
#[test]
fn small_motions_of_a_sheet_have_exact_derivatives_next_to_flat_too() {
    let mut model = include_str!("../../../../examples/miura.yaml").replace(
        "b: 2e-6",
        "b: { value: 2e-6, range: [1e-6, 4e-6] }, turn: { value: 1, range: [0.02, 1.2] }",
    );
    for (rest, turn) in [("60", "turn"), ("38.2", "0.46*turn")] {
        model = model.replace(&format!("rest: {rest} }}"), &format!("rest: \"{turn}\" }}"));
        model = model.replace(&format!("rest: -{rest} }}"), &format!("rest: \"-{turn}\" }}"));
    }
    assert_eq!(model.matches("turn\" }").count(), 24);
    let compiled = compiled(&model);
    let goals = "
        parameters: { b: {}, turn: {} }
        goals:
          pitch: { frequency: 1, target: 10 Hz }
          hard: { stiffness: corner.x, target: 1 N/m }
    ";
    let problem = problem(&compiled, goals);
    check(&problem, &[0.3, 0.57], STEP, 1e-9);
    // Here everything is a power of the fold, which a step must not change by much, and the state of rest, good to 1e-12, is
    // differenced.
    check(&problem, &[0.3, 0.01], 0.35 * STEP, 2e-7);
}

#[test]
fn forces_at_rest_have_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    let goals = "
        parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
        goals:
          front: { force: front, target: 1 N }
          back: { force: back, target: 1 N }
    ";
    check(&problem(&compiled, goals), &[0.3, 0.6, 0.45, 0.7], STEP, 1e-9);
}

/// Two rods in a row with springs, dampers, weights and a torque that is no gradient: the modes are damped, and neither M nor K is diagonal.
const PAIR: &str = "
parameters:
  k: { value: 3e-3, range: [2e-3, 6e-3] }
  b: { value: 2e-6, range: [1e-6, 2e-4] }
  l: { value: 20 mm, range: [10 mm, 40 mm] }
bodies:
  base: { fixed: true }
  near: { mass: 2 g, com: [0, \"-l/2\", 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
  far: { mass: 1 g, com: [0, \"-1.5*l\", 0], inertia: [[1e-7, 0, 0], [0, 1e-9, 0], [0, 0, 1e-7]] }
joints:
  hip: { bodies: [base, near], axis: [[0, 0], [1, 0]], stiffness: k, damping: b }
  knee: { bodies: [near, far], axis: [[0, \"-l\"], [1, \"-l\"]], stiffness: \"k/2\", damping: \"b/3\", torque: \"1e-4 + 3e-4*q.hip\" }
points: { tip: { body: far, at: [0, \"-2*l\", 0] } }
";

#[test]
fn damped_modes_have_exact_derivatives() {
    let compiled = compiled(PAIR);
    let goals = "
        parameters: { k: {}, b: {}, l: {} }
        goals:
          slow: { frequency: 1, target: 10 Hz }
          quick: { frequency: 2, target: 10 Hz }
          hard: { stiffness: tip.z, target: 1 N/m }
    ";
    let problem = problem(&compiled, goals);
    // Swinging, and so damped that a mode only decays.
    for x in [[0.4, 0.05, 0.3], [0.4, 0.95, 0.3]] {
        check(&problem, &x, STEP, 1e-9);
    }
}

/// A rod that a prescribed angle holds against its weight and a spring.
#[test]
fn the_torque_of_a_drive_and_the_force_of_a_hinge_are_those_of_statics() {
    let compiled = compiled(
        "
        parameters: { k: { value: 2e-3, range: [1e-3, 4e-3] }, l: { value: 20 mm, range: [10 mm, 40 mm] }, m: { value: 2 g, range: [1 g, 3 g] } }
        bodies:
          base: { fixed: true }
          rod: { mass: m, com: [0, \"-l\", 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
        joints:
          hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: k, drive: 0.5 }
        ",
    );
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, l: {}, m: {} }
        goals: { hold: { torque: hinge, target: 1 N*m }, carry: { force: hinge, target: 1 N } }
        ",
    );
    let x = [0.4, 0.3, 0.7];
    let [k, l, m]: [f64; 3] = [1e-3 + 0.4 * 3e-3, 0.010 + 0.3 * 0.030, 1e-3 + 0.7 * 2e-3];
    let (g, angle) = (9.81, 0.5_f64);
    let at = problem.evaluate(&x).unwrap();
    // The rod points to -y; turned up by the angle about x, gravity along -z pulls it with m g l cos(angle).
    let arm = g * l * angle.cos();
    let torque = k * angle - m * arm;
    let wanted = [(torque, [angle, -m * g * angle.cos(), -arm]), (m * g, [0.0, 0.0, g])];
    let widths = [3e-3, 0.030, 2e-3];
    for (reached, (value, slopes)) in at.goals.iter().zip(wanted) {
        assert!((reached.value / value - 1.0).abs() < 1e-12, "{} {value}", reached.value);
        for ((found, slope), width) in reached.errors[0][0].slope.iter().zip(slopes).zip(widths) {
            assert!((found - slope * width).abs() < 1e-12, "{found} {}", slope * width);
        }
    }
}

/// theta'' + 2 d theta' + w^2 theta = w^2 theta_rest from rest at zero.
#[test]
fn the_time_to_settle_is_that_of_a_damped_oscillator() {
    let model = numbers::ROD
        .replace("l: {", "b: { value: 1e-5, range: [4e-6, 1e-5] }, l: {")
        .replace("stiffness: k,", "stiffness: k, damping: b,");
    let compiled = compiled(&model);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, b: {}, m: {} }
        goals: { calm: { settle: { angle: hinge, within: 0.02, until: 3 s }, target: 1 s } }
        ",
    );
    let closed = |x: &[f64]| {
        let [k, b, m] = [1e-3 + x[0] * 3e-3, 4e-6 + x[1] * 6e-6, 1e-3 + x[2] * 2e-3];
        let inertia = m * 0.02 * 0.02 + 3e-7;
        let (decay, square, rest) = (0.5 * b / inertia, k / inertia, 1e-3 / k);
        let swing = (square - decay * decay).sqrt();
        let away = |t: f64| {
            let phase = swing * t;
            rest * (-decay * t).exp() * (phase.cos() + decay / swing * phase.sin())
        };
        let over = |t: f64| away(t).abs() - 0.02;
        let step = 1e-4;
        let last = (0..30_000).rev().find(|index| over(f64::from(*index) * step) > 0.0).unwrap();
        let (mut low, mut high) = (f64::from(last) * step, f64::from(last + 1) * step);
        while high - low > 1e-15 {
            let middle = 0.5 * (low + high);
            if over(middle) > 0.0 { low = middle } else { high = middle }
        }
        low
    };
    // Beyond these, another swing becomes the last one.
    const NEAR: f64 = 1e-5;
    let x = [0.4, 0.3, 0.7];
    let at = problem.evaluate(&x).unwrap();
    assert!((at.goals[0].value / closed(&x) - 1.0).abs() < 1e-7, "{}", at.goals[0].value);
    for variable in 0..3 {
        let moved = |steps: f64| {
            let mut x = x;
            x[variable] += steps * NEAR;
            closed(&x)
        };
        let slope =
            (moved(-2.0) - 8.0 * moved(-1.0) + 8.0 * moved(1.0) - moved(2.0)) / (12.0 * NEAR);
        let found = at.goals[0].errors[0][0].slope[variable];
        assert!((found - slope).abs() < 1e-6 * slope.abs(), "{found} {slope}");
    }
}

#[test]
fn a_motion_that_does_not_settle_is_no_result() {
    let compiled = compiled(numbers::ROD);
    let goals = "
        parameters: { k: {} }
        goals: { calm: { settle: { position: tip.z, within: 0.1 mm, until: 0.5 s }, at_most: 0.2 s } }
    ";
    let problem = problem(&compiled, goals);
    let failure = problem.evaluate(&[0.5]).unwrap_err();
    assert_eq!(failure, "`calm`: the motion has not settled after 0.5 s");
}

/// A strip of three plates; both flaps are turned up by springs without gravity.
const FLAPS: &str = "
units: { length: mm }
parameters:
  w: { value: 20 mm, range: [10 mm, 30 mm] }
  turn: { value: 1.2, range: [0.5, 2] }
materials: { card: { density: 700, thickness: 0.3 } }
layup: [card]
gravity: [0, 0, 0]
bodies:
  floor: { fixed: true, outline: [[0, 0], [w, 0], [w, 10], [0, 10]] }
  left: { outline: [[-15, 0], [0, 0], [0, 10], [-15, 10]] }
  right: { outline: [[w, 0], [\"w + 0.015\", 0], [\"w + 0.015\", 10], [w, 10]] }
joints:
  a: { bodies: [floor, left], axis: [[0, 0], [0, 10]], stiffness: 1e-3, rest: turn }
  b: { bodies: [floor, right], axis: [[w, 10], [w, 0]], stiffness: 1e-3, rest: turn }
";

#[test]
fn the_clearance_of_two_flaps_is_that_of_their_edges() {
    let compiled = compiled(FLAPS);
    let problem = problem(
        &compiled,
        "
        parameters: { w: {}, turn: {} }
        goals: { apart: { clearance: { between: [left, right] }, target: 10 mm } }
        ",
    );
    let widths = [20e-3, 1.5];
    let of = |x: [f64; 2]| -> ([f64; 2], Number) {
        let at = problem.evaluate(&x).unwrap();
        let number = at.goals[0].errors[0][0].scaled(0.0, problem.system.size());
        (
            [10e-3 + x[0] * widths[0], 0.5 + x[1] * widths[1]],
            Number { value: at.goals[0].value, ..number },
        )
    };
    // Apart by the hinges' distance, less what the tips lean inwards beyond a right angle.
    for (x, inwards) in [([0.4, 0.3], false), ([0.8, 0.9], true)] {
        let ([w, turn], found) = of(x);
        let (value, by_turn) = match inwards {
            true => (w + 2.0 * 15e-3 * turn.cos(), -2.0 * 15e-3 * turn.sin()),
            false => (w, 0.0),
        };
        assert!((found.value - value).abs() < 1e-12, "{} {value}", found.value);
        for (found, slope) in found.slope.iter().zip([widths[0], by_turn * widths[1]]) {
            assert!((found - slope).abs() < 1e-10, "{found} {slope}");
        }
    }
    // They pass through each other: each tip lies behind the other flap.
    let ([w, turn], found) = of([0.05, 0.98]);
    let depth = (-2.0 * 15e-3 * turn.cos() - w) * turn.sin();
    assert!(depth > 5e-4 && (found.value + depth).abs() < 1e-12, "{} {depth}", found.value);
}
