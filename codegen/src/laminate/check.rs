//! Checks of materials and inertias for physically impossible values.
//!
//! The inertia of a rigid body is symmetric, without negative principal moments, and each of these
//! is at most the sum of the two others (each is an integral of the squares of two coordinates).

use nalgebra::Matrix3;

use super::mechanism::MassProperties;
use crate::arithmetic::largest;
use crate::source::codes;
use crate::source::{Body, Diagnostic, Diagnostics, Drawn, Material, SourceModel, Span, Spanned};

/// Relative to the largest moment: differences below this are rounding of printed numbers.
const ROUNDING: f64 = 1e-6;

/// A number with its position in the source text.
pub trait Located {
    /// Returns both.
    fn located(&self) -> (f64, Span);
}

impl Located for Spanned<f64> {
    fn located(&self) -> (f64, Span) {
        (self.value, self.span)
    }
}

impl Located for Drawn<f64> {
    fn located(&self) -> (f64, Span) {
        (self.value, self.span)
    }
}

/// Checks a quantity that must be finite and positive.
pub fn positive(name: &str, given: &impl Located, unit: &str, found: &mut Diagnostics) {
    let (value, span) = given.located();
    if value > 0.0 && value.is_finite() {
        return;
    }
    let message = format!("the {name} is {value} {unit}");
    found.push(
        Diagnostic::error(codes::NOT_POSITIVE, span, message)
            .label("must be finite and greater than zero"),
    );
}

/// Returns whether every number is finite.
pub fn all_finite(values: &[f64]) -> bool {
    values.iter().all(|value| value.is_finite())
}

/// Checks density, thickness and moduli of every material.
pub fn materials(model: &SourceModel, found: &mut Diagnostics) {
    for material in &model.materials {
        positive("density", &material.density, "kg/m^3", found);
        positive("thickness", &material.thickness, "m", found);
        if let Some(modulus) = &material.youngs_modulus {
            positive("Young's modulus", modulus, "Pa", found);
        }
        if let Some(stress) = &material.yield_stress {
            positive("yield stress", stress, "Pa", found);
        }
    }
}

/// Returns whether sheets of a material have mass.
pub fn is_physical(material: &Material) -> bool {
    let values = [material.density.value, material.thickness.value];
    values.iter().all(|value| *value > 0.0 && value.is_finite())
}

/// Checks a given inertia: symmetry, no negative moments, triangle inequality.
pub fn rigid_inertia(inertia: &Matrix3<f64>, span: Span, found: &mut Diagnostics) {
    let largest = largest(inertia);
    let error = |code, message: String| Diagnostic::error(code, span, message);
    if !largest.is_finite() {
        found.push(error(codes::NOT_FINITE, "the inertia is not finite".into()));
        return;
    }
    if (inertia - inertia.transpose()).amax() > ROUNDING * largest {
        found.push(
            error(codes::ASYMMETRIC_INERTIA, "the inertia is not symmetric".into())
                .hint("xy = yx, xz = zx, yz = zy"),
        );
        return;
    }
    let moments = principal_moments(inertia);
    let [low, middle, high] = moments;
    if low < -ROUNDING * high.abs() || high < 0.0 {
        let message = format!("the inertia has the negative principal moment {low:.3e} kg m^2");
        found.push(error(codes::INERTIA_NOT_POSITIVE, message).hint(
            "products of inertia enter with a minus sign: xy = -sum(m x y), \
             and moments are about the centre of mass",
        ));
    } else if low + middle < high * (1.0 - ROUNDING) {
        let message = format!(
            "no rigid body has the principal moments {low:.3e}, {middle:.3e} and {high:.3e} kg m^2"
        );
        found.push(error(codes::INERTIA_TRIANGLE, message).label(
            "the largest exceeds the sum of the \
                                                           two others",
        ));
    }
}

/// Checks mass and inertia of a moving body whose parts are valid.
pub fn moving_body(body: &Body, properties: &MassProperties, found: &mut Diagnostics) {
    let name = &body.name.value;
    let error = |code, message: String| Diagnostic::error(code, body.name.span, message);
    let MassProperties { mass, com, inertia } = properties;
    if !mass.is_finite()
        || !com.iter().all(|x| x.is_finite())
        || !inertia.iter().all(|x| x.is_finite())
    {
        let message = format!("the mass properties of body `{name}` are not finite");
        found.push(error(codes::OUT_OF_SCALE, message).hint("are the units right?"));
        return;
    }
    if *mass <= 0.0 {
        found
            .push(error(codes::NO_MASS, format!("body `{name}` moves but has no mass")).hint(
                "give it an `outline`, `layers` with plates, or `mass`, `com` and `inertia`",
            ));
    }
}

/// The principal moments in ascending order.
fn principal_moments(inertia: &Matrix3<f64>) -> [f64; 3] {
    let mut moments: [f64; 3] = inertia.symmetric_eigenvalues().into();
    moments.sort_by(f64::total_cmp);
    moments
}
