//! Joint limits as stops: impact, rest and release against closed forms.

use lamc::program::{Interpreter, Selection};
use lamc_runtime::{
    Dopri5, Integrator, Mechanism, Rk4, Rodas, State, Stopped, assemble, equilibrium, project,
};
use lamc_tests::compare::keep_largest;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{compile_text, linkages, workspace};

/// A wheel of 1e-6 kg m^2 about its hinge, without gravity, and a torque towards its stop at -1.
const WHEEL: &str = "
gravity: [0, 0, 0]
bodies:
  base: { fixed: true }
  wheel: { mass: 1 g, com: [0, 0, 0], inertia: [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]] }
inputs: [load]
joints:
  hinge: { bodies: [base, wheel], axis: [[0, 0], [1, 0]], limits: [-1, 2], torque: TORQUE }
";

fn wheel(torque: &str) -> Stopped<Interpreter> {
    let compiled = compile_text(&WHEEL.replace("TORQUE", torque));
    Stopped::new(Interpreter::new(&compiled.program))
}

/// Falls onto the stop at constant acceleration 8 rad/s^2 and bounces: times and heights of a
/// ball in uniform gravity.
fn bounces<I: Integrator<Stopped<Interpreter>>>(make: impl Fn(&Stopped<Interpreter>) -> I) {
    let mut system = wheel("-8e-6");
    system.restitution = 0.5;
    let mut integrator = make(&system);
    let mut state = State { t: 0.0, q: vec![0.0], u: vec![0.0] };
    // From rest 1 rad above the stop: first impact at 1/2 s, with 4 rad/s.
    let mut at = 0.5;
    let mut speed = 4.0;
    for _ in 0..6 {
        system.run(&mut integrator, &mut state, at - 1e-9, |_| ()).unwrap();
        assert!((state.u[0] + speed).abs() < 1e-7, "{state:?}");
        speed *= 0.5;
        system.run(&mut integrator, &mut state, at + 1e-6, |_| ()).unwrap();
        assert!((state.u[0] - speed).abs() < 1e-4, "{state:?} should leave at {speed}");
        assert!((state.q[0] + 1.0).abs() < 1e-5);
        at += 2.0 * speed / 8.0;
    }
    // All bounces are over after 3 times the first fall.
    let mut lowest = 0.0_f64;
    system.run(&mut integrator, &mut state, 2.0, |state| lowest = lowest.min(state.q[0])).unwrap();
    assert!((lowest + 1.0).abs() < 1e-9, "{lowest}");
    assert!((state.q[0] + 1.0).abs() < 1e-12, "{state:?}");
    assert_eq!((state.u[0], system.sides[0]), (0.0, -1.0));
}

#[test]
fn a_wheel_bounces_as_a_ball_does() {
    bounces(|system| {
        let mut integrator = Dopri5::new(system);
        (integrator.relative, integrator.absolute) = (1e-11, 1e-11);
        integrator
    });
    bounces(|system| {
        let mut integrator = Rodas::new(system);
        (integrator.relative, integrator.absolute) = (1e-11, 1e-11);
        integrator
    });
}

/// The torque that holds it at the stop changes sign at t = 0.7 s: it leaves then, and turns by
/// the double integral of the torque.
#[test]
fn a_joint_leaves_its_stop_when_the_torque_turns() {
    let mut system = wheel("1e-5*(t - 0.7)");
    let mut integrator = Dopri5::new(&system);
    (integrator.relative, integrator.absolute) = (1e-11, 1e-11);
    let mut state = State { t: 0.0, q: vec![-1.0], u: vec![0.0] };
    let mut left = f64::NAN;
    let observe = |state: &State<Vec<f64>, f64>| {
        if state.q[0] > -1.0 && left.is_nan() {
            left = state.t;
        }
    };
    system.run(&mut integrator, &mut state, 1.3, observe).unwrap();
    assert!(left > 0.7, "left at {left}");
    let expected = -1.0 + 10.0 * 0.6_f64.powi(3) / 6.0;
    assert!((state.q[0] - expected).abs() < 1e-8, "{} is not {expected}", state.q[0]);
}

