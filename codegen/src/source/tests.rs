//! The schema as a whole, popupCAD files against independently computed parents, spans, round
//! trips, and texts that are out to break the reader.

use std::f64::consts::PI;

use super::*;

mod designs;
mod hostile;
mod merging;
mod older;
mod tolerance;

fn file(text: &str) -> SourceFile {
    SourceFile { path: "robots/my-robot.yaml".into(), text: text.into() }
}

fn read(text: &str) -> SourceModel {
    let file = file(text);
    match parse(&file) {
        Ok((model, warnings)) => {
            assert_eq!(warnings, Diagnostics::default());
            model
        }
        Err(errors) => panic!("{}", errors.render(&file, false)),
    }
}

/// Codes and marked texts of what is wrong with `text`, in the order of the file.
fn faults(text: &str) -> Vec<(&'static str, String)> {
    let errors = parse(&file(text)).expect_err(text);
    let marked =
        |span: Option<Span>| span.map_or("", |span| &text[span.start..span.end]).to_owned();
    errors.0.iter().map(|error| (error.code.name, marked(error.span))).collect()
}

/// Everything in a model but its spans, bit for bit: the debug text, which writes every field and
/// the shortest digits that tell doubles apart.
fn bare(model: &SourceModel) -> String {
    let text = format!("{model:?}");
    let mut bare = String::new();
    let mut rest = text.as_str();
    while let Some(at) = rest.find("span: Span {") {
        bare.push_str(&rest[..at]);
        rest = &rest[at..][rest[at..].find('}').map_or(0, |end| end + 1)..];
    }
    bare + rest
}

fn assert_round_trip(model: &SourceModel) {
    let yaml = to_yaml(model);
    let again = read(&yaml);
    // What is written is in radians.
    let named = |model: &SourceModel| {
        let (name, angle) = (again.name.clone(), again.angle);
        bare(&SourceModel { name, angle, ..model.clone() })
    };
    assert_eq!(again.name.value, model.name.value);
    assert_eq!(named(&again), named(model), "{yaml}");
    assert!(yaml.lines().all(|line| line.chars().count() <= 100), "{yaml}");
}

/// Every key of the schema.
const EVERYTHING: &str = r#"
name: everything
units: { length: mm, angle: deg }
gravity: [0, "g_x", "-9.81 m/s^2"]
materials:
  card:      { density: 700, thickness: 0.4 }
  polyester: { density: 1.38 g/cm^3, thickness: 127 um, youngs_modulus: 4383.27 MPa,
               yield_stress: 42.84 MPa }
layup: [card, polyester, card]
bodies:
  base:  { fixed: true, outline: [[0,0],[40,0],[40,20],[0,20],[0,0]] }
  wall:  { fixed: true }
  left:  { outline: [[0,0],[40,0],[40,20]], holes: [[[1,1],[2,1],[2,2]]],
           point_masses: [{mass: 0.5 g, at: [1,2,0]}] }
  right: { layers: [[{outline: [[0,0],[1,0],[0,1]]}], [],
                    [{outline: [[0,0],[1 cm,0],[0,1]], holes: [[[0.1,0.1],[0.2,0.1],[0.1,0.2]]]},
                     {outline: [[5,5],[6,5],[5,6]]}]] }
  hub:   { mass: 2 g, com: [1, 2, 3], inertia: [[2 g*mm^2, 0, 0], [0, 2e-9, 0], [0, 0, 3e-9]] }
parameters: { k: 11.4 mN*m/rad, b: 3.5e-6, g_x: 0, reach: 40 mm, turn: 90 deg }
inputs: [motor, brake]
tunable: [damping, mass]
joints:
  j0: { bodies: [base, left], axis: [[0,0],[0,20]], z: 0.5, stiffness: k, damping: "b*(1 + brake)",
        rest: 10, limits: [-180, 180], torque: "motor - 0.02*sin(2*pi*t) - 1e-3*u.j1*max(q.j0, 0)" }
  j1: { bodies: [left, right], axis: [[40,0],[40,20]], damping: 1e-6,
        hinge: { model: beam, material: polyester, length: 1, width: 20 } }
  j2: { bodies: [right, hub], axis: [[80,0],[80,20]], rest: "0.5*turn", fold: -180 }
