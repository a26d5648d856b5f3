//! Constrained acceleration and projection, against nalgebra, a reduction to one degree of
//! freedom, and what closure means; redundant rows and singular states included.

mod common;

use common::Tree;
use common::compare::largest;
use common::designs::{ALL, PLACES, SIX, chain, four_vertex, planar, sixbar, two_loops};
use common::planar::FourBar;
use common::uniform::Random;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{
    Error, Mechanism, Scalar, acceleration, acceleration_and_forces, assemble, project,
};
use nalgebra::{DMatrix, DVector};

type Rows = (DMatrix<f64>, DVector<f64>, DMatrix<f64>, DVector<f64>);

fn equations<Y: Mechanism<Scalar = f64>>(system: &Y, q: &[f64], u: &[f64]) -> Rows {
    let d = system.dimensions();
    let (n, c) = (d.coordinates, d.rows);
    let (mut mass, mut forcing) = (vec![0.0; n * n], vec![0.0; n]);
    let (mut jacobian, mut gamma) = (vec![0.0; c * n], vec![0.0; c]);
    system
        .write_equations(
            0.0,
            q,
            u,
            EquationsMut {
                mass: &mut mass,
                forcing: &mut forcing,
                jacobian: &mut jacobian,
                gamma: &mut gamma,
            },
        )
        .unwrap();
    (
        DMatrix::from_row_slice(n, n, &mass),
        DVector::from_vec(forcing),
        DMatrix::from_row_slice(c, n, &jacobian),
        DVector::from_vec(gamma),
    )
}

