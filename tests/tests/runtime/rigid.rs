//! Rigid contacts and stops at fixed steps: closed forms of sliding, sticking, impact and rocking, conserved momenta,
//! and the compliant law as its stiffness grows.

use lamc::program::Program;
use lamc_runtime::plumbing::{EquationsMut, GapsMut};
use lamc_runtime::{Mechanism, Rigid, State, Stopped};
use lamc_tests::compare::{keep_largest, largest, maximum};
use lamc_tests::random::Random;
use lamc_tests::{compile_text, dopri5, workspace};
use lamc_workbench::execution::Jit;

type Motion = State<Vec<f64>, f64>;

fn program(text: &str) -> Program {
    compile_text(text).program
}

/// The motion from the model's initial state to a time, s, in steps of `h`, s.
fn moved(system: &Jit, t: f64, h: f64, observe: impl FnMut(&Motion)) -> Motion {
    let mut state = system.assembled().unwrap();
    Rigid::new(system).run(system, &mut state, t, h, observe).unwrap();
    state
}

/// The heights of all points over their planes, m.
fn gaps(system: &Jit, state: &Motion) -> Vec<f64> {
    let (k, n) = (system.dimensions().contacts, system.dimensions().speeds);
    let (mut gap, mut normal) = (vec![0.0; 2 * k], vec![0.0; 3 * k]);
    let (mut friction, mut rows) = (vec![0.0; k], vec![0.0; 3 * k * n]);
    let out =
        GapsMut { gap: &mut gap, friction: &mut friction, normal: &mut normal, rows: &mut rows };
    system.write_gaps(state.t, &state.q, out).unwrap();
    gap.chunks(2).map(|gap| gap[0]).collect()
}

/// A block of card on a plane, 40 x 30 x 2 mm, with gravity turned by an angle instead of the plane.
fn block(slope: f64, initial: &str) -> Jit {
    let (sine, cosine) = slope.sin_cos();
    let text = format!(
        "
units: {{ length: mm }}
gravity: [{}, 0, {}]
materials: {{ card: {{ density: 2000, thickness: 2 }} }}
layup: [card]
bodies: {{ block: {{ free: true, outline: [[0, 0], [40, 0], [40, 30], [0, 30]] }} }}
contacts: {{ ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }}, bodies: all, friction: 0.3 }} }}
initial: {{ bodies: {{ block: {{ {initial} }} }} }}
",
        9.81 * sine,
        -9.81 * cosine
    );
    Jit::new(&program(&text))
}

/// v^2 / (2 mu g) and v / (mu g). A step ends with the velocity that it moved at, so that the distance is short by v h / 2.
#[test]
fn a_sliding_block_stops_after_its_distance_and_time() {
    let system = block(0.0, "velocity: [0.5, 0, 0]");
    let (distance, time) = (0.5 * 0.5 / (2.0 * 0.3 * 9.81), 0.5 / (0.3 * 9.81));
    let errors = [4e-4, 2e-4, 1e-4].map(|h| {
        let mut stops = f64::NAN;
        let end = moved(&system, 0.2, h, |state| {
            if stops.is_nan() && state.u[0] < 1e-9 {
                stops = state.t;
            }
        });
        assert!((stops - time).abs() <= 1.01 * h, "{stops} instead of {time}");
        1.0 - end.q[0] / distance
    });
    println!("distance: {errors:?}");
    assert!(errors[2].abs() <= 1e-3, "{errors:?}");
    for pair in errors.windows(2) {
        assert!((pair[0] / pair[1] - 2.0).abs() <= 0.1, "{errors:?}");
    }
}

