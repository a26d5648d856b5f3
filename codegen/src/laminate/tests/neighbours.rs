//! Plates of different bodies in one place, and hinge lines far from their plates.

use super::{body, drawn, material, model, named, plate, spanned};
use crate::laminate::build;
use crate::source::{Body, BodyId, Diagnostics, Plate, Shape};

/// Corner, width and height in mm, turned by 37.3 degrees and rounded to a multiple of `unit` mm.
fn rectangle([x, y, width, height]: [f64; 4], unit: f64) -> Vec<[f64; 2]> {
    let (sin, cos) = 37.3_f64.to_radians().sin_cos();
    let corners = [[x, y], [x + width, y], [x + width, y + height], [x, y + height]];
    let rounded = |x: f64| (x / unit).round() * unit * 1e-3;
    corners.map(|[x, y]| [rounded(cos * x - sin * y), rounded(sin * x + cos * y)]).to_vec()
}

fn of(name: &str, plates: Vec<Plate>) -> Body {
    body(name, Shape::Plates(vec![plates]))
}

/// Warnings about these bodies, the first hinged to the ground along y at `hinge` mm, the others to
/// each other.
fn warnings(bodies: Vec<Body>, hinge: [f64; 2]) -> Diagnostics {
    let count = bodies.len();
    let mut model = model(vec![material(700.0, 4e-4)], bodies);
    let [x, y] = hinge.map(|x| x * 1e-3);
    model.joints[0].axis = drawn([[x, y], [x, y + 0.02]]);
    for index in 1..count {
        let mut joint = model.joints[0].clone();
        joint.name = named(&format!("j{index}"));
        joint.bodies = [spanned(BodyId(index)), spanned(BodyId(index + 1))];
        model.joints.push(joint);
    }
    let mut warnings = Diagnostics::default();
    build(&model, &mut warnings).unwrap();
    warnings
}

#[track_caller]
fn check(bodies: Vec<Body>, hinge: [f64; 2], expected: &[&str]) -> String {
    let found = warnings(bodies, hinge);
    let codes: Vec<_> = found.0.iter().map(|warning| warning.code.name).collect();
    assert_eq!(codes, expected, "{found}");
    found.to_string()
}

fn pair(first: [f64; 4], second: [f64; 4], unit: f64) -> Vec<Body> {
    let of = |name, at| of(name, vec![plate(&rectangle(at, unit), &[])]);
    vec![of("left", first), of("right", second)]
}

#[test]
fn overlaps() {
    let left = [0.0, 0.0, 40.0, 20.0];
    for unit in [1e-12, 1e-4, 1e-2] {
        // Edges that are one, or part of one another, whatever the rounding makes of them.
        check(pair(left, [40.0, 0.0, 30.0, 20.0], unit), [0.0, 0.0], &[]);
        check(pair(left, [40.0, 3.7, 30.0, 9.9], unit), [0.0, 0.0], &[]);
        check(pair(left, [41.0, 0.0, 30.0, 20.0], unit), [0.0, 0.0], &[]);
        let message =
            check(pair(left, [39.5, 0.0, 30.0, 20.0], unit), [0.0, 0.0], &["overlapping-bodies"]);
        assert!(message.starts_with("`left` and `right` overlap by "), "{message}");
        let area: f64 = message.split(' ').nth(5).unwrap().parse().unwrap();
        assert!((area - 10.0).abs() < 0.5, "{message}");
        check(pair(left, left, unit), [0.0, 0.0], &["overlapping-bodies"]);
        check(pair(left, [10.0, 5.0, 10.0, 10.0], unit), [0.0, 0.0], &["overlapping-bodies"]);
    }
}

