//! Goals as they are read.

use super::*;
use crate::optimise::goals::{Aim, MAPPINGS, Measure, Norm, Wanted};

/// A mechanism with the names of the examples in the reference.
const MODEL: &str = "
units: { length: mm, angle: deg }
parameters: { crank: { value: 20 mm, range: [16 mm, 24 mm] }, rocker: 40 mm }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies: { base: { fixed: true, outline: [[0, 0], [9, 0], [9, -9]] }, arm: { mass: 1 g, com: [0, crank, 0], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] } }
joints: { j0: { bodies: [base, arm], axis: [[0, 0], [1, 0]], stiffness: 1e-3 } }
points: { pen: { body: arm, at: [0, rocker, 0] }, tip: { body: arm, at: [0, 0, 1] } }
";

#[test]
fn goals_have_units_ranges_and_defaults() {
    let compiled = compiled(MODEL);
    let problem = problem(
        &compiled,
        "
        parameters: { crank: {}, rocker: { range: [30 mm, 60 mm] } }
        goals:
          way:
            path: { point: pen, drive: j0, angles: [0, 90], plane: yz, unit: mm, timed: true, through: [[40, 0], [1 cm, ~]] }
          bend: { angle: j0, target: 30, weight: 2 }
        constraints: { low: { position: pen.z, at_most: 5 mm, at_least: -5 mm } }
        ",
    );
    let goals = &problem.goals;
    assert_eq!(goals.variables[0].bounds, [0.016, 0.024]);
    assert_eq!(goals.variables[1].bounds, [0.030, 0.060]);
    assert_eq!((goals.starts, goals.seed, goals.norm), (16, 0, Norm::Squares));
    let Aim::Path(path) = &goals.goals[0].aim else { panic!("{goals:?}") };
    assert_eq!((path.axes.as_slice(), path.timed), ([1, 2].as_slice(), true));
    assert_eq!(path.targets[0].at, [0.040, 0.0]);
    assert_eq!(path.targets[1].at[0], 0.01);
    assert!(path.targets[1].at[1].is_nan());
    assert_eq!(path.targets[1].angle, std::f64::consts::FRAC_PI_2);
    let wanted = Wanted::Target(30_f64.to_radians());
    assert_eq!(goals.goals[1].aim, Aim::Number(Measure::Angle(0), wanted));
    assert_eq!((goals.goals[0].weight, goals.goals[1].weight), (1.0, 2.0));
    let limits: Vec<Wanted> = goals.constraints.iter().map(|it| it.wanted).collect();
    assert_eq!(limits, [Wanted::AtMost(0.005), Wanted::AtLeast(-0.005)]);
}

#[test]
fn a_path_may_be_a_table() {
    let compiled = compiled(MODEL);
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("foot.csv");
    std::fs::write(&table, "angle [deg],y [mm],z\n10,20,0.001\n30,21,0.002\n").unwrap();
    let goals = format!(
        "{{ parameters: {{ crank: {{}} }}, goals: {{ way: {{ path: {{ point: pen, drive: j0, angles: [0, 90], plane: yz, \
         timed: true, through: {} }} }} }} }}",
        table.display()
    );
    let problem = problem(&compiled, &goals);
    let Aim::Path(path) = &problem.goals.goals[0].aim else { panic!() };
    assert_eq!(path.targets[1].at, [0.021, 0.002]);
    assert_eq!(path.targets[0].angle, 10_f64.to_radians());
    assert_eq!(path.angles, [10_f64.to_radians(), 30_f64.to_radians()]);
}

#[test]
fn a_second_column_of_a_quantity_is_refused() {
    let compiled = compiled(MODEL);
    let folder = tempfile::tempdir().unwrap();
    let table = folder.path().join("foot.csv");
    for header in ["y [mm],z,y [mm]", "y [mm],z,y", "z,y,z [m]"] {
        std::fs::write(&table, format!("{header}\n20,1,21\n21,2,22\n")).unwrap();
        let goals = file(&format!(
            "{{ parameters: {{ crank: {{}} }}, goals: {{ way: {{ path: {{ point: pen, drive: j0, angles: [0, 90], plane: yz, \
             through: {} }} }} }} }}",
            table.display()
        ));
        let problems = Goals::read(&goals, &compiled).unwrap_err().render(&goals, false);
        assert!(problems.contains("this is a second column of `"), "{problems}");
    }
}

