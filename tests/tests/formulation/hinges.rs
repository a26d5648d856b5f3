//! Hinge models and force laws of a model's text against closed forms, and against the other
//! functions of the same program.

use lamc::laminate::{Excursion, excursions};
use lamc::pipeline::{Compiled, compile};
use lamc::program::Interpreter;
use lamc::source::{SourceFile, parse, to_yaml};
use lamc_runtime::plumbing::Balance;
use lamc_runtime::{
    Integrator, JacobianMut, Mechanism, State, acceleration, acceleration_and_forces, assemble,
    jacobian, project,
};
use lamc_tests::random::Random;
use lamc_tests::{compile_text, dopri5, linkages, relative_error};

/// A plate of 40 mm x 20 mm that hangs on a line along y at its edge, in no gravity.
fn plate(joint: &str, more: &str) -> Compiled {
    compile_text(&format!(
        "
materials:
  card: {{ density: 700, thickness: 0.4 mm }}
  polyester: {{ density: 1380, thickness: 0.127 mm, youngs_modulus: 4383.27 MPa, yield_stress: 42.84 MPa }}
layup: [card, polyester, card]
gravity: [0, 0, 0]
bodies:
  base: {{ fixed: true }}
  plate: {{ outline: [[0, 0], [0.04, 0], [0.04, 0.02], [0, 0.02]] }}
joints:
  hinge: {{ bodies: [base, plate], axis: [[0, 0], [0, 0.02]], {joint} }}
{more}
"
    ))
}

/// About the hinge line, kg m^2.
fn inertia(compiled: &Compiled) -> f64 {
    let body = &compiled.topology.mechanism.bodies[1].mass_properties;
    body.inertia_about(&nalgebra::Vector3::zeros())[(1, 1)]
}

/// The state of the hinge after each of some times (s).
fn swing(compiled: &Compiled, start: [f64; 2], times: &[f64]) -> Vec<[f64; 2]> {
    let system = Interpreter::new(&compiled.program);
    let mut state = State { t: 0.0, q: vec![start[0]], u: vec![start[1]] };
    let mut integrator = dopri5(&system, 1e-12);
    let mut after = |&t: &f64| {
        integrator.run(&system, &mut state, t, |_| ()).unwrap();
        [state.q[0], state.u[0]]
    };
    times.iter().map(&mut after).collect()
}

#[test]
fn a_model_names_its_hinges() {
    let beam = plate(
        "hinge: { model: beam, material: polyester, length: 1 mm, width: 20 mm, gaps: 5 mm }",
        "",
    );
    let joint = &beam.topology.mechanism.joints[0];
    // Three quarters of the full strip's 0.01496435958735; 2 sigma x / (E t).
    let stiffness = joint.stiffness.constant().unwrap();
    assert!((stiffness / (0.75 * 0.01496435958735) - 1.0).abs() < 1e-12);
    assert!((joint.linear_range / (2.0 * 42.84 / 4383.27 / 0.127) - 1.0).abs() < 1e-12);
    let named =
        plate("hinge: { model: sharifzadeh2018, length: 1 mm, width: 50 mm, area: 50 cm^2 }", "");
    let joint = &named.topology.mechanism.joints[0];
    // The sums by hand of `laminate/flexure/sharifzadeh2018.rs`.
    assert!((joint.stiffness.constant().unwrap() / 0.0184110397 - 1.0).abs() < 1e-9);
    assert!((joint.damping.constant().unwrap() / 6.03247e-5 - 1.0).abs() < 1e-9);
}

#[test]
fn every_law_reads_back_as_it_is_written() {
    let text = "
parameters: { k3: 2e-3, cd: 1.3 }
materials: { film: { density: 1380, thickness: 0.1 mm, youngs_modulus: 4 GPa } }
layup: [film]
bodies: { base: { fixed: true }, b: { outline: [[0, 0], [1, 0], [1, 1]] }, c: { outline: [[0, 0], [1, 0], [1, 1]] } }
joints:
  j0: { bodies: [base, b], axis: [[0, 0], [0, 1]], cubic_stiffness: 2*k3, friction: { torque: 1e-3*k3, speed: 2 deg/s },
        hinge: { model: beam, material: film, length: 1 mm, width: 20 mm, gaps: 2 mm } }
  j1: { bodies: [b, c], axis: [[0, 0], [0, 1]],
        hinge: { model: sharifzadeh2018, length: 1 mm, width: 50 mm, area: 50 cm^2, coefficients: printed } }
air: { density: 1.2, drag: cd }
";
    let read = |text: String| parse(&SourceFile { path: "m.yaml".into(), text }).unwrap().0;
    let once = to_yaml(&read(text.into()));
    assert_eq!(once, to_yaml(&read(once.clone())));
    for part in ["cubic_stiffness: \"", "speed: 0.03490", "gaps: 0.002", "area: 0.005", "printed"] {
        assert!(once.contains(part), "{part} is lost:\n{once}");
    }
}

