//! The model as written in the file, with names resolved and quantities in SI and radians. Nothing
//! is derived yet.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

use super::argument::AngleUnit;
use super::controllers::Controller;
use super::diagnostic::{SourceFile, Span, Spanned};
use super::drawn::Drawn;
use super::elements::Elements;
use super::expression::Expression;
use super::ids::{BodyId, InputId, JointId, PointId};
use super::polynomial::Polynomial;
use super::tunable::Tunable;
use super::units::Dimension;

/// Default limit of the number of hinges: the size of the equations and the time to derive them
/// grow as the square of this number.
pub const MAX_HINGES: usize = 2000;
/// Most vertices of an outline or a hole: whether it crosses itself is found from all pairs of its edges.
pub const MAX_VERTICES: usize = 10_000;

/// A mechanism as its file describes it. All numbers are in SI units (m, kg, s, rad).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct SourceModel {
    /// The model's name: an identifier.
    pub name: Spanned<String>,
    /// Unit of angles that are written without a unit, also on a command line.
    pub angle: AngleUnit,
    /// Gravity in the base frame, m/s^2.
    pub gravity: [Expression; 3],
    /// Materials, in file order.
    pub materials: Vec<Material>,
    /// The stack of sheets, bottom (z = 0) to top: indices into `materials`.
    pub layup: Vec<usize>,
    /// Bodies, in file order.
    pub bodies: Vec<Body>,
    /// Joints, in file order: the order of q and u.
    pub joints: Vec<Joint>,
    /// Declared parameters with their default values.
    pub parameters: Vec<Parameter>,
    /// Inputs by name.
    pub inputs: Vec<Spanned<String>>,
    /// Constants of every joint (body) that become parameters.
    pub tunable: Vec<Spanned<Tunable>>,
    /// Guess of the initial coordinates, rad, for the joints under `initial`.
    pub initial_q: Vec<(JointId, f64)>,
    /// Guess of the initial speeds, rad/s, for the joints under `initial`.
    pub initial_u: Vec<(JointId, f64)>,
    /// Share of the joints' `fold` at which those start that are not in `initial_q`: from 0 to 1.
    pub initial_fold: Option<Spanned<f64>>,
    /// Initial states of the free bodies under `initial`.
    pub initial_bodies: Vec<(BodyId, InitialBody)>,
    /// Output points.
    pub points: Vec<Point>,
    /// Forces at points.
    pub forces: Vec<Force>,
    /// Springs, tendons and motors.
    pub elements: Elements,
    /// Contacts of points with planes.
    pub contacts: Vec<Contact>,
    /// Controllers in discrete time.
    pub controllers: Vec<Controller>,
    /// Joints at which loops are cut. For other loops the compiler chooses the joint.
    pub cuts: Vec<JointId>,
    /// Hinge models by name.
    pub hinge_models: Vec<HingeModel>,
    /// The air, which resists moving plates.
    pub air: Option<Air>,
    /// Limit of the number of joints: [`MAX_HINGES`], or the user's choice.
    pub max_hinges: usize,
    /// Largest rounding error of each coordinate of a hinge line, m.
    pub tolerance: f64,
    /// The drawing of its `pattern`.
    #[serde(skip)]
    pub drawing: Option<Arc<SourceFile>>,
}

/// Stiffness and damping of a family of hinges.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct HingeModel {
    /// Its name.
    pub name: Spanned<String>,
    /// Stiffness k, N m/rad.
    pub stiffness: Polynomial,
    /// Damping b, N m s/rad.
    pub damping: Polynomial,
    /// Length (m), width (m) and area (m^2) of the hinges that were measured.
    pub specimens: Vec<[f64; 3]>,
}

/// Where a free body is at the start, and how it moves.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct InitialBody {
    /// How far its centre of mass is from where it is drawn, m.
    pub position: [f64; 3],
    /// Its orientation, a unit quaternion w x y z.
    pub orientation: [f64; 4],
    /// Velocity of its centre of mass in the base frame, m/s.
    pub velocity: [f64; 3],
    /// Angular velocity in its own frame, rad/s.
    pub angular_velocity: [f64; 3],
}

