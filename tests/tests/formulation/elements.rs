//! Springs between points and between bodies, tendons and motors, against closed forms, scalar equations that are
//! solved apart, and maximal coordinates.

use std::f64::consts::PI;

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc::source::{SourceFile, parse};
use lamc_runtime::{
    Integrator, JacobianMut, Mechanism, State, acceleration, assemble, jacobian, project,
};
use lamc_tests::compare::keep_largest;
use lamc_tests::random::Random;
use lamc_tests::{compile_text, dopri5, linkages};
use lamc_workbench::verify::{Settings, at_states};

fn system(text: &str) -> Interpreter {
    Interpreter::new(&compile_text(text).program)
}

fn accelerated(system: &Interpreter, q: &[f64], u: &[f64]) -> Vec<f64> {
    let mut out = vec![f64::NAN; q.len()];
    acceleration(system, 0.3, q, u, &mut system.workspace(), &mut out).unwrap();
    out
}

/// The derivatives of the accelerations by q and by u, row-major.
fn slopes(system: &Interpreter, q: &[f64], u: &[f64]) -> [Vec<f64>; 2] {
    let n = q.len();
    let (mut a, mut dt) = (vec![0.0; n], vec![0.0; n]);
    let (mut dq, mut du) = (vec![0.0; n * n], vec![0.0; n * n]);
    let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
    jacobian(system, 0.3, q, u, &mut system.workspace(), out).unwrap();
    [dq, du]
}

/// The position of a point, m.
fn at(system: &Interpreter, q: &[f64], point: usize) -> [f64; 3] {
    system.points(&q.to_vec()).unwrap()[point]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
}

/// The derivative at 0, of sixth order.
fn derivative(f: impl Fn(f64) -> f64, h: f64) -> f64 {
    let pair = |k: f64| f(k * h) - f(-k * h);
    (45.0 * pair(1.0) - 9.0 * pair(2.0) + pair(3.0)) / (60.0 * h)
}

fn assert_near(found: f64, expected: f64, tolerance: f64, what: &str) {
    let error = (found - expected).abs();
    assert!(error <= tolerance, "{what}: {found} instead of {expected}: {error:e}");
}

/// A mass of 0.4 kg, 0.5 m below its hinge, pulled to the side by a band.
const PULLED: &str = "
gravity: [0, -9.81, 0]
bodies: { base: { fixed: true }, bob: { point_masses: [{ mass: 0.4, at: [0, -0.5, 0] }] } }
joints: { hinge: { bodies: [base, bob], axis: [[0, 0], [1, 0]] } }
points:
  tip: { body: bob, at: [0, -0.5, 0] }
  hook: { body: base, at: [0.1, -0.3, -0.8] }
springs: { band: { from: tip, to: hook, stiffness: 6, rest_length: 0.2, tension_only: true } }
";

/// dV/dq of this pendulum, N m, and d2V/dq2, from its potential energy
/// V = -m g r cos q + k (l - l0)^2 / 2 with l^2 = 0.1^2 + (0.3 - r cos q)^2 + (0.8 - r sin q)^2.
fn of_pulled(q: f64) -> [f64; 2] {
    let (weight, r, k, rest) = (0.4 * 9.81, 0.5, 6.0, 0.2);
    let [y, z] = [0.3, 0.8];
    let square = 0.01 + y * y + z * z + r * r - 2.0 * r * (y * q.cos() + z * q.sin());
    let length = f64::sqrt(square);
    // l l' = r (y sin q - z cos q), and l l'' + l'^2 is its derivative.
    let first = r * (y * q.sin() - z * q.cos()) / length;
    let second = (r * (y * q.cos() + z * q.sin()) - first * first) / length;
    [
        weight * r * q.sin() + k * (length - rest) * first,
        weight * r * q.cos() + k * (first * first + (length - rest) * second),
    ]
}

