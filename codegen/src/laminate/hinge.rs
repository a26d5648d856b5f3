//! Hinges: the line they turn about and the spring they turn against.
//!
//! A beam hinge is a strip bent over its free length L: k = E I / L, I = w t^3 / 12.

use nalgebra::Vector3;

use super::check;
use super::mechanism::Joint;
use crate::source::{Diagnostic, Diagnostics, Expression, SourceModel, Spanned, Spring};

/// Components of a unit vector below this are rounding of a direction along the other axis.
const ALONG_AXIS: f64 = 1e-15;

/// A joint with its line and spring; what is impossible or odd goes to `found`.
pub fn hinge(model: &SourceModel, joint: &crate::source::Joint, found: &mut Diagnostics) -> Joint {
    let name = &joint.name.value;
    let [from, to] = joint.axis.value;
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = dx.hypot(dy);
    if !(length >= f64::MIN_POSITIVE && length.is_finite() && joint.z.is_finite()) {
        let message = format!("the hinge line of `{name}` has no direction");
        found.push(
            Diagnostic::error("zero-axis", joint.axis.span, message)
                .hint("give two different points"),
        );
    }
    let stiffness = stiffness(model, joint, found);
    warn_of_negative_stiffness(name, &stiffness, found);
    driven_angle(joint, found);
    if let Some(damping) = joint.damping.value.as_number()
        && damping < 0.0
    {
        let message = format!("the damping of `{name}` is negative: it would add energy");
        found.push(Diagnostic::error("negative-damping", joint.damping.span, message));
    }
    for (what, value) in
        [("stiffness", &stiffness), ("damping", &joint.damping), ("rest angle", &joint.rest)]
    {
        if value.value.as_number().is_some_and(|number| !number.is_finite()) {
            let message = format!("the {what} of `{name}` is not finite");
            found.push(Diagnostic::error("not-finite", value.span, message));
        }
    }
    Joint {
        name: name.clone(),
        bodies: joint.bodies.each_ref().map(|body| body.value),
        point: Vector3::new(from[0], from[1], joint.z),
        direction: direction(dx, dy),
        length,
        stiffness: stiffness.value,
        damping: joint.damping.value.clone(),
        rest: joint.rest.value.clone(),
        torque: joint.torque.value.clone(),
        drive: joint.drive.as_ref().map(|drive| drive.value.clone()),
        limits: joint
            .limits
            .as_ref()
            .map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| limits.value),
        span: joint.span,
    }
}

/// The unit vector along (dx, dy); exactly along an axis where only rounding says otherwise, so
/// that later stages see zeros as zeros.
fn direction(dx: f64, dy: f64) -> Vector3<f64> {
    // Scaled first: the length of tiny lines has few digits.
    let largest = dx.abs().max(dy.abs());
    let (dx, dy) = (dx / largest, dy / largest);
    let length = dx.hypot(dy);
    let (x, y) = (dx / length, dy / length);
    if x.abs() < ALONG_AXIS {
        Vector3::new(0.0, y.signum(), 0.0)
    } else if y.abs() < ALONG_AXIS {
        Vector3::new(x.signum(), 0.0, 0.0)
    } else {
        Vector3::new(x, y, 0.0)
    }
}

/// A constant prescribed angle that the stops do not allow.
fn driven_angle(joint: &crate::source::Joint, found: &mut Diagnostics) {
    let (Some(drive), Some(limits)) = (&joint.drive, &joint.limits) else { return };
    let [low, high] = limits.value;
    if let Some(angle) = drive.value.constant()
        && (angle < low || angle > high)
    {
        let message = format!("the angle of `{}` is outside its limits", joint.name.value);
        let [angle, low, high] = [angle, low, high].map(f64::to_degrees);
        found.push(
            Diagnostic::error("driven-outside-limits", drive.span, message)
                .hint(format!("{angle:.4} deg is not within {low:.4} .. {high:.4} deg")),
        );
    }
}

/// A guess the stops do not allow.
pub fn initial_angle(joint: &Joint, angle: f64, found: &mut Diagnostics) {
    let [low, high] = joint.limits;
    if angle < low || angle > high {
        let message = format!("the initial angle of `{}` is outside its limits", joint.name);
        let [angle, low, high] = [angle, low, high].map(f64::to_degrees);
        found.push(
            Diagnostic::error("initial-outside-limits", joint.span, message)
                .hint(format!("{angle:.4} deg is not within {low:.4} .. {high:.4} deg")),
        );
    }
}

fn stiffness(
    model: &SourceModel,
    joint: &crate::source::Joint,
    found: &mut Diagnostics,
) -> Spanned<Expression> {
    let (material, length, width) = match &joint.spring {
        Spring::Stiffness(stiffness) => return stiffness.clone(),
        Spring::Beam { material, length, width } => (material, length, width),
    };
    check::positive("free length of the hinge", length, "m", found);
    check::positive("width of the hinge", width, "m", found);
    let strip = &model.materials[material.value];
    let modulus = strip.youngs_modulus.as_ref().map(|modulus| modulus.value);
    if modulus.is_none() {
        let message = format!("`{}` has no `youngs_modulus`", strip.name.value);
        found.push(
            Diagnostic::error("no-modulus", material.span, message)
                .label("a beam's stiffness needs it")
                .hint("add it to the material, as in `youngs_modulus: 4.4 GPa`"),
        );
    }
    let second_moment = width.value * strip.thickness.value.powi(3) / 12.0;
    let stiffness = modulus.map_or(0.0, |modulus| modulus * second_moment / length.value);
    // Mistakes in the strip's numbers are reported as such, not as what they lead to.
    let stiffness = if stiffness.is_finite() { stiffness } else { 0.0 };
    Spanned { value: Expression::Number(stiffness), span: joint.name.span }
}

fn warn_of_negative_stiffness(
    name: &str,
    stiffness: &Spanned<Expression>,
    found: &mut Diagnostics,
) {
    if stiffness.value.as_number().is_some_and(|stiffness| stiffness < 0.0) {
        let message = format!("the stiffness of `{name}` is negative: it is pushed from its rest");
        found.push(
            Diagnostic::warning("negative-stiffness", stiffness.span, message)
                .hint("that is right for a bistable hinge only"),
        );
    }
}
