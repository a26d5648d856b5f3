//! Undamped mechanisms whose springs carry them through the flat, singular state a hundred times: they
//! keep their energy and their branch with every integrator.

use lamc::program::Interpreter;
use lamc_runtime::{Error, Integrator, Mechanism, Rk4, Rodas, State, assemble, project};
use lamc_tests::compare::keep_largest;
use lamc_tests::linkages::{self, Linkage};
use lamc_tests::{compile_text, dopri5};

/// Passages of the flat state.
const PASSAGES: usize = 100;
/// By how much energy may change, of what there is.
const LOST: f64 = 1e-6;
/// Later than any of these motions takes, s.
const END: f64 = 1e3;
/// The first angle at which the branch is looked at, rad.
const CLEAR: f64 = 0.02;

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

type Motion = State<Vec<f64>, f64>;

/// A closed state at rest, folded.
fn folded(linkage: &Linkage, system: &Interpreter) -> Motion {
    let n = linkage.hinges.len();
    let mut start = State { t: 0.0, q: linkage.folded.clone(), u: vec![0.0; n] };
    if start.q.iter().all(|q| *q == 0.0) {
        start.q[0] = 0.4;
    }
    let mut pinned = vec![false; n];
    pinned[0] = true;
    let mut workspace = system.workspace();
    assemble(system, 0.0, &mut start.q, &pinned, &mut workspace).unwrap();
    project(system, 0.0, &mut start.q, &mut start.u, &mut workspace).unwrap();
    start
}

/// Which way each joint turns beside the first, if at all: what tells the branches of these linkages
/// apart.
fn branch(state: &Motion) -> Option<Vec<i8>> {
    let first = state.q[0];
    let way = |q: &f64| if q.abs() < 0.1 * CLEAR { 0 } else { (q * first).signum() as i8 };
    (first.abs() > CLEAR).then(|| state.q.iter().map(way).collect())
}

/// Takes steps until the flat state has been passed often enough.
fn check(
    name: &str,
    system: &Interpreter,
    start: &Motion,
    mut step: impl FnMut(&mut Motion) -> Result<(), Error>,
) {
    let total = |state: &Motion| {
        let energy = system.energy(state.t, &state.q, &state.u).unwrap();
        energy.kinetic + energy.potential
    };
    let begin = total(start);
    let mut state = start.clone();
    let (mut passed, mut steps, mut lost) = (0, 0, 0.0_f64);
    let mut side = start.q[0] > 0.0;
    let expected = branch(start).expect("the start is folded");
    while passed < PASSAGES {
        step(&mut state).unwrap_or_else(|error| panic!("{name}: {error} at {state:?}"));
        steps += 1;
        assert!(steps < 1_000_000, "{name}: only {passed} passages");
        let change = (total(&state) - begin).abs() / begin;
        assert!(change <= LOST, "{name}: energy changed by {change:e} within {passed} passages");
        lost = keep_largest(lost, change);
        passed += usize::from((state.q[0] > 0.0) != side);
        side = state.q[0] > 0.0;
        if let Some(found) = branch(&state) {
            assert_eq!(found, expected, "{name}: another branch after {passed} passages");
        }
    }
    println!("{name}: {passed} passages in {:.2} s, {steps} steps, energy {lost:e}", state.t);
}

/// Every integrator through the flat state of a linkage.
fn pass(linkage: &Linkage) {
    let system = springy(linkage);
    let start = folded(linkage, &system);
    let name = linkage.name;
    let mut fixed = Rk4::new(&system);
    check(&format!("{name} fixed"), &system, &start, |state| fixed.step(&system, state, 2e-4));
    let mut explicit = dopri5(&system, 1e-10);
    check(&format!("{name} explicit"), &system, &start, |state| explicit.step(&system, state, END));
    let mut implicit = Rodas::new(&system);
    (implicit.relative, implicit.absolute) = (1e-7, 1e-7);
    check(&format!("{name} implicit"), &system, &start, |state| implicit.step(&system, state, END));
}

#[test]
fn a_vertex_passes_on_its_branch_with_its_energy() {
    pass(&linkages::spherical("four_creases", &[0.0, 60.0, 180.0, 300.0]));
}

#[test]
fn a_four_bar_passes_on_its_branch_with_its_energy() {
    pass(&linkages::planar_four_bar());
}

#[test]
fn a_sheet_passes_on_its_branch_with_its_energy() {
    pass(&linkages::miura(3));
}
