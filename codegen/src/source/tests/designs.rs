//! The published designs: sizes by hand count, parents as computed by others, exact round trips.

use std::path::Path;

use super::*;

const DESIGNS: [&str; 4] = ["W_3.5", "pendulum2", "newMechanism", "4th_Design"];

/// The folder of published designs, beside the workspace; a loud message where it is not.
fn designs() -> Option<&'static Path> {
    let folder = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared/designs"));
    if !folder.is_dir() {
        println!("NOT TESTED: the published designs are not at ../shared/designs");
        return None;
    }
    Some(folder)
}

fn design(folder: &Path, name: &str) -> SourceModel {
    let path = folder.join(format!("{name}.cad.joints"));
    let file = SourceFile::read(path.to_str().unwrap()).unwrap();
    let (model, warnings) = parse(&file).unwrap_or_else(|e| panic!("{}", e.render(&file, false)));
    assert_eq!(warnings, Diagnostics::default());
    model
}

#[test]
fn designs_are_read() {
    let Some(folder) = designs() else { return };
    for (name, bodies, joints, identifier) in [
        ("W_3.5", 2, 1, "W_3_5"),
        ("pendulum2", 4, 3, "pendulum2"),
        ("newMechanism", 4, 4, "newMechanism"),
        ("4th_Design", 6, 6, "m4th_Design"),
    ] {
        let model = design(folder, name);
        assert_eq!(model.name.value, identifier);
        assert_eq!((model.bodies.len(), model.joints.len()), (bodies, joints), "{name}");
        assert_eq!(model.bodies.iter().filter(|body| body.fixed).count(), 1, "{name}");
        // All digits of a double: no hinge line is moved.
        assert!(model.tolerance < 1e-16, "{name}: {:e}", model.tolerance);
        // rigid, adhesive, flexible, adhesive, rigid: equal ones are one material.
        let names: Vec<_> = model.materials.iter().map(|m| m.name.value.as_str()).collect();
        assert_eq!(names, ["rigid", "adhesive", "flexible"], "{name}");
        assert_eq!(model.layup, [0, 1, 2, 1, 0], "{name}");
        for body in &model.bodies {
            let Shape::Plates(layers) = &body.shape else { panic!("{name}") };
            assert_eq!(layers.iter().map(Vec::len).collect::<Vec<_>>(), [1; 5], "{name}");
        }
        assert!(model.joints.iter().all(|j| j.limits.as_ref().map(|l| l.value) == Some([-PI, PI])));
    }
    let sixbar = design(folder, "4th_Design");
    let joint = &sixbar.joints[0];
    assert!(matches!(&joint.spring, Spring::Stiffness(k) if k.value == Expression::Number(0.0114)));
    assert_eq!(
        (&joint.damping.value, joint.z),
        (&Expression::Number(3.5e-6), 0.0030749999999999996)
    );
    assert_eq!(joint.axis.value[0], [0.009331878857394406, -0.029306516282004123]);
    assert!(sixbar.bodies[2].fixed);
}

/// Stiffness, hinge line and orientation of every joint, as computed independently.
#[test]
fn joints_agree_with_the_reference() {
    let Some(folder) = designs() else { return };
    for name in DESIGNS {
        let model = design(folder, name);
        let path = folder.join(format!("../reference/{name}.json"));
        let reference: serde_json::Value =
            serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap();
        let joints = reference["joints"].as_array().unwrap();
        assert_eq!(joints.len(), model.joints.len(), "{name}");
        for (expected, joint) in joints.iter().zip(&model.joints) {
            let text = |key: &str| expected[key].as_str().unwrap().trim_start_matches("ghost of ");
            let [parent, child] =
                joint.bodies.each_ref().map(|b| &model.bodies[b.value.index()].name.value);
            assert_eq!(
                (parent.as_str(), child.as_str()),
                (text("parent"), text("child")),
                "{name}"
            );
            let number = |value: &serde_json::Value| value.as_f64().unwrap();
            let Spring::Stiffness(stiffness) = &joint.spring else { panic!("{name}") };
            assert_eq!(stiffness.value, Expression::Number(number(&expected["stiffness"])));
            assert_eq!(joint.damping.value, Expression::Number(number(&expected["damping"])));
            let [from, to] = joint.axis.value;
            let length = (to[0] - from[0]).hypot(to[1] - from[1]);
            for i in 0..2 {
                assert_eq!(from[i], number(&expected["point"][i]), "{name}");
                let direction = (to[i] - from[i]) / length;
                assert!((direction - number(&expected["axis"][i])).abs() < 1e-15, "{name}");
            }
            assert_eq!(joint.z, number(&expected["point"][2]), "{name}");
        }
    }
}

#[test]
fn designs_survive_being_written() {
    let Some(folder) = designs() else { return };
    for name in DESIGNS {
        assert_round_trip(&design(folder, name));
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
