//! The part of the report on contacts: their numbers, where these are from, and the rates that limit steps.

use std::fmt::{self, Write};

use lamc::laminate::{Body, Contact, Mechanism, SINKING};
use lamc::source::Expression;
use nalgebra::Vector3;

/// Writes each contact, if there are any.
pub fn write(text: &mut String, mechanism: &Mechanism) -> fmt::Result {
    if mechanism.contacts.is_empty() {
        return Ok(());
    }
    writeln!(text, "\ncontacts")?;
    mechanism.contacts.iter().try_for_each(|contact| write_contact(text, mechanism, contact))
}

fn write_contact(text: &mut String, mechanism: &Mechanism, contact: &Contact) -> fmt::Result {
    let values: Vec<f64> = mechanism.parameters.iter().map(|parameter| parameter.value).collect();
    let value = |law: &Expression| law.at(&values);
    let carrier = contact.plane.body.map(|body| &mechanism.bodies[body.index()]);
    let carrier = carrier.map_or("the ground".to_owned(), |body| format!("`{}`", body.name));
    let count = contact.points.len();
    writeln!(text, "  {}: {count} points against a plane of {carrier}", contact.name)?;
    let shown = |law: &Expression, unit: &str| match value(law) {
        Some(value) => format!("{value:.4}{unit}"),
        None => "a formula".to_owned(),
    };
    let derived = contact.default.as_ref().map_or(String::new(), |default| {
        format!(
            ": one point under {:.4} g at {:.4} m/s^2 sinks in by {:.0} % of {:.4} mm",
            1e3 * default.mass,
            default.gravity,
            100.0 * SINKING,
            1e3 * default.thickness,
        )
    });
    writeln!(text, "    stiffness {}{derived}", shown(&contact.stiffness, " N/m"))?;
    writeln!(
        text,
        "    dissipation {}, friction {}, slip speed {:.4} mm/s",
        shown(&contact.dissipation, " s/m"),
        shown(&contact.friction, ""),
        1e3 * contact.slip_speed,
    )?;
    let Some(lightest) = lightest(mechanism, contact) else { return Ok(()) };
    let mass = lightest.mass_properties.mass;
    if let Some(stiffness) = value(&contact.stiffness) {
        let rate = (stiffness / mass).sqrt();
        writeln!(
            text,
            "    sqrt(k/m) = {rate:.4} rad/s for `{}`, the lightest body: explicit steps below {:.3e} s",
            lightest.name,
            1.0 / rate,
        )?;
        if let Some(outline) = &contact.plane.outline {
            let speed = 0.5 * outline.thickness * rate;
            writeln!(
                text,
                "    a point of it that arrives at {speed:.4} m/s sinks in by half of the plate; a faster one may get through"
            )?;
        }
    }
    let gravity = mechanism.gravity.each_ref().map(|law| value(law).unwrap_or(0.0));
    let gravity = Vector3::from(gravity).norm();
    match value(&contact.friction).map(|friction| friction * gravity / contact.slip_speed) {
        Some(rate) if rate > 0.0 => writeln!(
            text,
            "    friction mu g / s = {rate:.4} 1/s for what rests on it: explicit steps below {:.3e} s",
            1.0 / rate,
        ),
        _ => Ok(()),
    }
}

/// Returns the lightest of the moving bodies that a contact pushes.
fn lightest<'m>(mechanism: &'m Mechanism, contact: &Contact) -> Option<&'m Body> {
    let bodies = contact.points.iter().map(|point| point.body).chain(contact.plane.body);
    let moving = bodies.map(|body| &mechanism.bodies[body.index()]).filter(|body| !body.fixed);
    moving.min_by(|a, b| a.mass_properties.mass.total_cmp(&b.mass_properties.mass))
}
