//! Numbers of designs against closed forms, limits, and goals that stand against each other.

use lamc::source::{self, to_yaml};
use lamc_runtime::Mechanism as _;

use super::*;

/// A rod of length l with its mass at its end, on a hinge of stiffness k without gravity, and a torque: it rests at
/// torque/k, and swings with sqrt(k / (m l^2 + I)).
pub(super) const ROD: &str = "
parameters: { k: { value: 2e-3, range: [1e-3, 4e-3] }, l: { value: 20 mm, range: [10 mm, 40 mm] }, m: { value: 2 g, range: [1 g, 3 g] } }
bodies:
  base: { fixed: true }
  rod: { mass: m, com: [0, \"-l\", 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
gravity: [0, 0, 0]
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: k, torque: 1 mN*m }
points: { tip: { body: rod, at: [0, \"-l\", 0] } }
";

#[test]
fn angle_frequency_and_mass_have_the_values_and_derivatives_of_closed_forms() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, l: {}, m: {} }
        goals:
          bend: { angle: hinge, target: 0.1 }
          pitch: { frequency: 1, target: 1 Hz }
          light: { mass: all, target: 1 kg }
        ",
    );
    let x = [0.4, 0.3, 0.7];
    let [k, l, m]: [f64; 3] = [1e-3 + 0.4 * 3e-3, 0.010 + 0.3 * 0.030, 1e-3 + 0.7 * 2e-3];
    let at = problem.evaluate(&x).unwrap();
    let inertia = m * l * l + 3e-7;
    let pitch = (k / inertia).sqrt() / std::f64::consts::TAU;
    let wanted = [
        (1e-3 / k, [-1e-3 / (k * k), 0.0, 0.0]),
        (pitch, [0.5 * pitch / k, -pitch * m * l / inertia, -0.5 * pitch * l * l / inertia]),
        (m, [0.0, 0.0, 1.0]),
    ];
    let widths = [3e-3, 0.030, 2e-3];
    // Frequencies and masses by central differences.
    for ((reached, (value, slopes)), allowed) in
        at.goals.iter().zip(wanted).zip([1e-10, 1e-10, 1e-10])
    {
        assert!((reached.value / value - 1.0).abs() < 1e-9, "{} {value}", reached.value);
        for ((found, slope), width) in reached.errors[0][0].slope.iter().zip(slopes).zip(widths) {
            assert!(
                (found - slope * width).abs() <= allowed * value.abs().max(1.0),
                "{found} {}",
                slope * width
            );
        }
    }
}

#[test]
fn a_stiffness_is_found_for_an_angle_within_a_limit_of_mass() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, m: {} }
        starts: 4
        goals: { bend: { angle: hinge, target: 0.4 }, heavy: { mass: rod, at_least: 3 g } }
        constraints: { light: { mass: all, at_most: 2.5 g } }
        ",
    );
    let outcome = optimised(&problem);
    let best = &outcome.found[outcome.best];
    let values = problem.parameters(&best.x);
    assert!((values[0] - 1e-3 / 0.4).abs() < 1e-8, "{}", values[0]);
    assert!((values[2] - 2.5e-3).abs() < 1e-8, "{}", values[2]);
    assert!(best.is_kept());
    let remarks = remarks(&problem, &outcome);
    assert!(remarks.iter().any(|it| it == "at its limit: `light`"), "{remarks:?}");
}

#[test]
fn constraints_that_cannot_be_kept_are_named() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {} }
        starts: 3
        goals: { bend: { angle: hinge, target: 0.4 } }
        constraints: { quick: { frequency: 1, at_least: 100 Hz } }
        ",
    );
    let outcome = optimised(&problem);
    let best = &outcome.found[outcome.best];
    assert!(!best.is_kept());
    let remarks = remarks(&problem, &outcome);
    assert!(remarks.iter().any(|it| it == "no design was found that keeps `quick`"), "{remarks:?}");
    // The nearest design is the stiffest one.
    assert!(best.x[0] > 0.99, "{:?}", best.x);
}

#[test]
fn goals_that_are_against_each_other_are_named() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, m: {} }
        starts: 3
        goals:
          bend: { angle: hinge, target: 0.4 }
          straight: { angle: hinge, target: 0.3 }
          light: { mass: all, target: 2 g }
        ",
    );
    let outcome = optimised(&problem);
    let best = &outcome.found[outcome.best];
    assert!((best.evaluation.goals[0].value - 0.35).abs() < 1e-6);
    let remarks = remarks(&problem, &outcome);
    assert_eq!(
        remarks,
        [
            "the goals `bend`, `straight` are against each other: what brings one nearer takes another away"
        ]
    );
}

