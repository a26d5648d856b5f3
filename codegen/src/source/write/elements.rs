//! Springs, tendons and motors in our schema.

use super::{expression, line, list, mapping, number};
use crate::source::elements::{Motor, Tendon, Tension, Twist};
use crate::source::expression::Expression;
use crate::source::model::SourceModel;

/// Writes the force elements of a model.
pub fn write(out: &mut String, model: &SourceModel) {
    let elements = &model.elements;
    if !(elements.bands.is_empty() && elements.twists.is_empty()) {
        line(out, 0, "springs:");
        for band in &elements.bands {
            let names: Vec<&str> = points(band, model).collect();
            let mut fields = vec![format!("from: {}", names[0]), format!("to: {}", names[1])];
            fields.extend(tension(band, model));
            if let Tension::Elastic { tension_only: true, .. } = band.tension {
                fields.push("tension_only: true".to_owned());
            }
            mapping(out, 1, &band.name.value, &fields);
        }
        elements.twists.iter().for_each(|twist| self::twist(out, twist, model));
    }
    super::section(out, "tendons", &elements.tendons, |out, tendon| {
        let names: Vec<&str> = points(tendon, model).collect();
        let mut fields = vec![format!("through: [{}]", names.join(", "))];
        fields.extend(tension(tendon, model));
        mapping(out, 1, &tendon.name.value, &fields);
    });
    super::section(out, "motors", &elements.motors, |out, it| motor(out, it, model));
}

fn points<'m>(tendon: &'m Tendon, model: &'m SourceModel) -> impl Iterator<Item = &'m str> {
    let points = tendon.through.iter();
    points.map(|point| model.points[point.value.index()].name.value.as_str())
}

/// The field of a formula, unless it is the number 0, which is the default.
fn law(key: &str, value: &Expression, model: &SourceModel) -> Option<String> {
    let is_default = matches!(value, Expression::Number(zero) if zero.to_bits() == 0);
    (!is_default).then(|| field(key, value, model))
}

fn field(key: &str, value: &Expression, model: &SourceModel) -> String {
    format!("{key}: {}", expression(value, model))
}

fn tension(tendon: &Tendon, model: &SourceModel) -> Vec<String> {
    match &tendon.tension {
        Tension::Given(tension) => vec![field("tension", &tension.value, model)],
        Tension::Elastic { stiffness, damping, rest_length, .. } => {
            let mut fields = vec![field("stiffness", &stiffness.value, model)];
            fields.extend(law("damping", &damping.value, model));
            let rest_length = rest_length.as_ref();
            fields.extend(rest_length.map(|length| field("rest_length", &length.value, model)));
            fields
        }
    }
}

fn twist(out: &mut String, twist: &Twist, model: &SourceModel) {
    let bodies = twist.bodies.each_ref().map(|body| &*model.bodies[body.value.index()].name.value);
    let [from, to] = twist.axis.value.each_ref().map(|point| list(point));
    let mut fields = vec![
        format!("bodies: [{}]", bodies.join(", ")),
        format!("axis: [{from}, {to}]"),
        field("stiffness", &twist.stiffness.value, model),
    ];
    fields.extend(law("damping", &twist.damping.value, model));
    fields.extend(law("rest", &twist.rest.value, model));
    mapping(out, 1, &twist.name.value, &fields);
}

fn motor(out: &mut String, motor: &Motor, model: &SourceModel) {
    let joint = &model.joints[motor.joint.value.index()].name.value;
    let mut fields = vec![
        format!("joint: {joint}"),
        field("torque_constant", &motor.torque_constant.value, model),
        field("resistance", &motor.resistance.value, model),
        format!("gear: {}", number(motor.gear.value)),
    ];
    if motor.inertia.value.to_bits() != 0 {
        fields.push(format!("inertia: {}", number(motor.inertia.value)));
    }
    fields.push(field("voltage", &motor.voltage.value, model));
    for (key, limit) in [("max_voltage", &motor.max_voltage), ("max_current", &motor.max_current)] {
        fields.extend(limit.as_ref().map(|limit| field(key, &limit.value, model)));
    }
    mapping(out, 1, &motor.name.value, &fields);
}
