//! Contacts: closed forms of bounces, rest and rubbing, conserved quantities, and every function of a program
//! against poses and velocities.

use lamc::pipeline::Compiled;
use lamc::program::Interpreter;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{
    Integrator, JacobianMut, Mechanism, State, acceleration, equilibrium, jacobian,
};
use lamc_tests::compare::keep_largest;
use lamc_tests::random::Random;
use lamc_tests::{compile_text, dopri5, largest_difference, relative_error};
use lamc_workbench::verify::{Values, solve};

/// A point mass of 1 g at the end of an arm of 1 m that is hinged at the origin: it moves along z, but for the
/// square of its angle.
fn arm(gravity: f64, contact: &str) -> Compiled {
    compile_text(&format!(
        "
gravity: [0, 0, -{gravity}]
bodies: {{ base: {{ fixed: true }}, arm: {{ point_masses: [{{ mass: 1 g, at: [1, 0, 0] }}] }} }}
joints: {{ hinge: {{ bodies: [base, arm], axis: [[0, 0], [0, -1]] }} }}
points: {{ tip: {{ body: arm, at: [1, 0, 0] }} }}
contacts:
  ground: {{ plane: {{ point: [0, 0, 0], normal: [0, 0, 1] }}, points: [tip], {contact} }}
"
    ))
}

const MASS: f64 = 1e-3;
const STIFFNESS: f64 = 2000.0;

/// The mass arrives at the plane with a speed, without gravity, and leaves it.
#[test]
fn a_bounce_is_that_of_hunt_and_crossley() {
    for dissipation in [0.2, 1.0, 3.0] {
        let law = format!("stiffness: {STIFFNESS}, dissipation: {dissipation}, friction: 0");
        let compiled = arm(0.0, &law);
        let system = Interpreter::new(&compiled.program);
        let mut integrator = dopri5(&system, 1e-12);
        let arrives = 0.5_f64;
        let start: f64 = arrives * 1e-3;
        let mut state = State { t: 0.0, q: vec![start.asin()], u: vec![-arrives] };
        let duration = 1e-3 + 4.0 * f64::sqrt(MASS / STIFFNESS) + 0.01;
        integrator.run(&system, &mut state, duration, |_| ()).unwrap();
        let leaves = state.u[0];
        assert!(leaves > 0.0 && state.q[0] > 0.0, "it did not leave: {leaves}");
        // With c: dv/dd = -k d (1 + c v) / (m v), so v - ln(1 + c v) / c + c' k d^2 / 2 m is constant.
        let c = dissipation;
        let implicit = |v: f64| c * (arrives + v) - f64::ln((1.0 + c * arrives) / (1.0 - c * v));
        let (mut low, mut high) = (1e-3 * arrives, arrives.min((1.0 - 1e-12) / c));
        for _ in 0..100 {
            let middle = 0.5 * (low + high);
            match implicit(middle) > 0.0 {
                true => low = middle,
                false => high = middle,
            }
        }
        println!("c = {c}: leaves at {leaves}, {low} by the closed form");
        assert!((leaves / low - 1.0).abs() < 1e-5, "{leaves} is not {low}");
    }
}

/// Without dissipation and friction nothing is lost, in many bounces under gravity.
#[test]
fn a_smooth_bounce_keeps_its_energy() {
    let law = format!("stiffness: {STIFFNESS}, dissipation: 0, friction: 0");
    let compiled = arm(9.81, &law);
    let system = Interpreter::new(&compiled.program);
    let mut integrator = dopri5(&system, 1e-11);
    let mut state = State { t: 0.0, q: vec![0.02], u: vec![0.0] };
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        energy.kinetic + energy.potential
    };
    let (before, mut lowest, mut bounces) = (total(&state), 0.0_f64, 0);
    for sample in 1..=1000 {
        let falls = state.u[0] < 0.0;
        integrator.run(&system, &mut state, 1e-3 * f64::from(sample), |_| ()).unwrap();
        lowest = lowest.min(state.q[0]);
        bounces += usize::from(falls && state.u[0] > 0.0);
        let share = (total(&state) / before - 1.0).abs();
        assert!(share < 1e-6, "{share:e} of the energy is gone at {} s", state.t);
    }
    assert!(bounces > 5 && lowest < -1e-4, "{bounces} bounces, down to {lowest}");
}

