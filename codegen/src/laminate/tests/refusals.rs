//! What is physically impossible is refused, with its code, and everything at once.

use super::{body, drawn, material, model, plate, point_mass, spanned};
use crate::laminate::build;
use crate::source::{Body, Diagnostics, Expression, JointId, Shape, SourceModel, Spring};

const SQUARE: [[f64; 2]; 4] = [[0.0, 0.0], [0.04, 0.0], [0.04, 0.04], [0.0, 0.04]];

type Ring<'a> = &'a [[f64; 2]];

/// Plates of one layer: outlines with their holes.
fn plates(plates: &[(Ring, &[Ring])]) -> Body {
    let plates = plates.iter().map(|(outline, holes)| plate(outline, holes)).collect();
    body("plate", Shape::Plates(vec![plates]))
}

fn rigid(mass: f64, inertia: [[f64; 3]; 3]) -> Body {
    let (mass, com, inertia) = (drawn(mass), drawn([0.0; 3]), spanned(inertia));
    body("rigid", Shape::Rigid { mass, com, inertia })
}

fn diagonal(x: f64, y: f64, z: f64) -> [[f64; 3]; 3] {
    [[x, 0.0, 0.0], [0.0, y, 0.0], [0.0, 0.0, z]]
}

fn codes(model: &SourceModel) -> (Vec<&'static str>, Vec<&'static str>) {
    let mut warnings = Diagnostics::default();
    let errors = build(model, &mut warnings).err().unwrap_or_default();
    let codes = |d: Diagnostics| d.0.iter().map(|d| d.code.name).collect();
    (codes(errors), codes(warnings))
}

#[track_caller]
fn check(body: Body, errors: &[&str], warnings: &[&str]) {
    let found = codes(&model(vec![material(700.0, 4e-4)], vec![body]));
    assert_eq!(found, (errors.to_vec(), warnings.to_vec()));
}

#[test]
fn outlines() {
    let bow_tie = [[0.0, 0.0], [0.02, 0.02], [0.02, 0.0], [0.0, 0.02]];
    let pinched = [[0.0, 0.0], [0.01, 0.01], [0.02, 0.0], [0.02, 0.02], [0.01, 0.01], [0.0, 0.02]];
    let line = [[0.0, 0.0], [0.01, 0.01], [0.02, 0.02], [0.03, 0.03]];
    let spike = [[0.0, 0.0], [0.01, 0.01], [0.02, 0.03], [0.01, 0.01]];
    let inside = [[0.01, 0.01], [0.02, 0.01], [0.02, 0.02], [0.01, 0.02]];
    let shifted = [[0.015, 0.015], [0.025, 0.015], [0.025, 0.025], [0.015, 0.025]];
    let far = [[0.11, 0.01], [0.12, 0.01], [0.12, 0.02]];
    let across = [[0.03, 0.01], [0.05, 0.01], [0.05, 0.02], [0.03, 0.02]];
    let along_edge = [[0.0, 0.01], [0.02, 0.01], [0.02, 0.02], [0.0, 0.02]];
    let beside = [[0.04, 0.0], [0.08, 0.0], [0.08, 0.04], [0.04, 0.04]];
    let over = [[0.03, 0.0], [0.08, 0.0], [0.08, 0.04], [0.03, 0.04]];
    check(plates(&[(&SQUARE, &[])]), &[], &[]);
    check(plates(&[(&bow_tie, &[])]), &["self-crossing-outline"], &[]);
    check(plates(&[(&pinched, &[])]), &["self-crossing-outline"], &[]);
    check(plates(&[(&spike, &[])]), &["self-crossing-outline"], &[]);
    check(plates(&[(&line, &[])]), &["zero-area"], &[]);
    check(plates(&[(&[[f64::NAN, 0.0], [1.0, 0.0], [0.0, 1.0]], &[])]), &["not-finite"], &[]);
    check(plates(&[(&SQUARE, &[&inside])]), &[], &[]);
    check(plates(&[(&SQUARE, &[&along_edge])]), &[], &[]);
    check(
        plates(&[(&SQUARE, &[&bow_tie.map(|[x, y]| [x + 0.01, y + 0.01])])]),
        &["self-crossing-hole"],
        &[],
    );
    check(plates(&[(&SQUARE, &[&far])]), &["hole-outside"], &[]);
    check(plates(&[(&SQUARE, &[&across])]), &["hole-outside"], &[]);
    check(plates(&[(&SQUARE, &[&line])]), &["zero-area"], &[]);
    check(plates(&[(&SQUARE, &[&inside, &shifted])]), &["overlapping-holes"], &[]);
    check(plates(&[(&SQUARE, &[]), (&beside, &[])]), &[], &[]);
    check(plates(&[(&SQUARE, &[]), (&over, &[])]), &[], &["overlapping-plates"]);
    check(plates(&[(&SQUARE, &[&inside]), (&inside, &[])]), &[], &[]);
    check(plates(&[(&[], &[])]), &["zero-area"], &[]);
}

