//! Events of motions that have a closed form, and plates that steps must not jump over.

mod switches;

use std::f64::consts::{FRAC_PI_2, PI};

use lamc::pipeline;
use lamc::source::SourceFile;
use lamc_runtime::{Mechanism as _, State};

use super::{Direction, Event, Method, Reached, Settings, Simulation};
use crate::execution::Jit;

/// A body of 1e-6 kg m^2 about its hinge; its spring swings it at 20 rad/s.
const SPEED: f64 = 20.0;

fn swing(limits: &str, (q, u): (f64, f64), settings: &Settings) -> Simulation {
    let text = format!(
        "gravity: [0, 0, 0]\nbodies:\n  base: {{ fixed: true }}\n  \
         arm: {{ mass: 1 g, com: [0, 0, 0], inertia: [[1e-6,0,0],[0,1e-6,0],[0,0,1e-6]] }}\n\
         units: {{ length: m }}\njoints:\n  \
         hip: {{ bodies: [base, arm], axis: [[0,0],[0,1]], stiffness: 4e-4{limits} }}\n"
    );
    let file = SourceFile { path: "swing.yaml".into(), text };
    let system = Jit::new(&pipeline::compile(&file).unwrap().program);
    Simulation::new(system, State { t: 0.0, q: vec![q], u: vec![u] }, None, settings).unwrap()
}

fn event(
    function: impl Fn(&State<Vec<f64>, f64>) -> f64 + Send + 'static,
    direction: Direction,
    ends_at: Option<usize>,
) -> Event {
    Event { function: Box::new(move |state, _| Some(function(state))), direction, ends_at }
}

fn times(simulation: &Simulation) -> Vec<Vec<f64>> {
    simulation.events().map(|found| found.iter().map(|state| state.t).collect()).collect()
}

fn check(found: &[f64], expected: &[f64], tolerance: f64) {
    assert_eq!(found.len(), expected.len(), "{found:?} {expected:?}");
    for (found, expected) in found.iter().zip(expected) {
        assert!((found - expected).abs() < tolerance, "{found} {expected}");
    }
}

/// q = cos(20 t): both methods, samples in between.
#[test]
fn signs_change_where_the_closed_form_says() {
    for (method, tolerance) in [(Method::Dopri5, 1e-9), (Method::Rodas, 1e-7)] {
        let settings = Settings { method, tolerance: 1e-11, ..Settings::default() };
        let mut simulation = swing("", (1.0, 0.0), &settings);
        let half = |state: &State<Vec<f64>, f64>| state.q[0] - 0.5;
        simulation.watch(event(half, Direction::Either, None));
        simulation.watch(event(half, Direction::Rising, None));
        simulation.watch(event(half, Direction::Falling, None));
        // Zero at the start: no event there.
        simulation.watch(event(|state| state.u[0], Direction::Either, None));
        simulation.run([0.0, 0.1, 0.25, 0.5], || false, |_| ()).unwrap();
        let [either, rising, falling, turns] = &times(&simulation)[..] else { panic!() };
        // cos = 1/2 at pi/3, 5 pi/3, 7 pi/3; at 10 rad the third is past.
        check(either, &[PI / 3.0, 5.0 * PI / 3.0, 7.0 * PI / 3.0].map(|a| a / SPEED), tolerance);
        check(rising, &[5.0 * PI / 3.0 / SPEED], tolerance);
        check(falling, &[PI / 3.0, 7.0 * PI / 3.0].map(|a| a / SPEED), tolerance);
        check(turns, &[PI, 2.0 * PI, 3.0 * PI].map(|a| a / SPEED), tolerance);
        for state in simulation.events().next().unwrap() {
            assert!((state.q[0] - 0.5).abs() < 1e-9);
        }
    }
}

#[test]
fn the_second_return_ends_the_motion() {
    let settings = Settings { tolerance: 1e-11, ..Settings::default() };
    let mut simulation = swing("", (1.0, 0.0), &settings);
    simulation.watch(event(|state| state.q[0], Direction::Either, Some(2)));
    simulation.watch(event(|state| state.t - 0.3, Direction::Either, None));
    simulation.run([0.0, 0.1, 0.5, 0.9], || false, |_| ()).unwrap();
    let end = 3.0 * FRAC_PI_2 / SPEED;
    let motion = simulation.motion();
    assert!(motion.complete);
    check(
        &motion.samples.iter().map(|sample| sample.t).collect::<Vec<_>>(),
        &[0.0, 0.1, end],
        1e-9,
    );
    let last = &motion.samples[2];
    assert!(last.q[0].abs() < 1e-9 && (last.u[0] - SPEED).abs() < 1e-7, "{last:?}");
    // What comes later has not happened.
    assert!(times(&simulation)[1].is_empty());
}

