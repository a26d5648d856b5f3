//! Numbers of the drawing that follow from parameters: a module with other values of its parameters is the module
//! of the drawing that they give.

use lamc::pipeline::{self, Compiled};
use lamc::program::Interpreter;
use lamc::source::{SourceFile, parse, to_yaml};
use lamc_runtime::{Mechanism, acceleration};
use lamc_tests::random::{Random, closed_state};
use lamc_tests::{compile_text, relative_error};

/// Plates, holes, points and masses of two hinges, with a band whose rest length is as drawn.
const TREE: &str = "
units: { length: mm }
parameters:
  w: { value: 40 mm, range: [30 mm, 60 mm] }
  h: { value: 20 mm, range: [15 mm, 30 mm] }
  thick: { value: 0.4 mm, range: [0.2 mm, 0.6 mm] }
  m: { value: 1 g, range: [0.5 g, 3 g] }
materials:
  card: { density: 700, thickness: thick }
  film: { density: 1380, thickness: 0.05, youngs_modulus: 4383 MPa }
layup: [card, film, card]
bodies:
  base: { fixed: true }
  arm:
    outline: [[0, 0], [w, 0], [w, h], [0, h]]
    holes: [[[5, 5], [\"w/2\", 5], [\"w/2\", \"h/2\"], [5, \"h/2\"]]]
  hand:
    outline: [[w, 0], [\"w + h/2\", \"h/7\"], [w, h]]
    point_masses: [{ mass: m, at: [\"w + 0.01\", \"h/3\", thick] }]
joints:
  a:
    bodies: [base, arm]
    axis: [[0, 0], [\"w/9\", h]]
    hinge: { model: beam, material: film, length: 1, width: h }
  b: { bodies: [arm, hand], axis: [[w, 0], [w, h]], z: thick, stiffness: 0.01, damping: 1e-5 }
points:
  tip: { body: hand, at: [\"w + h/4\", 5, 0] }
  hook: { body: base, at: [-5, \"h/2\", 0] }
springs: { band: { from: tip, to: hook, stiffness: 20, damping: 0.01 } }
forces: { pull: { point: tip, force: [0.01, 0.02, 0.03] } }
";

/// Four bars in the plane, whose lengths are parameters.
const PLANAR: &str = "
units: { length: mm }
parameters:
  crank: { value: 20 mm, range: [15 mm, 25 mm] }
  coupler: { value: 50 mm, range: [45 mm, 60 mm] }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  base: { fixed: true }
  first: { outline: [[0, 0], [crank, 0], [crank, 20], [0, 20]] }
  second: { outline: [[crank, 0], [\"crank + coupler\", 0], [\"crank + coupler\", 20], [crank, 20]] }
  third:
    outline:
      - [\"crank + coupler\", 0]
      - [\"crank + coupler + 0.03\", 0]
      - [\"crank + coupler + 0.03\", 20]
      - [\"crank + coupler\", 20]
joints:
  a: { bodies: [base, first], axis: [[0, 0], [0, 20]], stiffness: 0.01 }
  b: { bodies: [first, second], axis: [[crank, 0], [crank, 20]], stiffness: 0.01 }
  c:
    bodies: [second, third]
    axis: [[\"crank + coupler\", 0], [\"crank + coupler\", 20]]
    stiffness: 0.01
  d: { bodies: [third, base], axis: [[40, 0], [40, 20]], z: 1, stiffness: 0.01 }
initial: { q: { a: 1.2 } }
";

/// A vertex of four creases, which moves with a parameter.
const SPHERICAL: &str = "
units: { length: mm }
parameters: { x: { value: 2 mm, range: [1 mm, 4 mm] }, y: { value: 1 mm, range: [0.5 mm, 3 mm] } }
bodies:
  base: { fixed: true }
  a: { mass: 1 g, com: [10, x, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
  b: { mass: 1 g, com: [0, 10, 0], inertia: [[1e-8, 0, 0], [0, 2e-8, 0], [0, 0, 1e-8]] }
  c: { mass: 1 g, com: [-10, 0, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
joints:
  east: { bodies: [base, a], axis: [[x, y], [20, 3]], stiffness: 0.01 }
  north: { bodies: [a, b], axis: [[x, y], [5, 20]], stiffness: 0.01 }
  west: { bodies: [b, c], axis: [[x, y], [-20, 2]], stiffness: 0.01 }
  south: { bodies: [c, base], axis: [[x, y], [3, -20]], stiffness: 0.01 }
initial: { q: { east: 0.5 } }
";

/// Seven hinges without a relation to each other.
const SPATIAL: &str = "
units: { length: mm }
parameters: { s: { value: 10 mm, range: [8 mm, 13 mm] } }
bodies:
  base: { fixed: true }
  a: { mass: 1 g, com: [10, s, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
  b: { mass: 1 g, com: [20, 10, 0], inertia: [[1e-8, 0, 0], [0, 2e-8, 0], [0, 0, 1e-8]] }
  c: { mass: 1 g, com: [30, 0, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
  d: { mass: 2 g, com: [30, 10, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
  e: { mass: 1 g, com: [20, 20, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
  f: { mass: 1 g, com: [\"s/2\", 20, 0], inertia: [[1e-8, 0, 0], [0, 1e-8, 0], [0, 0, 1e-8]] }
joints:
  one: { bodies: [base, a], axis: [[0, 0], [3, 20]], stiffness: 0.01 }
  two: { bodies: [a, b], axis: [[s, 0], [20, \"s/2\"]], stiffness: 0.01 }
  three: { bodies: [b, c], axis: [[25, 3], [20, 20]], z: 0.5, stiffness: 0.01 }
  four: { bodies: [c, d], axis: [[30, 0], [40, 20]], stiffness: 0.01 }
  five: { bodies: [d, e], axis: [[30, 20], [\"2*s\", 10]], z: \"s/20\", stiffness: 0.01 }
  six: { bodies: [e, f], axis: [[10, 20], [15, 40]], stiffness: 0.01 }
  seven: { bodies: [f, base], axis: [[0, 20], [-20, 13]], stiffness: 0.01 }
initial: { q: { one: 0.2 } }
";

/// A free body with an arm, whose corners may touch the ground.
const FREE: &str = "
units: { length: mm }
parameters: { w: { value: 40 mm, range: [30 mm, 60 mm] }, up: { value: 0 mm, range: [-1 mm, 1 mm] } }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  hull: { free: true, outline: [[0, 0], [w, 0], [w, 20], [0, 20]] }
  arm: { outline: [[w, 0], [\"w + 0.02\", 0], [w, 20]] }
joints:
  shoulder: { bodies: [hull, arm], axis: [[w, 0], [w, 20]], stiffness: 0.01, damping: 1e-5 }
contacts:
  ground: { plane: { point: [0, 0, up], normal: [0.1, 0, 1] }, stiffness: 200 N/m, friction: 0.4 }
";

/// The drawing at these values, as a model of its own.
fn drawn(text: &str, values: &[f64]) -> Compiled {
    let file = SourceFile { path: "model.yaml".into(), text: text.into() };
    let (model, _) = parse(&file).unwrap();
    compile_text(&to_yaml(&model.fixed_at(values)))
}

fn rates(system: &Interpreter, q: &[f64], u: &[f64]) -> Vec<f64> {
    let mut rates = vec![0.0; u.len()];
    acceleration(system, 0.0, q, u, &mut system.workspace(), &mut rates).unwrap();
    rates
}

/// Compares a module at random values of its parameters with that of the drawing that they give.
fn check(text: &str, seed: u64) {
    let mut random = Random::new(seed);
    let compiled = compile_text(text);
    let model = compiled.model.as_ref().unwrap();
    assert!(compiled.program.interface.drawn > 0);
    for _ in 0..4 {
        let mut system = Interpreter::new(&compiled.program);
        let values: Vec<f64> = model
            .parameters
            .iter()
            .map(|parameter| {
                let [low, high] = parameter.range.as_ref().unwrap().value;
                let value = random.range(low, high);
                system.set_parameter(&parameter.name.value, value).unwrap();
                value
            })
            .collect();
        let fixed = drawn(text, &values);
        assert_eq!(fixed.program.interface.drawn, 0);
        let other = Interpreter::new(&fixed.program);
        let state = closed_state(&other, &mut random);
        let (q, u) = (&state.q, &state.u);
        let error = relative_error(&rates(&system, q, u), &rates(&other, q, u));
        assert!(error < 1e-8, "seed {seed}: accelerations are off by {error:e} at {values:?}");
        let poses = |it: &Interpreter| it.poses(q).unwrap().as_flattened().to_vec();
        let error = relative_error(&poses(&system), &poses(&other));
        assert!(error < 1e-12, "seed {seed}: poses are off by {error:e}");
        let energy = |it: &Interpreter| it.energy(0.0, q, u).unwrap();
        let (found, expected) = (energy(&system), energy(&other));
        let pairs = [(found.kinetic, expected.kinetic), (found.potential, expected.potential)];
        for (found, expected) in pairs {
            let error = (found - expected).abs() / expected.abs().max(1e-9);
            assert!(error < 1e-9, "seed {seed}: an energy is off by {error:e}");
        }
    }
}

#[test]
fn modules_follow_their_parameters() {
    for (seed, text) in [TREE, PLANAR, SPHERICAL, SPATIAL, FREE].into_iter().enumerate() {
        check(text, 1 + seed as u64);
    }
}

/// The six-bar with the sizes of its plates as parameters.
const PLATES: &str = include_str!("../../../examples/optimise/sixbar_plates.yaml");

/// An evaluation costs what it costs with numbers in place of the parameters.
#[test]
fn formulas_of_the_drawing_cost_little() {
    for text in [TREE, PLANAR, SPHERICAL, SPATIAL, FREE, PLATES] {
        let compiled = compile_text(text);
        let model = compiled.model.as_ref().unwrap();
        let values: Vec<f64> = model.parameters.iter().map(|it| it.value * 1.0625 + 1e-4).collect();
        let fixed = drawn(text, &values);
        let cost = |it: &Compiled| {
            it.program.function_of(lamc::program::FunctionKind::Acceleration).cost().total() as f64
        };
        let ratio = cost(&compiled) / cost(&fixed);
        println!("{ratio:.3}");
        assert!(ratio <= 1.15, "{ratio}");
    }
}

/// A value outside its range, and one at which the drawing is impossible, are refused.
#[test]
fn values_that_do_not_suit_are_refused() {
    let compiled = compile_text(PLANAR);
    let refusal = |values: &[f64]| compiled.topology_at(values).unwrap_err().to_string();
    assert!(compiled.topology_at(&[0.016, 0.05]).is_ok());
    assert!(refusal(&[0.03, 0.05]).contains("range"));
    // A plate without an area.
    let free = compile_text(&PLANAR.replace("{ value: 20 mm, range: [15 mm, 25 mm] }", "20 mm"));
    assert!(free.topology_at(&[0.0, 0.05]).unwrap_err().has_errors());
}

/// `verify`'s formulation of its own sees the same mechanism.
#[test]
fn the_mechanism_follows_too() {
    let compiled = compile_text(TREE);
    let values = [0.05, 0.025, 3e-4, 2e-3];
    let topology = compiled.topology_at(&values).unwrap();
    let fixed = drawn(TREE, &values);
    for (found, expected) in topology.mechanism.bodies.iter().zip(&fixed.topology.mechanism.bodies)
    {
        let error = (found.mass_properties.mass - expected.mass_properties.mass).abs();
        assert!(error <= 1e-15, "{}", found.name);
    }
    let at = |it: &pipeline::Compiled| it.topology.mechanism.points[0].at;
    assert!((topology.mechanism.points[0].at - at(&fixed)).norm() < 1e-15);
}
