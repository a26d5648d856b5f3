//! [`SourceModel`] -> our schema, for `lamc import`.
//!
//! Numbers are in SI and radians, each as the shortest text that is read as the same double again.

use std::fmt::Write;

use super::diagnostic::Spanned;
use super::expression::Expression;
use super::formula::{number, print};
use super::model::{
    Contact, ContactPlane, ContactPoints, HingeModel, Joint, Parameter, SourceModel, Spring,
};
use super::polynomial::Term;
use super::schema::OUTLINE;
use drawing::{body, drawn, measure, row};

mod controllers;
mod drawing;
mod elements;

/// Longest line of vertices.
const WIDTH: usize = 100;

/// Writes the model in our schema; reading the text gives exactly the same model.
pub fn to_yaml(model: &SourceModel) -> String {
    let mut out = String::from("# SI units and radians.\n");
    line(&mut out, 0, &format!("name: {}", model.name.value));
    line(&mut out, 0, &format!("gravity: {}", expressions(&model.gravity, model)));
    line(&mut out, 0, &format!("tolerance: {}", number(model.tolerance)));
    materials(&mut out, model);
    section(&mut out, "parameters", &model.parameters, parameter);
    names(&mut out, "inputs", model.inputs.iter().map(|input| input.value.as_str()));
    if let Some(air) = &model.air {
        let [density, drag] = [&air.density, &air.drag].map(|law| expression(&law.value, model));
        line(&mut out, 0, &format!("air: {{ density: {density}, drag: {drag} }}"));
    }
    section(&mut out, "hinge_models", &model.hinge_models, hinge_model);
    names(&mut out, "tunable", model.tunable.iter().map(|kind| kind.value.name()));
    section(&mut out, "bodies", &model.bodies, |out, item| body(out, item, model));
    section(&mut out, "joints", &model.joints, |out, item| joint(out, item, model));
    initial(&mut out, model);
    section(&mut out, "points", &model.points, |out, point| {
        let body = &model.bodies[point.body.index()].name.value;
        let name = &point.name.value;
        line(out, 1, &format!("{name}: {{ body: {body}, at: {} }}", drawn(&point.at, model)));
    });
    section(&mut out, "forces", &model.forces, |out, force| {
        let point = &model.points[force.point.index()].name.value;
        let components = expressions(&force.force, model);
        let name = &force.name.value;
        line(out, 1, &format!("{name}: {{ point: {point}, force: {components} }}"));
    });
    elements::write(&mut out, model);
    section(&mut out, "contacts", &model.contacts, |out, item| contact(out, item, model));
    controllers::write(&mut out, model);
    out
}

fn parameter(out: &mut String, parameter: &Parameter) {
    let unit = parameter.dimension.map_or(String::new(), |dimension| dimension.si_unit());
    let with_unit = |value: f64| format!("{} {unit}", number(value)).trim_end().to_owned();
    let (name, value) = (&parameter.name.value, with_unit(parameter.value));
    match &parameter.range {
        None => line(out, 1, &format!("{name}: {value}")),
        Some(range) => {
            let [low, high] = range.value.map(with_unit);
            line(out, 1, &format!("{name}: {{ value: {value}, range: [{low}, {high}] }}"));
        }
    }
}

fn materials(out: &mut String, model: &SourceModel) {
    section(out, "materials", &model.materials, |out, material| {
        let mut fields = vec![
            format!("density: {}", measure(&material.density, model)),
            format!("thickness: {}", measure(&material.thickness, model)),
        ];
        let modulus = material.youngs_modulus.as_ref();
        fields.extend(modulus.map(|value| format!("youngs_modulus: {}", measure(value, model))));
        let stress = material.yield_stress.as_ref();
        fields.extend(stress.map(|value| format!("yield_stress: {}", number(value.value))));
        mapping(out, 1, &material.name.value, &fields);
    });
    if !model.layup.is_empty() {
        let names = model.layup.iter().map(|&i| model.materials[i].name.value.clone());
        line(
            out,
            0,
            &format!("layup: [{}]  # bottom to top", names.collect::<Vec<_>>().join(", ")),
        );
    }
}

fn hinge_model(out: &mut String, family: &HingeModel) {
    line(out, 1, &format!("{}:", family.name.value));
    for (key, polynomial) in [("stiffness", &family.stiffness), ("damping", &family.damping)] {
        line(out, 2, &format!("{key}:"));
        for Term { coefficient, powers: [l, w, a] } in &polynomial.0 {
            line(out, 3, &format!("- [{}, {l}, {w}, {a}]", number(*coefficient)));
        }
    }
    line(out, 2, "specimens:");
    family.specimens.iter().for_each(|at| line(out, 3, &format!("- {}", list(at))));
}