#[test]
fn inputs_may_change_between_runs_and_equilibria_rest_on_stops() {
    let mut system = wheel("load - 1e-6*q.hinge");
    let mut integrator = Dopri5::new(&system);
    let mut state = State { t: 0.0, q: vec![1.9], u: vec![0.0] };
    system.system.set_input("load", 1e-3).unwrap();
    system.run(&mut integrator, &mut state, 0.5, |_| ()).unwrap();
    assert!((state.q[0] - 2.0).abs() < 1e-12 && system.sides[0] == 1.0, "{state:?}");
    system.system.set_input("load", -1e-3).unwrap();
    system.run(&mut integrator, &mut state, 1.0, |_| ()).unwrap();
    assert!((state.q[0] + 1.0).abs() < 1e-12 && system.sides[0] == -1.0, "{state:?}");
    let mut q = vec![0.5];
    let mut workspace = system.system.workspace();
    let found = equilibrium(&system.system, 0.0, &mut q, &mut workspace).unwrap();
    assert!((q[0] + 1.0).abs() < 1e-12 && found.stable, "{q:?}");
    // A stop that the torque leaves does not hold it.
    system.system.set_input("load", 1e-6).unwrap();
    let mut q = vec![-1.0];
    equilibrium(&system.system, 0.0, &mut q, &mut workspace).unwrap();
    assert!((q[0] - 1.0).abs() < 1e-12, "{q:?}");
}

/// A fixed-step integrator with impacts after each step.
#[test]
fn stops_after_steps_of_fixed_length() {
    let mut system = wheel("-8e-6");
    let mut rk4 = Rk4::new(&system);
    let mut state = State { t: 0.0, q: vec![0.0], u: vec![0.0] };
    for _ in 0..1000 {
        rk4.step(&system, &mut state, 1e-3).unwrap();
        system.resolve_impacts(&mut state).unwrap();
    }
    assert!((state.q[0] + 1.0).abs() < 1e-12, "{state:?}");
    assert_eq!((state.u[0], system.sides[0]), (0.0, -1.0));
}

/// Beyond a stop, as a step of fixed length may leave it: back to the limit, outwards with the
/// share of its speed that the stop returns, inwards with all of it.
#[test]
fn a_joint_beyond_its_stop_goes_back() {
    for (restitution, before, after) in [(0.5, -4.0, 2.0), (0.0, -4.0, 0.0), (0.5, 3.0, 3.0)] {
        let mut system = wheel("0");
        system.restitution = restitution;
        let mut state = State { t: 0.0, q: vec![-1.01], u: vec![before] };
        assert!(system.resolve_impacts(&mut state).unwrap());
        assert!(
            (state.q[0] + 1.0).abs() < 1e-12 && (state.u[0] - after).abs() < 1e-12,
            "{state:?}"
        );
        assert_eq!(system.sides[0], if after == 0.0 { -1.0 } else { 0.0 });
    }
}