#[test]
fn a_band_holds_a_pendulum_where_moments_balance() {
    let system = system(PULLED);
    let (mut low, mut high) = (0.0, 1.5);
    for _ in 0..200 {
        let middle = 0.5 * (low + high);
        if of_pulled(middle)[0] < 0.0 { low = middle } else { high = middle }
    }
    let (rest, inertia) = (low, 0.4 * 0.25);
    assert!((0.2..1.2).contains(&rest), "{rest}");
    assert_near(accelerated(&system, &[rest], &[0.0])[0], 0.0, 1e-13, "acceleration at rest");
    let omega = f64::sqrt(of_pulled(rest)[1] / inertia);
    assert_near(slopes(&system, &[rest], &[0.0])[0][0], -omega * omega, 1e-11, "slope");

    // Half a period later a small swing is on the other side; its amplitude enters as the square.
    let amplitude = 1e-5;
    let mut state = State { t: 0.0, q: vec![rest + amplitude], u: vec![0.0] };
    dopri5(&system, 1e-13).run(&system, &mut state, PI / omega, |_| ()).unwrap();
    assert_near(state.q[0], rest - amplitude, 1e-9, "angle after half a period");
    assert_near(state.u[0], 0.0, 1e-9, "speed after half a period");
}

/// A disc of 1e-3 kg m^2, whose rim at 0.1 m hangs on a band from a hook 0.1 m from the axis: where the disc is
/// turned by q, the band has the length 0.2 |sin(q / 2)|.
fn disc(more: &str) -> String {
    format!(
        "
gravity: [0, 0, 0]
bodies:
  base: {{ fixed: true }}
  disc: {{ mass: 0.2, com: [0, 0, 0], inertia: [[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]] }}
joints: {{ axle: {{ bodies: [base, disc], axis: [[0, 0], [1, 0]] }} }}
points: {{ rim: {{ body: disc, at: [0, 0.1, 0] }}, hook: {{ body: base, at: [0, 0.1, 0] }} }}
springs:
  band: {{ from: rim, to: hook, stiffness: 30, rest_length: 0.08, tension_only: true{more} }}
"
    )
}

