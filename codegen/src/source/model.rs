//! The model as written: names resolved, quantities in SI and radians, nothing derived yet.

use super::diagnostic::{Span, Spanned};
use super::expression::Expression;
use super::given::AngleUnit;
use super::ids::{BodyId, InputId, JointId, PointId};
use super::polynomial::Polynomial;
use super::units::{ANGLE, DAMPING, Dimension, MASS, STIFFNESS};

/// Most hinges a model is compiled with, unless it is asked for: derived equations, their matrices
/// and the time all this takes grow as the square of the number.
pub const MAX_HINGES: usize = 2000;

/// A mechanism as its file describes it. All numbers SI (m, kg, s, rad).
#[derive(Clone, Debug)]
pub struct SourceModel {
    /// The model's name: an identifier.
    pub name: Spanned<String>,
    /// What bare angles are in, also on a command line.
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
    /// Rough guess of the coordinates, rad: those given.
    pub initial_q: Vec<(JointId, f64)>,
    /// Initial speeds, rad/s: those given.
    pub initial_u: Vec<(JointId, f64)>,
    /// Output points.
    pub points: Vec<Point>,
    /// Forces at points.
    pub forces: Vec<Force>,
    /// Joints that are to close loops; where they leave it open, a breadth-first walk chooses.
    pub cuts: Vec<JointId>,
    /// Hinge models by name.
    pub hinge_models: Vec<HingeModel>,
    /// The air that plates are dragged through.
    pub air: Option<Air>,
    /// With more joints it is not compiled: [`MAX_HINGES`], or what the user asked for.
    pub max_hinges: usize,
    /// How far each coordinate of a hinge line may be from where it is meant, m.
    pub tolerance: f64,
}

/// Stiffness and damping of a family of hinges.
#[derive(Clone, Debug)]
pub struct HingeModel {
    /// Its name.
    pub name: Spanned<String>,
    /// k, N m/rad.
    pub stiffness: Polynomial,
    /// b, N m s/rad.
    pub damping: Polynomial,
    /// Length (m), width (m) and area (m^2) of the hinges that were measured.
    pub specimens: Vec<[f64; 3]>,
}

/// Air, which resists plates.
#[derive(Clone, Debug)]
pub struct Air {
    /// kg/m^3.
    pub density: Spanned<Expression>,
    /// Drag coefficient of a plate square to the flow.
    pub drag: Spanned<Expression>,
}

/// A sheet material.
#[derive(Clone, Debug)]
pub struct Material {
    /// Its name.
    pub name: Spanned<String>,
    /// Density, kg/m^3.
    pub density: Spanned<f64>,
    /// Sheet thickness, m.
    pub thickness: Spanned<f64>,
    /// Young's modulus, Pa.
    pub youngs_modulus: Option<Spanned<f64>>,
    /// Yield stress, Pa.
    pub yield_stress: Option<Spanned<f64>>,
}

/// A rigid body.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its name.
    pub name: Spanned<String>,
    /// Part of the ground.
    pub fixed: bool,
    /// Where its mass comes from.
    pub shape: Shape,
    /// Point masses fixed to it.
    pub point_masses: Vec<PointMass>,
    /// The body's whole entry.
    pub span: Span,
}

/// Where a body's mass properties come from.
#[derive(Clone, Debug)]
pub enum Shape {
    /// Nothing given (a fixed body, or point masses only).
    None,
    /// One list of plates per layer of the layup, bottom to top (`outline` fills every layer).
    Plates(Vec<Vec<Plate>>),
    /// Given outright.
    Rigid {
        /// kg.
        mass: Spanned<f64>,
        /// Centre of mass, flat coordinates, m.
        com: Spanned<[f64; 3]>,
        /// Inertia about the centre of mass, axes of the flat state, kg m^2.
        inertia: Spanned<[[f64; 3]; 3]>,
    },
}

/// A polygon with holes, in one layer.
#[derive(Clone, Debug)]
pub struct Plate {
    /// Vertices, m; the last is joined to the first; either orientation.
    pub outline: Spanned<Vec<[f64; 2]>>,
    /// Holes, as the outline.
    pub holes: Vec<Spanned<Vec<[f64; 2]>>>,
}

