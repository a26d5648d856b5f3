//! From the model as written to the mechanism.

use nalgebra::Vector3;

use super::body::{check_positive, mass_properties};
use super::hinge;
use super::mechanism::{Body, Force, Joint, Mechanism, Parameter, Point};
use crate::source::{
    self, Diagnostic, Diagnostics, Expression, ParameterId, Shape, SourceModel, Tunable,
};

/// Builds the mechanism; doubts go to `warnings`.
///
/// # Errors
/// Everything physically impossible about the model.
pub fn build(model: &SourceModel, warnings: &mut Diagnostics) -> Result<Mechanism, Diagnostics> {
    let mut problems = Diagnostics::default();
    for material in &model.materials {
        check_positive("density", &material.density, &mut problems);
        check_positive("thickness", &material.thickness, &mut problems);
        if let Some(modulus) = &material.youngs_modulus {
            check_positive("youngs_modulus", modulus, &mut problems);
        }
    }
    let mut parameters = Parameters::declared(model);
    let mut bodies = Vec::new();
    for body in &model.bodies {
        let properties = mass_properties(model, body, &mut problems, warnings);
        let tunable = !body.fixed && parameters.tunable(Tunable::Mass);
        let name = &body.name.value;
        let mass_parameter =
            tunable.then(|| parameters.add(Tunable::Mass, "body", name, properties.mass, "kg"));
        bodies.push(Body {
            name: name.clone(),
            fixed: body.fixed,
            mass_properties: properties,
            mass_parameter,
            span: body.span,
        });
    }
    let mut joints = Vec::new();
    for joint in &model.joints {
        hinge::check_damping(&joint.damping, &mut problems);
        let stiffness = hinge::stiffness(model, joint, &mut problems, warnings);
        let name = &joint.name.value;
        let (point, direction, length) = hinge::line(joint);
        let (damping, rest) = (joint.damping.value.clone(), joint.rest.value.clone());
        let mut constant = |what, expression: Expression, unit| {
            parameters.of_constant(what, name, expression, unit)
        };
        joints.push(Joint {
            name: name.clone(),
            bodies: [joint.bodies[0].value, joint.bodies[1].value],
            point,
            direction,
            length,
            stiffness: constant(Tunable::Stiffness, stiffness, "N m/rad"),
            damping: constant(Tunable::Damping, damping, "N m s/rad"),
            rest: constant(Tunable::Rest, rest, "rad"),
            torque: joint.torque.value.clone(),
            limits: joint
                .limits
                .as_ref()
                .map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| limits.value),
            span: joint.span,
        });
    }
    let mut initial_q = vec![0.0; joints.len()];
    let mut initial_u = vec![0.0; joints.len()];
    for &(joint, angle) in &model.initial_q {
        initial_q[joint.index()] = angle;
        let [least, greatest] = joints[joint.index()].limits;
        if angle < least || angle > greatest {
            let name = &joints[joint.index()].name;
            let problem = Diagnostic::error(
                "initial-outside-limits",
                joints[joint.index()].span,
                format!("the initial angle of `{name}` is outside its limits"),
            )
            .hint(format!(
                "{:.4} deg is not within {:.4} .. {:.4} deg",
                angle.to_degrees(),
                least.to_degrees(),
                greatest.to_degrees()
            ));
            problems.push(problem);
        }
    }
    for &(joint, rate) in &model.initial_u {
        initial_u[joint.index()] = rate;
    }
    if problems.has_errors() {
        return Err(problems);
    }
    let points: Vec<_> = model.points.iter().map(point).collect();
    Ok(Mechanism {
        name: model.name.value.clone(),
        gravity: model.gravity.clone(),
        size: size(model, &bodies, &joints, &points),
        bodies,
        joints,
        parameters: parameters.list,
        inputs: model.inputs.iter().map(|input| input.value.clone()).collect(),
        points,
        forces: model
            .forces
            .iter()
            .map(|force| Force {
                name: force.name.value.clone(),
                point: force.point,
                force: force.force.clone(),
            })
            .collect(),
        initial_q,
        initial_given: model.initial_q.iter().map(|&(joint, _)| joint).collect(),
        initial_u,
    })
}

fn point(point: &source::Point) -> Point {
    Point { name: point.name.value.clone(), body: point.body, at: point.at.into() }
}

/// Parameters as they are gathered.
struct Parameters<'a> {
    model: &'a SourceModel,
    list: Vec<Parameter>,
}

impl<'a> Parameters<'a> {
    fn declared(model: &'a SourceModel) -> Self {
        let declared = |parameter: &source::Parameter| Parameter {
            name: parameter.name.value.clone(),
            value: parameter.value,
            doc: format!("Parameter `{}`, SI.", parameter.name.value),
        };
        Self { model, list: model.parameters.iter().map(declared).collect() }
    }

    fn tunable(&self, what: Tunable) -> bool {
        self.model.tunable.iter().any(|tunable| tunable.value == what)
    }

    fn add(
        &mut self,
        what: Tunable,
        kind: &str,
        owner: &str,
        value: f64,
        unit: &str,
    ) -> ParameterId {
        let doc = format!("{} of {kind} `{owner}`, {unit}.", sentence(what.name()));
        self.list.push(Parameter { name: what.parameter_name(owner), value, doc });
        ParameterId(self.list.len() - 1)
    }

    /// A joint's number: a new parameter when tunable and constant, else as it is.
    fn of_constant(
        &mut self,
        what: Tunable,
        joint: &str,
        expression: Expression,
        unit: &str,
    ) -> Expression {
        match expression.constant() {
            Some(value) if self.tunable(what) => {
                Expression::Parameter(self.add(what, "joint", joint, value, unit))
            }
            _ => expression,
        }
    }
}

fn sentence(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map_or_else(String::new, |first| first.to_uppercase().chain(letters).collect())
}

/// Diagonal of the box around everything drawn, m.
fn size(model: &SourceModel, bodies: &[Body], joints: &[Joint], points: &[Point]) -> f64 {
    let mut low = Vector3::repeat(f64::INFINITY);
    let mut high = Vector3::repeat(f64::NEG_INFINITY);
    let mut include = |at: Vector3<f64>| {
        low = low.inf(&at);
        high = high.sup(&at);
    };
    for (body, built) in model.bodies.iter().zip(bodies) {
        if let Shape::Plates(layers) = &body.shape {
            let mut z = 0.0;
            for (layer, &material) in layers.iter().zip(&model.layup) {
                let top = z + model.materials[material].thickness.value;
                for &[x, y] in layer.iter().flat_map(|plate| &plate.outline.value) {
                    include(Vector3::new(x, y, z));
                    include(Vector3::new(x, y, top));
                }
                z = top;
            }
        }
        body.point_masses.iter().for_each(|mass| include(mass.at.into()));
        if built.mass_properties.mass > 0.0 {
            include(built.mass_properties.com);
        }
    }
    for joint in joints {
        include(joint.point);
        include(joint.point + joint.direction * joint.length);
    }
    points.iter().for_each(|point| include(point.at));
    (high - low).norm()
}
