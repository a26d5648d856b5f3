//! States of rest against the potential energy and its finite differences, which do not use the forces of a program.

use lamc::program::Interpreter;
use lamc_runtime::{Mechanism, assemble, equilibrium, project};
use lamc_tests::random::Random;
use lamc_tests::sheets::{miura, yoshimura};
use lamc_tests::{EXAMPLES, compile, compile_text, designs, largest, linkages, workspace};
use nalgebra::{DMatrix, DVector};

/// Orthonormal directions along the closure: the null space of all nine rows per loop.
fn along_closure(system: &Interpreter, q: &[f64]) -> DMatrix<f64> {
    let n = q.len();
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * n]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    if rows == 0 {
        return DMatrix::identity(n, n);
    }
    // Not by J^T J: near a singular state its square loses the direction that fades.
    let factors = DMatrix::from_row_slice(rows, n, &jacobian).transpose().col_piv_qr();
    let r = factors.r();
    let rank = (0..n).take_while(|&i| r[(i, i)].abs() > 1e-9 * r[(0, 0)].abs()).count();
    factors.q().columns(rank, n - rank).into_owned()
}

fn potential(system: &Interpreter, q: &[f64]) -> f64 {
    system.energy(0.0, &q.to_vec(), &vec![0.0; q.len()]).unwrap().potential
}

/// dV/dq by fourth-order central differences, N m.
fn gradient(system: &Interpreter, q: &[f64]) -> DVector<f64> {
    let h = 1e-4;
    DVector::from_fn(q.len(), |joint, _| {
        let at = |k: f64| {
            let mut q = q.to_vec();
            q[joint] += k * h;
            potential(system, &q)
        };
        (at(-2.0) - 8.0 * at(-1.0) + 8.0 * at(1.0) - at(2.0)) / (12.0 * h)
    })
}

