//! Parameters: declared ones, and constants that `tunable` turns into parameters.

use super::mechanism::{Mechanism, Parameter};
use crate::source::{Expression, ParameterId, SourceModel, Tunable};

/// The declared parameters, in file order.
pub fn declared(model: &SourceModel) -> Vec<Parameter> {
    let parameter = |parameter: &crate::source::Parameter| Parameter {
        name: parameter.name.value.clone(),
        value: parameter.value,
        doc: format!("Parameter `{}`, SI units.", parameter.name.value),
    };
    model.parameters.iter().map(parameter).collect()
}

/// Replaces the constants of every joint (moving body) that `tunable` names by parameters with
/// these constants as defaults; values that are already expressions stay as they are.
pub fn apply(model: &SourceModel, mechanism: &mut Mechanism) {
    let Mechanism { joints, bodies, parameters, .. } = mechanism;
    for tunable in &model.tunable {
        let (key, what, unit) = match tunable.value {
            Tunable::Stiffness => ("stiffness", "Stiffness of joint", "N m/rad"),
            Tunable::Damping => ("damping", "Damping of joint", "N m s/rad"),
            Tunable::Rest => ("rest", "Rest angle of joint", "rad"),
            Tunable::Mass => ("mass", "Mass of body", "kg; its inertia scales with it"),
        };
        let mut make = |owner: &str, value: f64| {
            let doc = format!("{what} `{owner}`, {unit}.");
            parameters.push(Parameter { name: format!("{key}_{owner}"), value, doc });
            ParameterId(parameters.len() - 1)
        };
        for joint in joints.iter_mut() {
            let constant = match tunable.value {
                Tunable::Stiffness => &mut joint.stiffness,
                Tunable::Damping => &mut joint.damping,
                Tunable::Rest => &mut joint.rest,
                Tunable::Mass => break,
            };
            if let Some(value) = constant.as_number() {
                *constant = Expression::Parameter(make(&joint.name, value));
            }
        }
        if tunable.value == Tunable::Mass {
            for body in bodies.iter_mut().filter(|body| !body.fixed) {
                body.mass_parameter = Some(make(&body.name, body.mass_properties.mass));
            }
        }
    }
}