impl InitialBody {
    /// As drawn, at rest.
    pub const DRAWN: Self = Self {
        position: [0.0; 3],
        orientation: [1.0, 0.0, 0.0, 0.0],
        velocity: [0.0; 3],
        angular_velocity: [0.0; 3],
    };
}

/// Air, which resists moving plates.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Air {
    /// Density, kg/m^3.
    pub density: Spanned<Expression>,
    /// Drag coefficient of a plate that is perpendicular to the flow.
    pub drag: Spanned<Expression>,
}

/// Points of bodies that may touch a plane.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Contact {
    /// Its name.
    pub name: Spanned<String>,
    /// The plane.
    pub plane: ContactPlane,
    /// What touches the plane.
    pub points: ContactPoints,
    /// Stiffness k of each point, N/m; without it, weight and thickness give one.
    pub stiffness: Option<Spanned<Expression>>,
    /// Dissipation c, s/m.
    pub dissipation: Spanned<Expression>,
    /// Coefficient of friction.
    pub friction: Spanned<Expression>,
    /// Speed at which 71 % of the friction acts, m/s.
    pub slip_speed: Spanned<f64>,
}

/// The plane of a contact.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ContactPlane {
    /// A point of it in the flat state, m.
    pub point: Drawn<[f64; 3]>,
    /// The direction in which it pushes, of any length, in the flat state.
    pub normal: Spanned<[f64; 3]>,
    /// The body that carries it; `None` for the ground.
    pub body: Option<Spanned<BodyId>>,
    /// Whether it ends at the outline and at the back of the body's plate.
    pub within: Option<Spanned<()>>,
}

/// The points that may touch a plane.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum ContactPoints {
    /// The corners of all moving bodies but the plane's own.
    Corners,
    /// The corners of these bodies.
    CornersOf(Vec<Spanned<BodyId>>),
    /// Output points.
    Named(Vec<Spanned<PointId>>),
}

/// A sheet material.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Material {
    /// Its name.
    pub name: Spanned<String>,
    /// Density, kg/m^3.
    pub density: Drawn<f64>,
    /// Sheet thickness, m.
    pub thickness: Drawn<f64>,
    /// Young's modulus, Pa.
    pub youngs_modulus: Option<Drawn<f64>>,
    /// Yield stress, Pa.
    pub yield_stress: Option<Spanned<f64>>,
}

/// A rigid body.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Body {
    /// Its name.
    pub name: Spanned<String>,
    /// Whether the body is part of the ground.
    pub fixed: bool,
    /// Whether the body moves in all six directions.
    pub free: bool,
    /// Source of its mass properties.
    pub shape: Shape,
    /// Cuts without width through all layers of its plates: two ends each, m. They do not change its motion.
    pub slits: Vec<[[f64; 2]; 2]>,
    /// Point masses fixed to it.
    pub point_masses: Vec<PointMass>,
    /// Position of the body's entry in the file.
    pub span: Span,
}

/// Source of a body's mass properties.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Shape {
    /// No shape: a fixed body, or point masses only.
    None,
    /// One list of plates per layer of the layup, bottom to top (`outline` fills every layer).
    Plates(Vec<Vec<Plate>>),
    /// Mass, centre of mass and inertia are given.
    Rigid {
        /// Mass, kg.
        mass: Drawn<f64>,
        /// Centre of mass in the flat state, m.
        com: Drawn<[f64; 3]>,
        /// Inertia about the centre of mass, axes of the flat state, kg m^2.
        inertia: Spanned<[[f64; 3]; 3]>,
    },
}

/// A polygon with holes, in one layer.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Plate {
    /// Vertices, m; the last is joined to the first; either orientation.
    pub outline: Drawn<Vec<[f64; 2]>>,
    /// Holes, in the same form as the outline.
    pub holes: Vec<Drawn<Vec<[f64; 2]>>>,
}

/// A mass without extent.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PointMass {
    /// Mass, kg.
    pub mass: Drawn<f64>,
    /// Position in the flat state, m.
    pub at: Drawn<[f64; 3]>,
}

