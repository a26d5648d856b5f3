//! The examples are the published mechanisms: same masses, same mobility.

use lamc_tests::{EXAMPLES, compile, published, relative_error, workspace};
use nalgebra::Vector3;

/// Coordinates in the examples are rounded; what follows from them agrees to 1e-4.
const ROUNDED: f64 = 1e-4;

#[test]
fn examples_weigh_what_the_published_mechanisms_weigh() {
    for (example, design) in EXAMPLES.iter().zip(published()) {
        let compiled = compile(&workspace().join("examples").join(format!("{example}.yaml")));
        let reference = &design.reference;
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
        assert_eq!(compiled.topology.rank, reference.rank, "{example}");
        let mobility = reference.joints.len() - reference.rank;
        assert_eq!(compiled.topology.mobility, mobility, "{example}");
    }
}
