//! Drawings in popupCAD's format: sizes counted by hand, joints as written down beside the drawings, exact
//! round trips.

use super::*;

const DRAWINGS: [&str; 4] = ["drawn_pendulum", "drawn_fourbar", "drawn_sixbar", "drawn_sarrus"];

fn path(name: &str) -> String {
    format!("{}/../tests/data/drawings/{name}", env!("CARGO_MANIFEST_DIR"))
}

fn drawing(name: &str) -> SourceModel {
    let file = SourceFile::read(&path(&format!("{name}.cad.joints"))).unwrap();
    let (model, warnings) = parse(&file).unwrap_or_else(|e| panic!("{}", e.render(&file, false)));
    assert_eq!(warnings, Diagnostics::default());
    model
}

/// The number of plates in each layer.
fn plates(body: &Body) -> Vec<usize> {
    let Shape::Plates(layers) = &body.shape else { panic!("{} is no plate", body.name.value) };
    layers.iter().map(Vec::len).collect()
}

fn materials(model: &SourceModel) -> Vec<(&str, f64)> {
    model.materials.iter().map(|m| (m.name.value.as_str(), m.density.value)).collect()
}

#[test]
fn drawings_are_read() {
    for (name, bodies, joints) in [
        ("drawn_pendulum", 2, 1),
        ("drawn_fourbar", 4, 4),
        ("drawn_sixbar", 6, 6),
        ("drawn_sarrus", 6, 6),
    ] {
        let model = drawing(name);
        assert_eq!(model.name.value, name);
        assert_eq!((model.bodies.len(), model.joints.len()), (bodies, joints), "{name}");
        assert_eq!(model.bodies.iter().filter(|body| body.fixed).count(), 1, "{name}");
        // All digits of a double: no hinge line is moved.
        assert!(model.tolerance < 1e-16, "{name}: {:e}", model.tolerance);
    }
}

/// rigid, adhesive, flexible, adhesive, rigid: equal layers are one material.
#[test]
fn equal_layers_share_a_material() {
    let model = drawing("drawn_fourbar");
    let expected = [("rigid", 1400.0), ("adhesive", 1050.0), ("flexible", 1420.0)];
    assert_eq!(materials(&model), expected);
    assert_eq!(model.layup, [0, 1, 2, 1, 0]);
    assert!(model.bodies.iter().all(|body| plates(body) == [1; 5]));
    let Shape::Plates(layers) = &model.bodies[0].shape else { panic!("no plates") };
    let holes: Vec<_> = layers.iter().map(|layer| layer[0].holes.len()).collect();
    assert_eq!(holes, [2, 2, 0, 2, 2]);
}

/// Two storeys: layers without plates, a layer with two, and two adhesives of one name.
#[test]
fn layers_may_be_empty_and_materials_of_one_name_differ() {
    let model = drawing("drawn_sarrus");
    let expected = [
        ("card", 800.0),
        ("adhesive", 1050.0),
        ("film", 1390.0),
        ("spacer", 120.0),
        ("adhesive_2", 980.0),
    ];
    assert_eq!(materials(&model), expected);
    assert_eq!(model.layup, [0, 1, 2, 3, 2, 4, 0]);
    assert_eq!(plates(&model.bodies[1]), [1, 2, 2, 0, 0, 0, 0]);
    assert_eq!(plates(&model.bodies[5]), [0, 0, 0, 0, 1, 1, 1]);
}

/// Every joint: hinge line, orientation, laws and limits as written down by hand.
#[test]
fn joints_agree_with_the_reference() {
    for name in DRAWINGS {
        let model = drawing(name);
        let text = std::fs::read_to_string(path(&format!("{name}.json"))).unwrap();
        let reference: serde_json::Value = serde_json::from_str(&text).unwrap();
        let joints = reference["joints"].as_array().unwrap();
        assert_eq!(joints.len(), model.joints.len(), "{name}");
        for (expected, joint) in joints.iter().zip(&model.joints) {
            let text = |key: &str| expected[key].as_str().unwrap();
            let [parent, child] =
                joint.bodies.each_ref().map(|b| &model.bodies[b.value.index()].name.value);
            let bodies = (parent.as_str(), child.as_str());
            assert_eq!(bodies, (text("parent"), text("child")), "{name}");
            let number = |value: &serde_json::Value| value.as_f64().unwrap();
            let Spring::Stiffness(stiffness) = &joint.spring else { panic!("{name}") };
            assert_eq!(stiffness.value, Expression::Number(number(&expected["stiffness"])));
            assert_eq!(joint.damping.value, Expression::Number(number(&expected["damping"])));
            let Expression::Number(rest) = joint.rest.value else { panic!("{name}") };
            let limits = joint.limits.as_ref().unwrap().value;
            let due = &expected["limits"];
            for (angle, expected) in
                [(rest, &expected["rest"]), (limits[0], &due[0]), (limits[1], &due[1])]
            {
                assert!((angle - number(expected)).abs() <= 1e-15, "{name}: {angle}");
            }
            let [from, to] = joint.axis.value;
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            for i in 0..2 {
                assert_eq!(from[i], number(&expected["point"][i]), "{name}");
                let direction = (to[i] - from[i]) / length;
                assert!((direction - number(&expected["axis"][i])).abs() < 1e-15, "{name}");
            }
            assert_eq!(joint.z.value, number(&expected["point"][2]), "{name}");
        }
    }
}

#[test]
fn drawings_survive_being_written() {
    for name in DRAWINGS {
        assert_round_trip(&drawing(name));
    }
}

#[test]
fn a_small_design_is_read_in_full() {
    let text = include_str!("two_plates.joints");
    let model = read(text);
    let names: Vec<_> =
        model.materials.iter().map(|m| (m.name.value.as_str(), m.density.value)).collect();
    assert_eq!(names, [("glue", 1000.0), ("glue_2", 1200.0)]);
    let plates = |body: usize| match &model.bodies[body].shape {
        Shape::Plates(layers) => layers.iter().map(Vec::len).collect::<Vec<_>>(),
        _ => vec![],
    };
    assert_eq!((plates(0), plates(1)), (vec![1, 0], vec![2, 1]));
    let joint = &model.joints[0];
    // Written child first; the walk starts at the fixed body.
    assert_eq!(joint.bodies.each_ref().map(|body| body.value), [BodyId(0), BodyId(1)]);
    assert_eq!(joint.rest.value, Expression::Number(10f64.to_radians()));
    assert_eq!(joint.limits.as_ref().map(|l| l.value), Some([-PI / 2.0, PI / 4.0]));
    assert_round_trip(&model);
}
