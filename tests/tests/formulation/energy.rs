//! Conserved quantities and closed forms.

use lamc_tests::compare::keep_largest;
use std::f64::consts::PI;

use lamc::program::Interpreter;
use lamc_runtime::{Integrator, Mechanism, Rk4, State, assemble, project};
use lamc_tests::{compile_text, dopri5, workspace};

/// Ten seconds of the six-bar without dampers: the energy stays, to 1e-9 of the peak kinetic.
#[test]
fn the_undamped_six_bar_keeps_its_energy() {
    let path = workspace().join("examples/sixbar.yaml");
    let text = std::fs::read_to_string(&path).unwrap_or_else(|error| panic!("{error}"));
    let compiled = compile_text(&text.replace("damping: 3.5e-06", "damping: 0"));
    let system = Interpreter::new(&compiled.program);
    let mut state = system.initial();
    let mut workspace = system.workspace();
    assemble(&system, 0.0, &mut state.q, &[false; 6], &mut workspace)
        .unwrap_or_else(|error| panic!("{error}"));
    project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace)
        .unwrap_or_else(|error| panic!("{error}"));
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        (energy.kinetic + energy.potential, energy.kinetic)
    };
    let (start, mut peak) = total(&state);
    let mut drift: f64 = 0.0;
    let mut integrator = dopri5(&system, 1e-12);
    for sample in 1..=1000 {
        integrator
            .run(&system, &mut state, f64::from(sample) * 0.01, |_| ())
            .unwrap_or_else(|error| panic!("{error}"));
        let (now, kinetic) = total(&state);
        peak = keep_largest(peak, kinetic);
        drift = keep_largest(drift, (now - start).abs());
    }
    assert!(peak > 1e-6, "it hardly moved: {peak:e} J");
    assert!(drift <= 1e-9 * peak, "drift {drift:e} J of {peak:e} J");
}

const PENDULUM: &str = "
bodies:
  base: { fixed: true }
  rod: { mass: 0.2, com: [0, -0.3, 0], inertia: [[0.004, 0, 0], [0, 1e-3, 0], [0, 0, 0.004]] }
joints: { hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]] } }
gravity: [0, -9.81, 0]
";

/// A point mass one metre from its hinge and nothing else.
const POINT_PENDULUM: &str = "
bodies: { base: { fixed: true }, bob: { point_masses: [{ mass: 3, at: [0, -1, 0] }] } }
joints: { hinge: { bodies: [base, bob], axis: [[0, 0], [1, 0]] } }
gravity: [0, -9.81, 0]
";

#[test]
fn a_pendulum_has_the_exact_period() {
    let inertia = 0.004 + 0.2 * 0.3 * 0.3;
    swings(PENDULUM, f64::sqrt(inertia / (0.2 * 9.81 * 0.3)));
}

#[test]
fn a_point_mass_has_the_period_of_a_simple_pendulum() {
    swings(POINT_PENDULUM, f64::sqrt(1.0 / 9.81));
}

/// The period of a swing of 120 degrees, by the arithmetic-geometric mean (Gauss); `scale` is that
/// of small swings over 2 pi, s.
fn swings(text: &str, scale: f64) {
    let compiled = compile_text(text);
    let system = Interpreter::new(&compiled.program);
    let amplitude = 2.0 * PI / 3.0;
    let (mut a, mut b) = (1.0, (amplitude / 2.0_f64).cos());
    for _ in 0..8 {
        (a, b) = ((a + b) / 2.0, f64::sqrt(a * b));
    }
    let period = 2.0 * PI * scale / a;
    let mut state = State { t: 0.0, q: vec![amplitude], u: vec![0.0] };
    let mut integrator = dopri5(&system, 1e-12);
    integrator.run(&system, &mut state, period, |_| ()).unwrap_or_else(|error| panic!("{error}"));
    assert!((state.q[0] - amplitude).abs() < 1e-9, "{:e}", state.q[0] - amplitude);
    assert!(state.u[0].abs() < 1e-9, "{:e}", state.u[0]);
}

