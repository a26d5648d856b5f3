//! Mass properties against closed forms and quadrature; models that are refused.

mod hinges;
mod masses;
mod neighbours;
mod refusals;

use super::{Mechanism, build};
use crate::source::{
    Body, BodyId, Diagnostics, Drawn, Expression, Joint, Material, Plate, PointMass, Shape,
    SourceModel, Span, Spanned, Spring,
};

pub fn spanned<T>(value: T) -> Spanned<T> {
    Spanned { value, span: Span { start: 1, end: 2 } }
}

pub fn drawn<T>(value: T) -> Drawn<T> {
    spanned(value).into()
}

pub fn named(name: &str) -> Spanned<String> {
    spanned(name.to_string())
}

/// kg/m^3 and m.
pub fn material(density: f64, thickness: f64) -> Material {
    Material {
        name: named("sheet"),
        density: drawn(density),
        thickness: drawn(thickness),
        youngs_modulus: None,
        yield_stress: None,
    }
}

pub fn plate(outline: &[[f64; 2]], holes: &[&[[f64; 2]]]) -> Plate {
    Plate {
        outline: drawn(outline.to_vec()),
        holes: holes.iter().map(|hole| drawn(hole.to_vec())).collect(),
    }
}

pub fn body(name: &str, shape: Shape) -> Body {
    Body {
        name: named(name),
        fixed: false,
        free: false,
        shape,
        slits: Vec::new(),
        point_masses: Vec::new(),
        span: Span { start: 1, end: 9 },
    }
}

pub fn point_mass(mass: f64, at: [f64; 3]) -> PointMass {
    PointMass { mass: drawn(mass), at: drawn(at) }
}

/// Ground, then these bodies, the first hinged to the ground along y through the origin.
pub fn model(materials: Vec<Material>, bodies: Vec<Body>) -> SourceModel {
    let ground = Body { fixed: true, ..body("ground", Shape::None) };
    let zero = || spanned(Expression::ZERO);
    SourceModel {
        tolerance: 0.0,
        drawing: None,
        cuts: Vec::new(),
        max_hinges: crate::source::MAX_HINGES,
        name: named("test"),
        angle: Default::default(),
        gravity: [Expression::ZERO, Expression::ZERO, Expression::Number(-9.81)],
        layup: (0..materials.len()).collect(),
        materials,
        bodies: std::iter::once(ground).chain(bodies).collect(),
        joints: vec![Joint {
            name: named("j0"),
            bodies: [spanned(BodyId(0)), spanned(BodyId(1))],
            axis: drawn([[0.0, 0.0], [0.0, 1.0]]),
            z: drawn(0.0),
            spring: Spring::Stiffness(zero()),
            damping: zero(),
            rest: zero(),
            cubic_stiffness: zero(),
            friction: None,
            limits: None,
            torque: zero(),
            drive: None,
            fold: None,
            span: Span { start: 3, end: 9 },
        }],
        parameters: Vec::new(),
        inputs: Vec::new(),
        controllers: Vec::new(),
        tunable: Vec::new(),
        initial_q: Vec::new(),
        initial_u: Vec::new(),
        initial_fold: None,
        initial_bodies: vec![],
        points: Vec::new(),
        forces: Vec::new(),
        elements: Default::default(),
        contacts: Vec::new(),
        hinge_models: Vec::new(),
        air: None,
    }
}

/// Builds a model that has nothing wrong with it but for where its hinge is.
pub fn mechanism(model: &SourceModel) -> Mechanism {
    let mut warnings = Diagnostics::default();
    let mechanism = build(model, &mut warnings).unwrap();
    warnings.0.retain(|warning| warning.code.name != "far-hinge");
    assert_eq!(warnings, Diagnostics::default());
    mechanism
}