/// A loop whose joint hits a stop: u jumps along the closure only, and the energy never grows.
#[test]
fn impacts_of_a_loop_respect_its_closure() {
    let six = [0.0, 50.0, 140.0, 180.0, 220.0, 290.0];
    let mut text = linkages::spherical("struck", &six).text(4);
    let joint = text.find("  j1: {").expect("a joint");
    let end = text[joint..].find(" }").expect("its end") + joint;
    text.insert_str(end, ", limits: [-0.3, 0.3]");
    let compiled = compile_text(&text);
    for restitution in [0.0, 0.6, 1.0] {
        let mut system = Stopped::new(Interpreter::new(&compiled.program));
        system.restitution = restitution;
        let mut state = system.initial();
        state.q = vec![0.4, -0.2, -0.5, 0.3, 0.1, -0.2];
        state.u = vec![3.0, -8.0, 2.0, 1.0, -4.0, 2.0];
        let mut workspace = system.workspace();
        assemble(&system, 0.0, &mut state.q, &[false; 6], &mut workspace).unwrap();
        project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
        let mut integrator = Dopri5::new(&system);
        let mut last = state.clone();
        let mut impacts = 0;
        while state.t < 1.0 {
            let before = state.clone();
            system.step_with(&mut integrator, &mut state, 1.0).unwrap();
            assert!(state.q[1].abs() <= 0.3 + 1e-9, "{state:?}");
            if (state.u[1] - before.u[1]).abs() > 0.5 && state.q[1].abs() > 0.299 {
                impacts += 1;
            }
            let rows = 9;
            let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * 6]);
            system.write_closure(&state.q, &mut residual, &mut jacobian).unwrap();
            for row in jacobian.chunks(6) {
                let rate: f64 = row.iter().zip(&state.u).map(|(j, u)| j * u).sum();
                assert!(rate.abs() < 1e-9, "opens at {rate:e} m/s");
            }
            let total = |state: &State<Vec<f64>, f64>| {
                let energy = system.energy(0.0, &state.q, &state.u).unwrap();
                energy.kinetic + energy.potential
            };
            assert!(total(&state) <= total(&last) + 1e-9, "energy grew");
            last = state.clone();
        }
        println!("restitution {restitution}: {impacts} impacts");
        assert!(impacts > 0, "restitution {restitution}: nothing struck the stop");
    }
}

/// At the stop the speed turns by the restitution e, and the kinetic energy that the impulse takes is
/// (1 - e^2) / 2 of u_j^2 / w, with w = d u_j / d p along the closure whatever e.
#[test]
fn an_impact_takes_the_energy_of_its_impulse() {
    let six = [0.0, 50.0, 140.0, 180.0, 220.0, 290.0];
    let mut text = linkages::spherical("struck", &six).text(4);
    let joint = text.find("  j1: {").expect("a joint");
    let end = text[joint..].find(" }").expect("its end") + joint;
    text.insert_str(end, ", limits: [-0.3, 0.3]");
    let compiled = compile_text(&text);
    let loss = |restitution: f64| {
        let mut system = Stopped::new(Interpreter::new(&compiled.program));
        system.restitution = restitution;
        let mut state = system.initial();
        state.q = vec![0.4, 0.3, -0.5, 0.3, 0.1, -0.2];
        state.u = vec![3.0, 8.0, 2.0, 1.0, -4.0, 2.0];
        let (mut workspace, mut pinned) = (system.workspace(), [false; 6]);
        pinned[1] = true;
        assemble(&system, 0.0, &mut state.q, &pinned, &mut workspace).unwrap();
        project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
        let (before, speed) = (system.energy(0.0, &state.q, &state.u).unwrap().kinetic, state.u[1]);
        assert!(speed > 1.0, "{speed}");
        assert!(system.resolve_impacts(&mut state).unwrap());
        assert!((state.u[1] + restitution * speed).abs() < 1e-9 * speed, "{state:?}");
        before - system.energy(0.0, &state.q, &state.u).unwrap().kinetic
    };
    let whole = loss(0.0);
    assert!(whole > 0.0);
    for restitution in [0.3, 0.6, 1.0] {
        let share = loss(restitution) / whole;
        assert!((share - (1.0 - restitution * restitution)).abs() < 1e-9, "{restitution}: {share}");
    }
}

/// The limits of a drawing, set closer, stop it: its pendulum would hang further down.
#[test]
fn limits_of_popupcad_files_are_honoured() {
    let path = workspace().join("tests/data/drawings/drawn_pendulum.cad.joints");
    let text = std::fs::read_to_string(path).unwrap();
    let closer = text.replace("limit_pos: 150", "limit_pos: 40");
    assert_ne!(text, closer, "the file has no such limit");
    let compiled = compile_text(&closer);
    let mut system = Stopped::new(Interpreter::new(&compiled.program));
    let mut integrator = Dopri5::new(&system);
    let mut state = State { t: 0.0, q: vec![0.0], u: vec![0.0] };
    let mut highest = 0.0_f64;
    system
        .run(&mut integrator, &mut state, 3.0, |state| highest = keep_largest(highest, state.q[0]))
        .unwrap();
    let limit = 40.0_f64.to_radians();
    assert!((state.q[0] - limit).abs() < 1e-12 && highest < limit + 1e-9, "{state:?}, {highest}");
    let mut q = vec![0.0];
    equilibrium(&system.system, 0.0, &mut q, &mut system.workspace()).unwrap();
    assert!((q[0] - limit).abs() < 1e-12, "{q:?}");
}