/// tan(slope) = mu.
#[test]
fn a_block_on_an_incline_sticks_for_100_seconds_or_slides() {
    let slope = |share: f64| (share * 0.3_f64).atan();
    let end = moved(&block(slope(0.99), ""), 100.0, 2e-3, |_| ());
    let creep = largest(&end.q[..3]);
    println!("creep in 100 s: {creep:e} m");
    assert!(creep <= 1e-12, "{end:?}");
    let slope = slope(1.01);
    let end = moved(&block(slope, ""), 1.0, 1e-3, |_| ());
    let expected = 9.81 * (slope.sin() - 0.3 * slope.cos());
    assert!((end.u[0] / expected - 1.0).abs() <= 1e-9, "{} {expected}", end.u[0]);
}

/// A plate falls on a corner, tumbles and comes to rest; nothing sinks in, also not slowly.
#[test]
fn a_dropped_plate_comes_to_rest_without_sinking_in() {
    let system = block(0.0, "position: [0, 0, 50], turn: [10 deg, 20 deg, 0]");
    let h = 1e-4;
    let (mut before, mut after) = (0.0_f64, 0.0_f64);
    let end = moved(&system, 4.0, h, |state| {
        let deepest = maximum(gaps(&system, state).into_iter().map(|gap| -gap));
        let until_now = if state.t < 2.0 { &mut before } else { &mut after };
        *until_now = keep_largest(*until_now, deepest);
    });
    println!("deepest: {before:e} m while it moves, {after:e} m at rest");
    // What turns at w bends by w^2 h^2 / 2 of its length away from a straight step.
    assert!(before <= 50e-3 * 100.0_f64.powi(2) * h * h / 2.0, "{before:e}");
    assert!(after <= 1e-15, "{after:e}");
    assert!(end.u.iter().all(|u| u.abs() <= 1e-12), "{end:?}");
    let lowest = gaps(&system, &end).into_iter().filter(|gap| gap.abs() <= 1e-15).count();
    assert_eq!(lowest, 4, "{end:?}");
}

/// G. W. Housner, "The behavior of inverted pendulum structures during earthquakes", 1963: a block that rocks from one edge
/// to the other keeps its angular momentum about the new edge, so that it goes on at 1 - 1.5 sin^2(alpha) of its speed.
#[test]
fn a_rocking_block_loses_what_housner_says() {
    let (half_width, half_height, tilt) = (10e-3_f64, 40e-3_f64, 0.1_f64);
    let (sine, cosine) = tilt.sin_cos();
    let at = [
        half_width * (cosine - 1.0) - half_height * sine,
        half_width * sine + half_height * (cosine - 1.0),
    ];
    let text = format!(
        "
materials: {{ stone: {{ density: 2000, thickness: 80 mm }} }}
layup: [stone]
bodies: {{ block: {{ free: true, outline: [[0, 0], [0.02, 0], [0.02, 0.03], [0, 0.03]] }} }}
contacts: {{ ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }}, bodies: all, friction: 0.8 }} }}
initial: {{ bodies: {{ block: {{ position: [{}, 0, {}], turn: [0, -{tilt}, 0] }} }} }}
",
        at[0], at[1]
    );
    let system = Jit::new(&program(&text));
    let square = half_width * half_width / (half_width.powi(2) + half_height.powi(2));
    let expected = 1.0 - 1.5 * square;
    let errors = [2e-5, 1e-5].map(|h| {
        let mut speeds = Vec::new();
        moved(&system, 0.5, h, |state| speeds.push(state.u[4]));
        // It speeds up until the first impact, which takes two steps: to the plane, and along it.
        let impact = speeds.windows(2).position(|pair| pair[1] < pair[0]).unwrap();
        let ratio = speeds[impact + 2] / speeds[impact];
        println!("{ratio} instead of {expected}");
        (ratio / expected - 1.0).abs()
    });
    assert!(errors[1] <= 1e-3, "{errors:?}");
}

const FLYING: &str = "
units: { length: mm }
gravity: [0, 0, 0]
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  wing: { outline: [[40, 0], [80, 0], [80, 20], [40, 20]] }
joints:
  hinge: { bodies: [hull, wing], axis: [[40, 0], [40, 20]], limits: [-0.5, 0.5] }
