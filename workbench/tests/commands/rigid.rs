//! Loops that cannot move, and initial states that the loops do not allow.

use std::f64::consts::TAU;
use std::fs;

use crate::common::{example, folder, json, run, text, told};

/// Three creases that meet in a point, which no motion folds, and a flap apart from them: MORE is what else one
/// of the creases has. The moment of inertia of the flap about its hinge is 2e-8 + 1e-3 * 0.01^2 kg m^2.
const RIGID: &str = "
gravity: [0, 0, 0]
bodies:
  sheet: { fixed: true }
  left: { mass: 1 g, com: [-0.01, 0.01, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
  below: { mass: 1 g, com: [0, -0.01, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
  flap: { mass: 1 g, com: [0.04, 0, 0], inertia: [[1e-8, 0, 0], [0, 2e-8, 0], [0, 0, 3e-8]] }
joints:
  one: { bodies: [sheet, left], axis: [[0, 0], [0, 0.02]], stiffness: 1e-3 MORE }
  two: { bodies: [left, below], axis: [[0, 0], [-0.02, -0.005]], stiffness: 1e-3, fold: -3 }
  three: { bodies: [below, sheet], axis: [[0, 0], [0.015, -0.02]], stiffness: 1e-3, fold: -3 }
  hinge: { bodies: [sheet, flap], axis: [[0.03, 0], [0.03, 0.02]], stiffness: 1e-3, rest: 0.1 }
";

/// The stiffness of the flap over its moment of inertia is the square of its angular frequency. The rigid loop has
/// no mode, and is refused where its equations would give it one.
#[test]
fn a_rigid_loop_has_no_modes() {
    let (_guard, folder) = folder();
    let path = |name: &str| folder.join(name).display().to_string();
    fs::write(path("rigid.yaml"), RIGID.replace("MORE", "")).unwrap();
    fs::write(path("held.yaml"), RIGID.replace("MORE", ", drive: 0")).unwrap();
    let (rigid, held) = (path("rigid.yaml"), path("held.yaml"));
    let commands: [&[&str]; 4] =
        [&["modes"], &["equilibrium"], &["eval"], &["simulate", "--duration", "0.1"]];
    for command in commands {
        let output = run(&[command, &[rigid.as_str()]].concat());
        let said = told(&output);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {said}");
        for part in ["the loop of", "`one`", "`two`", "`three`", "cannot move", "--lock "] {
            assert!(said.contains(part), "{command:?}: {said}");
        }
        assert!(!said.contains("`hinge`"), "{said}");
        let output = run(&[command, &[held.as_str()]].concat());
        assert_eq!(output.status.code(), Some(0), "{command:?}: {}", told(&output));
    }
    let expected = (1e-3_f64 / 1.2e-7).sqrt() / TAU;
    for arguments in [vec![held.as_str()], vec![&rigid, "--lock", "three=0deg"]] {
        let found = json(&run(&[&["modes", "--json"], &arguments[..]].concat()));
        let modes = found["modes"].as_array().unwrap();
        assert_eq!(modes.len(), 1, "{found}");
        let frequency = modes[0]["frequency"].as_f64().unwrap();
        assert!((frequency / expected - 1.0).abs() < 1e-9, "{frequency} Hz, not {expected} Hz");
    }
    // What has no motion has no balance that could be wrong.
    let output = run(&["verify", &rigid]);
    let table = text(&output.stdout);
    assert_eq!(output.status.code(), Some(0), "{table}");
    for check in ["balance", "drift"] {
        let line = table.lines().find(|line| line.starts_with(check)).unwrap();
        assert!(line.contains("not checked") && line.contains("cannot move"), "{line}");
    }
}

/// Four hinges along y at x = 0, 30, 70 and 50 mm: flat, the loop stays closed if the speeds and their moments
/// add up to zero.
const CHAIN: &str = "
units: { length: mm, angle: deg }
gravity: [0, 0, 0]
bodies:
  base: { fixed: true }
  a: { mass: 1 g, com: [15, 0, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
  b: { mass: 1 g, com: [50, 0, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
  c: { mass: 1 g, com: [60, 0, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
joints:
  j0: { bodies: [base, a], axis: [[0, 0], [0, 20]] }
  j1: { bodies: [a, b], axis: [[30, 0], [30, 20]] }
  j2: { bodies: [b, c], axis: [[70, 0], [70, 20]] }
  j3: { bodies: [c, base], axis: [[50, 0], [50, 20]] }
initial: { u: { SPEEDS } }
";

#[test]
fn speeds_that_open_the_loops_are_said() {
    let (_guard, folder) = folder();
    let path = folder.join("chain.yaml").display().to_string();
    let started = |speeds: &str| {
        fs::write(&path, CHAIN.replace("SPEEDS", speeds)).unwrap();
        let output = run(&["eval", &path]);
        let speeds = json(&output)["states"][0]["u"].clone();
        let degrees: Vec<f64> = speeds
            .as_array()
            .unwrap()
            .iter()
            .map(|speed| speed.as_f64().unwrap().to_degrees())
            .collect();
        (degrees, told(&output))
    };
    // 10 - 15 + 10 - 5 = 0, and -15 * 30 + 10 * 70 - 5 * 50 = 0.
    let (speeds, said) = started("j0: 10, j1: -15, j2: 10, j3: -5");
    assert_eq!(said, "");
    for (found, given) in speeds.iter().zip([10.0, -15.0, 10.0, -5.0]) {
        assert!((found - given).abs() < 1e-9, "{speeds:?}");
    }
    let (speeds, said) = started("j0: 10, j1: 15");
    for (joint, given) in [("j0", 10.0), ("j1", 15.0)] {
        let found = speeds[usize::from(joint == "j1")];
        let says = format!(
            "`{joint}` should start with {given:.4} deg/s but starts with {found:.4} deg/s"
        );
        assert!(said.contains(&says), "{said}");
    }
}

/// A vertex of creases at these angles, deg, that are mountains but for one valley.
fn vertex(angles: &[f64], valley: usize) -> String {
    let at = |k: usize| {
        let (sin, cos) = angles[k % angles.len()].to_radians().sin_cos();
        format!("[{:?}, {:?}]", 0.03 * cos, 0.03 * sin)
    };
    let (mut bodies, mut joints) = (String::new(), String::new());
    for k in 0..angles.len() {
        let fixed = if k == 0 { "fixed: true, " } else { "" };
        bodies += &format!("  f{k}: {{ {fixed}outline: [[0, 0], {}, {}] }}\n", at(k), at(k + 1));
        let before = (k + angles.len() - 1) % angles.len();
        let fold = if k == valley { "180 deg" } else { "-180 deg" };
        joints += &format!(
            "  c{k}: {{ bodies: [f{before}, f{k}], axis: [[0, 0], {}], stiffness: 1e-3, fold: {fold} }}\n",
            at(k)
        );
    }
    format!(
        "materials: {{ card: {{ density: 700, thickness: 3e-4 }} }}\nlayup: [card]\ntolerance: 1e-9\nbodies:\n\
         {bodies}joints:\n{joints}initial: {{ fold: 30% }}\n"
    )
}

/// Every other sector of the first vertex adds up to 180 deg, and the crease pair of its smallest sector has both
/// signs, so it folds; three creases never do.
#[test]
fn an_initial_fold_that_is_lost_is_said() {
    const LOST: &str = "does not start near the initial fold";
    let (_guard, folder) = folder();
    let path = folder.join("vertex.yaml").display().to_string();
    for (angles, is_lost) in [(&[0.0, 80.0, 150.0, 250.0][..], false), (&[0.0, 100.0, 230.0], true)]
    {
        fs::write(&path, vertex(angles, 1)).unwrap();
        for command in ["check", "eval"] {
            let said = told(&run(&[command, &path]));
            assert_eq!(said.contains(LOST), is_lost, "{command}: {said}");
            assert_eq!(said.contains("100 % of it away"), is_lost, "{command}: {said}");
        }
    }
    // Joints without a fold and without a given angle may start anywhere.
    let said = told(&run(&["check", &example("fourbar.yaml")]));
    assert!(!said.contains(LOST), "{said}");
}
