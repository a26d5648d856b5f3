//! Free bodies on planes, against closed forms.

use lamc::program::Interpreter;
use lamc_runtime::{Integrator, Mechanism, State};
use lamc_tests::{compile_text, dopri5};

/// The motion from the model's initial state to a time, s.
fn moved(text: &str, t: f64) -> State<Vec<f64>, f64> {
    let system = Interpreter::new(&compile_text(text).program);
    let mut state = system.assembled().unwrap();
    dopri5(&system, 1e-9).run(&system, &mut state, t, |_| {}).unwrap();
    state
}

/// f = k d (1 + c d') gives c (v + w) = ln((1 + c v) / (1 - c w)) for the speeds v before and w after
/// (K. H. Hunt, F. R. E. Crossley, "Coefficient of restitution interpreted as damping in vibroimpact", 1975).
#[test]
fn a_ball_rebounds_as_hunt_and_crossley_say() {
    for dissipation in [0.1_f64, 0.6, 2.0] {
        let text = format!(
            "
gravity: [0, 0, 0]
bodies:
  ball: {{ free: true, mass: 0.01, com: [0, 0, 0],
          inertia: [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]] }}
points: {{ centre: {{ body: ball, at: [0, 0, 0] }} }}
contacts:
  ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }}, points: [centre], stiffness: 2000,
            dissipation: {dissipation}, friction: 0, slip_speed: 1 mm/s }}
initial: {{ bodies: {{ ball: {{ position: [0, 0, 0.01], velocity: [0, 0, -1] }} }} }}
"
        );
        let found = moved(&text, 0.1).u[2];
        let (mut low, mut high) = (0.0_f64, 1.0);
        for _ in 0..100 {
            let w = 0.5 * (low + high);
            let excess =
                dissipation * (1.0 + w) - ((1.0 + dissipation) / (1.0 - dissipation * w)).ln();
            if dissipation * w < 1.0 && excess > 0.0 { low = w } else { high = w }
        }
        assert!((found - low).abs() <= 1e-4, "{dissipation}: {found} instead of {low}");
    }
}

/// A block of 4.8 g, with gravity turned by an angle instead of the ground.
fn block(slope: f64, speed: f64) -> String {
    let (sine, cosine) = slope.sin_cos();
    format!(
        "
units: {{ length: mm }}
gravity: [{}, 0, {}]
materials: {{ card: {{ density: 2000, thickness: 2 }} }}
layup: [card]
bodies: {{ block: {{ free: true, outline: [[0, 0], [40, 0], [40, 30], [0, 30]] }} }}
contacts:
  ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }}, bodies: all, points: corners,
            stiffness: 2000, dissipation: 2, friction: 0.3, slip_speed: 0.1 mm/s }}
initial: {{ bodies: {{ block: {{ velocity: [{speed}, 0, 0] }} }} }}
",
        9.81 * sine,
        -9.81 * cosine
    )
}

#[test]
fn a_sliding_block_stops_after_its_distance() {
    let expected = 0.5 * 0.5 / (2.0 * 0.3 * 9.81);
    // At the end of the closed form it has all but stopped; a hundredth before, it moves at a hundredth.
    let time = 0.5 / (0.3 * 9.81);
    let end = moved(&block(0.0, 0.5), 1.5 * time);
    assert!((end.q[0] / expected - 1.0).abs() <= 1e-3, "{} instead of {expected}", end.q[0]);
    let before = moved(&block(0.0, 0.5), 0.99 * time);
    assert!((before.u[0] - 0.005).abs() <= 0.05 * 0.005, "{}", before.u[0]);
}

/// tan(slope) = mu; regularised friction creeps at a few times its slip speed below it.
#[test]
fn a_block_on_an_incline_sticks_or_slips() {
    let limit = 0.3_f64.atan();
    let sticks = moved(&block(0.99 * limit, 0.0), 1.0);
    assert!(sticks.u[0] < 1e-3, "{}", sticks.u[0]);
    let slope = 1.01 * limit;
    let slips = moved(&block(slope, 0.0), 1.0);
    let expected = 9.81 * (slope.sin() - 0.3 * slope.cos());
    assert!((slips.u[0] / expected - 1.0).abs() <= 0.1, "{} {expected}", slips.u[0]);
}
