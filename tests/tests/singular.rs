//! Undamped mechanisms whose springs carry them through the flat, singular state: nothing is lost
//! on the way, whichever branch they leave by.

use lamc::program::Interpreter;
use lamc_runtime::{Integrator, Rodas, State, System, assemble, project};
use lamc_tests::linkages::{self, Linkage};
use lamc_tests::{compile_text, dopri5};

/// The linkage with springs that rest at the flat state, without dampers and gravity.
fn springy(linkage: &Linkage) -> Interpreter {
    let mut text = String::new();
    for line in linkage.text(6).lines() {
        if line.starts_with("gravity") {
            text.push_str("gravity: [0, 0, 0]\n");
            continue;
        }
        let line = match line.find(", stiffness:") {
            Some(at) => format!("{}, stiffness: 1e-4 }}", &line[..at]),
            None => line.to_owned(),
        };
        text.push_str(&line);
        text.push('\n');
    }
    Interpreter::new(&compile_text(&text).program)
}

fn check<I: Integrator<Interpreter>>(
    name: &str,
    system: &Interpreter,
    start: &State<Vec<f64>, f64>,
    integrator: &mut I,
    tolerance: f64,
) {
    let total = |state: &State<Vec<f64>, f64>| {
        let energy = system.energy(state.t, &state.q, &state.u);
        energy.kinetic + energy.potential
    };
    let begin = total(start);
    let mut state = start.clone();
    let (mut worst, mut flattest, mut passes, mut steps) = (0.0_f64, f64::INFINITY, 0, 0);
    let mut side = start.q[0] > 0.0;
    integrator
        .run(system, &mut state, 1.0, |state| {
            worst = worst.max((total(state) - begin).abs() / begin);
            flattest = flattest.min(state.q.iter().fold(0.0, |most, q| q.abs().max(most)));
            passes += usize::from((state.q[0] > 0.0) != side);
            side = state.q[0] > 0.0;
            steps += 1;
        })
        .unwrap();
    println!("{name}: {steps} steps, {passes} passes within {flattest:e} rad, energy {worst:e}");
    assert!(passes >= 2 && flattest < 0.1, "{name} did not pass the flat state");
    assert!(worst < tolerance, "{name}: energy changed by {worst:e}");
}

#[test]
fn energy_is_kept_through_singular_states() {
    let linkages = [
        linkages::spherical("four_creases", &[0.0, 60.0, 180.0, 300.0]),
        linkages::planar_four_bar(),
        linkages::miura(3),
    ];
    for linkage in linkages {
        let system = springy(&linkage);
        let n = linkage.hinges.len();
        let mut start = State { t: 0.0, q: linkage.folded.clone(), u: vec![0.0; n] };
        if start.q.iter().all(|q| *q == 0.0) {
            start.q[0] = 0.4;
        }
        let mut pinned = vec![false; n];
        pinned[0] = true;
        let mut workspace = system.workspace();
        assemble(&system, 0.0, &mut start.q, &pinned, &mut workspace).unwrap();
        project(&system, 0.0, &mut start.q, &mut start.u, &mut workspace).unwrap();
        let mut integrator = dopri5(&system, 1e-10);
        check(&format!("{} explicit", linkage.name), &system, &start, &mut integrator, 1e-6);
        let mut rodas = Rodas::new(&system);
        (rodas.relative, rodas.absolute) = (1e-9, 1e-9);
        check(&format!("{} implicit", linkage.name), &system, &start, &mut rodas, 1e-5);
    }
}
