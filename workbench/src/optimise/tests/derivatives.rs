//! Derivatives by the variables against central differences.

use crate::compare::largest;

use super::*;

/// Central differences with this step, in shares of ranges: their error is about its square.
const STEP: f64 = 1e-5;

/// Compares the derivatives of all errors at a design with central differences.
fn check(problem: &Problem<'_>, x: &[f64], allowed: f64) {
    let numbers = |x: &[f64]| -> Vec<Number> {
        let at = problem.evaluate(x).unwrap_or_else(|reason| panic!("{reason}"));
        let errors = at.goals.into_iter().flat_map(|it| it.errors).flatten();
        errors.chain(at.constraints.into_iter().map(|it| it.excess)).collect()
    };
    let found = numbers(x);
    let largest = largest(found.iter().flat_map(|it| it.slope.iter()));
    assert!(largest > 0.0);
    for variable in 0..x.len() {
        let moved = |by: f64| {
            let mut x = x.to_vec();
            x[variable] += by;
            numbers(&x)
        };
        for ((number, plus), minus) in found.iter().zip(moved(STEP)).zip(moved(-STEP)) {
            let slope = (plus.value - minus.value) / (2.0 * STEP);
            let error = (number.slope[variable] - slope).abs() / largest;
            assert!(error < allowed, "variable {variable}: {} and {slope}", number.slope[variable]);
        }
    }
}

const LINKAGE: &str = include_str!("../../../../examples/linkage.yaml");

const TIMED: &str = "
parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
goals:
  way:
    path:
      { point: pen, drive: drive, angles: [60deg, 150deg], timed: true, through: [[0.03, 0.04, 0.03], [0.01, 0.04, 0.03], [0, 0.04, 0.02]] }
";

#[test]
fn a_path_that_is_timed_has_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    check(&problem(&compiled, TIMED), &[0.3, 0.6, 0.45, 0.7], 1e-8);
}

#[test]
fn the_distance_from_a_path_in_a_plane_has_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    // Points on either side of the path, and one beyond its end.
    let goals = "
        parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
        goals:
          way: { path: { point: pen, drive: drive, angles: [60deg, 120deg], plane: xz, unit: mm, through: [[27, -22], [20, -33], [90, 90]] } }
    ";
    let problem = problem(&compiled, goals);
    let x = [0.3, 0.6, 0.45, 0.7];
    let at = problem.evaluate(&x).unwrap();
    let signs: Vec<f64> = at.goals[0].errors.iter().map(|it| it[0].value.signum()).collect();
    assert!(signs[0] * signs[1] < 0.0, "{signs:?}");
    check(&problem, &x, 1e-7);
}

/// In space the error is a vector. Its parts turn with the path; the derivatives of its square are exact.
#[test]
fn the_square_of_the_distance_from_a_path_in_space_has_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    let goals = "
        parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
        goals:
          way: { path: { point: pen, drive: drive, angles: [60deg, 120deg], unit: mm, through: [[27, 38, -22], [20, 45, -33], [90, 0, 90]] } }
    ";
    let problem = problem(&compiled, goals);
    let x = [0.3, 0.6, 0.45, 0.7];
    let objective = |x: &[f64]| problem.evaluate(x).unwrap().objective(&problem.goals);
    let residuals = problem.evaluate(&x).unwrap().residuals(&problem.goals);
    for variable in 0..x.len() {
        let moved = |by: f64| {
            let mut x = x;
            x[variable] += by;
            objective(&x)
        };
        let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
        let found: f64 = residuals.iter().map(|it| 2.0 * it.value * it.slope[variable]).sum();
        assert!(
            (found - slope).abs() < 1e-8 * objective(&x),
            "variable {variable}: {found} {slope}"
        );
    }
}

#[test]
fn limits_on_a_path_have_exact_derivatives() {
    let model =
        LINKAGE.replace("hinge: *strip }\n  back", "hinge: *strip, limits: [-2, 2] }\n  back");
    let compiled = compiled(&model);
    let problem = problem(&compiled, TIMED);
    let at = problem.evaluate(&[0.5; 4]).unwrap();
    assert_eq!(at.constraints.len(), 2);
    check(&problem, &[0.3, 0.6, 0.45, 0.7], 1e-8);
}

#[test]
fn a_state_of_rest_has_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    let goals = "
        parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
        goals:
          bend: { angle: front, target: 0.5 }
          height: { position: pen.z, target: 20 mm }
          store: { energy: potential, target: 1 mJ }
    ";
    check(&problem(&compiled, goals), &[0.3, 0.6, 0.45, 0.7], 1e-7);
}

#[test]
fn strokes_have_exact_derivatives() {
    let compiled = compiled(LINKAGE);
    let goals = "
        parameters: { crank: {}, coupler: {}, rocker: {}, width: {} }
        goals:
          way: { stroke: { point: pen, drive: drive, angles: [60deg, 120deg] }, target: 20 mm }
          swing: { stroke: { joint: pivot, drive: drive, angles: [60deg, 170deg] }, target: 1 }
    ";
    check(&problem(&compiled, goals), &[0.3, 0.6, 0.45, 0.7], 1e-7);
}