/// It swings back, becomes slack, turns on evenly, and is stopped by the band on the other side.
#[test]
fn a_slack_band_lets_a_disc_turn_evenly() {
    let system = system(&disc(""));
    let (inertia, stiffness, rest, begin, push) = (1e-3, 30.0, 0.08, 1.9, -1.0);
    let energy_at = |q: f64| 0.5 * stiffness * (0.2 * (q / 2.0).sin() - rest).powi(2);
    let total = energy_at(begin) + 0.5 * inertia * push * push;
    let slack = 2.0 * f64::asin(rest / 0.2);
    // The time from the begin to where the band becomes slack, by Simpson's rule.
    let parts = 40_000;
    let step = (begin - slack) / f64::from(parts);
    let pace =
        |k: i32| 1.0 / f64::sqrt(2.0 / inertia * (total - energy_at(slack + f64::from(k) * step)));
    let weight = |k: i32| if k == 0 || k == parts { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
    let until: f64 = (0..=parts).map(|k| weight(k) * pace(k) * step / 3.0).sum();
    let fastest = f64::sqrt(2.0 * total / inertia);
    let across = 2.0 * slack / fastest;
    for share in [0.0, 0.3, 0.9] {
        let mut state = State { t: 0.0, q: vec![begin], u: vec![push] };
        let t = until + share * across;
        dopri5(&system, 1e-12).run(&system, &mut state, t, |_| ()).unwrap();
        assert_near(state.q[0], slack - share * across * fastest, 1e-8, "angle of the slack disc");
        assert_near(state.u[0], -fastest, 1e-8 * fastest, "speed of the slack disc");
    }
    // On the other side it does what it did before, backwards.
    let mut state = State { t: 0.0, q: vec![begin], u: vec![push] };
    dopri5(&system, 1e-12).run(&system, &mut state, 2.0 * until + across, |_| ()).unwrap();
    assert_near(state.q[0], -begin, 1e-8, "angle on the other side");
    assert_near(state.u[0], push, 1e-6, "speed on the other side");
}

#[test]
fn a_band_never_pushes() {
    let system = system(&disc(", damping: 0.5"));
    let moment = |q: f64, u: f64| {
        -1e3 * {
            let (length, rate) = (0.2 * (q / 2.0).sin(), 0.1 * (q / 2.0).cos() * u);
            let pull =
                if length > 0.08 { (30.0 * (length - 0.08) + 0.5 * rate).max(0.0) } else { 0.0 };
            pull * 0.1 * (q / 2.0).cos()
        }
    };
    for (q, u) in [(1.5, 0.0), (1.5, 4.0), (1.5, -2.0), (1.5, -60.0), (0.6, 30.0), (0.6, -30.0)] {
        let found = accelerated(&system, &[q], &[u])[0];
        assert_near(found, moment(q, u), 1e-9, &format!("{q}, {u}"));
    }
    assert_eq!(accelerated(&system, &[1.5], &[-60.0]), [0.0]);
    assert_eq!(accelerated(&system, &[0.6], &[30.0]), [0.0]);
    let energy = |q: f64| system.energy(0.0, &vec![q], &vec![0.0]).unwrap().potential;
    assert_near(energy(1.5), 15.0 * (0.2 * 0.75_f64.sin() - 0.08).powi(2), 1e-15, "energy");
    assert_eq!(energy(0.6), 0.0);
    // It pushes if it may.
    let both =
        self::system(&disc(", damping: 0.5").replace("tension_only: true", "tension_only: false"));
    assert!(accelerated(&both, &[0.6], &[-30.0])[0] > 1.0);
    let stored = both.energy(0.0, &vec![0.6], &vec![0.0]).unwrap().potential;
    assert_near(stored, 15.0 * (0.2 * 0.3_f64.sin() - 0.08).powi(2), 1e-15, "energy");
}

/// Where both points of a band meet, nothing is divided by zero: the band has no direction and does not pull.
#[test]
fn the_points_of_a_band_may_meet() {
    for more in ["", ", damping: 0.5"] {
        let text = disc(more).replace("tension_only: true", "tension_only: false");
        let system = system(&text);
        for u in [0.0, 3.0] {
            assert_eq!(accelerated(&system, &[0.0], &[u]), [0.0], "{more} {u}");
            let [dq, du] = slopes(&system, &[0.0], &[u]);
            assert!(dq[0].is_finite() && du[0].is_finite(), "{dq:?} {du:?}");
        }
    }
    let none = system(&disc("").replace("rest_length: 0.08", "rest_length: 0"));
    assert_near(slopes(&none, &[0.0], &[0.0])[0][0], -30.0 * 0.01 / 1e-3, 1e-9, "slope");
}

/// A finger of two hinges, with a tendon over both and torques that can hold against it.
const FINGER: &str = "
gravity: [0, 0, 0]
inputs: [first, second, pull]
bodies:
  base: { fixed: true }
  near: { mass: 0.02, com: [0.02, 0, 0], inertia: [[1e-6, 0, 0], [0, 5e-6, 0], [0, 0, 5e-6]] }
  far: { mass: 0.01, com: [0.05, 0, 0], inertia: [[1e-6, 0, 0], [0, 2e-6, 0], [0, 0, 2e-6]] }
joints:
  mcp: { bodies: [base, near], axis: [[0, 0], [0, 1]], torque: first }
  pip: { bodies: [near, far], axis: [[0.04, 0], [0.045, 1]], torque: second }
points:
  anchor: { body: base, at: [-0.02, 0.003, 0.008] }
  pulley: { body: near, at: [0.02, -0.002, 0.006] }
  exit: { body: near, at: [0.03, 0, 0.006] }
  end: { body: far, at: [0.055, 0.001, 0.004] }
tendons:
  flexor: { through: [anchor, pulley, exit, end], tension: 2*pull }
";

/// A torque -T dl/dq at each hinge is the same as the tendon: its opposite holds the finger.
#[test]
fn a_tendon_has_its_moment_arms() {
    let mut system = system(FINGER);
    let length = |system: &Interpreter, q: &[f64]| -> f64 {
        (0..3).map(|k| distance(at(system, q, k), at(system, q, k + 1))).sum()
    };
    let mut random = Random::new(3);
    for _ in 0..10 {
        let q = [random.range(-1.5, 1.5), random.range(-1.5, 1.5)];
        let arms = [0, 1].map(|joint| {
            let moved = |d: f64| {
                let mut q = q;
                q[joint] += d;
                length(&system, &q)
            };
            derivative(moved, 3e-3)
        });
        assert!(arms.iter().all(|arm| arm.abs() > 1e-4), "{arms:?}");
        let pull = random.range(0.5, 2.0);
        system.set_input("pull", pull).unwrap();
        system.set_input("first", 0.0).unwrap();
        system.set_input("second", 0.0).unwrap();
        let free = accelerated(&system, &q, &[0.0; 2]);
        assert!(free.iter().all(|a| a.abs() > 1.0), "{free:?}");
        system.set_input("first", 2.0 * pull * arms[0]).unwrap();
        system.set_input("second", 2.0 * pull * arms[1]).unwrap();
        for (held, free) in accelerated(&system, &q, &[0.0; 2]).iter().zip(&free) {
            assert!(held.abs() < 1e-9 * free.abs(), "{held} of {free}");
        }
        // A tendon does not push.
        system.set_input("pull", -pull).unwrap();
        system.set_input("first", 0.0).unwrap();
        system.set_input("second", 0.0).unwrap();
        assert_eq!(accelerated(&system, &q, &[0.0; 2]), [0.0; 2]);
    }
}

/// Two parallel hinges: the torsion spring between the ground and the last body acts on the sum of their angles.
#[test]
fn a_torsion_spring_adds_the_angles_of_parallel_hinges() {
    let text = "
gravity: [0, 0, 0]
inputs: [both]
bodies:
  base: { fixed: true }
  near: { mass: 0.02, com: [0.02, 0, 0], inertia: [[1e-6, 0, 0], [0, 5e-6, 0], [0, 0, 5e-6]] }
  far: { mass: 0.01, com: [0.05, 0, 0], inertia: [[1e-6, 0, 0], [0, 2e-6, 0], [0, 0, 2e-6]] }
joints:
  first: { bodies: [base, near], axis: [[0, 0], [1, 2]], torque: both }
  second: { bodies: [far, near], axis: [[0.05, 0.02], [0.04, 0]], torque: both }
springs:
  twist: { bodies: [far, base], axis: [[0.3, 0.6], [0, 0]], stiffness: 0.02, rest: -0.3, damping: 1e-4 }
";
    let mut system = system(text);
    for (q, u) in [([0.4, 0.9], [0.0, 0.0]), ([-1.4, -1.5], [2.0, -1.0]), ([2.0, 1.1], [0.5, 3.0])]
    {
        // far turns by q[0] + q[1] about (1, 2); base relative to far about (-1, -2) by the same.
        let angle: f64 = q.iter().sum();
        let torque = 0.02 * (angle + 0.3) + 1e-4 * u.iter().sum::<f64>();
        system.set_input("both", 0.0).unwrap();
        let sprung = accelerated(&system, &q, &u);
        let energy = system.energy(0.0, &q.to_vec(), &u.to_vec()).unwrap().potential;
        assert_near(energy, 0.01 * (angle + 0.3).powi(2), 1e-15, "energy");
        let plain = text.split_once("springs:").unwrap().0;
        let mut plain = self::system(plain);
        plain.set_input("both", -torque).unwrap();
        for (found, expected) in sprung.iter().zip(accelerated(&plain, &q, &u)) {
            assert_near(*found, expected, 1e-11 * expected.abs(), "acceleration");
        }
    }
}

/// A spatial loop and a branch with every element that stores energy, and a rotor without current.
fn conservative() -> String {
    let linkage = linkages::spherical("stored", &[0.0, 50.0, 140.0, 180.0, 220.0, 290.0]);
    let text = linkage.text(5);
    // What dissipates is left out.
    let text: String = text
        .lines()
        .map(|line| match line.find("damping: ") {
            Some(start) => {
                let end = line[start..].find([',', '}']).unwrap() + start;
                format!("{}damping: 0{}\n", &line[..start], &line[end..])
            }
            None => format!("{line}\n"),
        })
        .collect();
    format!(
        "{text}
points:
  a: {{ body: b1, at: [0.02, 0.01, 0.004] }}
  b: {{ body: b3, at: [-0.02, 0.015, 0.002] }}
  c: {{ body: b4, at: [0.01, -0.02, 0] }}
  g: {{ body: b0, at: [0.05, 0.03, 0.05] }}
springs:
  band: {{ from: a, to: g, stiffness: 0.4, rest_length: 0.01 }}
  push: {{ from: b, to: c, stiffness: 0.3 }}
  twist: {{ bodies: [b1, b4], axis: [[0, 0], [1, 0.4]], stiffness: 2e-5, rest: 0.2 }}
tendons: {{ elastic: {{ through: [g, a, b, c], stiffness: 0.5, rest_length: 0.02 }} }}
motors:
  idle: {{ joint: j2, torque_constant: 0.002, resistance: 3, gear: 10, inertia: 2e-9, voltage: \"0.02*u.j2\" }}
"
    )
}

#[test]
fn springs_and_tendons_keep_the_energy() {
    let system = system(&conservative());
    let n = system.initial().q.len();
    let mut random = Random::new(8);
    let mut state = system.initial();
    state.q.iter_mut().for_each(|q| *q = random.range(-0.4, 0.4));
    state.u.iter_mut().for_each(|u| *u = random.range(-1.0, 1.0));
    let mut workspace = system.workspace();
    assemble(&system, 0.0, &mut state.q, &vec![false; n], &mut workspace).unwrap();
    project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        [energy.kinetic + energy.potential, energy.kinetic]
    };
    let [start, mut peak] = total(&state);
    let mut drift = 0.0;
    let mut integrator = dopri5(&system, 1e-12);
    for sample in 1..=300 {
        integrator.run(&system, &mut state, f64::from(sample) * 0.01, |_| ()).unwrap();
        let [now, kinetic] = total(&state);
        peak = keep_largest(peak, kinetic);
        drift = keep_largest(drift, (now - start).abs());
    }
    println!("drift {drift:e} J of {peak:e} J");
    assert!(drift <= 1e-9 * peak, "drift {drift:e} J of {peak:e} J");
}

/// A wheel of 2e-4 kg m^2 on a motor.
fn wheel(more: &str) -> String {
    format!(
        "
gravity: [0, 0, 0]
inputs: [volts]
bodies:
  base: {{ fixed: true }}
  wheel: {{ mass: 0.2, com: [0, 0, 0], inertia: [[2e-4, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]] }}
joints: {{ axle: {{ bodies: [base, wheel], axis: [[0, 0], [1, 0]] }} }}
motors:
  drive: {{ joint: axle, torque_constant: 5 mN*m/A, resistance: 8 ohm, gear: 50, inertia: 40 g*mm^2, voltage: volts{more} }}
"
    )
}

#[test]
fn a_motor_runs_up_as_an_exponential() {
    let mut system = system(&wheel(""));
    let (volts, constant, resistance) = (3.0, 50.0 * 5e-3, 8.0);
    let inertia = 2e-4 + 2500.0 * 40e-9;
    system.set_input("volts", volts).unwrap();
    let stalled = accelerated(&system, &[0.7], &[0.0])[0];
    assert_near(stalled * inertia, constant * volts / resistance, 1e-14, "stall torque");
    let fastest = volts / constant;
    assert_near(accelerated(&system, &[0.7], &[fastest])[0], 0.0, 1e-12, "no-load speed");
    let slowness = inertia * resistance / (constant * constant);
    let mut state = State { t: 0.0, q: vec![0.0], u: vec![0.0] };
    let mut integrator = dopri5(&system, 1e-12);
    for share in [0.5, 1.0, 2.0, 5.0] {
        integrator.run(&system, &mut state, share * slowness, |_| ()).unwrap();
        let expected = fastest * (1.0 - f64::exp(-share));
        assert_near(state.u[0], expected, 1e-9, "speed");
        let turned = fastest * slowness * (share - 1.0 + f64::exp(-share));
        assert_near(state.q[0], turned, 1e-9, "angle");
    }
    let kinetic = system.energy(0.0, &state.q, &state.u).unwrap().kinetic;
    assert_near(kinetic, 0.5 * inertia * state.u[0].powi(2), 1e-15, "kinetic energy");
}

#[test]
fn limits_of_voltage_and_current_limit_the_torque() {
    let text = wheel(", max_voltage: 6 V, max_current: 500 mA");
    let mut system = system(&text);
    let inertia = 2e-4 + 2500.0 * 40e-9;
    for (volts, speed) in [
        (3.0, 0.0),
        (30.0, 0.0),
        (-30.0, 0.0),
        (30.0, 20.0),
        (-30.0, 20.0),
        (5.0, 40.0),
        (0.0, -9.0),
    ] {
        system.set_input("volts", volts).unwrap();
        let current = ((volts.clamp(-6.0, 6.0) - 0.25 * speed) / 8.0_f64).clamp(-0.5, 0.5);
        let found = accelerated(&system, &[0.1], &[speed])[0];
        assert_near(found, 0.25 * current / inertia, 1e-9, &format!("{volts} V, {speed} rad/s"));
    }
    // Where the limits are not reached, the motor damps; where the current has its limit, it does not.
    let slope = |system: &Interpreter, u: f64| slopes(system, &[0.1], &[u])[1][0];
    system.set_input("volts", 0.0).unwrap();
    assert_near(slope(&system, 1.0), -0.0625 / 8.0 / inertia, 1e-9, "slope");
    assert_eq!(slope(&system, 30.0), 0.0);
}

/// A motor on every joint of linkages of several loops, whose equations are reduced to independent speeds, and of
/// single loops and trees.
#[test]
fn rotors_are_inertias_of_their_own_coordinates() {
    let failures = |compiled: &Compiled| -> Vec<&'static str> {
        let checks = at_states(compiled, &Settings { states: 4, seed: 3, duration: 0.1 });
        checks.iter().filter(|check| check.failed()).map(|check| check.name).collect()
    };
    for linkage in [
        linkages::spherical("spherical_six_bar", &[0.0, 50.0, 140.0, 180.0, 220.0, 290.0]),
        linkages::planar_four_bar(),
        linkages::spatial_seven_bar(),
        linkages::watt(),
        linkages::miura(3),
    ] {
        let mut text = format!("{}motors:\n", linkage.text(5));
        for joint in 0..linkage.hinges.len() {
            let inertia = 1e-9 * f64::from(joint as u32 + 1);
            text.push_str(&format!(
                "  m{joint}: {{ joint: j{joint}, torque_constant: 1e-3, resistance: 5, gear: 30, \
                 inertia: {inertia:e}, voltage: \"0.1*sin({joint} + t)\" }}\n"
            ));
        }
        let mut compiled = compile_text(&text);
        assert_eq!(failures(&compiled), [""; 0], "{}", linkage.name);
        // Another inertia would be seen.
        compiled.topology.mechanism.elements.motors[1].inertia *= 1.01;
        let seen = failures(&compiled);
        assert!(
            seen.contains(&"acceleration") && seen.contains(&"energy"),
            "{}: {seen:?}",
            linkage.name
        );
    }
}

/// The derivatives of the program against differences of accelerations.
#[test]
fn derivatives_are_those_of_the_elements() {
    let text = "
gravity: [0, 0, -9.81]
bodies:
  base: { fixed: true }
  near: { mass: 0.02, com: [0.02, 0, 0], inertia: [[1e-6, 0, 0], [0, 5e-6, 0], [0, 0, 5e-6]] }
  far: { mass: 0.01, com: [0.05, 0, 0], inertia: [[1e-6, 0, 0], [0, 2e-6, 0], [0, 0, 2e-6]] }
joints:
  mcp: { bodies: [base, near], axis: [[0, 0], [0, 1]] }
  pip: { bodies: [near, far], axis: [[0.04, 0], [0.07, 0.1]] }
points:
  anchor: { body: base, at: [-0.02, 0.003, 0.03] }
  pulley: { body: near, at: [0.02, -0.002, 0.006] }
  end: { body: far, at: [0.055, 0.001, 0.004] }
springs:
  band: { from: anchor, to: end, stiffness: 20, damping: 0.3, rest_length: 0.03, tension_only: true }
  twist: { bodies: [base, far], axis: [[0, 0], [1, 3]], stiffness: 0.01, rest: 0.4, damping: 1e-3 }
tendons:
  flexor: { through: [anchor, pulley, end], stiffness: 30, damping: 0.1, rest_length: 0.02 }
  given: { through: [anchor, end, pulley], tension: 0.3 + 0.1*sin(q.mcp)*u.pip }
motors:
  hip: { joint: mcp, torque_constant: 1e-3, resistance: 2, gear: 20, inertia: 3e-9, voltage: sin(q.pip) }
";
    let system = system(text);
    let mut random = Random::new(12);
    for _ in 0..8 {
        let q = [random.range(-1.0, 1.0), random.range(-1.0, 1.0)];
        let u = [random.range(-1.0, 1.0), random.range(-1.0, 1.0)];
        let [dq, du] = slopes(&system, &q, &u);
        for (row, column) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            let by_q = |d: f64| {
                let mut q = q;
                q[column] += d;
                accelerated(&system, &q, &u)[row]
            };
            let by_u = |d: f64| {
                let mut u = u;
                u[column] += d;
                accelerated(&system, &q, &u)[row]
            };
            for (found, expected) in [
                (dq[2 * row + column], derivative(by_q, 1e-3)),
                (du[2 * row + column], derivative(by_u, 1e-2)),
            ] {
                assert_near(found, expected, 1e-8 * (1.0 + expected.abs()), "derivative");
            }
        }
    }
}

/// A joint that is held needs no voltage, and its motor would be refused beside the prescribed angle.
#[test]
fn a_joint_that_is_held_has_no_motor() {
    let file = SourceFile { path: "wheel.yaml".into(), text: wheel("") };
    let (mut model, _) = parse(&file).unwrap_or_else(|problems| panic!("{problems}"));
    assert_eq!(model.elements.motors.len(), 1);
    model.lock("axle", 0.3).unwrap();
    assert!(model.elements.motors.is_empty());
}