/// At rest, k d is the weight; the default stiffness lets one point sink in by 1 % of the thickness.
#[test]
fn what_rests_sinks_in_by_its_weight() {
    let compiled = arm(9.81, &format!("stiffness: {STIFFNESS}, friction: 0.3"));
    let system = Interpreter::new(&compiled.program);
    let mut q = vec![-1e-6];
    equilibrium(&system, 0.0, &mut q, &mut system.workspace()).unwrap();
    let depth = MASS * 9.81 / STIFFNESS;
    assert!((-q[0].sin() / depth - 1.0).abs() < 1e-9, "{} is not {depth}", -q[0].sin());
    let mut contact = [0.0; 6];
    system.write_contacts(0.0, &q, &[0.0], &mut contact).unwrap();
    assert!((contact[5] / (MASS * 9.81) - 1.0).abs() < 1e-9, "{contact:?}");
    assert!((contact[2] + depth).abs() < 1e-12 && contact[3].abs() < 1e-15, "{contact:?}");

    let plate = compile_text(
        "
materials: { card: { density: 700, thickness: 0.4 mm } }
layup: [card, card]
bodies:
  base: { fixed: true }
  plate: { outline: [[0, 0], [0.04, 0], [0.04, 0.02], [0, 0.02]] }
joints: { hinge: { bodies: [base, plate], axis: [[0, 0], [0, 0.02]] } }
contacts: { ground: { plane: { point: [0, 0, -1 mm], normal: [0, 0, 3] }, friction: 0.5 } }
",
    );
    let contact = &plate.topology.mechanism.contacts[0];
    let weight = 700.0 * 0.04 * 0.02 * 0.8e-3 * 9.81;
    let stiffness = contact.stiffness.constant().unwrap();
    assert!((stiffness * 0.01 * 0.8e-3 / weight - 1.0).abs() < 1e-12, "{stiffness}");
    let report = lamc_workbench::check::Check::new(&plate).report();
    let mass = weight / 9.81;
    for line in [
        "ground: 8 points against a plane of the ground".to_owned(),
        format!("stiffness {stiffness:.4} N/m: one point under {:.4} g", 1e3 * mass),
        "dissipation 0.5000 s/m, friction 0.5000, slip speed 1.0000 mm/s".to_owned(),
        format!("sqrt(k/m) = {:.4} rad/s for `plate`", f64::sqrt(9.81 / (0.01 * 0.8e-3))),
        format!("friction mu g / s = {:.4} 1/s", 0.5 * 9.81 / 1e-3),
    ] {
        assert!(report.contains(&line), "no {line:?} in:\n{report}");
    }
    // Four corners of the lower face and four of the upper one.
    let mut corners: Vec<[i64; 3]> = contact
        .points
        .iter()
        .map(|point| (point.at * 1e5).map(|x| x.round() as i64).into())
        .collect();
    corners.sort_unstable();
    let expected: Vec<[i64; 3]> = [0, 4000]
        .into_iter()
        .flat_map(|x| [0, 2000].map(|y| (x, y)))
        .flat_map(|(x, y)| [0, 80].map(|z| [x, y, z]))
        .collect();
    assert_eq!(corners, expected);
    assert_eq!(plate.program.interface.contacts[0], "ground.plate.c0");
}

/// A crank whose tip rubs on a plane across its axis, at a constant depth d: with w = r u and the slip speed s,
/// I w dw / r^2 = -T w / sqrt(w^2 + s^2) r dq has the integral I / r^2 (w sqrt(w^2 + s^2) + s^2 asinh(w / s)) / 2 =
/// T (q_end - q_0) with T = mu k d r.
#[test]
fn a_crank_that_rubs_stops_at_the_closed_form() {
    let (radius, depth, friction, slip) = (0.1_f64, 1e-5, 0.6, 1e-3);
    let compiled = compile_text(&format!(
        "
gravity: [0, 0, 0]
bodies: {{ base: {{ fixed: true }}, crank: {{ point_masses: [{{ mass: 1 g, at: [{radius}, 0.02, 0] }}] }} }}
joints: {{ hinge: {{ bodies: [base, crank], axis: [[0, 0], [0, 1]] }} }}
points: {{ tip: {{ body: crank, at: [{radius}, 0.02, 0] }} }}
contacts:
  wall:
    plane: {{ point: [7, {}, 3], normal: [0, -2, 0] }}
    points: [tip]
    stiffness: {STIFFNESS}
    dissipation: 2
    friction: {friction}
    slip_speed: {slip}
",
        0.02 - depth
    ));
    let system = Interpreter::new(&compiled.program);
    let mut integrator = dopri5(&system, 1e-11);
    let mut state = State { t: 0.0, q: vec![0.3], u: vec![5.0] };
    let w: f64 = radius * state.u[0];
    let force = friction * STIFFNESS * depth;
    let way = MASS / force * (w * f64::hypot(w, slip) + slip * slip * f64::asinh(w / slip)) / 2.0;
    let turned = way / radius;
    integrator.run(&system, &mut state, 0.2, |_| ()).unwrap();
    assert!(state.u[0].abs() < 1e-9, "it still turns: {}", state.u[0]);
    let error = (state.q[0] - 0.3) / turned - 1.0;
    assert!(error.abs() < 1e-6, "{error:e} of the way is missing");
}

