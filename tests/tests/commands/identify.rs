//! Round trips: a fit recovers the parameters with which a motion was simulated; with noise, to within the
//! standard errors.

use lamc::pipeline;
use lamc_runtime::{Integrator, Mechanism, State, assemble, project};
use lamc_tests::compare::largest;
use lamc_tests::{compile_text, dopri5, workspace};
use lamc_workbench::execution::Jit;
use lamc_workbench::identify::swing::Swing;
use lamc_workbench::identify::{Estimate, Fit, Problem, Record};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal};

/// Of the cameras of DETC2018-86359, Hz.
const RATE: f64 = 360.0;

/// A plate of 30 g and 100 mm that hangs on its edge.
const SWING: Swing = Swing { inertia: 2.5e-5, mass: 0.03, arm: 0.05, gravity: 9.81 };
const STIFFNESS: f64 = 0.0076;
const DAMPING: f64 = 2.5e-5;

/// The exact motion of a system from a state, at the cameras' rate.
fn motion(system: &Jit, q: &[f64], u: &[f64], seconds: f64) -> Record {
    let mut state = State { t: 0.0, q: q.to_vec(), u: u.to_vec() };
    let mut record = Record { t: vec![0.0], q: vec![q.to_vec()] };
    let mut integrator = dopri5(system, 1e-12);
    for sample in 1..=(seconds * RATE) as u32 {
        let t = f64::from(sample) / RATE;
        integrator.run(system, &mut state, t, |_| ()).unwrap();
        record.t.push(t);
        record.q.push(state.q.clone());
    }
    record
}

fn noisy(record: &Record, degrees: f64, seed: u64) -> Record {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let normal = Normal::new(0.0, degrees.to_radians()).unwrap();
    let mut record = record.clone();
    record.q.iter_mut().flatten().for_each(|q| *q += normal.sample(&mut random));
    record
}

fn swing() -> (Jit, Record) {
    let system = Jit::new(&pipeline::compile(&SWING.model()).unwrap().program);
    let mut exact = system.clone();
    exact.set_parameter("k", STIFFNESS).unwrap();
    exact.set_parameter("b", DAMPING).unwrap();
    let record = motion(&exact, &[0.7], &[0.0], 1.0);
    (system, record)
}

#[test]
fn a_swing_without_noise_gives_its_hinge_back() {
    let (system, record) = swing();
    let fit = SWING.by_trajectory(&system, &record).unwrap();
    for (estimate, exact) in fit.estimates.iter().zip([STIFFNESS, DAMPING]) {
        let error = estimate.value / exact - 1.0;
        println!("{}: {error:e}", estimate.name);
        assert!(error.abs() < 1e-6, "{estimate:?}");
    }
    let (t, theta) = record.seen(0);
    let (paper, series) = SWING.by_derivatives(&t, &theta).unwrap();
    let errors = [paper[0].value / STIFFNESS - 1.0, paper[1].value / DAMPING - 1.0];
    println!("by derivatives: order {}, k {:e}, b {:e}", series.order(), errors[0], errors[1]);
    assert!(errors[0].abs() < 1e-3 && errors[1].abs() < 1e-2, "{errors:?}");
}

/// In how many of a hundred runs both estimates are within three standard errors.
fn hits(degrees: f64) -> u32 {
    let (system, record) = swing();
    let exact = [STIFFNESS, DAMPING];
    let (mut hits, mut ours, mut papers) = (0, [0.0; 2], [0.0; 2]);
    for seed in 0..100 {
        let record = noisy(&record, degrees, seed);
        let fit = SWING.by_trajectory(&system, &record).unwrap();
        let near = |(estimate, exact): (&Estimate, &f64)| {
            (estimate.value - exact).abs() <= 3.0 * estimate.standard_error
        };
        hits += u32::from(fit.estimates.iter().zip(&exact).all(near));
        let (t, theta) = record.seen(0);
        let (paper, _) = SWING.by_derivatives(&t, &theta).unwrap();
        for k in 0..2 {
            ours[k] += (fit.estimates[k].value / exact[k] - 1.0).powi(2) / 100.0;
            papers[k] += (paper[k].value / exact[k] - 1.0).powi(2) / 100.0;
        }
    }
    let [ours, papers] = [ours, papers].map(|squares| squares.map(|x| 100.0 * x.sqrt()));
    println!("noise of {degrees} deg: {hits} of 100 within three standard errors");
    println!("  relative error k, b: trajectory {ours:.3?} %, derivatives {papers:.3?} %");
    assert!(ours[0] < papers[0] && ours[1] < papers[1], "the paper's way is the better one");
    hits
}

#[test]
fn standard_errors_hold_at_a_tenth_of_a_degree() {
    assert!(hits(0.1) >= 95);
}

#[test]
fn standard_errors_hold_at_a_degree() {
    assert!(hits(1.0) >= 95);
}

/// The paper's six-bar, every stiffness an unknown.
fn six_bar() -> (Jit, Vec<usize>) {
    let path = workspace().join("examples/sixbar.yaml");
    let text = std::fs::read_to_string(&path).unwrap();
    let system = Jit::new(&compile_text(&format!("{text}tunable: [stiffness, damping]\n")).program);
    let parameters = system.interface().parameters.iter().enumerate();
    let stiffnesses = parameters.filter(|(_, p)| p.name.starts_with("stiffness_"));
    let free = stiffnesses.map(|(index, _)| index).collect();
    (system, free)
}

