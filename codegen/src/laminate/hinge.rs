//! Hinges: the line they turn about and where their stiffness comes from.

use nalgebra::Vector3;

use super::body::check_positive;
use crate::source::{Diagnostic, Diagnostics, Expression, Joint, SourceModel, Spanned, Spring};

/// Components of a unit vector below this are rounding.
const ROUNDING: f64 = 1e-15;

/// A hinge line: first point, unit direction, length (m).
pub fn line(joint: &Joint) -> (Vector3<f64>, Vector3<f64>, f64) {
    let [from, to] = joint.axis.value.map(|[x, y]| Vector3::new(x, y, joint.z));
    let along = to - from;
    let length = along.norm();
    let direction = (along / length).map(|x| {
        if x.abs() < ROUNDING {
            0.0
        } else if (x.abs() - 1.0).abs() < ROUNDING {
            x.signum()
        } else {
            x
        }
    });
    (from, direction, length)
}

/// The stiffness of a joint, N m/rad.
///
/// A beam hinge is a strip of length L (across the gap), width w and thickness t bent over its
/// whole length by a moment: k = E I / L with I = w t^3 / 12 (Euler-Bernoulli; paper, eq. 12).
pub fn stiffness(
    model: &SourceModel,
    joint: &Joint,
    problems: &mut Diagnostics,
    warnings: &mut Diagnostics,
) -> Expression {
    match &joint.spring {
        Spring::Stiffness(stiffness) => {
            if stiffness.value.constant().is_some_and(|k| k < 0.0) {
                let warning =
                    Diagnostic::warning("negative-stiffness", stiffness.span, "negative stiffness")
                        .hint("the joint is pushed away from its rest angle: meant?");
                warnings.push(warning);
            }
            stiffness.value.clone()
        }
        Spring::Beam { material, length, width } => {
            check_positive("length", length, problems);
            check_positive("width", width, problems);
            let sheet = &model.materials[material.value];
            let Some(modulus) = &sheet.youngs_modulus else {
                let problem = Diagnostic::error(
                    "no-youngs-modulus",
                    material.span,
                    format!("material `{}` has no `youngs_modulus`", sheet.name.value),
                )
                .also(sheet.name.span, "the material")
                .hint("a beam hinge's stiffness is E I / L: add `youngs_modulus: 4383 MPa`");
                problems.push(problem);
                return Expression::ZERO;
            };
            let second_moment = width.value * sheet.thickness.value.powi(3) / 12.0;
            Expression::Number(modulus.value * second_moment / length.value)
        }
    }
}

/// Reports damping that feeds energy in.
pub fn check_damping(damping: &Spanned<Expression>, problems: &mut Diagnostics) {
    if damping.value.constant().is_some_and(|b| b < 0.0) {
        let problem = Diagnostic::error("negative-damping", damping.span, "negative damping")
            .hint("a damper takes energy out: its coefficient is 0 or more; drive with `torque`");
        problems.push(problem);
    }
}