/// Two links in a plane. The second one's tip touches a plane that the first one carries, and the hinge of the
/// first is the only thing that holds them.
fn pair(law: &str, axis: &str) -> Compiled {
    compile_text(&format!(
        "
gravity: [0, 0, 0]
bodies:
  base: {{ fixed: true }}
  upper: {{ mass: 2 g, com: [0.05, 0, 0], inertia: [[1e-7, 0, 0], [0, 2e-6, 0], [0, 0, 2e-6]] }}
  lower: {{ mass: 1 g, com: [0.13, 0.01, 0], inertia: [[1e-7, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]] }}
joints:
  shoulder: {{ bodies: [base, upper], axis: [[0, 0], [0, 1]] }}
  elbow: {{ bodies: [upper, lower], axis: {axis} }}
points: {{ tip: {{ body: lower, at: [0.16, 0.01, 0.002] }} }}
contacts:
  facets:
    plane: {{ point: [0.1, 0, -0.005], normal: [0.1, 0, 1], body: upper }}
    points: [tip]
    stiffness: {STIFFNESS}
    {law}
"
    ))
}

/// Forces between two bodies do not change the angular momentum about the hinge that holds both, and the energy
/// loses what the contact takes.
#[test]
fn a_plane_on_a_body_takes_the_opposite_force() {
    let parallel = "[[0.1, 0], [0.1, 1]]";
    for law in [
        "dissipation: 0\n    friction: 0",
        "dissipation: 0.5\n    friction: 0.4\n    slip_speed: 0.01",
    ] {
        let compiled = pair(law, parallel);
        let system = Interpreter::new(&compiled.program);
        let is_smooth = law.ends_with('0');
        let momentum = |state: &State<Vec<f64>, f64>| {
            let (mut mass, mut forcing) = (vec![0.0; 4], vec![0.0; 2]);
            let out = EquationsMut {
                mass: &mut mass,
                forcing: &mut forcing,
                jacobian: &mut [],
                gamma: &mut [],
            };
            system.write_equations(0.0, &state.q, &state.u, out).unwrap();
            mass[0] * state.u[0] + mass[1] * state.u[1]
        };
        let total = |state: &State<Vec<f64>, f64>| {
            let energy = system.energy(state.t, &state.q, &state.u).unwrap();
            energy.kinetic + energy.potential
        };
        let mut state = State { t: 0.0, q: vec![0.2, -0.02], u: vec![3.0, 12.0] };
        let (energy, turning) = (total(&state), momentum(&state));
        let mut integrator = dopri5(&system, 1e-11);
        let mut most = 0.0_f64;
        for sample in 1..=400 {
            integrator.run(&system, &mut state, 1e-4 * f64::from(sample), |_| ()).unwrap();
            let mut contact = [0.0; 6];
            system.write_contacts(state.t, &state.q, &state.u, &mut contact).unwrap();
            most = keep_largest(most, contact[5].abs());
            assert!((momentum(&state) / turning - 1.0).abs() < 1e-9);
        }
        assert!(most > 0.01, "nothing was touched: {most} N");
        let share = total(&state) / energy;
        match is_smooth {
            true => assert!((share - 1.0).abs() < 1e-7, "{share}"),
            false => assert!(share < 0.999, "{share}"),
        }
    }
}

/// A fold of plates with contacts of every kind: against the ground at an angle, against each other within the
/// outline, and of a fixed point against a moving plate.
const FOLD: &str = "
materials: { card: { density: 700, thickness: 1 mm } }
layup: [card, card]
parameters: { k: 900, mu: 0.4 }
bodies:
  base: { fixed: true, outline: [[-0.04, 0], [0, 0], [0, 0.03], [-0.04, 0.03]] }
  left: { outline: [[0, 0], [0.04, 0], [0.045, 0.03], [0, 0.03]] }
  right: { outline: [[0.04, 0], [0.08, 0], [0.08, 0.03], [0.045, 0.03]] }
joints:
  a: { bodies: [base, left], axis: [[0, 0], [0, 0.03]], stiffness: 1e-3, damping: 1e-6 }
  b: { bodies: [left, right], axis: [[0.04, 0], [0.045, 0.03]], z: 2 mm, stiffness: 1e-3, damping: 1e-6 }
points:
  post: { body: base, at: [0.02, 0.01, 0.012] }
  probe: { body: right, at: [0.06, 0.013, 0.001] }