#[test]
fn a_six_bar_gives_all_its_stiffnesses_back() {
    let (system, free) = six_bar();
    let names: Vec<String> =
        free.iter().map(|&k| system.interface().parameters[k].name.clone()).collect();
    let exact: Vec<f64> = (0..6).map(|k| 0.0114 * (0.8 + 0.08 * f64::from(k))).collect();
    let mut simulated = system.clone();
    for (name, value) in names.iter().zip(&exact) {
        simulated.set_parameter(name, *value).unwrap();
    }
    let mut state = simulated.initial();
    let mut workspace = simulated.workspace();
    let pinned: Vec<bool> = (0..6).map(|joint| simulated.is_pinned(joint)).collect();
    assemble(&simulated, 0.0, &mut state.q, &pinned, &mut workspace).unwrap();
    project(&simulated, 0.0, &mut state.q, &mut state.u, &mut workspace).unwrap();
    let record = motion(&simulated, &state.q, &state.u, 1.0);
    let worst = |fit: &Fit| {
        largest(fit.estimates.iter().zip(&exact).map(|(e, exact)| e.value / exact - 1.0))
    };
    let fit = |record: &Record| {
        let (system, free) = (system.clone(), free.clone());
        Problem { system, record, free, from_rest: false, tolerance: 1e-8 }.solve().unwrap()
    };
    let clean = fit(&record);
    println!("without noise: {:e} after {} motions", worst(&clean), clean.evaluations);
    assert!(worst(&clean) < 1e-6);
    for seed in 0..2 {
        let fit = fit(&noisy(&record, 0.1, seed));
        println!("0.1 degree, seed {seed}: {:e}", worst(&fit));
        assert!(worst(&fit) < 0.02);
        for (estimate, exact) in fit.estimates.iter().zip(&exact) {
            let off = (estimate.value - exact).abs() / estimate.standard_error;
            assert!(off < 4.0, "{off} standard errors: {estimate:?}");
        }
    }
}

/// Two plates with a hinge that tumble as they fall. Their first guess of the hinge is wrong.
const PLATES: &str = "
name: plates
units: { length: mm }
gravity: [0, 0, -9.81]
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
parameters: { k: 2e-4, b: 2e-7 }
bodies:
  hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  wing: { outline: [[40, 0], [80, 0], [80, 30], [40, 20]] }
joints:
  hinge: { bodies: [hull, wing], axis: [[40, 0], [40, 20]], stiffness: k, damping: b, rest: 0.6 }
initial:
  bodies:
    hull: { position: [0, 0, 500], turn: [0, 30 deg, 0], velocity: [1, 0, 0], angular_velocity: [3, -5, 10] }
";

/// The record without some coordinates.
fn without(record: &Record, coordinates: std::ops::Range<usize>) -> Record {
    let mut record = record.clone();
    record.q.iter_mut().for_each(|q| q[coordinates.clone()].fill(f64::NAN));
    record
}

#[test]
fn tumbling_plates_give_their_hinge_back() {
    let exact = [1e-4, 1e-7];
    let system = Jit::new(&compile_text(PLATES).program);
    let mut simulated = system.clone();
    simulated.set_parameter("k", exact[0]).unwrap();
    simulated.set_parameter("b", exact[1]).unwrap();
    let State { q, u, .. } = simulated.initial();
    let record = motion(&simulated, &q, &u, 0.3);
    // What of the hull is recorded, and which of its speeds the model tells.
    for (record, kept) in [
        (record.clone(), vec![]),
        (without(&record, 1..4), vec![1, 2, 3]),
        (without(&record, 4..8), vec![4, 5, 6]),
        (without(&record, 1..8), vec![1, 2, 3, 4, 5, 6]),
        (without(&record, 0..1), vec![]),
    ] {
        let system = system.clone();
        let problem = Problem {
            system,
            record: &record,
            free: vec![0, 1],
            from_rest: false,
            tolerance: 1e-9,
        };
        let fit = problem.solve().unwrap();
        let errors = fit.estimates.iter().zip(exact).map(|(e, exact)| e.value / exact - 1.0);
        let worst = largest(errors);
        println!("{kept:?} kept: {worst:e}, {:e} rad after {}", fit.rms, fit.evaluations);
        assert!(worst < 1e-6, "{kept:?}: {worst:e}");
        assert_eq!(fit.kept, kept);
        assert!(largest(fit.u.iter().zip(&u).map(|(found, given)| found - given)) < 1e-5);
    }
}

/// A plate that spins about its normal falls as a point does: the motion in closed form.
#[test]
fn a_falling_plate_gives_gravity_and_its_speeds() {
    let text = "
name: plate
units: { length: mm }
gravity: [0, 0, -g]
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
parameters: { g: 5 }
bodies: { hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] } }
";
    let system = Jit::new(&compile_text(text).program);
    let ([vx, vz, spin], g) = ([0.3, 2.0, -7.0], 9.81);
    let t: Vec<f64> = (0..100).map(|k| f64::from(k) / RATE).collect();
    let at = |t: &f64| {
        let half = 0.4 + spin * t / 2.0;
        // The sign of a measured quaternion is arbitrary.
        let sign = if *t > 0.1 { -1.0 } else { 1.0 };
        let (sine, cosine) = (sign * half.sin(), sign * half.cos());
        vec![0.1 + vx * t, 0.0, vz * t - g * t * t / 2.0, cosine, 0.0, 0.0, sine]
    };
    let record = Record { q: t.iter().map(at).collect(), t };
    let problem =
        Problem { system, record: &record, free: vec![0], from_rest: false, tolerance: 1e-9 };
    let fit = problem.solve().unwrap();
    assert!((fit.estimates[0].value / g - 1.0).abs() < 1e-9, "{:?}", fit.estimates);
    let speeds = [vx, 0.0, vz, 0.0, 0.0, spin];
    let off = largest(fit.u.iter().zip(speeds).map(|(found, exact)| found - exact));
    assert!(off < 1e-8 && fit.rms < 1e-9, "{off:e} {:e}", fit.rms);
}
