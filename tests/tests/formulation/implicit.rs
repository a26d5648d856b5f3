//! Implicit steps of sheets, whose derivatives are taken along the closure, against an explicit method.

use lamc_runtime::{Dopri5, Integrator, Mechanism, Rodas, State};
use lamc_tests::compare::largest;
use lamc_tests::compile_text;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_workbench::execution::Jit;

/// The joint of the first hinge gets a torque that changes with time, and all have much damping.
fn pushed(text: &str) -> String {
    let damped = text.replace("damping: 2e-6", "damping: 2e-5");
    damped.replacen("stiffness:", "torque: \"2e-4*sin(300*t)\", stiffness:", 1)
}

/// So many of the joints that may move independently are driven, from where they start; not the first, which has a torque.
fn driven(text: &str, count: usize) -> String {
    let topology = compile_text(text).topology;
    let independent = topology.reduction.unwrap().independent;
    let chosen: Vec<_> = independent.iter().filter(|it| it.index() > 0).take(count).collect();
    assert_eq!(chosen.len(), count);
    let (joints, initial) = text.split_once("initial: { q: { ").unwrap();
    let mut joints = joints.to_owned();
    let mut starts: Vec<&str> = initial.trim_end_matches([' ', '}', '\n']).split(", ").collect();
    for joint in chosen {
        let name = &topology.mechanism.joints[joint.index()].name;
        let start = topology.mechanism.initial_q[joint.index()];
        let drive = format!("  {name}: {{ drive: \"{start} + 0.2*sin(30*t)\", ");
        joints = joints.replacen(&format!("  {name}: {{ "), &drive, 1);
        starts.retain(|start| !start.starts_with(&format!("{name}: ")));
    }
    format!("{joints}initial: {{ q: {{ {} }} }}\n", starts.join(", "))
}

/// A Miura-ori of 3 x 3 plates with two plates in a row at its last one, whose hinges no loop has.
fn with_tail(text: &str) -> String {
    let bodies = "  f9: { outline: [[90, 48], [120, 48], [138, 72], [108, 72]] }
  f10: { outline: [[120, 48], [150, 48], [168, 72], [138, 72]] }
joints:
  tail_0: { bodies: [f8, f9], axis: [[90, 48], [108, 72]], stiffness: 1e-3, damping: 2e-5, rest: 20 }
  tail_1: { bodies: [f9, f10], axis: [[120, 48], [138, 72]], stiffness: 1e-3, damping: 2e-5 }
";
    text.replace("joints:\n", bodies)
}

fn end<I: Integrator<Jit>>(system: &Jit, mut method: I) -> (Vec<f64>, usize) {
    let state = system.assembled().unwrap();
    let mut state = State { t: 0.0, q: state.q, u: state.u };
    let mut steps = 0;
    method.run(system, &mut state, DURATION, |_| steps += 1).unwrap();
    (state.q, steps)
}

/// s.
const DURATION: f64 = 0.02;

/// The error of a step by RODASP is some h^5, and that of a method whose matrix is not the derivative of what it evaluates h^3 or
/// worse: with a tolerance a thousand times smaller it would take ten times as many steps or more, instead of four.
#[test]
fn implicit_steps_of_sheets_follow_the_motion() {
    let sheets = [
        ("driven miura 4x5", driven(&pushed(&miura(4, 5)), 1)),
        ("driven yoshimura 4x5", driven(&pushed(&yoshimura(4, 5)), 8)),
        ("miura 2x3", pushed(&miura(2, 3))),
        ("miura 3x3", pushed(&miura(3, 3))),
        ("miura 3x3 with a tail", pushed(&with_tail(&miura(3, 3)))),
        ("miura 4x5", pushed(&miura(4, 5))),
        ("yoshimura 4x5", pushed(&yoshimura(4, 5))),
    ];
    for (name, text) in sheets {
        let compiled = compile_text(&text);
        let system = Jit::new(&compiled.program);
        let mut explicit = Dopri5::new(&system);
        (explicit.relative, explicit.absolute) = (1e-11, 1e-12);
        let (expected, _) = end(&system, explicit);
        let mut counts = Vec::new();
        for tolerance in [1e-5, 1e-8] {
            let mut implicit = Rodas::new(&system);
            (implicit.relative, implicit.absolute) = (tolerance, tolerance);
            let (found, steps) = end(&system, implicit);
            let errors: Vec<f64> = found.iter().zip(&expected).map(|(a, b)| a - b).collect();
            let error = largest(&errors);
            println!("{name}, tolerance {tolerance:e}: {steps} steps, error {error:.1e}");
            assert!(error < 20.0 * tolerance, "{name}: {error:e}");
            counts.push(steps);
        }
        assert!(counts[1] < 8 * counts[0], "{name}: {counts:?} steps");
    }
}
