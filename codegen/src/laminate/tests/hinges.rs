//! Hinge lines, beams, limits, `tunable`, initial values, size.

use std::f64::consts::PI;

use super::{body, drawn, material, mechanism, model, named, plate, spanned};
use crate::laminate::build;
use crate::source::{
    Diagnostics, Expression, JointId, Parameter, ParameterId, Shape, SourceModel, Spring, Tunable,
};

fn pendulum() -> SourceModel {
    let outline = [[0.0, 0.0], [0.04, 0.0], [0.04, 0.02], [0.0, 0.02]];
    let bob = body("bob", Shape::Plates(vec![vec![plate(&outline, &[])]]));
    model(vec![material(700.0, 4e-4)], vec![bob])
}

#[test]
fn directions_are_exact_along_the_axes_and_unit_otherwise() {
    for (to, expected) in [
        ([0.0, 0.3], [0.0, 1.0]),
        ([0.0, -1e-9], [0.0, -1.0]),
        ([7.0, 0.0], [1.0, 0.0]),
        ([-1e-200, 0.0], [-1.0, 0.0]),
        ([0.1, 1e-17], [1.0, 0.0]),
        ([3.0, -4.0], [0.6, -0.8]),
    ] {
        let mut pendulum = pendulum();
        pendulum.joints[0].axis.value = [[0.0, 0.0], to];
        let direction = mechanism(&pendulum).joints[0].direction;
        assert_eq!([direction.x, direction.y, direction.z], [expected[0], expected[1], 0.0]);
    }
}

#[test]
fn beam_has_the_textbook_stiffness() {
    let mut pendulum = pendulum();
    pendulum.materials[0].youngs_modulus = Some(drawn(4.38327e9));
    pendulum.materials[0].thickness.value = 1.27e-4;
    pendulum.joints[0].spring =
        Spring::Beam { material: spanned(0), length: drawn(1e-3), width: drawn(20e-3), gaps: None };
    let stiffness = mechanism(&pendulum).joints[0].stiffness.as_number().unwrap();
    // 4.38327e9 * 0.02 * 1.27e-4^3 / 12 / 1e-3 in rational arithmetic.
    assert!((stiffness / 0.01496435958735 - 1.0).abs() < 1e-13, "{stiffness}");
}

#[test]
fn tunable_constants_become_parameters_after_the_declared_ones() {
    let mut pendulum = pendulum();
    pendulum.parameters =
        vec![Parameter { name: named("k"), value: 2.0, dimension: None, range: None }];
    pendulum.joints[0].spring = Spring::Stiffness(spanned(Expression::Parameter(ParameterId(0))));
    pendulum.joints[0].damping = spanned(Expression::Number(0.25));
    pendulum.tunable =
        [Tunable::Mass, Tunable::Stiffness, Tunable::Rest, Tunable::Damping].map(spanned).to_vec();
    let built = mechanism(&pendulum);
    let names: Vec<_> = built.parameters.iter().map(|p| (p.name.as_str(), p.value)).collect();
    let mass = built.bodies[1].mass_properties.mass;
    assert_eq!(names, [("k", 2.0), ("mass_bob", mass), ("rest_j0", 0.0), ("damping_j0", 0.25)]);
    // The ground has no mass to tune; what is an expression already stays.
    assert_eq!(built.bodies[0].mass_parameter, None);
    assert_eq!(built.bodies[1].mass_parameter, Some(ParameterId(1)));
    assert_eq!(built.joints[0].stiffness, Expression::Parameter(ParameterId(0)));
    assert_eq!(built.joints[0].rest, Expression::Parameter(ParameterId(2)));
    assert_eq!(built.joints[0].damping, Expression::Parameter(ParameterId(3)));
    assert_eq!(built.parameters[3].doc, "Damping of joint `j0`, N m s/rad.");
    assert!(built.parameters.iter().all(|p| !p.doc.is_empty()));
}

#[test]
fn values_not_given_are_zero_and_unlimited() {
    let mut pendulum = pendulum();
    let built = mechanism(&pendulum);
    assert_eq!(built.joints[0].limits, [f64::NEG_INFINITY, f64::INFINITY]);
    assert_eq!((built.initial_q, built.initial_u), (vec![0.0], vec![0.0]));
    assert!(built.initial_given.is_empty());
    pendulum.joints[0].limits = Some(spanned([-PI, 1.0]));
    pendulum.initial_q = vec![(JointId(0), 0.5)];
    let built = mechanism(&pendulum);
    assert_eq!(built.joints[0].limits, [-PI, 1.0]);
    assert_eq!((built.initial_q, built.initial_given), (vec![0.5], vec![JointId(0)]));
}

#[test]
fn a_share_of_the_fold_is_a_guess_within_the_limits() {
    let mut pendulum = pendulum();
    pendulum.joints[0].fold = Some(spanned(-2.0));
    pendulum.initial_fold = Some(spanned(0.25));
    let built = mechanism(&pendulum);
    // A share is not an angle that was given.
    assert_eq!((built.initial_q, built.initial_given), (vec![-0.5], vec![]));
    pendulum.joints[0].limits = Some(spanned([-0.3, 1.0]));
    assert_eq!(mechanism(&pendulum).initial_q, [-0.3]);
    pendulum.initial_q = vec![(JointId(0), 0.7)];
    let built = mechanism(&pendulum);
    assert_eq!((built.initial_q, built.initial_given), (vec![0.7], vec![JointId(0)]));
}

#[test]
fn size_spans_plates_and_hinge_lines() {
    // The plate spans x 0..0.04, the hinge line y 0..1, the sheet z 0..4e-4.
    let size = mechanism(&pendulum()).size;
    assert!((size - (0.04_f64.powi(2) + 1.0 + 4e-4_f64.powi(2)).sqrt()).abs() < 1e-15);
}

#[test]
fn negative_stiffness_is_allowed_with_a_warning() {
    let mut pendulum = pendulum();
    pendulum.joints[0].spring = Spring::Stiffness(spanned(Expression::Number(-0.1)));
    let mut warnings = Diagnostics::default();
    build(&pendulum, &mut warnings).unwrap();
    let codes: Vec<_> = warnings.0.iter().map(|w| w.code.name).collect();
    assert_eq!(codes, ["negative-stiffness"]);
}
