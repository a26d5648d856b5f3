//! Tests of the audit of energies, and of tensions.

use lamc_runtime::{Mechanism, State, acceleration};

use super::{Audit, Tensions, Work};
use crate::execution::Jit;
use lamc::pipeline;
use lamc::program::Interpreter;
use lamc::source::SourceFile;

/// A pendulum of 1 g at 0.1 m, and the audit of its motion.
fn pendulum() -> (Interpreter, Work) {
    let text = "bodies:\n  base: { fixed: true }\n  \
                arm: { mass: 1 g, com: [0.1, 0, 0], inertia: [[1e-8,0,0],[0,1e-8,0],[0,0,1e-8]] }\n\
                joints: { hip: { bodies: [base, arm], axis: [[0,0],[0,1]] } }\n";
    let file = SourceFile { path: "pendulum.yaml".into(), text: text.into() };
    let compiled = pipeline::compile(&file).unwrap();
    let work = Work::new(&compiled.topology.mechanism, &[], &[]).unwrap();
    (Interpreter::new(&compiled.program), work)
}

fn state(t: f64, q: f64, u: f64) -> State<Vec<f64>, f64> {
    State { t, q: vec![q], u: vec![u] }
}

#[test]
fn energy_that_nothing_feeds_is_found() {
    let (system, work) = pendulum();
    let energy = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        energy.kinetic + energy.potential
    };
    let begin = state(0.0, 0.2, 0.0);
    // The speed at an angle q if energy is conserved.
    let inertia = 2.0 * system.energy(0.0, &vec![0.2], &vec![1.0]).unwrap().kinetic;
    let falls = |q: f64| (2.0 * (energy(&begin) - energy(&state(0.0, q, 0.0))) / inertia).sqrt();
    let fair = state(0.1, 0.6, falls(0.6));
    assert!((energy(&fair) - energy(&begin)).abs() < 1e-12);
    let looked = |after: &State<Vec<f64>, f64>| {
        Audit::new(&system, &begin, 1e-8).unwrap().look(&system, &begin, after, &work).unwrap()
    };
    assert_eq!(looked(&fair), None);
    // One percent too much is more than 1e-3 and the floor, 1e-3 rad of its weight.
    let mut fast = fair.clone();
    fast.u[0] *= 1.01_f64.sqrt();
    let gain = looked(&fast).unwrap();
    assert!((gain.energy - (energy(&fast) - energy(&begin))).abs() < 1e-12, "{gain:?}");
    // A loss is not a gain.
    fast.u[0] *= 0.9;
    assert_eq!(looked(&fast), None);
}

#[test]
fn rounding_at_rest_is_no_gain() {
    let (system, work) = pendulum();
    let begin = state(0.0, 0.2, 0.0);
    let mut audit = Audit::new(&system, &begin, 1e-8).unwrap();
    // Hardly any kinetic energy yet, and raised by what a projection may move.
    let after = state(1e-9, 0.2 - 1e-8, 1e-7);
    assert_eq!(audit.look(&system, &begin, &after, &work), Ok(None));
    // At a radian a second it is one.
    let after = state(2e-9, 0.2, 1.0);
    assert!(audit.look(&system, &begin, &after, &work).unwrap().is_some());
}

#[test]
fn energy_that_is_no_number_is_found() {
    let (system, work) = pendulum();
    let begin = state(0.0, 0.2, 0.0);
    for after in [state(0.1, f64::NAN, 0.0), state(0.1, 0.2, f64::NAN)] {
        let mut audit = Audit::new(&system, &begin, 1e-8).unwrap();
        let gain = audit.look(&system, &begin, &after, &work).unwrap();
        assert!(gain.is_some(), "{after:?}");
    }
}

/// The system of a model, and its tensions at a state.
fn tensions(text: &str, state: &State<Vec<f64>, f64>) -> (Jit, Vec<f64>) {
    let file = SourceFile { path: "tensions.yaml".into(), text: text.into() };
    let compiled = pipeline::compile(&file).unwrap();
    let system = Jit::new(&compiled.program);
    let found = Tensions::new(&compiled.topology.mechanism)
        .at(&system, (system.parameters(), system.inputs()), state)
        .unwrap();
    (system, found)
}

/// A rod of 0.1 m whose tip hangs on lines from a hook 0.1 m from the hinge: turned by q, they have the length
/// 0.2 |sin(q / 2)|.
fn rod(lines: &str) -> String {
    format!(
        "gravity: [0, 0, 0]\n\
         inputs: [pull]\n\
         bodies:\n  base: {{ fixed: true }}\n  \
         rod: {{ mass: 0.2, com: [0, 0, 0], inertia: [[1e-3,0,0],[0,1e-3,0],[0,0,1e-3]] }}\n\
         joints: {{ axle: {{ bodies: [base, rod], axis: [[0, 0], [1, 0]] }} }}\n\
         points: {{ tip: {{ body: rod, at: [0, 0.1, 0] }}, hook: {{ body: base, at: [0, 0.1, 0] }} }}\n\
         {lines}\n"
    )
}