initial:
  q: { hinge: 0.4 }
  u: { hinge: 10 }
  bodies: { hull: { velocity: [1, 0.2, 0.1], angular_velocity: [3, 0, 5] } }
";

/// The impulse of a stop is one within the mechanism.
#[test]
fn a_stop_in_flight_keeps_the_momenta() {
    let system = Jit::new(&program(FLYING));
    let mut drifts = [0.0; 2];
    for (drift, h) in drifts.iter_mut().zip([1e-4, 5e-5]) {
        let start = system.assembled().unwrap();
        let before = system.momentum(&start.q, &start.u).unwrap();
        let mut most = [0.0_f64; 2];
        let mut held = false;
        moved(&system, 0.2, h, |state| {
            let now = system.momentum(&state.q, &state.u).unwrap();
            for axis in 0..3 {
                let linear = (now.linear[axis] - before.linear[axis]) / before.linear[0];
                let angular = (now.angular[axis] - before.angular[axis]) / before.angular[2];
                most = [keep_largest(most[0], linear.abs()), keep_largest(most[1], angular.abs())];
            }
            held |= (state.q[0] - 0.5).abs() <= 1e-15;
            assert!(state.q[0].abs() <= 0.5 + 1e-13, "{}", state.q[0]);
        });
        println!("drift of the momenta at {h}: {most:?}");
        assert!(held, "it never reached its stop");
        *drift = most[1];
        // The mass of the wing turns in steps of the old direction: a part of the method's order 1.
        assert!(most[0] <= 0.02 && most[1] <= 0.02, "{most:?}");
    }
    assert!(drifts[1] <= 0.7 * drifts[0], "{drifts:?}");
}

/// A pendulum falls on its stop, and stays there; with restitution as the events of [`Stopped`] find it.
#[test]
fn a_hinge_reaches_its_stop_without_bouncing() {
    let text = "
bodies: { base: { fixed: true }, arm: { point_masses: [{ mass: 1 g, at: [0.1, 0, 0] }] } }
joints: { hinge: { bodies: [base, arm], axis: [[0, 0], [0, -1]], limits: [-0.3, 1] } }
initial: { q: { hinge: 0.5 } }
";
    let system = Jit::new(&program(text));
    let mut landed = false;
    let end = moved(&system, 1.0, 1e-3, |state| {
        assert!(state.q[0] >= -0.3 - 1e-15, "{state:?}");
        assert!(!landed || state.u[0].abs() <= 1e-15, "{state:?}");
        landed |= state.q[0] <= -0.3 && state.u[0].abs() <= 1e-15;
    });
    assert!(landed && (end.q[0] + 0.3).abs() <= 1e-15, "{end:?}");

    let mut exact = system.assembled().unwrap();
    let mut stopped = Stopped::new(Jit::new(&program(text)));
    stopped.restitution = 0.6;
    let mut integrator = dopri5(&stopped, 1e-10);
    stopped.run(&mut integrator, &mut exact, 0.25, |_| ()).unwrap();
    let errors = [4e-4, 2e-4, 1e-4].map(|h| {
        let mut rigid = Rigid::new(&system);
        rigid.restitution = 0.6;
        let mut state = system.assembled().unwrap();
        rigid.run(&system, &mut state, 0.25, h, |_| ()).unwrap();
        assert!(state.u[0] * exact.u[0] > 0.0);
        (state.q[0] - exact.q[0]).abs()
    });
    println!("after a rebound: {errors:?}");
    // The time of the impact is known to within a step, and speeds of 12.5 rad/s are exchanged for 0.6 of them.
    assert!(
        errors.iter().zip([4e-4, 2e-4, 1e-4]).all(|(error, h)| *error <= 20.0 * h),
        "{errors:?}"
    );
}

