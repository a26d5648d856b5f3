//! Formulas that jump, against motions in closed form.

use std::f64::consts::PI;

use lamc::pipeline;
use lamc::source::SourceFile;
use lamc_runtime::State;

use super::super::{Method, Settings, Simulation};
use crate::execution::Jit;
use crate::motion::Work;

/// A body of 1e-6 kg m^2 about its hinge, with a torque (N m) and limits, rad, as in the model, in a motion to `t`, s,
/// with a sample every tenth.
fn turned(torque: &str, limits: &str, (q, u): (f64, f64), settings: &Settings) -> Simulation {
    let text = format!(
        "gravity: [0, 0, 0]\nbodies:\n  base: {{ fixed: true }}\n  \
         arm: {{ mass: 1 g, com: [0, 0, 0], inertia: [[1e-6,0,0],[0,1e-6,0],[0,0,1e-6]] }}\n\
         units: {{ length: m }}\njoints:\n  \
         hip: {{ bodies: [base, arm], axis: [[0,0],[0,1]], limits: {limits}, torque: \"{torque}\" }}\n"
    );
    let file = SourceFile { path: "arm.yaml".into(), text };
    let compiled = pipeline::compile(&file).unwrap();
    let system = Jit::new(&compiled.program);
    let work = Work::new(&compiled.topology.mechanism, system.parameters(), system.inputs());
    let state = State { t: 0.0, q: vec![q], u: vec![u] };
    let mut simulation = Simulation::new(system, state, work, settings).unwrap();
    let times = (0..=10).map(|k| settings.duration * f64::from(k) / 10.0);
    simulation.run(times, || false, |_| ()).unwrap();
    simulation
}

/// Both methods, with a tolerance of 1e-8.
fn both(duration: f64) -> [Settings; 2] {
    [Method::Dopri5, Method::Rodas].map(|method| Settings {
        method,
        duration,
        restitution: 1.0,
        ..Settings::default()
    })
}

fn check(simulation: &Simulation, [q, u]: [f64; 2], tolerance: f64) {
    let state = simulation.state();
    let error = (state.q[0] - q).abs() + (state.u[0] - u).abs() / 20.0;
    assert!(error <= tolerance, "{state:?}: {q} rad, {u} rad/s are exact");
}

/// Pulses that lie between two samples, and a square wave: the torque is 100 rad/s^2 times the inertia, or 1000.
#[test]
fn no_pulse_is_overlooked() {
    for (torque, exact) in [
        ("1e-3*step(t - 0.5031)*step(0.5033 - t)", [0.2 * (1.0 - 0.5032), 0.2]),
        ("1e-3*max(0, 1 - abs(t - 0.50312)/0.0001)", [0.1 * (1.0 - 0.50312), 0.1]),
        ("1e-4*sign(sin(2*pi*50*t))", [0.5, 0.0]),
        // At the start, at a sample, at the end.
        ("1e-4*step(t)*step(0.5 - t)", [37.5, 50.0]),
        ("1e-4*step(t - 1)", [0.0, 0.0]),
    ] {
        for settings in both(1.0) {
            let simulation = turned(torque, "[-1000, 1000]", (0.0, 0.0), &settings);
            check(&simulation, exact, 1e-10);
            // Where the motion is a parabola between its jumps, so is the work a step's, by Simpson's rule.
            let energy = 0.5e-6 * exact[1] * exact[1];
            let work = simulation.work().unwrap().total;
            assert!((work - energy).abs() <= 1e-12, "{torque}: {work} J, {energy} J");
        }
    }
}

/// q'' = -100 sign(q): parabolas of 0.3 rad to both sides.
#[test]
fn a_motor_that_reverses_reverses_in_time() {
    let quarter = (2.0 * 0.3 / 100.0_f64).sqrt();
    let top = 100.0 * quarter;
    let at = |t: f64| {
        let (quarters, s) = ((t / quarter).floor(), t % quarter);
        match quarters.rem_euclid(4.0) as u8 {
            0 => [0.3 - 50.0 * s * s, -100.0 * s],
            1 => [-top * s + 50.0 * s * s, -top + 100.0 * s],
            2 => [50.0 * s * s - 0.3, 100.0 * s],
            _ => [top * s - 50.0 * s * s, top - 100.0 * s],
        }
    };
    for settings in both(10.0) {
        let simulation = turned("-1e-4*sign(q.hip)", "[-1000, 1000]", (0.3, 0.0), &settings);
        check(&simulation, at(10.0), 1e-8);
    }
}

/// With dry friction, q'' = -400 q - 40 sign(u): half swings about -0.1 and 0.1 rad.
#[test]
fn friction_reverses_with_the_speed() {
    for settings in both(0.5) {
        let torque = "-4e-4*q.hip - 4e-5*sign(u.hip)";
        let simulation = turned(torque, "[-1000, 1000]", (1.0, 0.0), &settings);
        let phase = 20.0 * 0.5 - 3.0 * PI;
        let exact = [-0.1 - 0.3 * phase.cos(), 0.3 * 20.0 * phase.sin()];
        check(&simulation, exact, 1e-6);
    }
}

/// As the motor that reverses, with an elastic stop at -0.2 rad.
#[test]
fn surfaces_and_stops_follow_each_other() {
    let fall = (2.0 * 0.3 / 100.0_f64).sqrt();
    let (top, hit) = (100.0 * fall, (100.0 * (0.6 - 0.4_f64)).sqrt());
    let beyond = (top - hit) / 100.0;
    let period = 2.0 * (fall + beyond);
    for settings in both(1.0) {
        let simulation = turned("-1e-4*sign(q.hip)", "[-0.2, 10]", (0.3, 0.0), &settings);
        let s = 1.0 % period;
        assert!(s > fall + beyond && s < fall + 2.0 * beyond, "on the way back from the stop");
        let left = fall + 2.0 * beyond - s;
        check(&simulation, [-top * left + 50.0 * left * left, top - 100.0 * left], 1e-7);
    }
}
