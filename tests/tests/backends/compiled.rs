//! Generated modules of the published mechanisms, compiled by rustc in a package of their own, against
//! the reference values, in every number type.

use lamc::backend::rust::ScalarChoice;
use lamc_tests::designs::Design;
use lamc_tests::package::Package;
use lamc_tests::{largest_difference, published, relative_error};

const SCALARS: [(&str, ScalarChoice, f64); 3] = [
    ("generic", ScalarChoice::Generic, 1e-9),
    ("f64", ScalarChoice::F64, 1e-9),
    ("f32", ScalarChoice::F32, 2e-3),
];

#[test]
fn compiled_modules_agree_with_the_reference() {
    let designs: Vec<_> = published().collect();
    let mut package = Package::new();
    for Design { name, compiled, reference, .. } in &designs {
        for (scalar, choice, _) in SCALARS {
            let module = format!("{name}_{scalar}");
            package.add(&module, compiled, choice);
            for state in &reference.states {
                package.ask(&module, "acceleration", &[&state.q, &state.u]);
            }
        }
        let motion = reference.trajectory();
        let numbers: [&[f64]; 3] = [&motion.q0, &motion.u0, &motion.t];
        package.ask(&format!("{name}_generic"), "trajectory", &numbers);
    }
    let mut answers = package.answers();
    let mut next = || answers.next().expect("an answer to each question");
    for Design { name, reference, .. } in &designs {
        for (scalar, _, tolerance) in SCALARS {
            for (index, state) in reference.states.iter().enumerate() {
                let answer = next();
                let n = state.q.len();
                assert_eq!(answer.len(), n + 2, "{name} {scalar} state {index}");
                let error = relative_error(&answer[..n], &state.acceleration);
                assert!(error <= tolerance, "{name} {scalar} state {index}: {error:e}");
                let energies = [state.kinetic_energy, state.potential_energy];
                for (value, expected) in answer[n..].iter().zip(energies) {
                    let error = (value - expected).abs() / expected.abs();
                    assert!(error <= tolerance, "{name} {scalar} state {index}: energy {error:e}");
                }
            }
        }
        let answer = next();
        let motion = reference.trajectory();
        let n = motion.q0.len();
        assert_eq!(answer.len(), (n + 1) * motion.q.len(), "{name}");
        for (sample, expected) in answer.chunks(n + 1).zip(&motion.q) {
            let error = largest_difference(&sample[..n], expected);
            assert!(error <= 1e-6, "{name}: off by {error:e}");
            assert!(sample[n] <= 1e-9, "{name}: open by {:e} of its size", sample[n]);
        }
    }
}
