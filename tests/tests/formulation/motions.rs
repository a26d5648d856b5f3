//! The checks of `motions`: on some random mechanisms, and on spoiled ones, which must fail.

use lamc_tests::campaign::{Outcome, outcome};
use lamc_tests::motions::{NAMES, checks, compared};
use lamc_tests::varied::grounded;
use lamc_workbench::verify::Check;

/// Mechanisms of few joints, trees and loops.
const SEEDS: [u64; 4] = [7, 13, 15, 104];

#[test]
fn random_mechanisms_pass() {
    for seed in SEEDS {
        match outcome(&grounded(seed), &checks) {
            Outcome::Passes(_) => {}
            other => panic!("seed {seed}: {other:?}"),
        }
    }
}

/// Two arms with every law that changes the energy.
const ARMS: &str = "
name: arms
bodies:
  base: { fixed: true, mass: 0.01, com: [0, 0, 0], inertia: [[1e-5, 0, 0], [0, 1e-5, 0], [0, 0, 1e-5]] }
  arm: { outline: [[0, 0], [0.05, 0], [0.05, 0.02], [0, 0.02]] }
  end: { outline: [[0.05, 0], [0.09, 0.01], [0.09, 0.02], [0.05, 0.02]] }
materials: { card: { density: 700, thickness: 0.0004 } }
layup: [card]
air: { density: 1.2, drag: 1.1 }
gravity: [1, 2, -9.81]
joints:
  hip: { bodies: [base, arm], axis: [[0, 0], [0, 0.02]], stiffness: 0.002, rest: 0.1, damping: 1e-5,
         torque: 1e-4*sin(q.knee) }
  knee: { bodies: [arm, end], axis: [[0.05, 0], [0.05, 0.02]], stiffness: \"0.001*(1 + t)\", damping: 2e-6 }
points: { tip: { body: end, at: [0.09, 0.01, 0] } }
forces: { pull: { point: tip, force: [0.001, \"0.01*t\", 0] } }
";

fn failed(checks: Vec<Check>) -> Vec<&'static str> {
    assert!(checks.iter().all(|check| check.remark.is_none()), "{checks:?}");
    checks.iter().filter(|check| check.failed()).map(|check| check.name).collect()
}

#[test]
fn all_checks_apply_to_two_arms() {
    let checks = checks(ARMS).unwrap();
    let names: Vec<_> = checks.iter().map(|check| check.name).collect();
    // There is no loop to cut.
    assert_eq!(names, NAMES[..13]);
    assert_eq!(failed(checks), [""; 0]);
}

/// What a spoiled model says does not hold for the motion of the model: every check can fail.
#[test]
fn a_spoiled_law_fails() {
    let spoiled = |from: &str, to: &str| {
        let text = ARMS.replace(from, to);
        assert_ne!(text, ARMS);
        failed(compared(ARMS, &text).unwrap())
    };
    let gravity = spoiled("-9.81", "9.81");
    for name in NAMES[..13].iter().filter(|&&name| name != "momentum") {
        assert!(gravity.contains(name), "{name} does not see the sign of gravity");
    }
    assert!(spoiled("stiffness: 0.002", "stiffness: -0.002").contains(&"conserved"));
    let dissipative = spoiled("damping: 1e-5", "damping: 1.1e-5");
    assert!(dissipative.contains(&"energy") && !dissipative.contains(&"conserved"));
    assert!(spoiled("density: 700", "density: 701").contains(&"energy"));
    assert!(
        spoiled("[0.09, 0.01], [0.09, 0.02]", "[0.09, 0.012], [0.09, 0.02]").contains(&"momentum")
    );
}

/// A loop cut elsewhere whose spring is spoiled.
#[test]
fn a_spoiled_loop_fails() {
    let path = lamc_tests::workspace().join("examples/fourbar.yaml");
    let text = std::fs::read_to_string(path).unwrap();
    let gravity = "gravity: [0, 0, -9.81]";
    let text = if text.contains("gravity:") { text } else { format!("{gravity}\n{text}") };
    let spoiled = text.replace("-9.81", "9.81");
    assert_ne!(spoiled, text);
    let cut = |checks: Vec<Check>| checks.into_iter().find(|check| check.name == "other cut");
    assert!(!cut(checks(&text).unwrap()).unwrap().failed());
    assert!(cut(compared(&text, &spoiled).unwrap()).unwrap().failed());
}
