//! Bodies: mass properties from plates, point masses or as given, and whether they are possible.

use nalgebra::{Matrix3, Vector3};

use super::mechanism::MassProperties;
use super::moments::MassMoments;
use super::plate;
use crate::source::{Body, Diagnostic, Diagnostics, Plate, Shape, SourceModel, Span, Spanned};

/// Relative to the largest principal moment: what counts as zero or as a violated inequality.
const TOLERANCE: f64 = 1e-9;

/// The mass properties of a body; errors to `problems`, doubts to `warnings`.
pub fn mass_properties(
    model: &SourceModel,
    body: &Body,
    problems: &mut Diagnostics,
    warnings: &mut Diagnostics,
) -> MassProperties {
    let before = problems.0.len();
    // Moments are taken about a point near the body, so that none is a difference of large numbers.
    let origin = near(body);
    let shape = match &body.shape {
        Shape::None => MassMoments::default(),
        Shape::Plates(layers) => plates(model, layers, origin, problems, warnings),
        Shape::Rigid { mass, com, inertia } => {
            check_positive("mass", mass, problems);
            check_inertia(&inertia.value, inertia.span, problems);
            let com = Vector3::from(com.value);
            let inertia = Matrix3::from(inertia.value).transpose();
            MassProperties { mass: mass.value, com, inertia }.moments(origin)
        }
    };
    let all = body.point_masses.iter().fold(shape, |sum, point| {
        check_positive("mass", &point.mass, problems);
        sum.plus(MassMoments::point(point.mass.value, Vector3::from(point.at) - origin))
    });
    let properties = all.properties(origin);
    // A sheet without density was reported as such: no need to say that its plates have no mass.
    let sheets =
        || model.materials.iter().all(|m| m.density.value > 0.0 && m.thickness.value > 0.0);
    let sound = !matches!(body.shape, Shape::Plates(_)) || sheets();
    if !body.fixed && sound && problems.0.len() == before {
        check_moving(body, &properties, problems);
    }
    properties
}

fn plates(
    model: &SourceModel,
    layers: &[Vec<Plate>],
    origin: Vector3<f64>,
    problems: &mut Diagnostics,
    warnings: &mut Diagnostics,
) -> MassMoments {
    let mut bottom = -origin.z;
    let mut sum = MassMoments::default();
    let same = |a: &Plate, b: &Plate| a.outline.span == b.outline.span;
    for (index, (layer, &material)) in layers.iter().zip(&model.layup).enumerate() {
        let material = &model.materials[material];
        let top = bottom + material.thickness.value;
        // An outline that fills several layers is looked at (and reported) once.
        let seen = layers[..index].iter().any(|earlier| {
            earlier.len() == layer.len() && earlier.iter().zip(layer).all(|(a, b)| same(a, b))
        });
        let mut ignored = Diagnostics::default();
        let problems = if seen { &mut ignored } else { &mut *problems };
        let before = problems.0.len();
        for plate in layer {
            let area = plate::moments(plate, [origin.x, origin.y], problems);
            sum = sum.plus(MassMoments::slab(area, material.density.value, bottom, top));
        }
        if !seen && problems.0.len() == before {
            plate::check_overlaps(layer, warnings);
        }
        bottom = top;
    }
    sum
}

/// A point near the body.
fn near(body: &Body) -> Vector3<f64> {
    match &body.shape {
        Shape::Rigid { com, .. } => Vector3::from(com.value),
        Shape::Plates(layers) => layers
            .iter()
            .flatten()
            .find_map(|plate| plate.outline.value.first())
            .map_or(Vector3::zeros(), |&[x, y]| Vector3::new(x, y, 0.0)),
        Shape::None => body.point_masses.first().map_or(Vector3::zeros(), |p| p.at.into()),
    }
}

/// Reports a number that is not positive.
pub fn check_positive(what: &str, number: &Spanned<f64>, problems: &mut Diagnostics) {
    if number.value.is_nan() || number.value <= 0.0 {
        let message = format!("{what} must be positive");
        problems.push(Diagnostic::error("not-positive", number.span, message));
    }
}

fn check_inertia(rows: &[[f64; 3]; 3], span: Span, problems: &mut Diagnostics) {
    let inertia = Matrix3::from(*rows);
    if (inertia - inertia.transpose()).amax() > TOLERANCE * inertia.amax() {
        let problem = Diagnostic::error("inertia", span, "an inertia matrix is symmetric")
            .hint("entry [i][j] must equal entry [j][i]");
        problems.push(problem);
    } else if let Some(reason) = impossible(&inertia) {
        problems.push(Diagnostic::error("inertia", span, reason));
    }
}

/// Why no rigid body has this inertia about its centre of mass.
fn impossible(inertia: &Matrix3<f64>) -> Option<String> {
    let mut moments = inertia.symmetric_eigenvalues();
    moments.as_mut_slice().sort_by(f64::total_cmp);
    let [least, middle, most] = moments.into();
    let values = format!("its principal moments are {least:.3e}, {middle:.3e}, {most:.3e} kg m^2");
    if least.is_nan() || least <= TOLERANCE * most {
        return Some(format!("the inertia is not positive definite: {values}"));
    }
    (least + middle < most * (1.0 - TOLERANCE)).then(|| {
        format!(
            "no body has this inertia: {values}, and two must not add up to less than the third"
        )
    })
}

fn check_moving(body: &Body, properties: &MassProperties, problems: &mut Diagnostics) {
    let name = &body.name.value;
    if properties.mass <= 0.0 {
        let problem = Diagnostic::error(
            "no-mass",
            body.name.span,
            format!("body `{name}` moves and has no mass"),
        )
        .hint("give it an `outline`, `layers`, `point_masses`, or `mass`, `com` and `inertia`");
        problems.push(problem);
    } else if matches!(body.shape, Shape::None)
        && let Some(reason) = impossible(&properties.inertia)
    {
        let problem = Diagnostic::error(
            "inertia",
            body.name.span,
            format!("the point masses of body `{name}` lie on one line: {reason}"),
        )
        .hint("a rigid body needs extent in every direction: add a plate, or give its `inertia`");
        problems.push(problem);
    }
}