/// A sheet whose joints rest at angles beyond limits of 50 degrees, or of `apart` degrees more from joint to joint, with
/// independent speeds and without.
fn sheets(text: &str, apart: f64) -> [Stopped<Interpreter>; 2] {
    let mut parts = text.split(" stiffness:");
    let mut text = parts.next().unwrap().to_owned();
    for (index, part) in parts.enumerate() {
        let limit = 50.0 + apart * index as f64;
        text.push_str(&format!(" limits: [-{limit}, {limit}], stiffness:{part}"));
    }
    let program = compile_text(&text).program;
    let without = program.only(Selection::named(["none"]).unwrap());
    [program, without].map(|program| Stopped::new(Interpreter::new(&program)))
}

/// Moves until this time; returns the state, and how many joints a stop holds then.
fn moved(mut system: Stopped<Interpreter>, t: f64) -> (State<Vec<f64>, f64>, usize) {
    let mut state = system.initial();
    let mut integrator = Dopri5::new(&system);
    (integrator.relative, integrator.absolute) = (1e-11, 1e-11);
    system.run(&mut integrator, &mut state, t, |_| ()).unwrap();
    let held = system.sides.iter().filter(|side| **side != 0.0).count();
    (state, held)
}

/// By independent speeds, a sheet with joints at stops moves as it does by the equations of all joints: where one joint
/// after the other meets its stop, and where many do at once, of which all but one follow from it. Which of those a stop holds
/// makes no difference.
#[test]
fn sheets_meet_their_stops_as_by_the_equations_of_all_joints() {
    for (name, text, apart, t) in [
        ("miura 3x3", miura(3, 3), 0.0, 0.06),
        ("miura 4x4", miura(4, 4), 0.0, 0.06),
        ("yoshimura 3x3", yoshimura(3, 3), 0.31, 0.02),
    ] {
        let [fast, general] = sheets(&text, apart);
        assert!(fast.reduction().is_some() && general.reduction().is_none(), "{name}");
        let (start, mut out) = (fast.initial(), fast.speeds());
        let found = fast.write_acceleration(0.0, &start.q, &start.u, &mut out).unwrap();
        assert!(found.is_some(), "{name}: without stops, straight-line code solves");
        let (found, held) = moved(fast, t);
        let (expected, _) = moved(general, t);
        assert!(held > 0, "{name}: no joint is at a stop");
        let off = found.q.iter().zip(&expected.q).map(|(a, b)| (a - b).abs());
        let worst = off.fold(0.0, keep_largest);
        println!("{name}: {held} held, {worst:.1e} rad apart");
        assert!(worst < 1e-9, "{name}: {worst:e}");
    }
}

/// Of equal limits, a joint that meets its stop pushes another off its own, which is back at once: both come to rest.
#[test]
fn joints_do_not_push_each_other_off_their_stops_for_ever() {
    let text = yoshimura(3, 3).replace(" stiffness:", " limits: [-58, 58], stiffness:");
    let mut system = Stopped::new(Interpreter::new(&compile_text(&text).program));
    let (mut state, mut steps) = (system.initial(), 0);
    let mut integrator = Dopri5::new(&system);
    while state.t < 0.03 {
        system.step_with(&mut integrator, &mut state, 0.03).unwrap();
        steps += 1;
        assert!(steps < 1000, "{} s after {steps} steps", state.t);
    }
    assert!(system.sides.iter().any(|side| *side != 0.0), "no joint is at a stop");
}