/// A closed state with speeds that keep it closed.
fn closed_state(system: &Tree<f64>, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let n = system.bodies.len();
    let mut random = Random::new(seed);
    let (mut q, mut u) = (random.normals(n, 0.6), random.normals(n, 3.0));
    let mut workspace = system.workspace();
    assemble(system, 0.0, &mut q, &vec![false; n], &mut workspace).unwrap();
    project(system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
    (q, u)
}

/// Checks Gauss's principle: du/dt obeys the closure, and M du/dt - f is a closure force.
fn check_acceleration(system: &Tree<f64>, q: &[f64], u: &[f64], rank: usize) {
    let (m, f, j, gamma) = equations(system, q, u);
    let (mut out, mut lambda) = (vec![0.0; q.len()], vec![0.0; gamma.len()]);
    let workspace = &mut system.workspace();
    let constraint =
        acceleration_and_forces(system, 0.0, q, u, workspace, &mut out, &mut lambda).unwrap();
    assert_eq!(constraint.rank, rank);
    let (du, lambda) = (DVector::from_vec(out.clone()), DVector::from_vec(lambda));
    let open = largest(&(&j * &du + &gamma));
    assert!(open <= 1e-9 * largest(&gamma).max(1e-3), "J du/dt + gamma = {open:e}");
    let force = largest(&(&m * &du - &f - j.transpose() * lambda));
    assert!(force <= 1e-10 * (largest(&f) + largest(&(&m * &du))), "unbalanced by {force:e}");

    let mut again = vec![0.0; q.len()];
    acceleration(system, 0.0, q, u, workspace, &mut again).unwrap();
    assert_eq!(again, out, "asking for the forces changes nothing");
}

#[test]
fn acceleration_obeys_closure_and_balance_with_redundant_rows() {
    for seed in 1..20 {
        for (system, rank) in [
            (sixbar(&ALL), 3),
            (sixbar(&SIX), 3),
            (four_vertex(&ALL), 3),
            (planar(PLACES, &ALL), 3),
            (two_loops(&SIX), 6),
            (two_loops(&ALL), 6),
        ] {
            let (q, u) = closed_state(&system, seed);
            check_acceleration(&system, &q, &u, rank);
        }
    }
}

#[test]
fn independent_and_redundant_rows_give_the_same_acceleration() {
    // Rotation about the centre shows in two directions at one point and out of plane at another.
    let (few, all) = (sixbar::<f64>(&[4, 5, 8]), sixbar::<f64>(&ALL));
    for seed in 1..20 {
        let (q, u) = closed_state(&all, seed);
        let mut results = [vec![0.0; 6], vec![0.0; 6]];
        acceleration(&few, 0.0, &q, &u, &mut few.workspace(), &mut results[0]).unwrap();
        acceleration(&all, 0.0, &q, &u, &mut all.workspace(), &mut results[1]).unwrap();
        let [few, all] = results.map(DVector::from_vec);
        let error = largest(&(&few - &all));
        assert!(error <= 1e-9 * largest(&all), "seed {seed}: {error:e} of {}", largest(&all));
    }
}

#[test]
fn an_open_tree_is_solved_as_nalgebra_does() {
    let system = chain::<f64>(5);
    let mut random = Random::new(3);
    for _ in 0..20 {
        let (q, u) = (random.normals(5, 1.0), random.normals(5, 5.0));
        let (m, f, ..) = equations(&system, &q, &u);
        let mut out = vec![0.0; 5];
        acceleration(&system, 0.0, &q, &u, &mut system.workspace(), &mut out).unwrap();
        let expected = m.clone().cholesky().unwrap().solve(&f);
        assert!(largest(&(DVector::from_vec(out) - &expected)) <= 1e-9 * largest(&expected));
    }
}

#[test]
fn flat_singular_states_are_finite() {
    for system in [sixbar(&ALL), sixbar(&SIX), four_vertex(&ALL), two_loops(&SIX)] {
        let n = system.bodies.len();
        let mut random = Random::new(11);
        let (mut q, mut u) = (vec![0.0; n], random.normals(n, 2.0));
        let mut workspace = system.workspace();
        let projected = project(&system, 0.0, &mut q, &mut u, &mut workspace).unwrap();
        let generic = 3 * system.loops.len();
        assert!(projected.rank < generic, "the flat state is singular");
        assert_eq!(q, vec![0.0; n]);
        let mut out = vec![0.0; n];
        let constraint = acceleration(&system, 0.0, &q, &u, &mut workspace, &mut out).unwrap();
        assert_eq!(constraint.rank, projected.rank);
        assert!(out.iter().all(|du| du.is_finite()));
    }
}

/// The four-bar's motion with one degree of freedom: with the tangent v(q) of the closed curve,
/// A = v^T M v and u = v s, the power of all forces is s Q, so A ds/dt + A' s^2 / 2 = Q.
#[test]
fn four_bar_moves_like_its_reduction_to_one_degree_of_freedom() {
    let system = FourBar::<f64>::example();
    let state = system.assembled().unwrap();
    let rate = state.u[0];
    let tangent = state.u.map(|u| u / rate);
    let inertia = |distance: f64| {
        let mut q = state.q;
        // Along the closed curve by many small steps, each projected.
        let mut v = tangent;
        for _ in 0..100 {
            for j in 0..4 {
                q[j] += distance / 100.0 * v[j];
            }
            system_project(&system, &mut q, &mut v);
            v = v.map(|each| each / v[0]);
        }
        let (m, ..) = equations(&system, &q, &[0.0; 4]);
        let v = DVector::from_column_slice(&v);
        (q[0], (v.transpose() * m * v)[0], system.energy(0.0, &q, &[0.0; 4]).unwrap().potential)
    };
    let h = 1e-3;
    let (low, middle, high) = (inertia(-h), inertia(0.0), inertia(h));
    let slope = (high.1 - low.1) / (high.0 - low.0);
    let force = -(high.2 - low.2) / (high.0 - low.0);
    let expected = (force - slope * rate * rate / 2.0) / middle.1;
    let du = system.acceleration(0.0, &state.q, &state.u).unwrap();
    let error = (du[0] - expected).abs() / expected.abs();
    assert!(error < 1e-5, "{} is not {expected}", du[0]);
}

fn system_project(system: &FourBar<f64>, q: &mut [f64; 4], u: &mut [f64; 4]) {
    project(system, 0.0, q, u, &mut system.workspace()).unwrap();
}

#[test]
fn single_precision_follows_double() {
    let (double, single) = (FourBar::<f64>::example(), FourBar::<f32>::example());
    let state = double.assembled().unwrap();
    let (q, u) = (state.q.map(|q| q as f32), state.u.map(|u| u as f32));
    let expected = double.acceleration(0.0, &state.q, &state.u).unwrap();
    let du = single.acceleration(0.0, &q, &u).unwrap();
    for (du, expected) in du.iter().zip(expected) {
        assert!((f64::from(*du) - expected).abs() <= 2e-3 * expected.abs(), "{du}: {expected}");
    }

    let state = single.assembled().unwrap();
    let mut residual = [0.0; 9];
    single.write_closure(&state.q, &mut residual, &mut [0.0; 36]).unwrap();
    assert!(residual.iter().all(|r| r.abs() <= 16.0 * f32::EPSILON * 0.06), "{residual:?}");

    // Redundant rows, rounded to single precision: the rank is still seen.
    let (double, single) = (sixbar::<f64>(&ALL), sixbar::<f32>(&ALL));
    for seed in 1..20 {
        let (q, u) = closed_state(&double, seed);
        let mut expected = vec![0.0; 6];
        let workspace = &mut double.workspace();
        acceleration(&double, 0.0, &q, &u, workspace, &mut expected).unwrap();
        let (q, u): (Vec<f32>, Vec<f32>) =
            (q.iter().map(|&q| q as f32).collect(), u.iter().map(|&u| u as f32).collect());
        let mut du = vec![0.0; 6];
        let constraint =
            acceleration(&single, 0.0, &q, &u, &mut single.workspace(), &mut du).unwrap();
        assert_eq!(constraint.rank, 3);
        let scale = largest(&expected);
        for (du, expected) in du.iter().zip(expected) {
            assert!((du.to_f64() - expected).abs() <= 1e-2 * scale, "{du} is not {expected}");
        }
    }
}

#[test]
fn projection_is_the_least_change_in_the_metric_of_mass() {
    let systems = [(sixbar::<f64>(&SIX), 3), (two_loops(&SIX), 6), (sixbar(&[]), 3)];
    for ((system, rank), seed) in systems.iter().flat_map(|of| (5..11).map(move |seed| (of, seed)))
    {
        let (q, u) = closed_state(system, seed);
        let mut random = Random::new(seed + 100);
        let n = q.len();
        let mut off: Vec<f64> = q.iter().map(|q| q + 1e-4 * random.normal()).collect();
        let mut fast: Vec<f64> = u.iter().map(|u| u + random.normal()).collect();
        let before = (off.clone(), fast.clone());
        let workspace = &mut system.workspace();
        let projected = project(system, 0.0, &mut off, &mut fast, workspace).unwrap();
        assert!(projected.residual <= 1e-12 * system.size);
        assert_eq!(projected.rank, *rank);

        let mut residual = vec![0.0; 9 * system.loops.len()];
        let mut jacobian = vec![0.0; 9 * system.loops.len() * n];
        system.write_closure(&off, &mut residual, &mut jacobian).unwrap();
        let j = DMatrix::from_row_slice(residual.len(), n, &jacobian);
        assert!(largest(&(&j * DVector::from_vec(fast.clone()))) <= 1e-12);
        // The change is M-orthogonal to every motion that stays closed.
        let (m, ..) = equations(system, &before.0, &before.1);
        let kernel = kernel(&j, *rank);
        let change = DVector::from_vec(fast) - DVector::from_vec(before.1);
        let along = largest(&(kernel.transpose() * &m * &change));
        assert!(along <= 1e-9 * largest(&(&m * &change)), "along the closure by {along:e}");
        // Of a finite step only to first order: the closure curves, and on the way its directions turn by the
        // step (rad) over the least singular value, as a share of the largest.
        let change = DVector::from_vec(off) - DVector::from_vec(before.0);
        let along = largest(&(kernel.transpose() * &m * &change));
        let values = j.svd(false, false).singular_values;
        let turn = largest(&change) * values[0] / values[rank - 1];
        assert!(
            turn < 0.02 && along <= turn * largest(&(&m * &change)),
            "{along:e} along the closure"
        );
    }
}

/// An orthonormal basis of the null space.
fn kernel(j: &DMatrix<f64>, rank: usize) -> DMatrix<f64> {
    let mut eigen = (j.transpose() * j).symmetric_eigen();
    let mut order: Vec<usize> = (0..eigen.eigenvalues.len()).collect();
    order.sort_by(|&a, &b| eigen.eigenvalues[a].total_cmp(&eigen.eigenvalues[b]));
    order.truncate(j.ncols() - rank);
    eigen.eigenvectors = eigen.eigenvectors.select_columns(&order);
    eigen.eigenvectors
}

#[test]
fn mistakes_are_named() {
    let system = sixbar::<f64>(&SIX);
    let (q, mut u) = closed_state(&system, 2);
    let mut out = vec![0.0; 6];
    let mut run = |system: &Tree<f64>, q: &[f64], u: &[f64], room: usize| {
        acceleration(system, 0.0, q, u, &mut vec![0.0; room], &mut out)
    };
    let needed = system.workspace().len();
    let short = run(&system, &q, &u, 10);
    let least = match short {
        Err(Error::Workspace { needed: least, given: 10 }) => least,
        other => panic!("{other:?}"),
    };
    // What is offered suffices for joints at stops, too.
    assert!(least <= needed);
    assert!(run(&system, &q, &u, least).is_ok());
    let workspace = Error::Workspace { needed: least, given: least - 1 };
    assert_eq!(run(&system, &q, &u, least - 1), Err(workspace));
    let length = Error::Length { expected: 6, given: 5 };
    assert_eq!(run(&system, &q[..5], &u, needed), Err(length));
    u[3] = f64::NAN;
    assert_eq!(run(&system, &q, &u, needed), Err(Error::NotFinite { joint: 3 }));
    u[3] = f64::INFINITY;
    assert_eq!(run(&system, &q, &u, needed), Err(Error::NotFinite { joint: 3 }));

    let mut weightless = chain::<f64>(3);
    weightless.bodies[2].mass = 0.0;
    weightless.bodies[2].inertia *= 0.0;
    let result = run_chain(&weightless);
    assert_eq!(result, Err(Error::MassMatrix { joint: 2 }));
    assert_eq!(result.unwrap_err().to_string(), "mass matrix is not positive definite at joint 2");
}

fn run_chain(system: &Tree<f64>) -> Result<lamc_runtime::Constraint, Error> {
    let (q, u) = ([0.1, 0.2, 0.3], [0.0; 3]);
    acceleration(system, 0.0, &q, &u, &mut system.workspace(), &mut [0.0; 3])
}
