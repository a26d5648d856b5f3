//! Assembly from rough guesses: a thousand for each example and each published design, every joint
//! normally distributed with 0.5 rad.

use std::f64::consts::TAU;
use std::path::Path;

use lamc::program::Interpreter;
use lamc_runtime::{Error, System, assemble};
use lamc_tests::random::Random;
use lamc_tests::{DESIGNS, EXAMPLES, compile, compile_text, shared, workspace};

const GUESSES: usize = 1000;

/// By G. E. P. Box and M. E. Muller.
fn normal(random: &mut Random) -> f64 {
    let radius = (-2.0 * random.range(f64::MIN_POSITIVE, 1.0).ln()).sqrt();
    radius * (TAU * random.range(0.0, 1.0)).cos()
}

fn check(name: &str, path: &Path) {
    let compiled = compile(path);
    let system = Interpreter::new(&compiled.program);
    let n = system.dimensions().coordinates;
    let rows = 9 * system.dimensions().loops;
    let mut random = Random::new(2026);
    let mut workspace = system.workspace();
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * n]);
    let (mut closed, mut signs) = (0, 0);
    for _ in 0..GUESSES {
        let guess: Vec<f64> = (0..n).map(|_| 0.5 * normal(&mut random)).collect();
        let mut q = guess.clone();
        if assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace).is_err() {
            continue;
        }
        system.write_closure(&q, &mut residual, &mut jacobian);
        let open = residual.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let inside = q.iter().enumerate().all(|(joint, &q)| {
            let [least, greatest] = system.limits(joint);
            q >= least && q <= greatest && q.abs() <= TAU / 2.0
        });
        closed += usize::from(open < 1e-12 * system.size() && inside);
        signs += usize::from(guess.iter().zip(&q).all(|(guess, q)| guess * q > 0.0));
    }
    println!("{name}: {closed} of {GUESSES} closed within the limits, {signs} with all signs kept");
    assert!(closed * 100 >= GUESSES * 99, "{name}: {closed} of {GUESSES}");
}

#[test]
fn of_the_examples() {
    for name in EXAMPLES {
        check(name, &workspace().join(format!("examples/{name}.yaml")));
    }
}

#[test]
fn of_the_published_designs() {
    let Some(shared) = shared() else { return };
    for name in DESIGNS {
        check(name, &shared.join(format!("designs/{name}.cad.joints")));
    }
}

/// A four-bar of unequal lengths whose limits leave no room: the loop, how far it stays open, and
/// a joint that ran into its limit.
#[test]
fn failure_names_loop_residual_and_joint() {
    let bar = |name: &str, x: f64| {
        format!(
            "  {name}: {{ mass: 1 g, com: [{x}, 0.01, 0], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }}\n"
        )
    };
    let text = format!(
        "bodies:\n  base: {{ fixed: true }}\n{}{}{}joints:
  j0: {{ bodies: [base, crank], axis: [[0, 0], [0, 0.1]], limits: [0.5, 1] }}
  j1: {{ bodies: [crank, coupler], axis: [[0.1, 0], [0.1, 0.1]], limits: [-0.1, 0.1] }}
  j2: {{ bodies: [coupler, rocker], axis: [[0.4, 0], [0.4, 0.1]], limits: [-0.1, 0.1] }}
  j3: {{ bodies: [rocker, base], axis: [[0.05, 0], [0.05, 0.1]], limits: [-0.1, 0.1] }}
",
        bar("crank", 0.05),
        bar("coupler", 0.2),
        bar("rocker", 0.3)
    );
    let compiled = compile_text(&text);
    let system = Interpreter::new(&compiled.program);
    let mut q = vec![0.7, 0.0, 0.0, 0.0];
    let error =
        assemble(&system, 0.0, &mut q, &[true, false, false, false], &mut system.workspace());
    let Err(Error::NotClosed { loop_index: 0, residual, joint: Some(_) }) = error else {
        panic!("{error:?}");
    };
    assert!(residual > 1e-3, "{residual:e}");
    assert_eq!(q, [0.7, 0.0, 0.0, 0.0], "a failure leaves the guess");
}