#[test]
fn the_best_model_has_the_values_and_its_formulas() {
    let (model, _) = source::parse(&file(ROD)).unwrap();
    let best = to_yaml(&model.at(&[3e-3, 0.015, 2.2e-3]));
    let (read, _) = source::parse(&file(&best)).unwrap_or_else(|problems| panic!("{problems}"));
    let values: Vec<f64> = read.parameters.iter().map(|it| it.value).collect();
    assert_eq!(values, [3e-3, 0.015, 2.2e-3]);
    assert!(read.is_parametric(), "{best}");
    assert_eq!(read.parameters[1].range.as_ref().map(|it| it.value), Some([0.010, 0.040]));
}

/// Two rods: the first is pressed against its stop, the second hangs on it.
#[test]
fn a_joint_on_its_stop_stays_there() {
    let model = ROD
        .replace("torque: 1 mN*m }", "torque: 1 mN*m, limits: [-0.2, 0.2] }\n  knee: { bodies: [rod, shank], axis: [[0, -0.1], [1, -0.1]], stiffness: k, torque: 0.5 mN*m }")
        .replace("gravity:", "  shank: { mass: 1 g, com: [0, -0.2, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }\ngravity:");
    let compiled = compiled(&model);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {} }
        goals: { hip: { angle: hinge, target: 0.1 }, knee: { angle: knee, target: 0.1 } }
        ",
    );
    let at = problem.evaluate(&[0.5]).unwrap();
    let k = 2.5e-3;
    let slopes: Vec<f64> = at.goals.iter().map(|goal| goal.errors[0][0].slope[0]).collect();
    assert_eq!((at.goals[0].value, slopes[0]), (0.2, 0.0));
    assert!((at.goals[1].value - 0.5e-3 / k).abs() < 1e-12, "{}", at.goals[1].value);
    assert!((slopes[1] + 0.5e-3 / (k * k) * 3e-3).abs() < 1e-9, "{}", slopes[1]);
}

/// From rest at 0, the rod swings as (M/k) (1 - cos w t) with w^2 = k / (m l^2 + I).
#[test]
fn numbers_at_a_time_have_the_values_and_derivatives_of_the_closed_form() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {}, l: {}, m: {} }
        goals:
          angle: { angle: hinge, at: 60 ms, target: 1rad }
          height: { position: tip.z, at: 60 ms, target: 1 mm }
          speed: { energy: kinetic, at: 60 ms, target: 1 J }
          spring: { energy: potential, at: 60 ms, target: 1 J }
        ",
    );
    let x = [0.4, 0.3, 0.7];
    let [k, l, m]: [f64; 3] = [1e-3 + 0.4 * 3e-3, 0.010 + 0.3 * 0.030, 1e-3 + 0.7 * 2e-3];
    let (t, torque) = (0.06, 1e-3);
    let closed = |k: f64, l: f64, m: f64| {
        let inertia = m * l * l + 3e-7;
        let w = (k / inertia).sqrt();
        let angle = torque / k * (1.0 - (w * t).cos());
        let speed = torque / k * w * (w * t).sin();
        // Turned about x from -y.
        [angle, -l * angle.sin(), 0.5 * inertia * speed * speed, 0.5 * k * angle * angle]
    };
    let at = problem.evaluate(&x).unwrap();
    let widths = [3e-3, 0.030, 2e-3];
    let scales = [1.0, compiled.program.interface.size, 1.0, 1.0];
    let wanted = closed(k, l, m);
    for (index, (reached, scale)) in at.goals.iter().zip(scales).enumerate() {
        let value = wanted[index];
        assert!((reached.value / value - 1.0).abs() < 1e-6, "{index}: {} {value}", reached.value);
        for (variable, width) in widths.into_iter().enumerate() {
            let moved = |by: f64| {
                let mut values = [k, l, m];
                values[variable] += by * width;
                closed(values[0], values[1], values[2])[index]
            };
            // Of order 4: what is left is rounding.
            let h = 1e-3;
            let slope = (moved(-2.0 * h) - 8.0 * moved(-h) + 8.0 * moved(h) - moved(2.0 * h))
                / (12.0 * h * scale);
            let found = reached.errors[0][0].slope[variable];
            assert!(
                (found - slope).abs() < 1e-5 * slope.abs(),
                "{index}, {variable}: {found} {slope}"
            );
        }
    }
}

