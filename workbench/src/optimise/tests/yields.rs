//! Robots that are built with tolerances, against probabilities and means that are known.

use statrs::distribution::{ContinuousCDF as _, Normal};

use super::numbers::ROD;
use super::*;

/// The share of a standard normal distribution below a number.
fn below(number: f64) -> f64 {
    Normal::new(0.0, 1.0).unwrap().cdf(number)
}

fn built(problem: &Problem<'_>, robots: u64, threads: usize) -> Yield {
    problem.built_robots(robots, threads, &|| false, &|| ()).unwrap().unwrap()
}

/// The rod rests at 1 mN m/k. Its angle and its mass depend on one tolerance each, so that probabilities multiply.
#[test]
fn the_share_of_good_robots_is_a_product_of_probabilities() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { l: {} }
        tolerances: { k: { normal: 5% }, m: { normal: 0.1 g } }
        goals: { bend: { angle: hinge, target: 0.5rad, within: 0.05rad } }
        constraints: { light: { mass: all, at_most: 2.1 g } }
        ",
    );
    let robots = 4096;
    let found = built(&problem, robots, 2);
    let share = |good: u64| good as f64 / robots as f64;
    let by_angle = below((1e-3 / 0.45 - 2e-3) / 1e-4) - below((1e-3 / 0.55 - 2e-3) / 1e-4);
    let by_mass = below(1.0);
    // Sobol's sequence is better than independent robots: a few of them are on the wrong side.
    let near = |found: f64, wanted: f64| {
        assert!((found - wanted).abs() < 2e-3, "{found} is not {wanted}");
    };
    near(share(found.good), by_angle * by_mass);
    near(share(found.judged[0].good.unwrap()), by_angle);
    near(share(found.judged[1].good.unwrap()), by_mass);
    near(share(found.tolerances[0].good_without), by_mass);
    near(share(found.tolerances[1].good_without), by_angle);
    // Of n robots, those that change are lost or won.
    let changed = (by_mass - by_angle * by_mass) * robots as f64;
    assert!((found.tolerances[0].error - changed.sqrt()).abs() < 1.0);
    let [low, high] = found.interval();
    assert!(low < by_angle * by_mass && by_angle * by_mass < high && high - low < 0.03);
    assert!((found.judged[0].nominal - 0.5).abs() < 1e-9);
    assert!((found.judged[1].deviation / 1e-4 - 1.0).abs() < 1e-2);
    assert_eq!((found.judged[0].shares.len(), found.failures.len()), (2, 0));
    assert!((found.judged[0].shares[0] - 1.0).abs() < 1e-9);
    assert!((found.judged[1].shares[1] - 1.0).abs() < 1e-9);
    // One thread or many: the same robots.
    assert_eq!(built(&problem, 64, 1).good, built(&problem, 64, 2).good);
}

/// Robots that cannot be are counted with the reason, and are not good.
#[test]
fn robots_that_are_not_possible_are_not_good() {
    let compiled = compiled(ROD);
    let problem = problem(
        &compiled,
        "
        parameters: { l: {} }
        tolerances: { k: { normal: 1e-3 } }
        goals: { bend: { angle: hinge, target: 0.5rad, within: 100rad } }
        ",
    );
    let found = built(&problem, 1024, 2);
    // The model has a range for the stiffness, from one standard deviation below the mean to two above.
    let impossible: u64 = found.failures.iter().map(|(_, times)| times).sum();
    assert_eq!(found.good + impossible, 1024);
    assert!((impossible as f64 / 1024.0 - below(-1.0) - below(-2.0)).abs() < 5e-3, "{impossible}");
}

/// Half the width of the tolerance of k, and its mean and mean square of the angle, by integrals.
const WIDE: f64 = 1e-4;

fn moments(k: f64) -> (f64, f64) {
    let mean = 1e-3 * ((k + WIDE) / (k - WIDE)).ln() / (2.0 * WIDE);
    let square = 1e-6 / (k * k - WIDE * WIDE);
    (mean, (square - mean * mean).sqrt())
}

const ROBUST: &str = "
    parameters: { k: {} }
    tolerances: { k: { uniform: 1e-4 } }
    robust: 3
    robots: 1024
    starts: 3
";

/// The rod is to bend as far as it can, but by no more than half a radian with three standard deviations.
#[test]
fn a_robust_constraint_keeps_its_distance() {
    let compiled = compiled(ROD);
    let goals = format!(
        "{ROBUST}
    goals: {{ bend: {{ angle: hinge, target: 1rad }} }}
    constraints: {{ stay: {{ angle: hinge, at_most: 0.5rad }} }}"
    );
    let problem = problem(&compiled, &goals);
    let found = optimised(&problem);
    let k = problem.parameters(&found.found[found.best].x)[0];
    let (mean, deviation) = moments(k);
    assert!((mean + 3.0 * deviation - 0.5).abs() < 1e-4, "{k}: {mean} +- {deviation}");
}

/// The best mean plus spread of a curved function is not where the design itself is best.
#[test]
fn a_robust_target_moves_away_from_where_the_slope_is_steep() {
    let compiled = compiled(ROD);
    for norm in ["squares", "max"] {
        let goals = format!(
            "{ROBUST}
    norm: {norm}
    goals: {{ bend: {{ angle: hinge, target: 0.8rad }} }}"
        );
        let problem = problem(&compiled, &goals);
        let found = optimised(&problem);
        let k = problem.parameters(&found.found[found.best].x)[0];
        let cost = |k: f64| {
            let (mean, deviation) = moments(k);
            let error = mean - 0.8;
            match norm {
                "squares" => error * error + 9.0 * deviation * deviation,
                _ => error.abs() + 3.0 * deviation,
            }
        };
        // A fine grid: the cost is smooth or has one kink.
        let grid = (0..=300_000).map(|step| 1.15e-3 + 1e-9 * f64::from(step));
        let best = grid.min_by(|a, b| cost(*a).total_cmp(&cost(*b))).unwrap();
        assert!((k / best - 1.0).abs() < 1e-3, "{norm}: {k} is not {best}");
        assert!(best / (1e-3 / 0.8) - 1.0 > 1e-3, "{norm}: the design is as good: {best}");
    }
}

#[test]
fn mistakes_of_tolerances_are_located() {
    let compiled = compiled(ROD);
    let wrong = |tolerances: &str, rest: &str, message: &str| {
        let goals = format!(
            "{{ parameters: {{ l: {{}} }}, tolerances: {tolerances}, {rest} goals: {{ bend: {{ angle: hinge, target: 1rad }} }} }}"
        );
        let problems = Goals::read(&file(&goals), &compiled).unwrap_err();
        let text = problems.to_string();
        assert!(text.contains(message), "{text}");
        assert!(problems.0.iter().all(|problem| problem.span.is_some()));
    };
    wrong("{ x: { normal: 1 } }", "", "the model has no quantity `x`");
    wrong("{ initial.hinge: { normal: 1 } }", "", "no quantity `initial.hinge`");
    wrong("{ k: { normal: -1 } }", "", "a tolerance must be more than 0");
    wrong("{ k: {} }", "", "give one of `uniform`, `log_uniform` and `normal`");
    wrong("{ k: { normal: 1% } }", "robots: 1,", "`robots` must be 2 to 10000");
    wrong("{ k: { normal: 1% } }", "robust: -1,", "`robust` must not be negative");
    wrong("{}", "robust: 3,", "`robust` needs `tolerances`");
}
