//! Mass on a point or a line: what resists turning about a hinge, and what does not.

use nalgebra::{Matrix3, Vector3};

use super::{Hinge, build, hinge, mechanism};
use crate::laminate::{MassProperties, Mechanism};

fn point(mass: f64, at: [f64; 3]) -> MassProperties {
    MassProperties::point(mass, Vector3::from(at))
}

/// Along x through its centre of mass.
fn rod(at: [f64; 3]) -> MassProperties {
    MassProperties {
        inertia: Matrix3::from_diagonal(&Vector3::new(0.0, 1.0, 1.0)),
        ..point(1.0, at)
    }
}

/// A hinge along y at x.
fn along_y(bodies: [usize; 2], x: f64) -> Hinge {
    hinge(bodies, [x, 0.0], [x, 1.0])
}

fn with(hinges: &[Hinge], masses: &[MassProperties]) -> Mechanism {
    let mut mechanism = mechanism(hinges);
    for (body, properties) in mechanism.bodies[1..].iter_mut().zip(masses) {
        body.mass_properties = *properties;
    }
    mechanism
}

/// Joints that nothing resists turning about.
#[track_caller]
fn check(mechanism: Mechanism, expected: &[usize]) {
    let spans: Vec<_> = expected.iter().map(|joint| mechanism.joints[*joint].span).collect();
    let errors = build(mechanism).err().unwrap_or_default().0;
    assert!(errors.iter().all(|error| error.code.name == "singular-inertia"), "{errors:?}");
    let found: Vec<_> = errors.iter().map(|error| error.span.unwrap()).collect();
    assert_eq!(found, spans, "{errors:?}");
}

#[test]
fn one_body() {
    let one = |properties| with(&[along_y([0, 1], 0.0)], &[properties]);
    check(one(point(1.0, [1.0, 0.0, 0.0])), &[]);
    check(one(point(1.0, [0.0, 0.0, 1e-3])), &[]);
    for on_line in [[0.0; 3], [0.0, 0.7, 0.0], [1e-12, -5.0, 0.0]] {
        check(one(point(1.0, on_line)), &[0]);
    }
    check(one(rod([0.0; 3])), &[]);
    let rod_along = |at| with(&[hinge([0, 1], [0.0, 0.0], [1.0, 0.0])], &[rod(at)]);
    check(rod_along([0.0; 3]), &[0]);
    check(rod_along([3.0, 0.0, 0.0]), &[0]);
    check(rod_along([3.0, 0.1, 0.0]), &[]);
}

#[test]
fn a_body_held_by_what_hangs_on_it() {
    let chain =
        |first, second| with(&[along_y([0, 1], 0.0), along_y([1, 2], 1.0)], &[first, second]);
    let on_first = point(1.0, [0.0; 3]);
    check(chain(point(1.0, [1.0, 0.0, 0.0]), point(1.0, [2.0, 0.0, 0.0])), &[]);
    // The second body has an inertia of its own: both hinges move it, differently.
    check(chain(on_first, rod([1.5, 0.0, 0.0])), &[]);
    check(chain(on_first, point(1.0, [1.0, 0.0, 0.3])), &[]);
    // Flat, both hinges move a point in line with them along one direction.
    check(chain(on_first, point(1.0, [2.0, 0.0, 0.0])), &[0]);
    let mut bent = chain(on_first, point(1.0, [2.0, 0.0, 0.0]));
    bent.initial_q = vec![0.0, 0.5];
    check(bent, &[]);
    // On the second hinge's line a mass is as good as the first body's own.
    check(chain(on_first, point(1.0, [1.0, 0.4, 0.0])), &[1]);
    check(chain(on_first, point(1.0, [0.0; 3])), &[0]);
}

/// A body of a loop need not hang on the hinge that its mass lies on.
#[test]
fn masses_on_the_hinges_of_a_loop() {
    let bars =
        [along_y([0, 1], 0.0), along_y([0, 2], 3.0), along_y([1, 3], 1.0), along_y([2, 3], 2.5)];
    let at = |x| point(1.0, [x, 0.0, 0.0]);
    let loop_of = |coupler| with(&bars, &[at(0.5), at(2.7), coupler]);
    for x in [1.7, 1.0, 2.5] {
        check(loop_of(at(x)), &[]);
    }
    // However it is cut, some mass lies on the line it hangs on.
    assert!(build(with(&bars, &[at(0.0), at(3.0), at(1.0)])).is_err());
    // Where the user says where to cut, it is done there.
    let mut cut = loop_of(at(1.0));
    cut.cuts = vec![crate::source::JointId(2)];
    check(cut, &[2]);
}