/// They are k (l - l0) + b dl/dt, and what accelerates the rod: T = -I dw/dt / (dl/dq).
#[test]
fn tensions_are_those_of_the_law_and_of_the_motion() {
    for (only, q, u) in [
        ("false", 1.3, -7.0),
        ("false", 0.5, 3.0),
        ("true", 1.3, 4.0),
        ("true", 0.5, 3.0),
        ("true", 1.3, -90.0),
    ] {
        let line = format!(
            "from: tip, to: hook, stiffness: 30, damping: 0.4, rest_length: 0.08, tension_only: {only}"
        );
        let state = state(0.1, q, u);
        let (system, found) = tensions(&rod(&format!("springs: {{ band: {{ {line} }} }}")), &state);
        let (length, slope) = (0.2 * (q / 2.0).sin(), 0.1 * (q / 2.0).cos());
        let tension = 30.0 * (length - 0.08) + 0.4 * slope * u;
        let is_slack = only == "true" && (length < 0.08 || tension < 0.0);
        let tension = if is_slack { 0.0 } else { tension };
        assert!((found[0] - tension).abs() < 1e-11 * (1.0 + u.abs()), "{found:?} {tension}");
        let mut rate = [f64::NAN];
        acceleration(&system, state.t, &state.q, &state.u, &mut system.workspace(), &mut rate)
            .unwrap();
        assert!((found[0] * slope + 1e-3 * rate[0]).abs() < 1e-11, "{found:?} {rate:?}");
    }
}

#[test]
fn a_given_tension_is_its_formula_and_never_pushes() {
    let text = rod(
        "tendons: { pull: { through: [tip, hook], tension: \"pull - 2*q.axle + u.axle + t\" } }",
    );
    let (mut system, found) = tensions(&text, &state(0.25, 0.5, 3.0));
    assert!((found[0] - 2.25).abs() < 1e-15, "{found:?}");
    system.set_input("pull", -10.0).unwrap();
    let file = SourceFile { path: "tensions.yaml".into(), text };
    let compiled = pipeline::compile(&file).unwrap();
    let law = Tensions::new(&compiled.topology.mechanism);
    assert_eq!(law.names().collect::<Vec<_>>(), ["tendons.pull"]);
    assert_eq!(law.at(&system, (&[], system.inputs()), &state(0.25, 0.5, 3.0)).unwrap(), [0.0]);
}

/// Of two free bodies that spin and drift the length changes by n . (v2 + w2 x r2 - v1 - w1 x r1).
#[test]
fn free_bodies_stretch_a_damper() {
    let body = "free: true, mass: 0.2, inertia: [[1e-3,0,0],[0,2e-3,0],[0,0,3e-3]]";
    let text = format!(
        "gravity: [0, 0, 0]\n\
         bodies:\n  one: {{ {body}, com: [0, 0, 0] }}\n  two: {{ {body}, com: [1, 0, 0] }}\n\
         points: {{ a: {{ body: one, at: [0.1, 0.2, 0.3] }}, b: {{ body: two, at: [1.2, -0.1, 0.1] }} }}\n\
         springs: {{ strut: {{ from: a, to: b, stiffness: 0, damping: 2 }} }}\n"
    );
    // As drawn, but for the drift.
    let q = [[0.3, -0.2, 0.1, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0]].concat();
    let u = [[1.0, 2.0, -3.0, 40.0, -20.0, 10.0], [-0.5, 0.0, 2.0, 3.0, 5.0, -60.0]].concat();
    let (_, found) = tensions(&text, &State { t: 0.0, q, u });
    let velocity = |v: [f64; 3], w: [f64; 3], r: [f64; 3]| {
        let [v, w, r] = [v, w, r].map(nalgebra::Vector3::from);
        v + w.cross(&r)
    };
    let apart = nalgebra::Vector3::new(1.2 - 0.4, -0.1 - 0.0, 0.1 - 0.4);
    let fast = velocity([-0.5, 0.0, 2.0], [3.0, 5.0, -60.0], [0.2, -0.1, 0.1])
        - velocity([1.0, 2.0, -3.0], [40.0, -20.0, 10.0], [0.1, 0.2, 0.3]);
    let expected = 2.0 * apart.normalize().dot(&fast);
    assert!((found[0] - expected).abs() < 1e-10, "{found:?} {expected}");
}