/// Halving the step of RK4 divides the error by sixteen.
#[test]
fn rk4_is_of_fourth_order() {
    let compiled = compile_text(PENDULUM);
    let system = Interpreter::new(&compiled.program);
    let end = |steps: u32| {
        let mut state = State { t: 0.0, q: vec![1.0], u: vec![0.0] };
        let mut rk4 = Rk4::new(&system);
        for _ in 0..steps {
            rk4.step(&system, &mut state, 1.0 / f64::from(steps))
                .unwrap_or_else(|error| panic!("{error}"));
        }
        state.q[0]
    };
    let exact = end(3200);
    let ratio = (end(100) - exact) / (end(200) - exact);
    assert!((14.0..18.0).contains(&ratio), "{ratio}");
}

/// A slender damped oscillator without gravity is the textbook one.
#[test]
fn a_damped_hinge_decays_as_it_should() {
    let text = PENDULUM
        .replace("gravity: [0, -9.81, 0]", "gravity: [0, 0, 0]")
        .replace("axis: [[0, 0], [1, 0]]", "axis: [[0, 0], [1, 0]], stiffness: 0.5, damping: 0.01");
    let compiled = compile_text(&text);
    let system = Interpreter::new(&compiled.program);
    let inertia = 0.004 + 0.2 * 0.3 * 0.3;
    let (k, b) = (0.5, 0.01);
    let decay = b / (2.0 * inertia);
    let omega = f64::sqrt(k / inertia - decay * decay);
    let mut state = State { t: 0.0, q: vec![0.4], u: vec![0.0] };
    let mut integrator = dopri5(&system, 1e-11);
    for sample in 1..=20 {
        let t = 0.1 * f64::from(sample);
        integrator.run(&system, &mut state, t, |_| ()).unwrap_or_else(|error| panic!("{error}"));
        let phase = omega * t;
        let exact = 0.4 * (-decay * t).exp() * (phase.cos() + decay / omega * phase.sin());
        assert!((state.q[0] - exact).abs() < 1e-8, "at {t}: {:e}", state.q[0] - exact);
    }
}

/// A four-bar; all mass of the coupler lies on the pin at the crank's end.
const PINNED: &str = "
bodies:
  base: { fixed: true }
  crank: { point_masses: [{ mass: 0.02, at: [0.01, 0, 0] }] }
  rocker: { point_masses: [{ mass: 0.05, at: [0.08, 0, 0] }] }
  coupler: { point_masses: [{ mass: 0.01, at: [0.04, 0, 0] }] }
joints:
  a: { bodies: [base, crank], axis: [[0, 0], [0, 1]], stiffness: 0.03 }
  b: { bodies: [crank, coupler], axis: [[0.04, 0], [0.04, 1]] }
  c: { bodies: [rocker, coupler], axis: [[0.09, 0], [0.09, 1]] }
  d: { bodies: [base, rocker], axis: [[0.06, 0], [0.06, 1]] }
initial: { q: { a: 0.9 } }
gravity: [0, 0, 0]
";

/// It moves with the crank: one freedom, whose motion the energy decides.
#[test]
fn mass_on_a_pin_moves_with_what_it_is_pinned_to() {
    let compiled = compile_text(PINNED);
    let system = Interpreter::new(&compiled.program);
    let mut state = system.initial();
    let mut workspace = system.workspace();
    let given: Vec<bool> = (0..4).map(|joint| system.is_pinned(joint)).collect();
    assemble(&system, 0.0, &mut state.q, &given, &mut workspace).unwrap();
    let [crank, rocker] = [0.02 * 0.01 * 0.01 + 0.01 * 0.04 * 0.04, 0.05 * 0.02 * 0.02];
    let spring = |angle: f64| 0.5 * 0.03 * angle * angle;
    let start = state.q[0];
    let mut integrator = dopri5(&system, 1e-11);
    for sample in 1..=20 {
        integrator.run(&system, &mut state, 1e-3 * f64::from(sample), |_| ()).unwrap();
        let (a, d) = (state.u[0], state.u[3]);
        let energy = 0.5 * crank * a * a + 0.5 * rocker * d * d + spring(state.q[0]);
        assert!((energy - spring(start)).abs() < 1e-9 * spring(start), "{energy:e}");
    }
    assert!(state.q[0] < start - 0.1 && state.u[3] < -10.0, "it moves: {state:?}");
}
