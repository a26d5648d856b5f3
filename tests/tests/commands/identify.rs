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