/// The six-bar pushes a point against a slanted plane: the loop stays closed, and the point on its side.
#[test]
fn a_loop_that_touches_stays_closed() {
    let example = std::fs::read_to_string(workspace().join("examples/sixbar.yaml")).unwrap();
    let text = example
        + "contacts: { table: { plane: { point: [0, 0, -44.5], normal: [0, -0.1, -1] }, points: [tip], friction: 0.4 } }\n";
    let system = Jit::new(&program(&text));
    let d = system.dimensions();
    let mut state = system.assembled().unwrap();
    let mut rigid = Rigid::new(&system);
    let (mut open, mut deepest, mut touches) = (0.0_f64, 0.0_f64, 0);
    for _ in 0..5000 {
        rigid.step(&system, &mut state, 1e-4).unwrap();
        let mut residual = vec![0.0; 9 * d.loops];
        system
            .write_closure(&state.q, &mut residual, &mut vec![0.0; 9 * d.loops * d.speeds])
            .unwrap();
        open = keep_largest(open, largest(&residual));
        deepest = keep_largest(deepest, -gaps(&system, &state)[0]);
        touches += usize::from(rigid.forces(&system)[0][2] != 0.0);
    }
    println!("open by {open:e} m, overlaps by {deepest:e} m, touches in {touches} of 5000 steps");
    assert!(open <= 1e-12 * system.size() && deepest <= 1e-8 && touches > 1000);
    // It rests, and goes on to rest.
    assert!(gaps(&system, &state)[0].abs() <= 1e-9);
}

/// A ball falls, and leaves with what Hunt and Crossley's law leaves it, which does not depend on the stiffness; a point
/// mass on an arm comes to rest. The stiffer the law is, the less it matters.
#[test]
fn the_compliant_law_tends_to_the_rigid_one() {
    let text = |stiffness: f64| {
        format!(
            "
bodies:
  ball: {{ free: true, mass: 0.01, com: [0, 0, 0], inertia: [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]] }}
points: {{ centre: {{ body: ball, at: [0, 0, 0] }} }}
contacts:
  ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }}, points: [centre], stiffness: {stiffness},
            dissipation: 0.8, friction: 0.3 }}
initial: {{ bodies: {{ ball: {{ position: [0, 0, 0.02], velocity: [0.01, 0, 0] }} }} }}
"
        )
    };
    let (arrives, c) = ((2.0 * 9.81 * 0.02_f64).sqrt(), 0.8_f64);
    let (mut low, mut high) = (0.0, arrives);
    for _ in 0..100 {
        let w = 0.5 * (low + high);
        let excess = c * (arrives + w) - ((1.0 + c * arrives) / (1.0 - c * w)).ln();
        if excess > 0.0 { low = w } else { high = w }
    }
    let t = 0.1;
    let system = Jit::new(&program(&text(1e3)));
    let mut rigid = Rigid::new(&system);
    rigid.restitution = low / arrives;
    let mut end = system.assembled().unwrap();
    rigid.run(&system, &mut end, t, 2e-6, |_| ()).unwrap();
    let flight = t - arrives / 9.81;
    let expected = low * flight - 0.5 * 9.81 * flight * flight;
    assert!((end.q[2] - expected).abs() <= 1e-5, "{} {expected}", end.q[2]);
    let differences = [1e3, 1e4, 1e5].map(|stiffness| {
        use lamc_runtime::Integrator;
        let system = Jit::new(&program(&text(stiffness)));
        let mut state = system.assembled().unwrap();
        dopri5(&system, 1e-9).run(&system, &mut state, t, |_| ()).unwrap();
        (state.q[2] - end.q[2]).abs()
    });
    println!("rigid and compliant differ by {differences:?} m");
    // An impact lasts pi sqrt(m / k).
    assert!(differences.windows(2).all(|pair| pair[1] < 0.5 * pair[0]), "{differences:?}");
}