initial: { q: { j0: 30, j2: -0.5 rad }, u: { j1: 90 }, fold: 30% }
points: { tip: { body: right, at: [40, 10, 0.5] }, mark: { body: base, at: [0, 0, 0] } }
contacts:
  ground: { plane: { point: [0, 0, -5], normal: [0, 1, 2] }, friction: "b/2" }
  facets: { plane: { point: [0, 0, 1], normal: [0, 0, 1], body: left, within: outline }, bodies: [right],
            points: corners, stiffness: 2 N/mm, dissipation: "0.3 + t", friction: 0, slip_speed: 2 mm/s }
  probe: { plane: { point: [0, 0, -9], normal: [0, 0, 1], body: wall }, points: [tip], friction: 0.1 }
forces: { pull: { point: tip, force: [0, 5 mN, "0.01*t - b*u.j2"] } }
springs:
  band: { from: tip, to: mark, stiffness: 2 N/mm, damping: "b*2", rest_length: 12, tension_only: yes }
  twist: { bodies: [base, hub], axis: [[0,0],[0,20]], stiffness: 2e-3, damping: 1e-6, rest: 15 }
  push: { from: mark, to: tip, stiffness: 20 }
tendons:
  given: { through: [mark, tip, mark], tension: "motor + 0.1*q.j0" }
  elastic: { through: [tip, mark], stiffness: 200, damping: 0.01, rest_length: reach }
motors:
  hip: { joint: j0, torque_constant: 5 mN*m/A, resistance: 8 ohm, gear: 50, inertia: 10 g*mm^2,
         voltage: "6*motor", max_voltage: 6 V, max_current: 500 mA }
  plain: { joint: j1, torque_constant: b, resistance: 8, gear: 1, voltage: 3 }
"#;