/// q'' = -(k/I) q - (k3/I) q^3 has the period 4 K(m) / w, w^2 = (k + k3 A^2) / I,
/// m = k3 A^2 / (2 I w^2) (G. Duffing); K by the arithmetic-geometric mean (Gauss).
#[test]
fn a_cubic_spring_has_the_exact_period() {
    for (k, k3) in [(0.0, 5e-4), (2e-4, 5e-4), (4e-4, -1e-4)] {
        let compiled = plate(&format!("stiffness: {k}, cubic_stiffness: {k3}, rest: 0.1"), "");
        let (i, amplitude) = (inertia(&compiled), 0.9);
        let square = (k + k3 * amplitude * amplitude) / i;
        let m = k3 * amplitude * amplitude / (2.0 * i * square);
        let (mut a, mut b) = (1.0, f64::sqrt(1.0 - m));
        for _ in 0..8 {
            (a, b) = ((a + b) / 2.0, f64::sqrt(a * b));
        }
        let period = 2.0 * std::f64::consts::PI / (a * square.sqrt());
        let [q, u] = swing(&compiled, [0.1 + amplitude, 0.0], &[period])[0];
        assert!((q - 0.1 - amplitude).abs() < 1e-8, "{q}");
        assert!(u.abs() < 1e-8 * square.sqrt(), "{u}");
    }
}

#[test]
fn a_cubic_spring_stores_what_it_gives_back() {
    let (k, k3, rest) = (2e-4, 5e-4, 0.1);
    let compiled = plate(&format!("stiffness: {k}, cubic_stiffness: {k3}, rest: {rest}"), "");
    let system = Interpreter::new(&compiled.program);
    let bend: f64 = 0.8 - rest;
    let stored = system.energy(0.0, &vec![0.8], &vec![0.0]).unwrap().potential;
    assert!((stored - (k * bend * bend / 2.0 + k3 * bend.powi(4) / 4.0)).abs() < 1e-16);
    let total = |[q, u]: [f64; 2]| {
        let energy = system.energy(0.0, &vec![q], &vec![u]).unwrap();
        energy.kinetic + energy.potential
    };
    for state in swing(&compiled, [0.8, 0.0], &[0.05, 0.1, 0.2, 0.4]) {
        assert!((total(state) / stored - 1.0).abs() < 1e-9, "{state:?}");
    }
}

/// I u' = -T tanh(u/s) has the solution sinh(u/s) = sinh(u0/s) exp(-T t / (I s)).
#[test]
fn dry_friction_stops_a_hinge_as_it_should() {
    let (torque, speed, start) = (1e-5, 0.5, 4.0);
    let law = format!("friction: {{ torque: {torque}, speed: {speed} }}");
    let compiled = plate(&law, "");
    let stop = start * inertia(&compiled) / torque;
    let times: Vec<f64> = [0.2, 0.6, 0.9, 1.0, 1.1, 1.5].map(|share| share * stop).to_vec();
    for (state, t) in swing(&compiled, [0.0, start], &times).iter().zip(&times) {
        let decay = f64::exp(-torque * t / (inertia(&compiled) * speed));
        let exact = speed * f64::asinh(f64::sinh(start / speed) * decay);
        assert!((state[1] - exact).abs() < 1e-9 * start, "{} is not {exact}", state[1]);
    }
}

/// A plate that turns about its edge is held back by c u^2, c = density drag width length^4 / 8:
/// free, u = u0 / (1 + c u0 t / I); driven by a torque T, u = U tanh(t T / (I U)), U^2 = T / c.
#[test]
fn air_slows_a_plate_as_it_should() {
    let air = "air: { density: 1.2, drag: 1.5 }";
    let c = 1.2 * 1.5 * 0.02 * 0.04_f64.powi(4) / 8.0;
    let free = plate("damping: 0", air);
    let i = inertia(&free);
    let times = [0.1, 0.5, 2.0];
    for start in [30.0, -30.0_f64] {
        for (state, t) in swing(&free, [0.0, start], &times).iter().zip(times) {
            let exact = start / (1.0 + c * start.abs() * t / i);
            // The area is a union of outlines on a grid of 1e-9.
            assert!((state[1] / exact - 1.0).abs() < 1e-8, "{} is not {exact}", state[1]);
        }
    }
    let torque = 1e-6;
    let terminal = f64::sqrt(torque / c);
    let driven = plate(&format!("torque: {torque}"), air);
    let end = 8.0 * i * terminal / torque;
    let times = [0.2 * end, 0.5 * end, end];
    for (state, t) in swing(&driven, [0.0, 0.0], &times).iter().zip(times) {
        let exact = terminal * f64::tanh(t * torque / (i * terminal));
        assert!((state[1] / exact - 1.0).abs() < 1e-8, "{} is not {exact}", state[1]);
    }
}