#[test]
fn mistakes_at_any_scale() {
    for scale in [1e-150, 1e-30, 1.0, 1e30, 1e150] {
        let square = SQUARE.map(|v| v.map(|x| x * scale));
        let bow_tie = [square[0], square[2], square[1], square[3]];
        let (errors, _) = codes(&model(
            vec![material(700.0, 4e-4)],
            vec![plates(&[(&bow_tie, &[])]), plates(&[(&square, &[]), (&square, &[])])],
        ));
        assert_eq!(errors[0], "self-crossing-outline", "{scale:e}");
    }
    let huge = SQUARE.map(|v| v.map(|x| x * 1e200));
    check(plates(&[(&huge, &[])]), &["out-of-scale"], &[]);
}

#[test]
fn masses() {
    check(body("nothing", Shape::None), &["no-mass"], &[]);
    check(plates(&[]), &["no-mass"], &[]);
    let with = |masses: &[(f64, [f64; 3])]| {
        let mut body = body("points", Shape::None);
        body.point_masses = masses.iter().map(|(mass, at)| point_mass(*mass, *at)).collect();
        body
    };
    // Whether mass on one point or line resists turning depends on the hinge: see the topology.
    check(with(&[(0.1, [0.0; 3])]), &[], &[]);
    check(with(&[(-0.1, [0.0; 3])]), &["not-positive"], &[]);
    check(with(&[(f64::NAN, [0.0; 3])]), &["not-positive"], &[]);
}

#[test]
fn rigid_bodies() {
    check(rigid(0.1, diagonal(1.0, 1.0, 2.0)), &[], &[]);
    check(rigid(0.0, diagonal(1.0, 1.0, 1.0)), &["not-positive"], &[]);
    check(rigid(0.1, diagonal(1.0, 1.0, 2.1)), &["inertia-triangle"], &[]);
    check(rigid(0.1, diagonal(1.0, -1.0, 1.0)), &["inertia-not-positive"], &[]);
    check(rigid(0.1, diagonal(0.0, 0.0, 0.0)), &[], &[]);
    check(rigid(0.1, diagonal(0.0, 1.0, 1.0)), &[], &[]);
    check(rigid(0.1, diagonal(f64::INFINITY, 1.0, 1.0)), &["not-finite"], &[]);
    // Symmetric parts with large products are not positive definite.
    let mut crossed = diagonal(1.0, 1.0, 1.0);
    (crossed[0][1], crossed[1][0]) = (1.5, 1.5);
    check(rigid(0.1, crossed), &["inertia-not-positive"], &[]);
    crossed[1][0] = -1.5;
    check(rigid(0.1, crossed), &["asymmetric-inertia"], &[]);
}

#[test]
fn a_fixed_body_needs_nothing() {
    let mut fixed = body("fixed", Shape::None);
    fixed.fixed = true;
    let square = plates(&[(&SQUARE, &[])]);
    assert_eq!(codes(&model(vec![material(700.0, 4e-4)], vec![square, fixed])).0, [""; 0]);
}

#[test]
fn everything_is_reported_together_and_once() {
    let sheet = material(-1.0, 0.0);
    let bow_tie = [SQUARE[0], SQUARE[2], SQUARE[1], SQUARE[3]];
    // An outline fills every layer: its mistake is one.
    let twice = vec![vec![plate(&bow_tie, &[])]; 2];
    let mut model = model(vec![sheet.clone(), sheet], vec![body("plate", Shape::Plates(twice))]);
    model.joints[0].damping = spanned(Expression::Number(-1.0));
    model.bodies.push(body("nothing", Shape::None));
    model.joints[0].limits = Some(spanned([0.0, 1.0]));
    model.initial_q = vec![(JointId(0), -0.1)];
    model.joints[0].spring = Spring::Beam {
        material: spanned(0),
        length: drawn(0.0),
        width: drawn(f64::NAN),
        gaps: None,
    };
    let expected = [
        "not-positive", // density
        "not-positive", // thickness
        "self-crossing-outline",
        "no-mass",      // of the body without plates
        "not-positive", // length
        "not-positive", // width
        "no-modulus",
        "initial-outside-limits",
        "negative-damping",
    ];
    assert_eq!(codes(&model), (expected.to_vec(), vec![]));
}
