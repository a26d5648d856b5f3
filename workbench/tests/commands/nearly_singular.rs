//! What is said of a mass matrix that is nearly singular, against the closed form of two links.

use std::fs;

use super::common::{folder, json, run, text};

/// A light link that carries a point of a kilogram at the end of another one, lengths 0.1 m, and a torque of 1 N m between both. A
/// four-bar beside them is part of the same mass matrix.
fn model(light: f64) -> String {
    format!(
        "gravity: [0, 0, 0]\nbodies:\n  base: {{ fixed: true }}\n  \
         a: {{ mass: 1e-3, com: [0, 0, 0], inertia: [[{light}, 0, 0], [0, {light}, 0], [0, 0, {light}]] }}\n  \
         b: {{ mass: 1, com: [0.2, 0, 0], inertia: [[{light}, 0, 0], [0, {light}, 0], [0, 0, {light}]] }}\n  \
         c: {{ mass: 0.01, com: [0.05, 1, 0], inertia: [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]] }}\n  \
         d: {{ mass: 0.01, com: [0.15, 1, 0], inertia: [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]] }}\n  \
         e: {{ mass: 0.01, com: [0.22, 1, 0], inertia: [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]] }}\njoints:\n  \
         j: {{ bodies: [base, a], axis: [[0, 0], [0, 0.02]] }}\n  \
         k: {{ bodies: [a, b], axis: [[0.1, 0], [0.1, 0.02]], torque: \"1\" }}\n  \
         l: {{ bodies: [base, c], axis: [[0, 1], [0, 1.02]] }}\n  \
         m: {{ bodies: [c, d], axis: [[0.1, 1], [0.1, 1.02]] }}\n  \
         n: {{ bodies: [d, e], axis: [[0.3, 1], [0.3, 1.02]] }}\n  \
         o: {{ bodies: [e, base], axis: [[0.15, 1], [0.15, 1.02]] }}\n\
         initial: {{ q: {{ l: 0.5 }} }}\n"
    )
}

/// M of both links in a line, and its determinant without cancellation.
fn closed_form(light: f64) -> ([f64; 3], f64) {
    let [length, reach] = [0.1_f64, 0.1];
    let own = light + reach * reach;
    let cross = own + length * reach;
    let all = light + cross + length * length + length * reach;
    ([all, cross, own], light * own + light * length * length)
}

#[test]
fn check_states_the_condition_number_of_independent_speeds() {
    let (_guard, folder) = folder();
    let file = folder.join("links.yaml").display().to_string();
    for (light, is_singular) in [(1e-13, true), (1e-4, false)] {
        fs::write(&file, model(light)).unwrap();
        let ([all, cross, own], determinant) = closed_form(light);
        // The eigenvalues of the scaled matrix are 1 - c and 1 + c, and those of the four-bar lie between.
        let c = cross / (all * own).sqrt();
        let expected = (1.0 + c).powi(2) * all * own / determinant;
        let output = run(&["check", &file]);
        let report = text(&output.stdout);
        let line = report.lines().find(|line| line.starts_with("mass matrix at the start"));
        let found = line.and_then(|line| line.split_whitespace().nth(7)).expect(&report);
        let found: f64 = found.parse().unwrap();
        assert!((found / expected - 1.0).abs() < 1e-2, "{found} is not {expected}");
        let said = text(&output.stderr).contains("the mass matrix is nearly singular");
        assert_eq!(said, is_singular, "{}", text(&output.stderr));
        let simulated = run(&["simulate", &file, "--duration", "1e-5"]);
        let said = text(&simulated.stderr).contains("the mass matrix is nearly singular");
        assert_eq!(said, is_singular, "{}", text(&simulated.stderr));
    }
}

/// The warning says how many digits are left: so many are right, and hardly more.
#[test]
fn accelerations_lose_what_is_said() {
    let (_guard, folder) = folder();
    let file = folder.join("links.yaml").display().to_string();
    let light = 1e-13;
    fs::write(&file, model(light)).unwrap();
    let found = json(&run(&["eval", &file]));
    let found = found["states"][0]["acceleration"][0].as_f64().unwrap();
    let ([_, cross, _], determinant) = closed_form(light);
    let error = (found / (-cross / determinant) - 1.0).abs();
    assert!((1e-9..1e-4).contains(&error), "{found}: {error}");
}
