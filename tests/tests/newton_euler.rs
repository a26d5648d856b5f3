//! The independent evaluator against the reference values.

use lamc_tests::expression::Values;
use lamc_tests::newton_euler::{solve, tree_mass_matrix};
use lamc_tests::{DESIGNS, Reference, relative_error, shared};

/// Accelerations and energies of every reference state, to 1e-9 of the largest component.
#[test]
fn the_evaluator_agrees_with_the_reference() {
    let Some(shared) = shared() else { return };
    for stem in DESIGNS {
        let reference = Reference::read(&shared, stem);
        let mechanism = reference.mechanism();
        for (index, state) in reference.states.iter().enumerate() {
            let values = Values { q: state.q.clone(), u: state.u.clone(), ..Values::default() };
            let solution = solve(&mechanism, &values);
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