/// Two plates: a corner of one on the other and on the ground, each of them pushed in.
const FACETS: &str = "
units: { length: mm }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  wing: { outline: [[40, 0], [80, 0], [80, 20], [40, 20]] }
joints: { hinge: { bodies: [hull, wing], axis: [[40, 0], [40, 20]] } }
points: { tip: { body: wing, at: [55, 10, 0.4] } }
CONTACTS
";
const CONTACTS: &str = "
contacts:
  ground: { plane: { point: [0, 0, 0], normal: [0.1, 0.2, 1] }, bodies: all, stiffness: 500, friction: 0.6 }
  facet:
    plane: { point: [0, 0, 0.4], normal: [0, 0, 1], body: hull, within: outline }
    points: [tip]
    stiffness: 300
    friction: 0.2
";

/// The rows times the forces of the law are its generalised forces, and the rows times u the rates of the gaps.
#[test]
fn gaps_and_rows_are_those_of_the_compliant_law() {
    let with = Jit::new(&program(&FACETS.replace("CONTACTS", CONTACTS)));
    let without = Jit::new(&program(&FACETS.replace("CONTACTS", "")));
    let (n, k) = (with.dimensions().speeds, with.dimensions().contacts);
    let mut random = Random::new(5);
    let mut pushes = 0;
    for _ in 0..50 {
        let mut q = with.initial().q;
        let step: Vec<f64> = random.normals(n, 0.02);
        with.advance(&mut q, &step);
        q[0] = 2.8 + 0.1 * random.normals(1, 1.0)[0];
        let u = random.normals(n, 1.0);
        let forcing = |system: &Jit| {
            let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
            let out = EquationsMut {
                mass: &mut mass,
                forcing: &mut forcing,
                jacobian: &mut [],
                gamma: &mut [],
            };
            system.write_equations(0.0, &q, &u, out).unwrap();
            forcing
        };
        let mut contacts = vec![0.0; 6 * k];
        with.write_contacts(0.0, &q, &u, &mut contacts).unwrap();
        let (mut gap, mut friction) = (vec![0.0; 2 * k], vec![0.0; k]);
        let (mut normal, mut rows) = (vec![0.0; 3 * k], vec![0.0; 3 * k * n]);
        let out = GapsMut {
            gap: &mut gap,
            friction: &mut friction,
            normal: &mut normal,
            rows: &mut rows,
        };
        with.write_gaps(0.0, &q, out).unwrap();
        let mut explained = forcing(&without);
        for (point, contact) in contacts.chunks(6).enumerate() {
            for axis in 0..3 {
                let row = &rows[(3 * point + axis) * n..][..n];
                explained.iter_mut().zip(row).for_each(|(f, g)| *f += g * contact[3 + axis]);
            }
            pushes += usize::from(contact[5] != 0.0);
        }
        for (found, explained) in forcing(&with).iter().zip(&explained) {
            assert!((found - explained).abs() <= 1e-12, "{found} {explained}");
        }
        let heights = |h: f64| {
            let mut q = q.clone();
            with.advance(&mut q, &u.iter().map(|u| h * u).collect::<Vec<_>>());
            gaps(&with, &State { t: 0.0, q, u: u.clone() })
        };
        let (before, after) = (heights(-1e-6), heights(1e-6));
        for point in 0..k {
            let rate: f64 = (0..3)
                .map(|axis| {
                    let row = &rows[(3 * point + axis) * n..][..n];
                    normal[3 * point + axis] * row.iter().zip(&u).map(|(g, u)| g * u).sum::<f64>()
                })
                .sum();
            let difference = (after[point] - before[point]) / 2e-6;
            assert!((rate - difference).abs() <= 1e-7, "{point}: {rate} {difference}");
        }
        let expected = [0.6, 0.2].map(|mu| friction.iter().filter(|&&f| f == mu).count());
        assert_eq!(expected, [k - 1, 1]);
    }
    assert!(pushes > 50, "{pushes}");
}
