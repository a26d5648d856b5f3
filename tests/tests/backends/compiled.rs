//! Generated modules of the published designs, compiled by rustc in a package of their own, against
//! the reference values, in every number type.

use lamc::backend::rust::ScalarChoice;
use lamc_tests::package::Package;
use lamc_tests::{DESIGNS, Reference, compile, relative_error, shared};

const SCALARS: [(&str, ScalarChoice, f64); 3] = [
    ("generic", ScalarChoice::Generic, 1e-9),
    ("f64", ScalarChoice::F64, 1e-9),
    ("f32", ScalarChoice::F32, 2e-3),
];

#[test]
fn compiled_modules_agree_with_the_reference() {
    let Some(shared) = shared() else { return };
    let references: Vec<_> = DESIGNS.iter().map(|name| Reference::read(&shared, name)).collect();
    let mut package = Package::new();
    for (index, (name, reference)) in DESIGNS.iter().zip(&references).enumerate() {
        let compiled = compile(&shared.join("designs").join(format!("{name}.cad.joints")));
        for (scalar, choice, _) in SCALARS {
            let module = format!("d{index}_{scalar}");
            package.add(&module, &compiled, choice);
            for state in &reference.states {
                package.ask(&module, "acceleration", &[&state.q, &state.u]);
            }
        }
        let motion = &reference.trajectory;
        let numbers: [&[f64]; 3] = [&motion.q0, &motion.u0, &motion.t];
        package.ask(&format!("d{index}_generic"), "trajectory", &numbers);
    }
    let mut answers = package.answers();
    let mut next = || answers.next().unwrap_or_default();
    for (name, reference) in DESIGNS.iter().zip(&references) {
        for (scalar, _, tolerance) in SCALARS {
            for (index, state) in reference.states.iter().enumerate() {
                let answer = next();
                let n = state.q.len();
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
        let n = reference.trajectory.q0.len();
        for (sample, expected) in answer.chunks(n + 1).zip(&reference.trajectory.q) {
            let error = sample.iter().zip(expected).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            assert!(error <= 1e-6, "{name}: off by {error:e}");
            assert!(sample[n] <= 1e-9, "{name}: open by {:e} of its size", sample[n]);
        }
    }
}
