//! Hinges: their lines, springs and dampers.
//!
//! Models of hinges are in [`flexure`](super::flexure).

use nalgebra::Vector3;

use super::check;
use super::flexure::sharifzadeh2018::Coefficients;
use super::flexure::{self, Beam};
use super::mechanism::{Friction, Joint};
use crate::arithmetic::hypot;
use crate::source::codes;
use crate::source::{
    Diagnostic, Diagnostics, Drawn, Expression, HingeModel, Material, Operator, SourceModel, Span,
    Spanned, Spring,
};

/// Components of a unit vector below this bound are rounding errors of a direction along the other
/// axis.
const ALONG_AXIS: f64 = 1e-15;

/// Derives a joint with its line and spring; errors and warnings go to `found`.
pub fn hinge(model: &SourceModel, joint: &crate::source::Joint, found: &mut Diagnostics) -> Joint {
    let name = &joint.name.value;
    let [from, to] = joint.axis.value;
    let (dx, dy) = (to[0] - from[0], to[1] - from[1]);
    let length = hypot(dx, dy);
    if !(length >= f64::MIN_POSITIVE && length.is_finite() && joint.z.value.is_finite()) {
        let message = format!("the hinge line of `{name}` has no direction");
        found.push(
            Diagnostic::error(codes::ZERO_AXIS, joint.axis.span, message)
                .hint("give two different points"),
        );
    }
    let Flexure { stiffness, damping, linear_range } = flexed(model, joint, found);
    Joint {
        name: name.clone(),
        bodies: joint.bodies.each_ref().map(|body| body.value),
        point: Vector3::new(from[0], from[1], joint.z.value),
        direction: direction(dx, dy),
        length,
        stiffness,
        damping,
        rest: joint.rest.value.clone(),
        cubic_stiffness: joint.cubic_stiffness.value.clone(),
        friction: joint.friction.as_ref().map(|given| friction(given, found)),
        linear_range,
        torque: joint.torque.value.clone(),
        drive: joint.drive.as_ref().map(|drive| drive.value.clone()),
        limits: joint
            .limits
            .as_ref()
            .map_or([f64::NEG_INFINITY, f64::INFINITY], |limits| limits.value),
        fold: joint.fold.as_ref().map(|fold| fold.value),
        span: joint.span,
    }
}

/// Returns the unit vector along (dx, dy). If it differs from an axis by rounding only, it is
/// exactly along that axis, so that later stages see exact zeros.
pub fn direction(dx: f64, dy: f64) -> Vector3<f64> {
    // The vector is scaled first, because the length of tiny lines has few digits.
    let largest = dx.abs().max(dy.abs());
    let (dx, dy) = (dx / largest, dy / largest);
    let length = hypot(dx, dy);
    let (x, y) = (dx / length, dy / length);
    if x.abs() < ALONG_AXIS {
        Vector3::new(0.0, y.signum(), 0.0)
    } else if y.abs() < ALONG_AXIS {
        Vector3::new(x.signum(), 0.0, 0.0)
    } else {
        Vector3::new(x, y, 0.0)
    }
}

/// Reports an initial angle that is outside the limits.
pub fn initial_angle(joint: &Joint, angle: f64, found: &mut Diagnostics) {
    let [low, high] = joint.limits;
    if angle < low || angle > high {
        let message = format!("the initial angle of `{}` is outside its limits", joint.name);
        let [angle, low, high] = [angle, low, high].map(f64::to_degrees);
        found.push(
            Diagnostic::error(codes::INITIAL_OUTSIDE_LIMITS, joint.span, message)
                .hint(format!("{angle:.4} deg is not within {low:.4} .. {high:.4} deg")),
        );
    }
}

/// Result of a hinge model.
struct Flexure {
    stiffness: Expression,
    damping: Expression,
    /// rad.
    linear_range: f64,
}

