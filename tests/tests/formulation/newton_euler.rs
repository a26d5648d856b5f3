//! Kane's equations against Newton's and Euler's, on random mechanisms; and first the latter
//! against the reference values.

use lamc::program::Interpreter;
use lamc_runtime::plumbing::EquationsMut;
use lamc_runtime::{Mechanism, acceleration, assemble, project};
use lamc_tests::random::{Lines, Random, Recipe, model};
use lamc_tests::{compile_text, published, relative_error};
use lamc_workbench::verify::{Values, solve, tree_mass_matrix};
use nalgebra::DMatrix;

/// Accelerations and energies of every reference state, to 1e-9 of the largest component.
#[test]
fn the_evaluator_agrees_with_the_reference() {
    for design in published() {
        let (stem, reference) = (design.name, &design.reference);
        let mechanism = reference.mechanism();
        for (index, state) in reference.states.iter().enumerate() {
            let values = Values { q: state.q.clone(), u: state.u.clone(), ..Values::default() };
            let solution = solve(&mechanism, &values).unwrap();
            assert!(solution.open_by < 1e-10, "{stem} {index}: open by {}", solution.open_by);
            assert!(solution.speed_mismatch < 1e-9, "{stem}: {}", solution.speed_mismatch);
            let check = |what: &str, found: &[f64], expected: &[f64]| {
                let error = relative_error(found, expected);
                assert!(error < 1e-9, "{stem} state {index}: {what} off by {error:e}");
            };
            check("acceleration", &solution.acceleration, &state.acceleration);
            check("kinetic energy", &[solution.kinetic_energy], &[state.kinetic_energy]);
            check("potential energy", &[solution.potential_energy], &[state.potential_energy]);
            if let Some(expected) = &state.mass_matrix {
                let found = tree_mass_matrix(&mechanism, &values).concat();
                check("mass matrix", &found, &expected.concat());
            }
        }
    }
}

/// States compared per mechanism.
const STATES: usize = 3;
/// Guesses tried to find them.
const GUESSES: usize = 30;
/// States whose closure is nearer than this to losing rank are not compared: there both sides lose
/// digits, and the rank becomes a decision.
const CONDITION: f64 = 1e-2;

#[test]
fn trees() {
    check(1000..1080, |seed| Recipe {
        branches: 1 + seed as usize % 12,
        loops: 0,
        lines: Lines::Any,
    });
}

#[test]
fn trees_of_thirty_bodies() {
    check(2000..2004, |_| Recipe { branches: 30, loops: 0, lines: Lines::Any });
}

#[test]
fn planar_loops() {
    check(3000..3050, |seed| looped(seed, Lines::Parallel));
}

#[test]
fn spherical_loops() {
    check(4000..4050, |seed| looped(seed, Lines::Concurrent));
}

#[test]
fn spatial_loops() {
    check(5000..5024, |seed| looped(seed, Lines::Any));
}

/// Drawn flat, hinge lines through one point lie in one plane: the closure loses rank. From rest the
/// accelerations are still those of Gauss's principle.
#[test]
fn flat_sheets_at_rest() {
    for seed in 6000..6020 {
        let compiled = compile_text(&model(seed, looped(seed, Lines::Concurrent)));
        let mechanism = &compiled.topology.mechanism;
        let mut system = Interpreter::new(&compiled.program);
        system.set_input("motor", 1e-3).unwrap();
        let n = mechanism.joints.len();
        let parameters = mechanism.parameters.iter().map(|parameter| parameter.value).collect();
        let (q, u) = (vec![0.0; n], vec![0.0; n]);
        let rank = certain_rank(&system, &q).expect("the lines' directions are well apart");
        assert!(rank < compiled.topology.rank, "seed {seed}: flat is not singular");
        let values = Values { parameters, inputs: vec![1e-3], t: 0.5, q, u };
        let expected = solve(mechanism, &values).unwrap();
        let (mut found, mut workspace) = (vec![0.0; n], system.workspace());
        let at = (values.t, &values.q, &values.u);
        let found_rank = acceleration(&system, at.0, at.1, at.2, &mut workspace, &mut found)
            .map(|constraint| constraint.rank);
        assert_eq!(found_rank, Ok(rank), "seed {seed}");
        let error = relative_error(&found, &expected.acceleration);
        assert!(error < 1e-9, "seed {seed}: acceleration off by {error:e}");
    }
}

/// One, two or three loops with up to three more plates.
fn looped(seed: u64, lines: Lines) -> Recipe {
    Recipe { branches: seed as usize % 4, loops: 1 + seed as usize % 3, lines }
}

