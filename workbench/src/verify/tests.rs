use lamc::pipeline::{Compiled, compile};
use lamc::program::{FunctionKind, Op};
use lamc::source::SourceFile;

use super::*;

const SETTINGS: Settings = Settings { states: 6, seed: 3, duration: 0.2 };

fn compiled(text: &str) -> Compiled {
    let file = SourceFile { path: "model.yaml".into(), text: text.into() };
    compile(&file).unwrap_or_else(|error| panic!("{error}"))
}

fn example(name: &str) -> Compiled {
    let path = format!("{}/../examples/{name}.yaml", env!("CARGO_MANIFEST_DIR"));
    compiled(&std::fs::read_to_string(path).unwrap())
}

/// The names of the checks that failed.
fn failures(compiled: &Compiled) -> Vec<&'static str> {
    let checks = verify(compiled, &SETTINGS);
    checks.iter().filter(|check| check.failed()).map(|check| check.name).collect()
}

/// Multiplies the largest constant of each function of these kinds.
fn spoiled(mut compiled: Compiled, kinds: &[FunctionKind], factor: f64) -> Compiled {
    for function in compiled.program.functions.iter_mut().filter(|f| kinds.contains(&f.kind)) {
        let constants = function.instructions.iter_mut().filter_map(|i| match &mut i.op {
            Op::Const(number) => Some(number),
            _ => None,
        });
        let largest = constants.max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
        *largest *= factor;
    }
    compiled
}

#[test]
fn examples_pass() {
    for name in ["triple_pendulum", "sixbar"] {
        assert_eq!(failures(&example(name)), [""; 0], "{name}");
    }
}

#[test]
fn every_law_is_compared() {
    let model = "
name: laws
bodies:
  base: { fixed: true }
  arm: { outline: [[0, 0], [0.05, 0], [0.05, 0.02], [0, 0.02]] }
  end: { outline: [[0.05, 0], [0.09, 0], [0.09, 0.02], [0.05, 0.02]] }
  tail: { outline: [[0, 0], [-0.03, 0], [-0.03, 0.02], [0, 0.02]] }
materials: { card: { density: 700, thickness: 0.0004 } }
layup: [card]
air: { density: 1.2, drag: 1.1 }
inputs: [motor]
joints:
  hip: { bodies: [base, arm], axis: [[0, 0], [0, 0.02]], stiffness: 0.02, cubic_stiffness: 0.3, rest: 0.1,
         friction: { torque: 1e-4, speed: 0.1 }, torque: \"motor + 1e-4*tanh(u.hip)\" }
  knee: { bodies: [arm, end], axis: [[0.05, 0], [0.05, 0.02]], damping: 1e-5, torque: \"1e-5*t*q.hip\" }
  wag: { bodies: [base, tail], axis: [[0, 0], [0, 0.02]], drive: \"0.3*sin(20*t) + t^2\" }
points:
  tip: { body: end, at: [0.09, 0.01, 0] }
  back: { body: tail, at: [-0.03, 0, 0.004] }
  hook: { body: base, at: [0.02, 0.01, 0.05] }
forces: { pull: { point: tip, force: [0, \"1e-4*sin(t)\", 1e-3] } }
springs:
  band: { from: tip, to: hook, stiffness: 1, damping: 1e-3, rest_length: 0.05, tension_only: true }
  twist: { bodies: [tail, end], axis: [[0, 0], [0.1, 0.03]], stiffness: 1e-4, damping: \"1e-6*(1 + t)\", rest: 0.2 }
tendons:
  given: { through: [hook, back, tip], tension: \"0.01*sin(q.knee)\" }
  elastic: { through: [back, hook, tip], stiffness: 0.3, rest_length: \"0.1*t\" }
motors:
  hip: { joint: hip, torque_constant: 1e-4, resistance: 8, gear: 30, inertia: 1e-9, voltage: motor, max_current: 1 }
  knee: { joint: knee, torque_constant: 1e-4, resistance: 8, gear: 9, voltage: \"3*sin(t) - u.knee\", max_voltage: 2 }
";
    let checks = verify(&compiled(model), &SETTINGS);
    for check in &checks {
        assert!(!check.failed(), "{check:?}");
    }
    let acceleration = &checks[0];
    assert!(acceleration.cases == 6 && acceleration.error < 1e-11, "{acceleration:?}");
    let balance = checks.iter().find(|check| check.name == "balance").unwrap();
    assert!(matches!(balance.remark, Some(Remark::NotChecked(_))), "{balance:?}");
}

#[test]
fn faults_are_found() {
    use FunctionKind::{Acceleration, Energy, Equations, Poses};
    let solving = [Equations, Acceleration];
    let found = failures(&spoiled(example("triple_pendulum"), &solving, 1.0 + 1e-6));
    assert!(found.contains(&"acceleration"), "{found:?}");
    assert!(!found.contains(&"energy") && !found.contains(&"interpreter"), "{found:?}");
    let found = failures(&spoiled(example("triple_pendulum"), &[Energy], 1.0 + 1e-6));
    assert!(found.contains(&"energy") && !found.contains(&"acceleration"), "{found:?}");
    // What is drawn decides nothing.
    assert_eq!(failures(&spoiled(example("triple_pendulum"), &[Poses], 2.0)), [""; 0]);
    // A spring that is twice as stiff in the equations as in the energy.
    let found = failures(&spoiled(example("sixbar"), &[Energy], 2.0));
    assert!(found.contains(&"balance"), "{found:?}");
}

#[test]
fn what_cannot_be_compared_is_said() {
    let rod = "
name: rod
bodies: { base: { fixed: true }, bob: { point_masses: [{ mass: 0.1, at: [0, -0.1, 0] }] } }
joints: { j: { bodies: [base, bob], axis: [[0, 0], [0.1, 0]] } }
";
    let checks = verify(&compiled(rod), &SETTINGS);
    let Some(Remark::NotChecked(reason)) = &checks[0].remark else { panic!("{checks:?}") };
    assert!(reason.contains("`bob`"), "{reason}");
    assert!(checks.iter().all(|check| !check.failed()), "{checks:?}");
    assert!(checks.iter().any(|check| check.name == "balance" && check.cases > 0), "{checks:?}");
}
