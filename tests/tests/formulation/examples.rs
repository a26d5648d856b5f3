//! The examples are the published mechanisms: same masses, same mobility.

use lamc_tests::{DESIGNS, EXAMPLES, Reference, compile, relative_error, shared, workspace};
use nalgebra::Vector3;

/// Coordinates in the examples are rounded; what follows from them agrees to 1e-4.
const ROUNDED: f64 = 1e-4;

#[test]
fn examples_weigh_what_the_published_designs_weigh() {
    let Some(shared) = shared() else { return };
    for (example, design) in EXAMPLES.iter().zip(DESIGNS) {
        let compiled = compile(&workspace().join("examples").join(format!("{example}.yaml")));
        let reference = Reference::read(&shared, design);
        let bodies = &compiled.topology.mechanism.bodies;
        assert_eq!(bodies.len(), reference.bodies.len(), "{example}");
        // Bodies have names of their own, and any order: equal masses tell them apart by place.
        for expected in &reference.bodies {
            let com = Vector3::from(expected.com);
            let body = bodies
                .iter()
                .min_by(|a, b| {
                    let [a, b] = [a, b].map(|body| (body.mass_properties.com - com).norm());
                    a.total_cmp(&b)
                })
                .unwrap();
            let found = body.mass_properties;
            assert_eq!(body.fixed, expected.fixed, "{example} {}", body.name);
            let name = format!("{example} {} ({})", body.name, expected.name);
            let error = relative_error(&[found.mass], &[expected.mass]);
            assert!(error < ROUNDED, "{name}: mass off by {error:e}");
            let error = relative_error(found.com.as_slice(), &expected.com);
            assert!(error < ROUNDED, "{name}: centre off by {error:e}");
            let inertia = expected.inertia.concat();
            let error = relative_error(found.inertia.as_slice(), &inertia);
            assert!(error < 3.0 * ROUNDED, "{name}: inertia off by {error:e}");
        }
        let state = &reference.states[0];
        assert_eq!(compiled.topology.rank, state.constraint_rank, "{example}");
        assert_eq!(compiled.topology.mobility, state.dof, "{example}");
    }
}
