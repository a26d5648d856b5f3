//! Constraint forces: hinge reactions against Newton's and Euler's laws for each body, computed from poses
//! alone; motor torques against closed forms and the balance of energy.

use lamc::program::Interpreter;
use lamc_runtime::plumbing::Balance;
use lamc_runtime::{
    Integrator, Mechanism, Rodas, State, acceleration_and_forces, assemble, project,
};
use lamc_tests::compare::{keep_largest, largest};
use lamc_tests::random::Random;
use lamc_tests::{compile_text, designs, dopri5, linkages, relative_error};
use nalgebra::{Matrix3, Vector3};

/// Momentum and moment of momentum.
type Momentum = (Vector3<f64>, Vector3<f64>);

/// Poses of the bodies, R and p.
fn poses(system: &Interpreter, q: &[f64]) -> Vec<(Matrix3<f64>, Vector3<f64>)> {
    let pose = |x: &[f64; 12]| (Matrix3::from_row_slice(&x[..9]), Vector3::from_row_slice(&x[9..]));
    system.poses(&q.to_vec()).unwrap().iter().map(pose).collect()
}

/// du/dt, lambda and reactions at a state.
fn reactions(system: &Interpreter, q: &[f64], u: &[f64]) -> (Vec<f64>, Vec<Vec<f64>>) {
    let (n, d) = (q.len(), system.dimensions());
    let (mut a, mut lambda) = (vec![0.0; n], vec![0.0; d.rows + d.drives]);
    let mut workspace = system.workspace();
    acceleration_and_forces(system, 0.0, q, u, &mut workspace, &mut a, &mut lambda).unwrap();
    let mut out = vec![0.0; 6 * n];
    let multipliers = &lambda[..d.rows];
    system
        .write_reactions(Balance { t: 0.0, q, u, acceleration: &a, multipliers }, &mut out)
        .unwrap();
    (a, out.chunks(6).map(<[f64]>::to_vec).collect())
}

/// Largest error of force and moment balance over the moving bodies, relative to the largest
/// reaction: sum of what hinges and gravity do to a body against its change of momentum, by central
/// differences of poses along q + u s + a s^2 / 2.
fn imbalance(
    compiled: &lamc::pipeline::Compiled,
    system: &Interpreter,
    q: &[f64],
    u: &[f64],
) -> f64 {
    let mechanism = &compiled.topology.mechanism;
    let (a, reactions) = reactions(system, q, u);
    let at = |s: f64| -> Vec<(Matrix3<f64>, Vector3<f64>)> {
        let q: Vec<f64> = (0..q.len()).map(|i| q[i] + s * u[i] + 0.5 * s * s * a[i]).collect();
        poses(system, &q)
    };
    let now = at(0.0);
    // Momentum and moment of momentum about the base's origin of each body at a time nearby.
    let h = 2e-4;
    let momenta = |s: f64| -> Vec<Momentum> {
        let [far_before, before, after, far_after] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(s + k * h));
        let rate = |i: usize| {
            let r = (far_before[i].0 - before[i].0 * 8.0 + after[i].0 * 8.0 - far_after[i].0)
                / (12.0 * h);
            let p = (far_before[i].1 - before[i].1 * 8.0 + after[i].1 * 8.0 - far_after[i].1)
                / (12.0 * h);
            (r, p)
        };
        let there = at(s);
        mechanism
            .bodies
            .iter()
            .enumerate()
            .map(|(i, body)| {
                let properties = &body.mass_properties;
                let ((dr, dp), (r, p)) = (rate(i), there[i]);
                let skew = dr * r.transpose();
                let omega = Vector3::new(
                    skew[(2, 1)] - skew[(1, 2)],
                    skew[(0, 2)] - skew[(2, 0)],
                    skew[(1, 0)] - skew[(0, 1)],
                ) / 2.0;
                let velocity = dr * properties.com + dp;
                let com = r * properties.com + p;
                let momentum = velocity * properties.mass;
                let spin = r * properties.inertia * r.transpose() * omega;
                (momentum, com.cross(&momentum) + spin)
            })
            .collect()
    };
    let [far_before, before, after, far_after] = [-2.0, -1.0, 1.0, 2.0].map(|k| momenta(k * h));
    let gravity = Vector3::from_fn(|i, _| mechanism.gravity[i].constant().unwrap());
    let mut sums: Vec<(Vector3<f64>, Vector3<f64>)> = Vec::new();
    for (i, body) in mechanism.bodies.iter().enumerate() {
        let com = now[i].0 * body.mass_properties.com + now[i].1;
        let rate = |pick: fn(&Momentum) -> Vector3<f64>| {
            (pick(&far_before[i]) - pick(&before[i]) * 8.0 + pick(&after[i]) * 8.0
                - pick(&far_after[i]))
                / (12.0 * h)
        };
        let weight = gravity * body.mass_properties.mass;
        sums.push((weight - rate(|m| m.0), com.cross(&weight) - rate(|m| m.1)));
    }
    let (mut largest_force, mut largest_moment) = (1e-12_f64, 1e-12_f64);
    for (joint, reaction) in mechanism.joints.iter().zip(&reactions) {
        let [first, second] = joint.bodies.map(|id| id.index());
        // The joint's frame is fixed to the second body.
        let x = joint.direction;
        let z = Vector3::z();
        let axes = now[second].0 * Matrix3::from_columns(&[x, z.cross(&x), z]);
        let force = axes * Vector3::from_row_slice(&reaction[..3]);
        let point = now[second].0 * joint.point + now[second].1;
        let moment = axes * Vector3::from_row_slice(&reaction[3..]) + point.cross(&force);
        sums[first].0 -= force;
        sums[first].1 -= moment;
        sums[second].0 += force;
        sums[second].1 += moment;
        largest_force = keep_largest(largest_force, force.norm());
        largest_moment = keep_largest(largest_moment, moment.norm());
    }
    let moving = sums.iter().zip(&mechanism.bodies).filter(|(_, body)| !body.fixed);
    largest(moving.flat_map(|((force, moment), _)| {
        [force.norm() / largest_force, moment.norm() / largest_moment]
    }))
}