fn initial(out: &mut String, model: &SourceModel) {
    let guess = |values: &[(super::JointId, f64)]| {
        let named = values.iter().map(|(id, value)| {
            format!("{}: {}", model.joints[id.index()].name.value, number(*value))
        });
        format!("{{ {} }}", named.collect::<Vec<_>>().join(", "))
    };
    let share = model.initial_fold.as_ref();
    let states = &model.initial_bodies;
    let of_joints = !(model.initial_q.is_empty() && model.initial_u.is_empty());
    if share.is_some() || of_joints || !states.is_empty() {
        line(out, 0, "initial:");
        share.into_iter().for_each(|fold| line(out, 1, &format!("fold: {}", number(fold.value))));
        for (key, values) in [("q", &model.initial_q), ("u", &model.initial_u)] {
            if !values.is_empty() {
                line(out, 1, &format!("{key}: {}", guess(values)));
            }
        }
        section_at(out, 1, "bodies", states, |out, (id, state)| {
            let fields = [
                format!("position: {}", list(&state.position)),
                format!("orientation: {}", list(&state.orientation)),
                format!("velocity: {}", list(&state.velocity)),
                format!("angular_velocity: {}", list(&state.angular_velocity)),
            ];
            mapping(out, 2, &model.bodies[id.index()].name.value, &fields);
        });
    }
}

fn contact(out: &mut String, contact: &Contact, model: &SourceModel) {
    line(out, 1, &format!("{}:", contact.name.value));
    let ContactPlane { point, normal, body, within } = &contact.plane;
    let mut plane =
        vec![format!("point: {}", drawn(point, model)), format!("normal: {}", list(&normal.value))];
    let body = body.as_ref().map(|body| &model.bodies[body.value.index()].name.value);
    plane.extend(body.map(|body| format!("body: {body}")));
    plane.extend(within.as_ref().map(|_| format!("within: {OUTLINE}")));
    mapping(out, 2, "plane", &plane);
    let among = |out: &mut String, key: &str, names: Vec<&String>| {
        line(out, 2, &format!("{key}:"));
        names.into_iter().for_each(|name| line(out, 3, &format!("- {name}")));
    };
    match &contact.points {
        ContactPoints::Corners => {}
        ContactPoints::CornersOf(bodies) => {
            let names = bodies.iter().map(|body| &model.bodies[body.value.index()].name.value);
            among(out, "bodies", names.collect());
        }
        ContactPoints::Named(points) => {
            let names = points.iter().map(|point| &model.points[point.value.index()].name.value);
            among(out, "points", names.collect());
        }
    }
    let laws = [("dissipation", &contact.dissipation), ("friction", &contact.friction)];
    for (key, law) in contact.stiffness.iter().map(|law| ("stiffness", law)).chain(laws) {
        line(out, 2, &format!("{key}: {}", expression(&law.value, model)));
    }
    line(out, 2, &format!("slip_speed: {}", number(contact.slip_speed.value)));
}

fn line(out: &mut String, indent: usize, text: &str) {
    // Writing to a string cannot fail.
    let _ = writeln!(out, "{:1$}{text}", "", 2 * indent);
}

/// Writes `key: { .. }` on one line, or one field per line if that line would be too long.
fn mapping(out: &mut String, indent: usize, key: &str, fields: &[String]) {
    let flow = format!("{key}: {{ {} }}", fields.join(", "));
    if 2 * indent + flow.len() <= WIDTH {
        return line(out, indent, &flow);
    }
    line(out, indent, &format!("{key}:"));
    fields.iter().for_each(|field| line(out, indent + 1, field));
}

fn section<T>(out: &mut String, key: &str, items: &[T], write: impl FnMut(&mut String, &T)) {
    section_at(out, 0, key, items, write);
}

fn section_at<T>(
    out: &mut String,
    indent: usize,
    key: &str,
    items: &[T],
    mut write: impl FnMut(&mut String, &T),
) {
    if !items.is_empty() {
        line(out, indent, &format!("{key}:"));
        items.iter().for_each(|item| write(out, item));
    }
}