/// Two plates on a base, one of which is held.
const PLATES: &str = "
units: { length: mm }
parameters: { size: { value: 20 mm, range: [10 mm, 30 mm] } }
materials: { card: { density: 700, thickness: 0.3 } }
layup: [card]
bodies:
  base: { fixed: true }
  left: { outline: [[0, 0], [-10, 0], [-10, 10], [0, 10]] }
  right: { outline: [[size, 0], [\"2*size\", 0], [\"2*size\", 10], [size, 10]] }
joints:
  crank: { bodies: [base, left], axis: [[0, 0], [0, 10]], stiffness: 1e-3 }
  knee: { bodies: [base, right], axis: [[size, 0], [size, 10]], drive: 30 deg }
points: { tip: { body: left, at: [-10, 0, 0] } }
";

/// Each key with its example.
#[test]
fn the_examples_of_the_reference_are_goals() {
    // A name is that of a parameter in some examples, and of a joint in others.
    let model = MODEL.replace("crank", "size").replace("j0", "crank");
    let [with_joint, with_parameter, with_plates] =
        [compiled(&model), compiled(MODEL), compiled(PLATES)];
    let way = "point: pen, drive: crank, angles: [0deg, 90deg], through: [[0, 0, 0], [0.02, 0, 0]]";
    for mapping in MAPPINGS {
        for key in mapping.keys {
            let entry = format!("{}: {}", key.name, key.example);
            let (varied, size) = ("parameters: { crank: {} }", "parameters: { size: {} }");
            let goal = "goals: { bend: { angle: j0, target: 1 } }";
            let (compiled, text) = match (mapping.name, key.name) {
                ("goals", "parameters") => (&with_parameter, format!("{entry}\n{goal}")),
                ("goals", "goals") => (&with_parameter, format!("{varied}\n{entry}")),
                ("goals", "robust") => (
                    &with_parameter,
                    format!("{varied}\n{goal}\n{entry}\ntolerances: {{ crank: {{ normal: 1% }} }}"),
                ),
                ("goals", _) => (&with_parameter, format!("{varied}\n{goal}\n{entry}")),
                ("variable", _) => {
                    (&with_parameter, format!("parameters: {{ rocker: {{ {entry} }} }}\n{goal}"))
                }
                ("goal", "path") => (
                    &with_joint,
                    format!("parameters: {{ size: {{}} }}\ngoals: {{ way: {{ {entry} }} }}"),
                ),
                ("goal", "target" | "weight") => {
                    let rest = if key.name == "weight" { ", target: 1" } else { "" };
                    (
                        &with_parameter,
                        format!("{varied}\ngoals: {{ bend: {{ angle: j0, {entry}{rest} }} }}"),
                    )
                }
                ("goal" | "constraint", "at") => (
                    &with_parameter,
                    format!("{varied}\ngoals: {{ it: {{ position: pen.x, target: 1, {entry} }} }}"),
                ),
                ("goal", "within") => (
                    &with_parameter,
                    format!("{varied}\ngoals: {{ it: {{ position: pen.x, target: 1, {entry} }} }}"),
                ),
                ("goal" | "constraint", "at_most") => (
                    &with_parameter,
                    format!("{varied}\n{goal}\nconstraints: {{ c: {{ mass: all, {entry} }} }}"),
                ),
                ("goal" | "constraint", "at_least") => (
                    &with_parameter,
                    format!("{varied}\n{goal}\nconstraints: {{ c: {{ frequency: 1, {entry} }} }}"),
                ),
                ("constraint" | "goal", "stroke") => (
                    &with_joint,
                    format!(
                        "parameters: {{ size: {{}} }}\ngoals: {{ it: {{ {entry}, target: 1 }} }}"
                    ),
                ),
                ("goal" | "constraint", "torque" | "settle" | "clearance") => {
                    (&with_plates, format!("{size}\ngoals: {{ it: {{ {entry}, target: 1 }} }}"))
                }
                ("settle", name) => {
                    let rest = match name {
                        "angle" | "position" => "within: 1, until: 1",
                        "within" => "angle: knee, until: 1",
                        _ => "angle: knee, within: 1",
                    };
                    let settle = format!("settle: {{ {rest}, {entry} }}, target: 1");
                    (&with_plates, format!("{size}\ngoals: {{ it: {{ {settle} }} }}"))
                }
                ("clearance", name) => {
                    let (model, rest) = match name {
                        "drive" => (&with_joint, "angles: [0deg, 90deg], "),
                        "angles" => (&with_joint, "drive: crank, "),
                        _ => (&with_plates, ""),
                    };
                    let clearance = format!("clearance: {{ {rest}{entry} }}, target: 1");
                    (model, format!("{size}\ngoals: {{ it: {{ {clearance} }} }}"))
                }
                ("goal", _) => (
                    &with_parameter,
                    format!("{varied}\ngoals: {{ it: {{ {entry}, target: 1 }} }}"),
                ),
                ("stroke", name) => {
                    let rest = match name {
                        "drive" => "point: pen, angles: [0deg, 90deg]",
                        "angles" => "point: pen, drive: crank",
                        _ => "drive: crank, angles: [0deg, 90deg]",
                    };
                    let stroke = format!("stroke: {{ {rest}, {entry} }}, target: 1");
                    (
                        &with_joint,
                        format!("parameters: {{ size: {{}} }}\ngoals: {{ it: {{ {stroke} }} }}"),
                    )
                }
                ("constraint", _) => (
                    &with_parameter,
                    format!("{varied}\n{goal}\nconstraints: {{ it: {{ {entry}, at_most: 1 }} }}"),
                ),
                ("path", name) => {
                    let rest = match name {
                        "samples" => "point: pen, drive: crank, angles: [0deg, 90deg], timed: true, through: [[~, 0, 0]]".to_owned(),
                        "plane" => way.replace("[[0, 0, 0], [0.02, 0, 0]]", "[[0, 0]]"),
                        "point" => way.replace("point: pen, ", ""),
                        "drive" => way.replace("drive: crank, ", ""),
                        "angles" => way.replace("angles: [0deg, 90deg], ", ""),
                        "through" => way.replace(", through: [[0, 0, 0], [0.02, 0, 0]]", ""),
                        _ => way.to_owned(),
                    };
                    (
                        &with_joint,
                        format!(
                            "parameters: {{ size: {{}} }}\ngoals: {{ way: {{ path: {{ {rest}, {entry} }} }} }}"
                        ),
                    )
                }
                other => panic!("no example of {other:?}"),
            };
            let read = Goals::read(&file(&text), compiled);
            assert!(read.is_ok(), "{text}\n{}", read.unwrap_err().render(&file(&text), false));
        }
    }
}

#[test]
fn a_path_needs_a_mechanism_that_moves_in_one_way() {
    let compiled = compiled(include_str!("../../../../examples/triple_pendulum.yaml"));
    let joint = &compiled.program.interface.joints[0].name;
    let goals = format!(
        "{{ parameters: {{}}, goals: {{ way: {{ stroke: {{ joint: {joint}, drive: {joint}, angles: [0, 1] }}, target: 1 }} }} }}"
    );
    let found = Goals::read(&file(&goals), &compiled).unwrap_err().to_string();
    assert!(found.contains("the mechanism has mobility 3"), "{found}");
}

/// A prescribed angle leaves no degree of freedom for a mode.
#[test]
fn a_frequency_needs_a_degree_of_freedom() {
    let goals = "{ parameters: { crank: {} }, goals: { fast: { frequency: 1, at_least: 1 } } }";
    assert!(Goals::read(&file(goals), &compiled(MODEL)).is_ok());
    let driven = MODEL.replace("stiffness: 1e-3 }", "stiffness: 1e-3, drive: 10 }");
    let found = Goals::read(&file(goals), &compiled(&driven)).unwrap_err().to_string();
    assert!(found.contains("no degree of freedom is left beside its drives"), "{found}");
}

/// A prescribed angle that follows a parameter would move the state of rest along.
#[test]
fn a_parameter_of_a_drive_cannot_vary() {
    let model = MODEL.replace("stiffness: 1e-3 }", "stiffness: 1e-3, drive: \"50*rocker*t\" }");
    let compiled = compiled(&model);
    let goals = "{ parameters: { rocker: { range: [0.03, 0.06] } }, goals: { light: { mass: all, at_most: 1 g } } }";
    let found = Goals::read(&file(goals), &compiled).unwrap_err().to_string();
    assert!(found.contains("a prescribed angle depends on `rocker`"), "{found}");
}

#[test]
fn limits_that_contradict_each_other_are_refused() {
    let compiled = compiled(MODEL);
    let read = |constraints: &str| {
        let goals = format!(
            "{{ parameters: {{ crank: {{}} }}, goals: {{ bend: {{ angle: j0, target: 1 }} }}, constraints: {{ {constraints} }} }}"
        );
        Goals::read(&file(&goals), &compiled).map_err(|problems| problems.to_string())
    };
    for wrong in [
        "a: { mass: all, at_least: 3 g, at_most: 2 g }",
        "a: { mass: all, at_least: 3 g }, b: { mass: all, at_most: 2 g }",
        "a: { mass: all, at_most: 2 g }, b: { mass: all, at_least: 3 g }",
    ] {
        let text = read(wrong).unwrap_err();
        assert!(text.contains("no number keeps both limits of"), "{text}");
    }
    for right in [
        "a: { mass: all, at_least: 2 g, at_most: 2 g }",
        "a: { mass: all, at_least: 3 g }, b: { mass: arm, at_most: 2 g }",
    ] {
        assert!(read(right).is_ok(), "{right}");
    }
}

#[test]
fn times_of_numbers_that_have_none_are_refused() {
    let compiled = compiled(MODEL);
    let read = |goal: &str| {
        let goals = format!(
            "{{ parameters: {{ crank: {{}} }}, goals: {{ it: {{ {goal}, target: 1 }} }} }}"
        );
        Goals::read(&file(&goals), &compiled).map_err(|problems| problems.to_string())
    };
    for (goal, message) in [
        ("mass: all, at: 1 s", "`mass` does not depend on the time"),
        ("energy: kinetic", "the kinetic energy needs a time: at rest it is 0"),
        ("angle: j0, at: 0 s", "`at` must be more than 0"),
        ("angle: j0, at: 1 m", "expected"),
    ] {
        let text = read(goal).unwrap_err();
        assert!(text.contains(message), "{goal}: {text}");
    }
}

#[test]
fn forces_clearances_and_times_to_settle_that_do_not_exist_are_refused() {
    let compiled = compiled(PLATES);
    let read = |goal: &str| {
        let goals =
            format!("{{ parameters: {{ size: {{}} }}, goals: {{ it: {{ {goal}, target: 1 }} }} }}");
        Goals::read(&file(&goals), &compiled).map_err(|problems| problems.to_string())
    };
    for (goal, message) in [
        ("torque: crank", "no torque holds `crank` at rest: its angle is not prescribed"),
        ("force: hip", "the model has no joint `hip`"),
        ("clearance: { between: [left, rihgt] }", "the model has no body `rihgt`"),
        ("clearance: { between: [left, left] }", "bodies that share a hinge touch there"),
        ("clearance: { between: [left, base] }", "`base` has no outline"),
        ("clearance: { between: [left] }", "expected"),
        ("clearance: { drive: crank }", "give both `drive` and `angles`, or neither"),
        ("settle: { within: 1deg, until: 1 s }", "give one of `angle` and `position`"),
        ("settle: { angle: crank, until: 1 s }", "`within`"),
        ("settle: { angle: crank, within: 1deg }", "`until`"),
        ("settle: { angle: crank, within: 0deg, until: 1 s }", "`within` must be more than 0"),
        ("settle: { angle: crank, within: 1 mm, until: 1 s }", "expected an angle"),
        ("settle: { position: tip, within: 1 mm, until: 1 s }", "such as `tip.z`"),
        (
            "settle: { angle: crank, within: 1deg, until: 1 s }, at: 1 s",
            "does not depend on the time",
        ),
    ] {
        let text = read(goal).unwrap_err();
        assert!(text.contains(message), "{goal}: {text}");
    }
}