/// A linkage of which every hinge has a cubic spring and dry friction, in thick air.
fn everything(linkage: &linkages::Linkage) -> Compiled {
    let text = linkage.text(5).replace(
        "damping:",
        "cubic_stiffness: 2e-5, friction: { torque: 1e-6, speed: 0.7 }, damping:",
    );
    let compiled = compile_text(&format!("{text}air: {{ density: 1.2, drag: 3 }}\n"));
    assert!(compiled.topology.mechanism.joints.iter().all(|joint| joint.friction.is_some()));
    assert!(compiled.topology.mechanism.bodies.iter().any(|body| !body.surface.is_empty()));
    compiled
}

/// What drives a mechanism loses what dampers, friction and air take; hinges pass on the moments of
/// their laws; derivatives are those of differences.
#[test]
fn every_function_of_a_program_has_the_same_laws() {
    for linkage in [linkages::planar_four_bar(), linkages::spatial_seven_bar()] {
        let compiled = everything(&linkage);
        let mechanism = &compiled.topology.mechanism;
        let system = Interpreter::new(&compiled.program);
        let n = linkage.hinges.len();
        let mut random = Random::new(4);
        let mut workspace = system.workspace();
        let mut tried = 0;
        while tried < 4 {
            let mut q: Vec<f64> =
                linkage.folded.iter().map(|q| q + random.range(-0.5, 0.5)).collect();
            let mut u: Vec<f64> = (0..n).map(|_| random.range(-2.0, 2.0)).collect();
            if assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace).is_err() {
                continue;
            }
            tried += 1;
            project(&system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
            // Reactions about the hinge lines.
            let d = system.dimensions();
            let (mut a, mut lambda) = (vec![0.0; n], vec![0.0; d.rows + d.drives]);
            acceleration_and_forces(&system, 0.0, &q, &u, &mut workspace, &mut a, &mut lambda)
                .unwrap();
            let mut reactions = vec![0.0; 6 * n];
            let multipliers = &lambda[..d.rows];
            let at = Balance { t: 0.0, q: &q, u: &u, acceleration: &a, multipliers };
            system.write_reactions(at, &mut reactions).unwrap();
            let about: Vec<f64> = reactions.chunks(6).map(|reaction| reaction[3]).collect();
            let law = |j: usize| {
                let joint = &mechanism.joints[j];
                let constant = |x: &lamc::source::Expression| x.constant().unwrap();
                let bend = q[j] - constant(&joint.rest);
                -constant(&joint.stiffness) * bend
                    - 2e-5 * bend.powi(3)
                    - constant(&joint.damping) * u[j]
                    - 1e-6 * f64::tanh(u[j] / 0.7)
            };
            let laws: Vec<f64> = (0..n).map(law).collect();
            let error = relative_error(&about, &laws);
            assert!(error < 1e-9, "{}: reactions {error:e}", linkage.name);
            // da/du along a speed the closure allows.
            let mut direction: Vec<f64> = (0..n).map(|_| random.range(-1.0, 1.0)).collect();
            project(&system, 0.0, &mut q, &mut direction, &mut workspace).unwrap();
            let (mut dq, mut du, mut dt) = (vec![0.0; n * n], vec![0.0; n * n], vec![0.0; n]);
            let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
            jacobian(&system, 0.0, &q, &u, &mut workspace, out).unwrap();
            let own: Vec<f64> = du
                .chunks(n)
                .map(|row| row.iter().zip(&direction).map(|(a, d)| a * d).sum())
                .collect();
            let mut at = |h: f64| {
                let u: Vec<f64> = u.iter().zip(&direction).map(|(u, d)| u + h * d).collect();
                let mut out = vec![0.0; n];
                acceleration(&system, 0.0, &q, &u, &mut workspace, &mut out).unwrap();
                out
            };
            let h = 1e-4;
            let [b, c, d, e] = [-2.0, -1.0, 1.0, 2.0].map(|k| at(k * h));
            let expected: Vec<f64> =
                (0..n).map(|i| (b[i] - 8.0 * c[i] + 8.0 * d[i] - e[i]) / (12.0 * h)).collect();
            let error = relative_error(&own, &expected);
            assert!(error < 1e-6, "{}: derivatives {error:e}", linkage.name);
        }
    }
}

