//! A mechanism straight from a reference file, past every stage of lamc.

use lamc::laminate::{Body, Joint, MassProperties, Mechanism};
use lamc::source::{BodyId, Expression, Span};
use nalgebra::{Matrix3, Vector3};

use crate::Reference;

impl Reference {
    /// The mechanism made of the reference's own bodies and joints.
    pub fn mechanism(&self) -> Mechanism {
        let body = |name: &str| {
            let name = name.strip_prefix("ghost of ").unwrap_or(name);
            BodyId(self.bodies.iter().position(|body| body.name == name).expect("a known body"))
        };
        let bodies = self.bodies.iter().map(|body| Body {
            name: body.name.clone(),
            fixed: body.fixed,
            mass_properties: MassProperties {
                mass: body.mass,
                com: body.com.into(),
                inertia: Matrix3::from_fn(|i, j| body.inertia[i][j]),
            },
            mass_parameter: None,
            sheets: Vec::new(),
            point_masses: Vec::new(),
            surface: Vec::new(),
            span: Span::default(),
        });
        let joints = self.joints.iter().map(|joint| Joint {
            name: joint.name.clone(),
            bodies: [body(&joint.parent), body(&joint.child)],
            point: joint.point.into(),
            direction: Vector3::from(joint.axis).normalize(),
            length: 1.0,
            stiffness: Expression::Number(joint.stiffness),
            damping: Expression::Number(joint.damping),
            rest: Expression::Number(joint.rest),
            cubic_stiffness: lamc::source::Expression::ZERO,
            friction: None,
            linear_range: f64::INFINITY,
            torque: Expression::ZERO,
            drive: None,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
            span: Span::default(),
        });
        let points = self.joints.iter().map(|joint| Vector3::from(joint.point));
        let spread = points.clone().map(|p| p.norm()).fold(0.0, f64::max);
        Mechanism {
            cuts: Vec::new(),
            name: "reference".into(),
            gravity: self.gravity.map(Expression::Number),
            bodies: bodies.collect(),
            joints: joints.collect(),
            parameters: Vec::new(),
            inputs: Vec::new(),
            points: Vec::new(),
            forces: Vec::new(),
            initial_q: vec![0.0; self.joints.len()],
            initial_given: Vec::new(),
            initial_u: vec![0.0; self.joints.len()],
            air: None,
            tolerance: 0.0,
            size: spread,
        }
    }
}