/// Checks a state of rest; whether it is stable.
fn check(name: &str, system: &Interpreter, q: &mut Vec<f64>) -> bool {
    let found = equilibrium(system, 0.0, q, &mut system.workspace())
        .unwrap_or_else(|error| panic!("{name}: {error}"));
    assert!(found.force <= 1e-9, "{name}: {found:?}");
    let rows = 9 * system.dimensions().loops;
    let (mut residual, mut jacobian) = (vec![0.0; rows], vec![0.0; rows * q.len()]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    let open = largest(&residual);
    assert!(open <= 1e-12 * system.size(), "{name}: open by {open:e} m");
    let directions = along_closure(system, q);
    let slope = gradient(system, q);
    let force = largest(&(directions.transpose() * &slope));
    // Differences of V cost digits: what is left of 1e-16 of V over the step.
    let rounding = 4e-15 * potential(system, q).abs().max(largest(&slope)) / 1e-4;
    assert!(force <= 1e-9 + rounding, "{name}: dV along the closure {force:e} N m");
    found.stable
}

/// V grows wherever a stable state is pushed along the closure, and falls somewhere otherwise.
fn check_stability(name: &str, system: &Interpreter, q: &[f64], stable: bool, reach: f64) {
    let mut random = Random::new(1);
    let directions = along_closure(system, q);
    if directions.ncols() == 0 {
        return;
    }
    let mut least = f64::INFINITY;
    for _ in 0..200 {
        let z = DVector::from_fn(directions.ncols(), |_, _| random.range(-1.0, 1.0)).normalize();
        let step = &directions * z * reach;
        let mut pushed: Vec<f64> = q.iter().zip(step.iter()).map(|(q, s)| q + s).collect();
        let mut rest = vec![0.0; q.len()];
        project(system, 0.0, &mut pushed, &mut rest, &mut system.workspace()).unwrap();
        let change = potential(system, &pushed) - potential(system, q);
        assert!(change.is_finite(), "{name}: {change}");
        least = least.min(change);
    }
    assert_eq!(least > 0.0, stable, "{name}: V changes by {least:e} J at least");
}

#[test]
fn of_the_designs() {
    for design in designs() {
        let (name, reference) = (design.name, &design.reference);
        let system = Interpreter::new(&design.compiled.program);
        let starts = reference.states.iter().map(|state| state.q.clone());
        let flat = vec![0.0; reference.joints.len()];
        for mut q in starts.chain([flat]) {
            let stable = check(name, &system, &mut q);
            // The four-bar rests 1e-4 rad beside the singular state.
            check_stability(
                name,
                &system,
                &q,
                stable,
                if name == "paper_fourbar" { 1e-5 } else { 1e-3 },
            );
            assert!(stable, "{name}: {q:?}");
        }
    }
}

#[test]
fn of_the_examples_and_of_many_loops() {
    for name in EXAMPLES {
        let compiled = compile(&workspace().join(format!("examples/{name}.yaml")));
        let system = Interpreter::new(&compiled.program);
        let n = system.dimensions().coordinates;
        let mut q = system.initial().q;
        let pinned: Vec<bool> = (0..n).map(|joint| system.is_pinned(joint)).collect();
        assemble(&system, 0.0, &mut q, &pinned, &mut system.workspace()).unwrap();
        assert!(check(name, &system, &mut q), "{name}");
    }
    for linkage in [linkages::bennett(), linkages::spatial_seven_bar(), linkages::watt()] {
        let compiled = compile_text(&linkage.text(3));
        let system = Interpreter::new(&compiled.program);
        let mut random = Random::new(17);
        let (mut tried, mut stable) = (0, 0);
        while tried < 10 {
            let mut q: Vec<f64> =
                linkage.folded.iter().map(|q| q + random.range(-1.0, 1.0)).collect();
            let n = q.len();
            if assemble(&system, 0.0, &mut q, &vec![false; n], &mut system.workspace()).is_err() {
                continue;
            }
            tried += 1;
            let is_stable = check(linkage.name, &system, &mut q);
            check_stability(linkage.name, &system, &q, is_stable, 1e-3);
            stable += usize::from(is_stable);
        }
        assert!(stable >= 9, "{}: {stable} of 10 are stable", linkage.name);
    }
}

/// Sheets, whose equations depend on each other: from the start and from a nearly flat state.
#[test]
fn of_sheets() {
    for (name, text) in [("miura 6x6", miura(6, 6)), ("yoshimura 4x5", yoshimura(4, 5))] {
        let compiled = compile_text(&text);
        let system = Interpreter::new(&compiled.program);
        for share in [1.0, 0.05] {
            let mut q: Vec<f64> = system.initial().q.iter().map(|q| share * q).collect();
            let n = q.len();
            assemble(&system, 0.0, &mut q, &vec![false; n], &mut system.workspace()).unwrap();
            let stable = check(name, &system, &mut q);
            check_stability(name, &system, &q, stable, 1e-3);
            assert!(stable, "{name} from {share}: {q:?}");
        }
    }
}

/// An inverted rod is at rest and not stable; a spring strong enough holds it.
#[test]
fn an_inverted_pendulum() {
    for (stiffness, stable) in [(3e-4, false), (5e-4, true)] {
        // m g l = 3.924e-4 N m, upright at q = 0 with gravity along -x.
        let text = format!(
            "
gravity: [-9.81, 0, 0]
bodies:
  base: {{ fixed: true }}
  rod: {{ mass: 2 g, com: [0.02, 0, 0], inertia: [[1e-9, 0, 0], [0, 3e-7, 0], [0, 0, 3e-7]] }}
joints: {{ hinge: {{ bodies: [base, rod], axis: [[0, 0], [0, 1]], stiffness: {stiffness} }} }}
"
        );
        let compiled = compile_text(&text);
        let system = Interpreter::new(&compiled.program);
        let mut q = vec![0.0];
        let found = equilibrium(&system, 0.0, &mut q, &mut system.workspace()).unwrap();
        assert_eq!((q[0], found.stable), (0.0, stable));
        // Pushed, it falls to where k q = m g l sin q.
        let mut q = vec![0.01];
        equilibrium(&system, 0.0, &mut q, &mut system.workspace()).unwrap();
        let torque = stiffness * q[0] - 0.002 * 9.81 * 0.02 * q[0].sin();
        assert!(torque.abs() < 1e-12);
        assert_eq!(q[0].abs() < 1e-9, stable, "{q:?}");
    }
}