#[test]
fn every_key_is_read() {
    let model = read(EVERYTHING);
    assert_eq!(model.name.value, "everything");
    assert_eq!(model.gravity[0], Expression::Number(0.0));
    assert_eq!(model.gravity[1], Expression::Parameter(ParameterId(2)));
    assert_eq!(model.gravity[2], Expression::Number(-9.81));

    let polyester = &model.materials[1];
    assert_eq!((polyester.density.value, polyester.thickness.value), (1380.0, 127e-6));
    assert_eq!(polyester.youngs_modulus.as_ref().map(|e| e.value), Some(4383.27e6));
    assert_eq!(model.materials[0].thickness.value, 0.4e-3);
    assert!(model.materials[0].youngs_modulus.is_none());
    assert_eq!(model.layup, [0, 1, 0]);

    let [base, wall, left, right, hub] = model.bodies.as_slice() else { panic!() };
    assert!(base.fixed && wall.fixed && !left.fixed);
    assert!(matches!(wall.shape, Shape::None));
    let Shape::Plates(layers) = &base.shape else { panic!() };
    let corners = [[0.0, 0.0], [0.04, 0.0], [0.04, 0.02], [0.0, 0.02]];
    assert!(layers.len() == 3 && layers.iter().all(|l| l[0].outline.value == corners));
    assert_eq!(
        (left.point_masses[0].mass.value, left.point_masses[0].at.value),
        (0.5e-3, [1e-3, 2e-3, 0.0])
    );
    let Shape::Plates(layers) = &right.shape else { panic!() };
    assert_eq!(layers.iter().map(Vec::len).collect::<Vec<_>>(), [1, 0, 2]);
    assert_eq!(layers[2][0].outline.value[1], [0.01, 0.0]);
    assert_eq!(layers[2][0].holes[0].value[2], [1e-4, 2e-4]);
    let Shape::Rigid { mass, com, inertia } = &hub.shape else { panic!() };
    assert_eq!((mass.value, com.value), (2e-3, [1e-3, 2e-3, 3e-3]));
    assert_eq!(inertia.value, [[2e-9, 0.0, 0.0], [0.0, 2e-9, 0.0], [0.0, 0.0, 3e-9]]);

    let values: Vec<_> =
        model.parameters.iter().map(|p| (p.name.value.as_str(), p.value)).collect();
    let expected =
        [("k", 0.0114), ("b", 3.5e-6), ("g_x", 0.0), ("reach", 0.04), ("turn", PI / 2.0)];
    assert_eq!(values, expected);
    assert_eq!(model.input("brake"), Some(InputId(1)));
    let tunable: Vec<_> = model.tunable.iter().map(|t| t.value).collect();
    assert_eq!(tunable, [Tunable::Damping, Tunable::Mass]);

    let [j0, j1, j2] = model.joints.as_slice() else { panic!() };
    assert_eq!(j0.bodies.each_ref().map(|b| b.value), [BodyId(0), BodyId(2)]);
    assert_eq!((j0.axis.value, j0.z.value), ([[0.0, 0.0], [0.0, 0.02]], 0.5e-3));
    let Spring::Stiffness(stiffness) = &j0.spring else { panic!() };
    assert_eq!(stiffness.value, Expression::Parameter(ParameterId(0)));
    assert_eq!(j0.rest.value, Expression::Number(10f64.to_radians()));
    assert_eq!(j0.limits.as_ref().map(|l| l.value), Some([-PI, PI]));
    assert!(matches!(&j1.spring, Spring::Beam { material, length, width, gaps: None }
            if (material.value, length.value, width.value) == (1, 1e-3, 20e-3)));
    assert_eq!(j1.damping.value, Expression::Number(1e-6));
    assert!(j2.limits.is_none() && j2.torque.value == Expression::ZERO && j2.z.value == 0.0);

    assert_eq!(model.initial_q, [(JointId(0), 30f64.to_radians()), (JointId(2), -0.5)]);
    assert_eq!(model.initial_u, [(JointId(1), PI / 2.0)]);
    assert_eq!(model.initial_fold.as_ref().map(|share| share.value), Some(0.3));
    let folds = [j0, j1, j2].map(|joint| joint.fold.as_ref().map(|fold| fold.value));
    assert_eq!(folds, [None, None, Some(-PI)]);
    assert_eq!((model.points[0].body, model.points[0].at.value), (BodyId(3), [0.04, 0.01, 0.5e-3]));
    assert_eq!(model.forces[0].point, PointId(0));
    assert_eq!(model.forces[0].force[1], Expression::Number(5e-3));
    elements_are_read(&model);
    assert_round_trip(&model);
}

fn elements_are_read(model: &SourceModel) {
    use super::elements::Tension;
    let number = |value: f64| Expression::Number(value);
    let elements = &model.elements;
    let [band, push] = elements.bands.as_slice() else { panic!() };
    let points: Vec<_> = band.through.iter().map(|point| point.value).collect();
    assert_eq!(points, [PointId(0), PointId(1)]);
    let Tension::Elastic { stiffness, rest_length, tension_only, .. } = &band.tension else {
        panic!()
    };
    assert_eq!((&stiffness.value, tension_only), (&number(2e3), &true));
    assert_eq!(rest_length.as_ref().map(|length| &length.value), Some(&number(0.012)));
    let Tension::Elastic { rest_length: None, tension_only: false, damping, .. } = &push.tension
    else {
        panic!()
    };
    assert_eq!(damping.value, Expression::ZERO);
    let [twist] = elements.twists.as_slice() else { panic!() };
    assert_eq!(twist.bodies.each_ref().map(|body| body.value), [BodyId(0), BodyId(4)]);
    assert_eq!(
        (twist.axis.value[1], &twist.rest.value),
        ([0.0, 0.02], &number(15f64.to_radians()))
    );
    let [given, elastic] = elements.tendons.as_slice() else { panic!() };
    assert!(given.through.len() == 3 && matches!(given.tension, Tension::Given(_)));
    assert!(matches!(&elastic.tension, Tension::Elastic { tension_only: true, .. }));
    let [hip, plain] = elements.motors.as_slice() else { panic!() };
    assert_eq!((hip.joint.value, hip.gear.value, hip.inertia.value), (JointId(0), 50.0, 1e-8));
    assert_eq!(hip.torque_constant.value, number(5e-3));
    assert_eq!(hip.max_current.as_ref().map(|limit| &limit.value), Some(&number(0.5)));
    assert!(plain.inertia.value == 0.0 && plain.max_voltage.is_none());
}