fn names<'n>(out: &mut String, key: &str, names: impl Iterator<Item = &'n str>) {
    let names: Vec<_> = names.collect();
    if !names.is_empty() {
        line(out, 0, &format!("{key}: [{}]", names.join(", ")));
    }
}

fn list(values: &[f64]) -> String {
    let values: Vec<_> = values.iter().map(|value| number(*value)).collect();
    format!("[{}]", values.join(", "))
}

/// Writes a number as it is and anything else in quotes.
fn expression(expression: &Expression, model: &SourceModel) -> String {
    match expression {
        Expression::Number(value) => number(*value),
        other => format!("\"{}\"", print(other, model)),
    }
}

fn expressions(values: &[Expression], model: &SourceModel) -> String {
    let values: Vec<_> = values.iter().map(|value| expression(value, model)).collect();
    format!("[{}]", values.join(", "))
}

fn joint(out: &mut String, joint: &Joint, model: &SourceModel) {
    line(out, 1, &format!("{}:", joint.name.value));
    let [first, second] =
        joint.bodies.each_ref().map(|id| &model.bodies[id.value.index()].name.value);
    line(out, 2, &format!("bodies: [{first}, {second}]"));
    let points: Vec<String> =
        (0..2).map(|end| row(&joint.axis, end, &joint.axis.value[end], model)).collect();
    let axis = format!("axis: [{}]", points.join(", "));
    match axis.len() + 4 > WIDTH {
        true => {
            line(out, 2, "axis:");
            points.iter().for_each(|point| line(out, 3, &format!("- {point}")));
        }
        false => line(out, 2, &axis),
    }
    // A negative zero must stay negative.
    if joint.z.value.to_bits() != 0 || !joint.z.is_fixed() {
        line(out, 2, &format!("z: {}", measure(&joint.z, model)));
    }
    let mut law = |key: &str, value: &Expression| {
        if !matches!(value, Expression::Number(zero) if zero.to_bits() == 0) {
            line(out, 2, &format!("{key}: {}", expression(value, model)));
        }
    };
    if let Spring::Stiffness(stiffness) = &joint.spring {
        law("stiffness", &stiffness.value);
    }
    law("damping", &joint.damping.value);
    law("rest", &joint.rest.value);
    law("cubic_stiffness", &joint.cubic_stiffness.value);
    law("torque", &joint.torque.value);
    if let Some(drive) = &joint.drive {
        line(out, 2, &format!("drive: {}", expression(&drive.value, model)));
    }
    if let Some(fold) = &joint.fold {
        line(out, 2, &format!("fold: {}", number(fold.value)));
    }
    if let Some(friction) = &joint.friction {
        let torque = expression(&friction.torque.value, model);
        let speed = number(friction.speed.value);
        line(out, 2, &format!("friction: {{ torque: {torque}, speed: {speed} }}"));
    }
    hinge(out, &joint.spring, model);
    if let Some(limits) = &joint.limits {
        line(out, 2, &format!("limits: {}", list(&limits.value)));
    }
}

fn hinge(out: &mut String, spring: &Spring, model: &SourceModel) {
    let size = |length: &Spanned<f64>, width: &Spanned<f64>| {
        format!("length: {}, width: {}", number(length.value), number(width.value))
    };
    let optional = |key: &str, value: &Option<Spanned<f64>>| {
        value.as_ref().map_or(String::new(), |value| format!(", {key}: {}", number(value.value)))
    };
    let fields = match spring {
        Spring::Stiffness(_) => return,
        Spring::Beam { material, length, width, gaps } => {
            let material = &model.materials[material.value].name.value;
            let [length, width] = [length, width].map(|given| measure(given, model));
            let gaps = gaps.as_ref().map(|gaps| format!(", gaps: {}", measure(gaps, model)));
            let gaps = gaps.unwrap_or_default();
            format!("model: beam, material: {material}, length: {length}, width: {width}{gaps}")
        }
        Spring::Family { model: family, length, width, area, .. } => {
            let name = &model.hinge_models[*family].name.value;
            format!("model: {name}, {}{}", size(length, width), optional("area", area))
        }
        Spring::Sharifzadeh2018 { length, width, area, printed, .. } => {
            let (size, area) = (size(length, width), optional("area", area));
            let coefficients = if *printed { ", coefficients: printed" } else { "" };
            format!("model: sharifzadeh2018, {size}{area}{coefficients}")
        }
    };
    line(out, 2, &format!("hinge: {{ {fields} }}"));
}
