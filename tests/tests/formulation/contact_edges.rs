//! Contacts whose plane ends at a plate's outline and back.

use lamc::program::Interpreter;
use lamc_runtime::Mechanism;
use lamc_tests::{compile_text, largest_difference};

/// A point over a plate is pushed by its distance to the nearest face or edge; beside it, not at all.
#[test]
fn a_plate_ends_at_its_outline_and_its_back() {
    let (width, thickness, k) = (0.03, 2e-3, 1000.0);
    for (at, depth) in [
        ([0.02, 0.015, 1.9e-3], 0.1e-3),
        ([0.02, 0.015, 2.1e-3], 0.0),
        ([0.02, 0.015, 0.4e-3], 0.4e-3),
        ([0.02, 0.015, -0.1e-3], 0.0),
        ([0.02, width - 0.05e-3, 1.9e-3], 0.05e-3),
        ([0.02, width + 0.05e-3, 1.9e-3], 0.0),
        ([-0.01e-3, 0.015, 1.0e-3], 0.0),
        ([0.03e-3, 0.015, 1.0e-3], 0.03e-3),
    ] {
        let [x, y, z] = at;
        let compiled = compile_text(&format!(
            "
materials: {{ card: {{ density: 700, thickness: {thickness} }} }}
layup: [card]
bodies:
  base: {{ fixed: true, outline: [[0, 0], [0.04, 0], [0.04, {width}], [0, {width}]] }}
  flap: {{ outline: [[0.1, 0], [0.2, 0], [0.2, 0.03], [0.1, 0.03]] }}
joints: {{ hinge: {{ bodies: [base, flap], axis: [[0.1, 0], [0.1, 0.03]] }} }}
points: {{ tip: {{ body: flap, at: [{x}, {y}, {z}] }} }}
contacts:
  table:
    plane: {{ point: [0, 0, {thickness}], normal: [0, 0, 1], body: base, within: outline }}
    points: [tip]
    stiffness: {k}
    friction: 0
"
        ));
        let system = Interpreter::new(&compiled.program);
        let mut contact = [0.0; 6];
        system.write_contacts(0.0, &[0.0], &[0.0], &mut contact).unwrap();
        let expected = [x, y, z, 0.0, 0.0, k * depth];
        assert!(largest_difference(&contact, &expected) < 1e-9, "{contact:?} is not {expected:?}");
    }
}