#[test]
fn reactions_balance_every_body() {
    let cases = [
        linkages::spherical("spherical_six_bar", &[0.0, 50.0, 140.0, 180.0, 220.0, 290.0]),
        linkages::planar_four_bar(),
        linkages::spatial_seven_bar(),
        linkages::bennett(),
        linkages::watt(),
        linkages::miura(3),
    ];
    for linkage in cases {
        let compiled = compile_text(&linkage.text(5));
        let system = Interpreter::new(&compiled.program);
        let n = linkage.hinges.len();
        let mut random = Random::new(21);
        let mut workspace = system.workspace();
        let (mut tried, mut worst) = (0, 0.0_f64);
        while tried < 6 {
            let mut q: Vec<f64> =
                linkage.folded.iter().map(|q| q + random.range(-0.5, 0.5)).collect();
            let mut u: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
            if assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace).is_err() {
                continue;
            }
            // Next to the flat state a loop is loose in a direction more: bodies then do not move
            // as their hinges say.
            if q.iter().all(|q| q.abs() < 0.02) {
                continue;
            }
            tried += 1;
            project(&system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
            worst = keep_largest(worst, imbalance(&compiled, &system, &q, &u));
        }
        println!("{}: {worst:e}", linkage.name);
        assert!(worst < 1e-8, "{}: {worst:e}", linkage.name);
    }
}

#[test]
fn reactions_balance_the_designs() {
    // Plates of a milligram on stiff hinges accelerate by 1e5 rad/s^2, which differences of poses follow to
    // 1e-6. The published four-bar is next to flat, where they have too few digits.
    for design in designs().filter(|design| design.name != "paper_fourbar") {
        let system = Interpreter::new(&design.compiled.program);
        for state in &design.reference.states {
            let error = imbalance(&design.compiled, &system, &state.q, &state.u);
            assert!(error < 1e-5, "{}: {error:e}", design.name);
        }
    }
}

/// A rod of 2 g, 20 mm from its hinge, whose motor swings it 0.4 rad at 3 Hz against gravity, a
/// spring and a damper.
const DRIVEN: &str = "
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0.02, 0, 0], inertia: [[1e-9, 0, 0], [0, 3e-7, 0], [0, 0, 3e-7]] }
parameters: { amplitude: 0.4 }
joints:
  hinge: { bodies: [base, rod], axis: [[0, 0], [0, 1]], stiffness: 1e-3, damping: 1e-5, rest: 0.1,
           drive: amplitude*sin(6*pi*t) }
";