/// Compares accelerations, energies and (of trees) mass matrices of random mechanisms.
fn check(seeds: std::ops::Range<u64>, recipe: impl Fn(u64) -> Recipe) {
    let (wanted, mut compared) = (STATES * seeds.clone().count(), 0);
    for seed in seeds {
        compared += compare(seed, recipe(seed));
    }
    assert!(compared * 10 >= wanted * 9, "only {compared} of {wanted} states could be compared");
}

/// The number of states compared.
fn compare(seed: u64, recipe: Recipe) -> usize {
    let text = model(seed, recipe);
    let compiled = compile_text(&text);
    let mechanism = &compiled.topology.mechanism;
    assert_eq!(compiled.topology.loops.len(), recipe.loops, "seed {seed}");
    for closed in &compiled.topology.loops {
        assert!(recipe.lines.is(&closed.class), "seed {seed}: {} loop", closed.class);
    }
    let mut system = Interpreter::new(&compiled.program);
    let mut workspace = system.workspace();
    let mut random = Random::new(seed);
    let n = mechanism.joints.len();
    let mut compared = 0;
    for _ in 0..GUESSES {
        if compared == STATES {
            break;
        }
        let mut q: Vec<f64> = (0..n).map(|_| random.range(-1.2, 1.2)).collect();
        let mut u: Vec<f64> = (0..n).map(|_| random.range(-3.0, 3.0)).collect();
        let t = random.range(0.0, 1.0);
        let motor = random.range(-2e-3, 2e-3);
        system.set_input("motor", motor).unwrap();
        if assemble(&system, 0.0, &mut q, &vec![false; n], &mut workspace).is_err()
            || project(&system, t, &mut q, &mut u, &mut workspace).is_err()
        {
            continue;
        }
        let Some(rank) = certain_rank(&system, &q) else { continue };
        compared += 1;

        let parameters = mechanism.parameters.iter().map(|parameter| parameter.value).collect();
        let values = Values { parameters, inputs: vec![motor], t, q, u };
        let expected = solve(mechanism, &values).unwrap();
        assert!(expected.open_by < 1e-9, "seed {seed}: open by {:e}", expected.open_by);
        let slip = expected.speed_mismatch;
        assert!(slip < 1e-8, "seed {seed}: speeds differ by {slip:e}");
        let (q, u) = (&values.q, &values.u);
        let mut found = vec![0.0; n];
        let found_rank = acceleration(&system, t, q, u, &mut workspace, &mut found)
            .map(|constraint| constraint.rank);
        assert_eq!(found_rank, Ok(rank), "seed {seed}");
        let energy = system.energy(t, q, u).unwrap();
        let same = |what: &str, found: &[f64], expected: &[f64], tolerance: f64| {
            let error = relative_error(found, expected);
            assert!(error < tolerance, "seed {seed}: {what} off by {error:e}\n{text}");
        };
        same("acceleration", &found, &expected.acceleration, 1e-9);
        let total = expected.kinetic_energy.abs() + expected.potential_energy.abs();
        let energies = [energy.kinetic, energy.potential, total];
        let expected = [expected.kinetic_energy, expected.potential_energy, total];
        // A cut body's copies coincide as well as assembly closed the loop, to 1e-12 of the size.
        same("energy", &energies, &expected, if recipe.loops == 0 { 1e-12 } else { 1e-10 });
        if recipe.loops == 0 {
            let mut mass = vec![0.0; n * n];
            let out = EquationsMut {
                mass: &mut mass,
                forcing: &mut vec![0.0; n],
                jacobian: &mut [],
                gamma: &mut [],
            };
            system.write_equations(t, q, u, out).unwrap();
            same("mass matrix", &mass, &tree_mass_matrix(mechanism, &values).concat(), 1e-12);
        }
    }
    compared
}

/// The rank of the closure, where it is beyond doubt.
fn certain_rank(system: &Interpreter, q: &[f64]) -> Option<usize> {
    let d = system.dimensions();
    if d.loops == 0 {
        return Some(0);
    }
    let (mut residual, mut jacobian) = (vec![0.0; 9 * d.loops], vec![0.0; 9 * d.loops * q.len()]);
    system.write_closure(q, &mut residual, &mut jacobian).unwrap();
    let singular = DMatrix::from_row_slice(9 * d.loops, q.len(), &jacobian).singular_values();
    let relative = singular.iter().map(|value| value / singular.max());
    let is_doubtful = relative.clone().any(|value| (1e-9..CONDITION).contains(&value));
    (!is_doubtful).then(|| relative.filter(|&value| value >= CONDITION).count())
}
