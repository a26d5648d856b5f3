//! Tests of the audit of energies.

use lamc_runtime::{Mechanism, State};

use super::{Audit, Work};
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