#[test]
fn a_motor_that_swings_a_pendulum() {
    let compiled = compile_text(DRIVEN);
    let system = Interpreter::new(&compiled.program);
    let w = 6.0 * std::f64::consts::PI;
    for t in [0.0, 0.03, 0.11, 0.2] {
        let (s, c) = f64::sin_cos(w * t);
        let (q, u, a) = (0.4 * s, 0.4 * w * c, -0.4 * w * w * s);
        let (mut out, mut torque) = ([0.0], [0.0]);
        let mut workspace = system.workspace();
        acceleration_and_forces(&system, t, &[q], &[u], &mut workspace, &mut out, &mut torque)
            .unwrap();
        assert!((out[0] - a).abs() <= 1e-12 * w * w);
        // The hinge turns about y: positive angles lower the rod.
        let expected = (3e-7 + 0.002 * 0.02 * 0.02) * a - 0.002 * 9.81 * 0.02 * q.cos()
            + 1e-3 * (q - 0.1)
            + 1e-5 * u;
        assert!((torque[0] - expected).abs() <= 1e-12, "{} is not {expected}", torque[0]);
    }
    // The motion follows, whatever it starts from, through both adaptive integrators.
    let mut state = State { t: 0.0, q: vec![0.0], u: vec![0.4 * w] };
    dopri5(&system, 1e-9).run(&system, &mut state, 1.27, |_| ()).unwrap();
    let expected = 0.4 * f64::sin(w * 1.27);
    assert!((state.q[0] - expected).abs() < 1e-12);
    let mut state = State { t: 0.0, q: vec![0.0], u: vec![0.4 * w] };
    Rodas::new(&system).run(&system, &mut state, 1.27, |_| ()).unwrap();
    assert!((state.q[0] - expected).abs() < 1e-12);
}

/// A driven six-bar: what the motor does is what energy grows by and dampers take.
#[test]
fn work_of_a_motor_in_a_loop() {
    let six = [0.0, 50.0, 140.0, 180.0, 220.0, 290.0];
    let mut text = linkages::spherical("driven", &six).text(9);
    let joint = text.find("  j2: {").expect("a joint");
    let end = text[joint..].find(" }").expect("its end") + joint;
    text.insert_str(end, ", drive: 0.5 + 0.3*sin(9*t)");
    let compiled = compile_text(&text);
    let system = Interpreter::new(&compiled.program);
    let mut state = system.initial();
    state.q = vec![0.3, -0.4, 0.5, 0.2, -0.3, 0.1];
    let mut workspace = system.workspace();
    assemble(&system, 0.0, &mut state.q, &[false; 6], &mut workspace).unwrap();
    project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
    let dampers: Vec<f64> = compiled
        .topology
        .mechanism
        .joints
        .iter()
        .map(|joint| joint.damping.constant().unwrap())
        .collect();
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        energy.kinetic + energy.potential
    };
    // Power of the motor less that of the dampers.
    let power = |state: &State<Vec<f64>, f64>| {
        let d = system.dimensions();
        let (mut a, mut lambda) = (vec![0.0; 6], vec![0.0; d.rows + d.drives]);
        let mut workspace = system.workspace();
        let (q, u) = (&state.q, &state.u);
        acceleration_and_forces(&system, state.t, q, u, &mut workspace, &mut a, &mut lambda)
            .unwrap();
        let lost: f64 = dampers.iter().zip(u).map(|(b, u)| b * u * u).sum();
        lambda[d.rows] * u[2] - lost
    };
    let (before, mut work, mut swing) = (total(&state), 0.0, 0.0_f64);
    let mut integrator = dopri5(&system, 1e-11);
    let step = 1e-3;
    for k in 0..250 {
        // Simpson's rule over two samples.
        let start = power(&state);
        integrator.run(&system, &mut state, step * (2 * k + 1) as f64, |_| ()).unwrap();
        let middle = power(&state);
        integrator.run(&system, &mut state, step * (2 * k + 2) as f64, |_| ()).unwrap();
        work += step / 3.0 * (start + 4.0 * middle + power(&state));
        swing = keep_largest(swing, (total(&state) - before).abs());
        assert!((state.q[2] - 0.5 - 0.3 * f64::sin(9.0 * state.t)).abs() < 1e-11);
    }
    let gained = total(&state) - before;
    println!("work {work:e} J, gained {gained:e} J, swing {swing:e} J");
    assert!((gained - work).abs() < 1e-7 * swing);
    assert!(relative_error(&[gained], &[work]) < 1e-4);
}