/// A flexure hinge.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Joint {
    /// Its name.
    pub name: Spanned<String>,
    /// q turns `bodies[1]` relative to `bodies[0]`.
    pub bodies: [Spanned<BodyId>; 2],
    /// Two points of the hinge line in the flat state, m.
    pub axis: Drawn<[[f64; 2]; 2]>,
    /// Height of the hinge line, m.
    pub z: Drawn<f64>,
    /// The linear spring.
    pub spring: Spring,
    /// Damping, N m s/rad.
    pub damping: Spanned<Expression>,
    /// Angle at which the spring is relaxed, rad.
    pub rest: Spanned<Expression>,
    /// Cubic part of the spring, N m/rad^3.
    pub cubic_stiffness: Spanned<Expression>,
    /// Dry friction.
    pub friction: Option<Friction>,
    /// Allowed angles, rad.
    pub limits: Option<Spanned<[f64; 2]>>,
    /// Torque on `bodies[1]` about the axis, N m.
    pub torque: Spanned<Expression>,
    /// Prescribed angle, rad: a function of t, parameters and inputs.
    pub drive: Option<Spanned<Expression>>,
    /// Angle of the finished fold, from -pi (mountain) to pi (valley), rad.
    pub fold: Option<Spanned<f64>>,
    /// Position of the joint's entry in the file.
    pub span: Span,
}

/// Source of a hinge's stiffness.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Spring {
    /// Stiffness, N m/rad.
    Stiffness(Spanned<Expression>),
    /// A strip in bending: k = E I / L, I = w t^3 / 12.
    Beam {
        /// Index into `materials`: gives E and t.
        material: Spanned<usize>,
        /// Free length L across the gap, m.
        length: Drawn<f64>,
        /// Width w along the hinge line, m.
        width: Drawn<f64>,
        /// Total length that is cut out of the width, m.
        gaps: Option<Drawn<f64>>,
    },
    /// The polynomials of DETC2018-86359, which give the damping too.
    Sharifzadeh2018 {
        /// Hinge length l, m.
        length: Spanned<f64>,
        /// Hinge width w, m.
        width: Spanned<f64>,
        /// Area a of the body that swings, m^2; without it the damping by the air is left out.
        area: Option<Spanned<f64>>,
        /// Whether the coefficients are used as printed, not as corrected.
        printed: bool,
        /// Position of the entry in the file.
        span: Span,
    },
    /// One of `hinge_models`, which gives the damping too.
    Family {
        /// Index into `hinge_models`.
        model: usize,
        /// Hinge length l, m.
        length: Spanned<f64>,
        /// Hinge width w, m.
        width: Spanned<f64>,
        /// Area a of the body that swings, m^2; without it the damping by the air is left out.
        area: Option<Spanned<f64>>,
        /// Position of the entry in the file.
        span: Span,
    },
}

/// Coulomb's friction, smoothed: torque tanh(u / speed) against the motion.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Friction {
    /// Torque, N m.
    pub torque: Spanned<Expression>,
    /// Speed at which 76 % of the torque acts, rad/s.
    pub speed: Spanned<f64>,
}

/// A named number that stays a symbol.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: Spanned<String>,
    /// Default value, SI.
    pub value: f64,
    /// Its dimension, if it was written with a unit.
    pub dimension: Option<Dimension>,
    /// Smallest and largest value for which the model has to hold, SI.
    pub range: Option<Spanned<[f64; 2]>>,
}

/// An output point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    /// Its name.
    pub name: Spanned<String>,
    /// The body it is fixed to.
    pub body: BodyId,
    /// Position in the flat state, m.
    pub at: Drawn<[f64; 3]>,
}

/// A force at a point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Force {
    /// Its name.
    pub name: Spanned<String>,
    /// The point at which it acts.
    pub point: PointId,
    /// Components in the base frame, N.
    pub force: [Expression; 3],
}

impl SourceModel {
    /// Returns the input with this name.
    pub fn input(&self, name: &str) -> Option<InputId> {
        self.inputs.iter().position(|input| input.value == name).map(InputId)
    }
}