#[test]
fn little_is_required() {
    let model = read(
        "bodies: {a: {fixed: true}, b: {}}\njoints: {j: {bodies: [a, b], axis: [[0,0],[1,0]]}}",
    );
    assert_eq!(model.name.value, "my_robot");
    assert_eq!(model.gravity, [0.0, 0.0, -9.81].map(Expression::Number));
    assert!(matches!(&model.joints[0].spring, Spring::Stiffness(k) if k.value == Expression::ZERO));
    assert_round_trip(&model);
}

#[test]
fn aliases_and_old_line_ends_are_read() {
    let plain = read(EVERYTHING);
    assert_eq!(bare(&read(&EVERYTHING.replace('\n', "\r\n"))), bare(&plain));
    let model = read(
        "layup: [m]\nmaterials: {m: {density: 1, thickness: 1}}\nbodies:\n  a: {fixed: true, \
         outline: &o [[0,0],[1,0],[0,1]]}\n  b: {outline: *o}\n\
         joints: {j: {bodies: [a, b], axis: [[0,0],[1,0]]}}",
    );
    let outlines = model.bodies.iter().map(|body| match &body.shape {
        Shape::Plates(layers) => layers[0][0].outline.value.len(),
        _ => 0,
    });
    assert_eq!(outlines.collect::<Vec<_>>(), [3, 3]);
}

#[test]
fn spans_mark_the_very_text() {
    let text = "# größer als µ — ✓\nbodies: { bäse: {fixed: true}, b: {} }\njoints:\n  \
                j: { bodies: [b, bäsé], axis: [[0, 0], [1 furlong, 0]],\n       \
                torque: \"2*mtr + 'é\" , rest: 'q.j + 1', stiffness: k * (x), damping: 3 mm }\n";
    let expected = [
        ("bad-name", "bäse"),
        ("unknown-body", "bäsé"),
        ("unknown-unit", "furlong"),
        ("unknown-name", "k"),
        ("unknown-name", "x"),
        ("wrong-dimension", "3 mm"),
        ("not-here", "q.j"),
        ("unknown-name", "mtr"),
        ("bad-expression", "'"),
    ];
    let expected: Vec<_> =
        expected.iter().map(|(code, text)| (*code, (*text).to_owned())).collect();
    assert_eq!(faults(text), expected);
    // The same with carriage returns: the parser's columns must not drift.
    assert_eq!(faults(&text.replace('\n', "\r\n")), expected);
}

#[test]
fn entries_span_key_and_value() {
    let text = r"bodies:
  base: {fixed: true}
  arm:
    mass: 1
    com: [0, 0, 0]
    inertia:
      - [1, 0, 0]
      - [0, 1, 0]
      - [0, 0, 1]
# end
joints:
  j: {bodies: [base, arm], axis: [[0,0],[1,0]]}
";
    let model = read(text);
    let spans: Vec<_> =
        model.bodies.iter().map(|body| &text[body.span.start..body.span.end]).collect();
    assert_eq!(spans[0], "base: {fixed: true}");
    assert!(spans[1].starts_with("arm:\n") && spans[1].ends_with("- [0, 0, 1]"), "{}", spans[1]);
    let joint = model.joints[0].span;
    assert_eq!(&text[joint.start..joint.end], "j: {bodies: [base, arm], axis: [[0,0],[1,0]]}");
}

#[test]
fn folded_lines_are_followed() {
    let text = "bodies: {a: {fixed: true}, b: {}}\njoints:\n  j:\n    bodies: [a, b]\n    \
                axis: [[0,0],[1,0]]\n    torque: >-\n      2*t +\n\n      whatever\n    \
                rest: 'k*\n      µ*x'\n    damping: \"1\\n  + no\"\n";
    let marked: Vec<_> = faults(text).into_iter().map(|(_, marked)| marked).collect();
    assert_eq!(marked, ["\"1\\n  + no\"", "k", "µ", "whatever"], "{marked:?}");
}
