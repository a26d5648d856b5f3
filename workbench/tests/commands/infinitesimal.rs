//! Small motions that the equations of closure allow where no finite motion goes on: they are refused, with a way out
//! if there is one.

use std::f64::consts::TAU;
use std::fs;

use crate::common::{folder, json, run, told};

/// A strip with a straight edge from x = -20 mm to 20 mm, and a half plane of three sectors that are joined to it and to
/// each other by creases through the middle of the edge. It turns about the edge; `one` and `two` stay flat.
const EDGE: &str = "
units: { length: mm }
gravity: [0, 0, 0]
bodies:
  strip: { fixed: true }
  east: { mass: 1 g, com: [10, 5, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
  north: { mass: 2 g, com: [0, 10, 0], inertia: [[2e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
  west: { mass: 1 g, com: [-10, 5, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 2e-8]] }
joints:
  right: { bodies: [strip, east], axis: [[0, 0], [20, 0]], stiffness: 1e-3 }
  one: { bodies: [east, north], axis: [[0, 0], [10, 15]], stiffness: 1e-3 }
  two: { bodies: [north, west], axis: [[0, 0], [-10, 15]], stiffness: 1e-3 }
  left: { bodies: [west, strip], axis: [[0, 0], [-20, 0]], stiffness: 1e-3 }
";

/// The two hinges of the edge work together: the square of the angular frequency is their stiffness over the moments of
/// inertia about the edge, Ixx + m y^2 of each sector.
#[test]
fn creases_at_a_straight_edge_are_held_to_compute_its_motion() {
    let (_guard, folder) = folder();
    let path = folder.join("edge.yaml").display().to_string();
    fs::write(&path, EDGE).unwrap();
    let mut locks = Vec::new();
    let commands: [&[&str]; 4] =
        [&["modes"], &["equilibrium"], &["eval"], &["simulate", "--duration", "0.1"]];
    for command in commands {
        let output = run(&[command, &[path.as_str()]].concat());
        let said = told(&output);
        assert_eq!(output.status.code(), Some(1), "{command:?}: {said}");
        let (_, way_out) = said.split_once("hold it by `").unwrap_or_else(|| panic!("{said}"));
        locks = way_out.split('`').next().unwrap().split(' ').map(str::to_owned).collect();
    }
    let [lock, joint] = &locks[..] else { panic!("{locks:?}") };
    assert_eq!(lock, "--lock");
    assert!(["one=0deg", "two=0deg"].contains(&joint.as_str()), "{joint}");
    let found = json(&run(&["modes", "--json", &path, lock, joint]));
    let modes = found["modes"].as_array().unwrap();
    assert_eq!(modes.len(), 1, "{found}");
    let frequency = modes[0]["frequency"].as_f64().unwrap();
    let inertia = 2.0 * (1e-8 + 1e-3 * 5e-3_f64.powi(2)) + 2e-8 + 2e-3 * 10e-3_f64.powi(2);
    let expected = (2e-3 / inertia).sqrt() / TAU;
    assert!((frequency / expected - 1.0).abs() < 1e-9, "{frequency} Hz, not {expected} Hz");
}

/// The eight plates around the hole of a Miura sheet of nine, folded as the whole sheet would be: the corners of its
/// parallelograms are 30 mm and (18, 24) mm apart. Small motions that do not exist turn all of its hinges.
#[test]
fn a_shaky_ring_is_refused_without_a_joint_to_hold() {
    let (_guard, folder) = folder();
    let path = folder.join("ring.yaml").display().to_string();
    let corner =
        |column: usize, row: usize| format!("[{}, {}]", 30 * column + 18 * (row % 2), 24 * row);
    let zigzag = |column, row| format!("[{}, {}]", corner(column, row), corner(column, row + 1));
    let straight = |column, row| format!("[{}, {}]", corner(column, row), corner(column + 1, row));
    let bend = 24.637942882669687;
    let hinges = [
        (zigzag(1, 0), 40.0),
        (zigzag(2, 0), -40.0),
        (straight(2, 1), bend),
        (straight(2, 2), -bend),
        (zigzag(2, 2), 40.0),
        (zigzag(1, 2), -40.0),
        (straight(0, 2), bend),
        (straight(0, 1), -bend),
    ];
    let (mut bodies, mut joints, mut guess) = (String::new(), String::new(), String::new());
    for (k, (axis, angle)) in hinges.iter().enumerate() {
        bodies += &match k {
            0 => "  p0: { fixed: true }\n".to_owned(),
            _ => format!("  p{k}: {{ point_masses: [{{ mass: 1 g, at: [{k}, 3, 1] }}] }}\n"),
        };
        let next = (k + 1) % hinges.len();
        joints +=
            &format!("  j{k}: {{ bodies: [p{k}, p{next}], axis: {axis}, stiffness: 1e-3 }}\n");
        guess += &format!("j{k}: {angle}, ");
    }
    let text = format!(
        "units: {{ length: mm, angle: deg }}\nbodies:\n{bodies}joints:\n{joints}initial: {{ q: {{ {guess} }} }}\n"
    );
    fs::write(&path, text).unwrap();
    for command in ["modes", "equilibrium", "eval", "simulate"] {
        let output = run(&[command, &path]);
        let said = told(&output);
        assert_eq!(output.status.code(), Some(1), "{command}: {said}");
        assert!(said.contains("at all states near this one") && !said.contains("--lock"), "{said}");
    }
}