/// A mass without extent.
#[derive(Clone, Debug)]
pub struct PointMass {
    /// kg.
    pub mass: Spanned<f64>,
    /// Flat coordinates, m.
    pub at: [f64; 3],
}

/// A flexure hinge.
#[derive(Clone, Debug)]
pub struct Joint {
    /// Its name.
    pub name: Spanned<String>,
    /// q turns `bodies[1]` relative to `bodies[0]`.
    pub bodies: [Spanned<BodyId>; 2],
    /// Two points of the hinge line, flat coordinates, m.
    pub axis: Spanned<[[f64; 2]; 2]>,
    /// Height of the hinge line, m.
    pub z: f64,
    /// Spring.
    pub spring: Spring,
    /// N m s/rad.
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
    /// The joint's whole entry.
    pub span: Span,
}

/// Where a hinge's stiffness comes from.
#[derive(Clone, Debug)]
pub enum Spring {
    /// N m/rad.
    Stiffness(Spanned<Expression>),
    /// A strip in bending: k = E I / L, I = w t^3 / 12.
    Beam {
        /// Index into `materials`: gives E and t.
        material: Spanned<usize>,
        /// Free length L across the gap, m.
        length: Spanned<f64>,
        /// Width w along the hinge line, m.
        width: Spanned<f64>,
        /// What is cut out of the width, m.
        gaps: Option<Spanned<f64>>,
    },
    /// The polynomials of DETC2018-86359, which give the damping too.
    Sharifzadeh2018 {
        /// Hinge length l, m.
        length: Spanned<f64>,
        /// Hinge width w, m.
        width: Spanned<f64>,
        /// Area a of the body that swings, m^2; without it the air's damping is left out.
        area: Option<Spanned<f64>>,
        /// With the coefficients as printed, not as corrected.
        printed: bool,
        /// The entry.
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
        /// Area a of the body that swings, m^2; without it the air's damping is left out.
        area: Option<Spanned<f64>>,
        /// The entry.
        span: Span,
    },
}

/// Coulomb's friction, smoothed: torque tanh(u / speed) against the motion.
#[derive(Clone, Debug)]
pub struct Friction {
    /// N m.
    pub torque: Spanned<Expression>,
    /// Speed at which 76 % of the torque acts, rad/s.
    pub speed: Spanned<f64>,
}

/// A named number that stays a symbol.
#[derive(Clone, Debug)]
pub struct Parameter {
    /// Its name.
    pub name: Spanned<String>,
    /// Default value, SI.
    pub value: f64,
    /// What it measures, where it was written with a unit.
    pub dimension: Option<Dimension>,
}

/// What `tunable` turns into parameters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Tunable {
    /// `stiffness_<joint>`.
    Stiffness,
    /// `damping_<joint>`.
    Damping,
    /// `rest_<joint>`.
    Rest,
    /// `mass_<body>`; inertia scales with it (same shape, other density).
    Mass,
}

/// An output point.
#[derive(Clone, Debug)]
pub struct Point {
    /// Its name.
    pub name: Spanned<String>,
    /// The body it is fixed to.
    pub body: BodyId,
    /// Flat coordinates, m.
    pub at: [f64; 3],
}

/// A force at a point.
#[derive(Clone, Debug)]
pub struct Force {
    /// Its name.
    pub name: Spanned<String>,
    /// Where it acts.
    pub point: PointId,
    /// Components in the base frame, N.
    pub force: [Expression; 3],
}

impl SourceModel {
    /// The input with this name.
    pub fn input(&self, name: &str) -> Option<InputId> {
        self.inputs.iter().position(|input| input.value == name).map(InputId)
    }
}

impl Tunable {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::Stiffness, Self::Damping, Self::Rest, Self::Mass];

    /// Its name in the file.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Stiffness => "stiffness",
            Self::Damping => "damping",
            Self::Rest => "rest",
            Self::Mass => "mass",
        }
    }

    /// What its parameters measure.
    pub fn dimension(self) -> Dimension {
        match self {
            Self::Stiffness => STIFFNESS.dimension,
            Self::Damping => DAMPING.dimension,
            Self::Rest => ANGLE.dimension,
            Self::Mass => MASS.dimension,
        }
    }

    /// The parameter it makes of a joint's (body's) constant.
    pub fn parameter_name(self, owner: &str) -> String {
        format!("{}_{owner}", self.name())
    }
}