/// At a stop the speed jumps: no time within a step has the value zero.
#[test]
fn an_impact_changes_a_sign_at_once() {
    let settings = Settings { tolerance: 1e-11, restitution: 0.5, ..Settings::default() };
    let mut simulation = swing(", limits: [-1, 0.5]", (0.0, SPEED), &settings);
    simulation.watch(event(|state| state.u[0], Direction::Falling, Some(1)));
    let reached = simulation.reach(0.1, || false).unwrap();
    assert_eq!(reached, Reached::Event);
    // q = sin(20 t) until it is 0.5; it returns with half its speed.
    let state = simulation.state();
    assert!((state.t - PI / 6.0 / SPEED).abs() < 1e-9, "{state:?}");
    assert!((state.u[0] + 0.5 * SPEED * 0.75_f64.sqrt()).abs() < 1e-6, "{state:?}");
}

/// Fixed steps end at samples, find the events between, and hold what reaches its stop: sin(20 t) until it is 0.5.
#[test]
fn rigid_steps_end_at_samples_and_at_stops() {
    let step = 1e-5;
    let settings = Settings { method: Method::Rigid { step }, ..Settings::default() };
    let mut simulation = swing(", limits: [-1, 0.5], torque: 1e-3", (0.0, SPEED), &settings);
    simulation.watch(event(|state| state.q[0] - 0.25, Direction::Rising, None));
    simulation.run([0.0, 0.01003, 0.1], || false, |_| ()).unwrap();
    let motion = simulation.motion();
    let [_, between, last] = motion.samples.as_slice() else { panic!("three samples") };
    assert_eq!((between.t, last.t), (0.01003, 0.1));
    // With the torque it swings about 2.5 rad.
    let exact = |t: f64| 2.5 - 2.5 * (SPEED * t).cos() + (SPEED * t).sin();
    assert!((between.q[0] - exact(between.t)).abs() <= 3e-4, "{between:?}");
    let at = times(&simulation)[0][0];
    assert!((exact(at) - 0.25).abs() <= 3e-4, "{at}");
    assert!((last.q[0] - 0.5).abs() <= 1e-12 && last.u[0].abs() <= 1e-12, "{last:?}");
    assert!(last.acceleration[0].abs() <= 1e-6, "{last:?}");
    assert_eq!(simulation.stopped(), [true]);
    assert!(simulation.steps().rigid >= 10_000, "{:?}", simulation.steps());
}

#[test]
fn a_function_can_interrupt_and_must_have_a_value() {
    let mut simulation = swing("", (1.0, 0.0), &Settings::default());
    simulation.watch(Event {
        function: Box::new(|state, _| (state.t < 0.05).then_some(1.0)),
        direction: Direction::Either,
        ends_at: None,
    });
    assert_eq!(simulation.reach(0.1, || false).unwrap(), Reached::Interrupted);
    let mut simulation = swing("", (1.0, 0.0), &Settings::default());
    simulation.watch(event(|state| (0.05 - state.t).sqrt(), Direction::Either, None));
    let error = simulation.reach(0.1, || false).unwrap_err();
    assert!(
        error.to_string().starts_with("the function of event 0 has no value at t = 0.0"),
        "{error}"
    );
}

/// A leaf that falls on a thin bench, as fast as without steps that are bounded by anything but the error: it rests on top, and
/// sinks in by its weight.
#[test]
fn no_step_jumps_over_a_plate() {
    for (height, method) in [
        (10, Method::Dopri5),
        (50, Method::Dopri5),
        (80, Method::Rodas),
        (100, Method::Rodas),
        (120, Method::Auto),
    ] {
        let text = format!(
            "units: {{ length: mm }}\nmaterials: {{ card: {{ density: 700, thickness: 0.4 }} }}\nlayup: [card]\nbodies:\n  \
             bench: {{ fixed: true, outline: [[-50, -50], [50, -50], [50, 50], [-50, 50]] }}\n  \
             leaf: {{ free: true, outline: [[-10, -5], [10, -5], [10, 5], [-10, 5]] }}\n\
             contacts:\n  top: {{ plane: {{ point: [0, 0, 0.4], normal: [0, 0, 1], body: bench, within: outline }}, \
             points: corners, bodies: [leaf], friction: 0.5, stiffness: 20000 N/m, dissipation: 2 }}\n\
             initial: {{ bodies: {{ leaf: {{ position: [0, 0, {height}], turn: [0.3, 0.2, 0] }} }} }}\n"
        );
        let file = SourceFile { path: "leaf.yaml".into(), text };
        let system = Jit::new(&pipeline::compile(&file).unwrap().program);
        let settings = Settings { method, duration: 1.5, ..Settings::default() };
        let start = system.initial();
        let mut simulation = Simulation::new(system, start, None, &settings).unwrap();
        simulation.run([0.0, 1.5], || false, |_| ()).unwrap();
        let sunk = 0.02 * 0.01 * 0.4e-3 * 700.0 * 9.81 / (4.0 * 20_000.0);
        let above = simulation.state().q[2] - 0.4e-3;
        assert!((above + sunk).abs() < 1e-7, "{height} mm: {above}");
    }
}
