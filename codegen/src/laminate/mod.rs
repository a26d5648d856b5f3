//! Stage 2: [`SourceModel`] -> [`Mechanism`]: plates become mass properties, hinges become springs;
//! physically impossible models are errors.

mod air;
mod check;
mod contact;
mod elements;
pub mod flexure;
mod fold;
mod geometry;
mod hinge;
mod kinks;
mod lift;
mod linear;
mod mass;
mod mechanism;
mod neighbours;
mod number;
mod outline;
mod plate;
#[cfg(test)]
mod tests;
mod tunable;
mod verdicts;

pub use contact::SINKING;
pub use elements::{Elements, Motor, Tendon, Tension, Twist};
pub use geometry::{Geometry, HingeLine, fixed};
pub(crate) use hinge::direction;
pub use kinks::{Kink, kinks};
pub use linear::{Excursion, excursions};
pub use mechanism::*;
pub use number::{Formula, Number, Real};
pub use verdicts::{Verdict, verdicts};

use nalgebra::Vector3;

use crate::source::codes;
use crate::source::{BodyId, Diagnostic, Diagnostics, InitialBody, Severity, Shape, SourceModel};

/// Smallest size of a mechanism, m. Smaller ones are mistakes and lose digits to underflow.
const SMALLEST: f64 = 1e-9;
/// Largest size of a mechanism, m. Larger ones are mistakes and lose digits to overflow.
const LARGEST: f64 = 1e9;

/// Derives the rigid bodies and hinges of a model; allowed but unusual values go to `warnings`.
///
/// # Errors
/// Returns all physically impossible values together.
pub fn build(model: &SourceModel, warnings: &mut Diagnostics) -> Result<Mechanism, Diagnostics> {
    let mut found = Diagnostics::default();
    check::materials(model, &mut found);
    elements::check_motors(model, &mut found);
    let bodies = model.bodies.iter().map(|body| plate::body(model, body, &mut found)).collect();
    let joints = model.joints.iter().map(|joint| hinge::hinge(model, joint, &mut found)).collect();
    let mut mechanism = Mechanism {
        name: model.name.value.clone(),
        gravity: model.gravity.clone(),
        bodies,
        joints,
        parameters: tunable::declared(model),
        inputs: model.inputs.iter().map(|input| input.value.clone()).collect(),
        points: points(model),
        forces: forces(model),
        elements: elements::elements(model),
        contacts: Vec::new(),
        controllers: model.controllers.clone(),
        initial_q: fold::initial_angles(model, &mut found),
        cuts: model.cuts.clone(),
        initial_given: model.initial_q.iter().map(|(joint, _)| *joint).collect(),
        initial_u: per_joint(model, &model.initial_u),
        free: free_bodies(model),
        air: model.air.as_ref().map(air::air),
        tolerance: model.tolerance,
        size: 0.0,
    };
    for (joint, angle) in &model.initial_q {
        hinge::initial_angle(&mechanism.joints[joint.index()], *angle, &mut found);
    }
    mechanism.size = size(model, &mechanism);
    let across = mechanism.size;
    if !(SMALLEST..LARGEST).contains(&across) && !found.has_errors() {
        let message = format!("the mechanism is {across:e} m across");
        found.push(
            Diagnostic::error(codes::OUT_OF_SCALE, model.name.span, message)
                .hint("are the units right?"),
        );
    }
    if !found.has_errors() {
        neighbours::check(model, across, &mut found);
    }
    if !found.has_errors() {
        mechanism.contacts = contact::contacts(model, &mechanism, &mut found);
    }
    tunable::apply(model, &mut mechanism);
    let defaults: Vec<f64> = mechanism.parameters.iter().map(|parameter| parameter.value).collect();
    let judged = verdicts(&mechanism, &defaults).into_iter();
    found.extend(judged.map(|verdict| verdict.diagnostic(model)));

    let reported = once(found);
    if reported.iter().any(|diagnostic| diagnostic.severity == Severity::Error) {
        return Err(Diagnostics(reported));
    }
    warnings.0.extend(reported);
    Ok(mechanism)
}