#[test]
fn a_stiffness_is_found_for_an_angle_at_a_time() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {} }
        starts: 4
        goals: { there: { angle: hinge, at: 0.04 s, target: 0.5rad } }
        constraints: { slow: { energy: kinetic, at: 0.04 s, at_most: 0.3 mJ } }
        ",
    );
    let outcome = optimised(&problem);
    let best = &outcome.found[outcome.best];
    assert!(best.is_kept());
    assert!((best.evaluation.goals[0].value - 0.5).abs() < 1e-6);
}

/// A strip as long as the stock allows: 5 mm of the stock are for the base.
#[test]
fn a_sheet_fits_its_stock() {
    let compiled = compiled(
        "
units: { length: mm }
parameters: { l: { value: 10 mm, range: [5 mm, 90 mm] } }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  base: { fixed: true, outline: [[0, -5], [10, -5], [10, 0], [0, 0]] }
  strip: { outline: [[0, 0], [10, 0], [10, \"l\"], [0, \"l\"]] }
joints:
  hinge: { bodies: [base, strip], axis: [[0, 0], [10, 0]], stiffness: 1e-3 }
",
    );
    let problem = problem(
        &compiled,
        "
        parameters: { l: {} }
        starts: 4
        goals: { heavy: { mass: strip, at_least: 1 kg } }
        constraints: { long: { extent: y, at_most: 60 mm }, wide: { extent: x, at_most: 10.1 mm } }
        ",
    );
    let at = problem.evaluate(&[0.5]).unwrap();
    let [long, wide] = [&at.constraints[0], &at.constraints[1]];
    assert!((long.value - 0.0525).abs() < 1e-12 && (wide.value - 0.01).abs() < 1e-12);
    // By the share of the range, over the size.
    let size = problem.system.size();
    assert!((long.excess.slope[0] * size - 0.085).abs() < 1e-9);
    assert!((wide.excess.slope[0] * size).abs() < 1e-9);
    let outcome = optimised(&problem);
    let best = &outcome.found[outcome.best];
    let length = problem.parameters(&best.x)[0];
    assert!((length - 0.055).abs() < 1e-7, "{length}");
}

/// Two rods in a row, bent at rest by the torques of their hinges: the compliance of the tip is that of two springs with
/// their lever arms, sum of a_i^2/k_i. Along the axes of the hinges the tip cannot move.
#[test]
fn the_stiffness_of_a_point_is_that_of_springs_in_a_row() {
    let model = "
parameters: { k: { value: 2e-3, range: [1e-3, 4e-3] } }
bodies:
  base: { fixed: true }
  one: { mass: 1 g, com: [0, 0.01, 0], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
  two: { mass: 1 g, com: [0, 0.03, 0], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
gravity: [0, 0, 0]
joints:
  first: { bodies: [base, one], axis: [[0, 0], [1, 0]], stiffness: k, rest: 0.3 }
  second: { bodies: [one, two], axis: [[0, 0.02], [1, 0.02]], stiffness: 3e-3, rest: 0.4 }
points: { tip: { body: two, at: [0, 0.05, 0] } }
";
    let compiled = compiled(model);
    let problem = problem(
        &compiled,
        "
        parameters: { k: {} }
        goals: { up: { stiffness: tip.z, target: 1 N/m }, along: { stiffness: tip.y, at_least: 2 N/m } }
        ",
    );
    let at = problem.evaluate(&[0.5]).unwrap();
    let k: f64 = 2.5e-3;
    // The lever arms about both hinges: how far the tip is from them across the axis.
    let [first, second] = [0.3_f64, 0.7_f64];
    let [near, far] = [first.sin_cos(), second.sin_cos()].map(|(sine, cosine)| [cosine, sine]);
    for (axis, reached) in at.goals.iter().enumerate() {
        let outer = 0.03 * far[axis];
        let whole = 0.02 * near[axis] + outer;
        let expected = 1.0 / (whole * whole / k + outer * outer / 3e-3);
        assert!((reached.value / expected - 1.0).abs() < 1e-9, "{} {expected}", reached.value);
        let slope = whole * whole * expected * expected / (k * k) * 3e-3;
        let found = reached.errors[0][0].slope[0].abs() * [1.0, 2.0][axis];
        let exceeds = axis == 0 || expected < 2.0;
        assert!(!exceeds || (found / slope - 1.0).abs() < 1e-6, "{found} {slope}");
    }
    let held = "{ parameters: { k: {} }, goals: { it: { stiffness: tip.x, target: 1 N/m } } }";
    let problem = self::problem(&compiled, held);
    assert!(problem.evaluate(&[0.5]).unwrap_err().contains("the point cannot move along x"));
}