fn flexed(model: &SourceModel, joint: &crate::source::Joint, found: &mut Diagnostics) -> Flexure {
    let damping = joint.damping.value.clone();
    match &joint.spring {
        Spring::Stiffness(stiffness) => {
            Flexure { stiffness: stiffness.value.clone(), damping, linear_range: f64::INFINITY }
        }
        Spring::Beam { material, length, width, gaps } => {
            let strip = &model.materials[material.value];
            let beam = beam(strip, material.span, length, width, gaps.as_ref(), found);
            // Mistakes in the numbers of the strip are reported directly, not their consequences.
            let stiffness = Some(beam.stiffness()).filter(|stiffness| stiffness.is_finite());
            // The angle depends on the bending moment only, not on the arm.
            let range = |sigma: &Spanned<f64>| beam.linear_range(sigma.value, 1.0).angle;
            let linear_range = strip.yield_stress.as_ref().map_or(f64::INFINITY, range);
            let number = Expression::Number(stiffness.unwrap_or(0.0));
            let stiffness = beam_formula(strip, length, width, gaps.as_ref()).unwrap_or(number);
            Flexure { stiffness, damping, linear_range }
        }
        Spring::Family { model: family, length, width, area, span } => {
            let family = &model.hinge_models[*family];
            check::positive("length of the hinge", length, "m", found);
            check::positive("width of the hinge", width, "m", found);
            let at = [length.value, width.value, area.as_ref().map_or(0.0, |area| area.value)];
            let [stiffness, damping] =
                [&family.stiffness, &family.damping].map(|polynomial| polynomial.value(at));
            family_bounds(family, &joint.name.value, at, area.is_some(), *span, found);
            for (what, value) in [("stiffness", stiffness), ("damping", damping)] {
                if value.is_nan() || value <= 0.0 {
                    let name = &family.name.value;
                    let message =
                        format!("the {what} of `{name}` is {value:.4e}, which is not positive");
                    found.push(Diagnostic::error(codes::OUTSIDE_MODEL, *span, message));
                }
            }
            let [stiffness, damping] = [stiffness, damping].map(Expression::Number);
            Flexure { stiffness, damping, linear_range: f64::INFINITY }
        }
        Spring::Sharifzadeh2018 { length, width, area, printed, span } => {
            let model = if *printed { Coefficients::Printed } else { Coefficients::Corrected };
            let area = area.as_ref().map(|area| area.value);
            let [stiffness, damping] = match model.hinge(length.value, width.value, area) {
                Ok(hinge) => [hinge.stiffness, hinge.material_damping + hinge.air_damping],
                Err(refusal) => {
                    let name = &joint.name.value;
                    found.push(
                        Diagnostic::error(codes::OUTSIDE_MODEL, *span, refusal.to_string())
                            .label(format!("`sharifzadeh2018` does not describe `{name}`"))
                            .hint(
                                "see docs/HINGES.md, or give `stiffness` and `damping` \
                                   directly",
                            ),
                    );
                    [0.0; 2]
                }
            };
            let [stiffness, damping] = [stiffness, damping].map(Expression::Number);
            Flexure { stiffness, damping, linear_range: f64::INFINITY }
        }
    }
}

fn beam(
    strip: &Material,
    named: Span,
    length: &Drawn<f64>,
    width: &Drawn<f64>,
    gaps: Option<&Drawn<f64>>,
    found: &mut Diagnostics,
) -> Beam {
    check::positive("free length of the hinge", length, "m", found);
    check::positive("width of the hinge", width, "m", found);
    let cut = gaps.map_or(0.0, |gaps| gaps.value);
    if let Some(gaps) = gaps
        && !(cut >= 0.0 && cut < width.value)
    {
        let message = format!("gaps of {cut} m in a hinge {} m wide", width.value);
        found.push(Diagnostic::error(codes::NO_WIDTH, gaps.span, message).hint(
            "`gaps` is the part of the width that is cut out: it must be less than the \
                       width",
        ));
    }
    let modulus = strip.youngs_modulus.as_ref().map(|modulus| modulus.value);
    if modulus.is_none() {
        let message = format!("`{}` has no `youngs_modulus`", strip.name.value);
        found.push(
            Diagnostic::error(codes::NO_MODULUS, named, message)
                .label("a beam's stiffness needs it")
                .hint("add it to the material, as in `youngs_modulus: 4.4 GPa`"),
        );
    }
    Beam {
        youngs_modulus: modulus.unwrap_or(0.0),
        length: length.value,
        width: width.value - cut,
        thickness: strip.thickness.value,
    }
}

/// Returns the stiffness of a strip, k = E w t^3 / (12 x), as a formula if it depends on parameters.
fn beam_formula(
    strip: &Material,
    length: &Drawn<f64>,
    width: &Drawn<f64>,
    gaps: Option<&Drawn<f64>>,
) -> Option<Expression> {
    let modulus = strip.youngs_modulus.as_ref()?;
    let mut given = [modulus, length, width, &strip.thickness].into_iter().chain(gaps);
    if given.all(Drawn::is_fixed) {
        return None;
    }
    let of =
        |drawn: &Drawn<f64>| drawn.formula(0).cloned().unwrap_or(Expression::Number(drawn.value));
    let cut = gaps.map(|gaps| (Operator::Sub, of(gaps)));
    let width = Expression::Chain(Box::new(of(width)), cut.into_iter().collect());
    let thickness = (Operator::Mul, of(&strip.thickness));
    let rest = [
        (Operator::Mul, width),
        thickness.clone(),
        thickness.clone(),
        thickness,
        (Operator::Div, Expression::Number(12.0)),
        (Operator::Div, of(length)),
    ];
    Some(Expression::Chain(Box::new(of(modulus)), rest.to_vec()))
}

/// Warns of a hinge outside the convex hull of the specimens its model was fitted to.
fn family_bounds(
    family: &HingeModel,
    joint: &str,
    at: [f64; 3],
    has_area: bool,
    span: Span,
    found: &mut Diagnostics,
) {
    let [length, width, _] = at;
    let flat: Vec<[f64; 2]> = family.specimens.iter().map(|[l, w, _]| [*l, *w]).collect();
    let inside = match has_area {
        true => flexure::contains(&family.specimens, at),
        false => flexure::contains(&flat, [length, width]),
    };
    if !inside {
        let name = &family.name.value;
        let message = format!("`{joint}` lies outside the specimens that `{name}` was fitted to");
        found.push(
            Diagnostic::warning(codes::OUTSIDE_SPECIMENS, span, message)
                .hint("the polynomials are not reliable beyond the measured sizes"),
        );
    }
}

fn friction(given: &crate::source::Friction, found: &mut Diagnostics) -> Friction {
    check::positive("speed of the friction", &given.speed, "rad/s", found);
    Friction { torque: given.torque.value.clone(), speed: given.speed.value }
}