/// Returns each diagnostic once: a body's `outline` is copied to every layer, and so are its mistakes.
fn once(found: Diagnostics) -> Vec<Diagnostic> {
    let mut reported: Vec<Diagnostic> = Vec::new();
    for diagnostic in found.0 {
        if !reported.contains(&diagnostic) {
            reported.push(diagnostic);
        }
    }
    reported
}

fn per_joint(model: &SourceModel, given: &[(crate::source::JointId, f64)]) -> Vec<f64> {
    let mut values = vec![0.0; model.joints.len()];
    for (joint, value) in given {
        values[joint.index()] = *value;
    }
    values
}

fn free_bodies(model: &SourceModel) -> Vec<FreeBody> {
    let free = model.bodies.iter().enumerate().filter(|(_, body)| body.free);
    let initial = |id: BodyId| {
        let given = model.initial_bodies.iter().find(|(body, _)| *body == id);
        given.map_or(InitialBody::DRAWN, |(_, initial)| initial.clone())
    };
    free.map(|(index, _)| {
        let body = BodyId(index);
        let InitialBody { position, orientation, velocity, angular_velocity } = initial(body);
        let ([x, y, z], [qw, qx, qy, qz]) = (position, orientation);
        let ([vx, vy, vz], [wx, wy, wz]) = (velocity, angular_velocity);
        FreeBody { body, q: [x, y, z, qw, qx, qy, qz], u: [vx, vy, vz, wx, wy, wz] }
    })
    .collect()
}

fn points(model: &SourceModel) -> Vec<Point> {
    let point = |point: &crate::source::Point| Point {
        name: point.name.value.clone(),
        body: point.body,
        at: point.at.value.into(),
    };
    model.points.iter().map(point).collect()
}

fn forces(model: &SourceModel) -> Vec<Force> {
    let force = |force: &crate::source::Force| Force {
        name: force.name.value.clone(),
        point: force.point,
        force: force.force.clone(),
    };
    model.forces.iter().map(force).collect()
}

/// Returns two ends of a body without a drawing: its radius of gyration away from its centre of mass.
fn gyration(body: &MassProperties) -> [Vector3<f64>; 2] {
    let radius = (body.inertia.trace() / (2.0 * body.mass)).max(0.0).sqrt();
    let side = Vector3::repeat(if radius.is_finite() { radius / 3f64.sqrt() } else { 0.0 });
    [body.com - side, body.com + side]
}

/// Returns the diagonal of the flat bounding box over plates, hinge lines, centres of mass and
/// points, m.
fn size(model: &SourceModel, mechanism: &Mechanism) -> f64 {
    let mut all: Vec<Vector3<f64>> = Vec::new();
    for (body, built) in model.bodies.iter().zip(&mechanism.bodies) {
        if built.mass_properties.mass > 0.0 {
            all.push(built.mass_properties.com);
        }
        if body.free {
            all.extend(gyration(&built.mass_properties));
        }
        if let Shape::Plates(layers) = &body.shape {
            for (layer, plates) in plate::stack(model).zip(layers) {
                for [x, y] in plates.iter().flat_map(|plate| &plate.outline.value) {
                    all.push(Vector3::new(*x, *y, layer.bottom));
                    all.push(Vector3::new(*x, *y, layer.bottom + layer.thickness));
                }
            }
        }
    }
    for joint in &mechanism.joints {
        all.push(joint.point);
        all.push(joint.point + joint.direction * joint.length);
    }
    all.extend(mechanism.points.iter().map(|point| point.at));
    let Some(first) = all.first() else { return 0.0 };
    let low = all.iter().fold(*first, |low, x| low.inf(x));
    let high = all.iter().fold(*first, |high, x| high.sup(x));
    (high - low).norm()
}