#[test]
fn a_plate_in_the_hole_of_another() {
    let outer = rectangle([0.0, 0.0, 40.0, 20.0], 1e-9);
    let hole = rectangle([10.0, 5.0, 20.0, 10.0], 1e-9);
    let inside = |at| of("inner", vec![plate(&rectangle(at, 1e-9), &[])]);
    let frame = || of("frame", vec![plate(&outer, &[&hole])]);
    check(vec![frame(), inside([10.0, 5.0, 20.0, 10.0])], [0.0, 0.0], &[]);
    check(vec![frame(), inside([12.0, 6.0, 10.0, 5.0])], [0.0, 0.0], &[]);
    check(vec![frame(), inside([8.0, 6.0, 10.0, 5.0])], [0.0, 0.0], &["overlapping-bodies"]);
}

#[test]
fn other_layers_and_fixed_bodies_may_overlap() {
    let square = || plate(&rectangle([0.0, 0.0, 20.0, 20.0], 1e-9), &[]);
    let layered = |name, layers| body(name, Shape::Plates(layers));
    let mut model = model(
        vec![material(700.0, 4e-4), material(700.0, 4e-4)],
        vec![
            layered("low", vec![vec![square()], vec![]]),
            layered("high", vec![vec![], vec![square()]]),
        ],
    );
    let mut found = Diagnostics::default();
    build(&model, &mut found).unwrap();
    assert_eq!(found, Diagnostics::default());
    model.bodies[2] = layered("high", vec![vec![square()], vec![square()]]);
    build(&model, &mut found).unwrap();
    assert_eq!(found.0.len(), 1);
    assert!(found.0[0].message.contains("layer 1"), "{found}");
    model.bodies[0] = Body { fixed: true, ..layered("ground", vec![vec![], vec![square()]]) };
    model.bodies[2].fixed = true;
    found = Diagnostics::default();
    build(&model, &mut found).unwrap();
    assert_eq!(found.0.len(), 1, "{found}");
}

/// Many bodies in one place are not all compared.
#[test]
fn a_heap_of_bodies() {
    let square = || plate(&rectangle([0.0, 0.0, 20.0, 20.0], 1e-9), &[]);
    let heap = (0..400).map(|index| of(&format!("b{index}"), vec![square()])).collect();
    let found = warnings(heap, [0.0, 0.0]);
    assert_eq!(found.0.len(), 20);
    assert!(found.0[19].hint.as_deref().unwrap().contains("more such pairs"));
}

#[test]
fn far_hinges() {
    let bodies = || pair([0.0, 0.0, 40.0, 20.0], [40.0, 0.0, 30.0, 20.0], 1e-9);
    // Within, at an edge, in a gap.
    for hinge in [[5.0, 10.0], [0.0, 0.0], [-2.0, 0.0]] {
        check(bodies(), hinge, &[]);
    }
    let message = check(bodies(), [500.0, 0.0], &["far-hinge", "far-hinge"]);
    assert!(message.contains("the hinge line of `j1` is "), "{message}");
    assert!(message.contains(" mm from `left` and ") && message.contains(" mm from `right`"));
    // Above and below the plates: the box around them is 68 mm x 58 mm, so that 5 % of the size are 4.5 mm.
    for (z, expected) in [(3.0, &[][..]), (6.0, &["far-hinge"]), (1e5, &["far-hinge"])] {
        for z in [z, -z] {
            let mut model = model(vec![material(700.0, 4e-4)], bodies());
            model.joints[0].axis = drawn([[0.0, 0.0], [0.0, 0.02]]);
            model.joints[0].z = drawn(1e-3 * z);
            let mut found = Diagnostics::default();
            build(&model, &mut found).unwrap();
            let codes: Vec<_> = found.0.iter().map(|warning| warning.code.name).collect();
            assert_eq!(codes, expected, "{z}: {found}");
        }
    }
    // What has no outline may be anywhere.
    let mut rigid = bodies();
    rigid[1].shape = Shape::Rigid {
        mass: drawn(1.0),
        com: drawn([0.0; 3]),
        inertia: spanned([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]),
    };
    check(rigid, [500.0, 0.0], &["far-hinge"]);
}