/// Energy of a four-bar is lost by the work of dampers, friction and the air alone. The air's power
/// is that of a fine grid of points on every plate, moved by finite differences of poses.
#[test]
fn losses_are_what_energy_lacks() {
    let linkage = linkages::planar_four_bar();
    let compiled = everything(&linkage);
    let mechanism = &compiled.topology.mechanism;
    let system = Interpreter::new(&compiled.program);
    let n = linkage.hinges.len();
    // Away from the flat state, where the loop is loose.
    let mut state = State { t: 0.0, q: vec![0.5; n], u: vec![3.0; n] };
    let mut workspace = system.workspace();
    let mut pinned = vec![false; n];
    pinned[0] = true;
    assemble(&system, 0.0, &mut state.q, &pinned, &mut workspace).unwrap();
    project(&system, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
    let poses = |q: &Vec<f64>| system.poses(q).unwrap().into_flattened();
    let power = |state: &State<Vec<f64>, f64>| {
        let joints = mechanism.joints.iter().zip(&state.u).map(|(joint, u)| {
            joint.damping.constant().unwrap() * u * u + 1e-6 * u * f64::tanh(u / 0.7)
        });
        let h = 1e-6;
        let moved = |h: f64| -> Vec<f64> {
            poses(&state.q.iter().zip(&state.u).map(|(q, u)| q + h * u).collect::<Vec<_>>())
        };
        let (now, before, after) = (poses(&state.q), moved(-h), moved(h));
        let mut air = 0.0;
        for (b, body) in mechanism.bodies.iter().enumerate() {
            for point in &body.surface {
                let at = |pose: &[f64], i: usize| {
                    (0..3).map(|k| pose[12 * b + 3 * i + k] * point.at[k]).sum::<f64>()
                        + pose[12 * b + 9 + i]
                };
                let speed: f64 = (0..3)
                    .map(|i| (at(&after, i) - at(&before, i)) / (2.0 * h) * now[12 * b + 3 * i + 2])
                    .sum();
                air += 0.5 * 1.2 * 3.0 * point.area * speed.abs().powi(3);
            }
        }
        joints.sum::<f64>() + air
    };
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        energy.kinetic + energy.potential
    };
    let (before, mut lost) = (total(&state), 0.0);
    let mut integrator = dopri5(&system, 1e-11);
    let step = 2e-4;
    for k in 0..500 {
        // Simpson's rule over two samples.
        let start = power(&state);
        integrator.run(&system, &mut state, step * (2 * k + 1) as f64, |_| ()).unwrap();
        let middle = power(&state);
        integrator.run(&system, &mut state, step * (2 * k + 2) as f64, |_| ()).unwrap();
        lost += step / 3.0 * (start + 4.0 * middle + power(&state));
    }
    let gone = before - total(&state);
    println!("lost {lost:e} J of {gone:e} J that are gone");
    assert!(relative_error(&[gone], &[lost]) < 1e-6);
}

#[test]
fn a_motion_that_leaves_the_linear_range_is_noticed() {
    let compiled = plate(
        "hinge: { model: beam, material: polyester, length: 1 mm, width: 20 mm }, rest: 0.1",
        "",
    );
    let allowed = 2.0 * 42.84 / 4383.27 / 0.127;
    let motion =
        [(0.0, [0.1]), (0.1, [0.1 + 1.5 * allowed]), (0.2, [0.1 - 2.0 * allowed]), (0.3, [0.1])];
    let found = excursions(
        &compiled.topology.mechanism,
        &[],
        &[],
        motion.iter().map(|(t, q)| (*t, q.as_slice())),
    );
    let [Excursion { joint, since, worst, ratio, .. }] = found.as_slice() else {
        panic!("{found:?}")
    };
    assert_eq!((joint.as_str(), *since, *worst), ("hinge", 0.1, 0.2));
    assert!((ratio - 2.0).abs() < 1e-12);
    assert!(
        found[0].to_string().contains("`hinge` leaves its linear range of 8.82 deg at t = 0.100 s")
    );
}

#[test]
fn a_negative_friction_is_refused() {
    let text = "
bodies: { base: { fixed: true }, b: { mass: 1, com: [1, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] } }
joints: { j: { bodies: [base, b], axis: [[0, 0], [0, 1]], friction: { torque: 1, speed: -1 } } }
";
    let error = compile(&SourceFile { path: "m.yaml".into(), text: text.into() }).unwrap_err();
    assert!(error.to_string().contains("speed of the friction"), "{error}");
}