contacts:
  ground:
    plane: { point: [0.01, 0, -0.004], normal: [0.1, -0.2, 1] }
    stiffness: k
    dissipation: \"0.4 + 0.1*sin(t)\"
    friction: mu
    slip_speed: 20 mm/s
  facets:
    plane: { point: [0, 0, 0.002], normal: [0, 0, 1], body: left, within: outline }
    points: [probe, post]
    stiffness: \"1.5*k\"
    friction: \"mu/2\"
    slip_speed: 10 mm/s
";

/// Accelerations, energies and their derivatives at random states, against maximal coordinates and differences.
#[test]
fn every_function_of_a_program_knows_contacts() {
    let compiled = compile_text(FOLD);
    let system = Interpreter::new(&compiled.program);
    let mechanism = &compiled.topology.mechanism;
    let mut random = Random::new(7);
    let mut workspace = system.workspace();
    let (mut inside, mut touching) = (0, 0);
    for _ in 0..300 {
        let q = vec![random.range(-0.6, 0.6), random.range(-3.1, 3.1)];
        let u: Vec<f64> = (0..2).map(|_| random.range(-2.0, 2.0)).collect();
        let mut contacts = vec![0.0; 6 * compiled.program.interface.contacts.len()];
        system.write_contacts(0.0, &q, &u, &mut contacts).unwrap();
        let pushed = |row: &[f64]| row[3..].iter().any(|x| *x != 0.0);
        touching += usize::from(contacts.chunks(6).any(pushed));
        inside += contacts.chunks(6).skip(16).filter(|row| pushed(row)).count();
        let mut a = vec![0.0; 2];
        acceleration(&system, 0.0, &q, &u, &mut workspace, &mut a).unwrap();
        let values = Values {
            q: q.clone(),
            u: u.clone(),
            parameters: system.parameters().to_vec(),
            ..Values::default()
        };
        let other = solve(mechanism, &values).unwrap();
        let error = other.relative_error(&a);
        assert!(error < 1e-9, "acceleration {error:e} at {q:?} {u:?}");
        let energy = system.energy(0.0, &q, &u).unwrap();
        let error = (energy.potential - other.potential_energy).abs() / energy.potential.abs();
        assert!(error < 1e-10, "energy {error:e} at {q:?}");
    }
    println!("{touching} of 300 touch, {inside} within the outline");
    assert!(touching > 100 && inside > 5);
}

/// Away from corners of the law, derivatives are those of differences.
#[test]
fn derivatives_of_contacts_are_those_of_differences() {
    let compiled = compile_text(FOLD);
    let system = Interpreter::new(&compiled.program);
    let mut random = Random::new(11);
    let mut workspace = system.workspace();
    let mut compared = 0;
    for _ in 0..200 {
        let q = vec![random.range(-0.6, 0.6), random.range(-3.1, 3.1)];
        let u: Vec<f64> = (0..2).map(|_| random.range(-2.0, 2.0)).collect();
        let (mut a, mut dq, mut du, mut dt) =
            (vec![0.0; 2], vec![0.0; 4], vec![0.0; 4], vec![0.0; 2]);
        let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
        jacobian(&system, 0.0, &q, &u, &mut workspace, out).unwrap();
        let mut at = |q: &[f64], u: &[f64], t: f64| {
            let mut out = vec![0.0; 2];
            acceleration(&system, t, q, u, &mut workspace, &mut out).unwrap();
            out
        };
        // A step at which a corner of the law lies between changes the difference: two steps must agree.
        let mut slope = |h: f64, column: usize| {
            let moved = |h: f64| {
                let (mut q, mut u, mut t) = (q.clone(), u.clone(), 0.0);
                match column {
                    0 | 1 => q[column] += h,
                    2 | 3 => u[column - 2] += h,
                    _ => t += h,
                }
                (q, u, t)
            };
            let [b, c, d, e] = [-2.0, -1.0, 1.0, 2.0].map(|k| {
                let (q, u, t) = moved(k * h);
                at(&q, &u, t)
            });
            let difference = |i: usize| (b[i] - 8.0 * c[i] + 8.0 * d[i] - e[i]) / (12.0 * h);
            [difference(0), difference(1)]
        };
        for column in 0..5 {
            let [fine, coarse] = [1e-6, 2e-6].map(|h| slope(h, column));
            let own = match column {
                0 | 1 => [dq[column], dq[2 + column]],
                2 | 3 => [du[column - 2], du[column]],
                _ => [dt[0], dt[1]],
            };
            if relative_error(&fine, &coarse) < 1e-6 {
                compared += 1;
                let error =
                    largest_difference(&own, &fine) / (1.0 + fine[0].abs().max(fine[1].abs()));
                assert!(error < 1e-5, "{own:?} is not {fine:?} in column {column} at {q:?} {u:?}");
            }
        }
    }
    assert!(compared > 800, "{compared}");
}
