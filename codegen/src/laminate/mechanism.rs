//! The mechanism as a multibody system: rigid bodies with inertia, revolute joints with springs.
//!
//! Flat state: all q = 0, every body as drawn, all frames parallel to the base frame. SI, radians.

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use super::elements::Elements;
use crate::source::free::{COORDINATES, SPEED_NAMES, SPEEDS};
use crate::source::ids::index;
use crate::source::{
    BodyId, Controller, CoordinateId, Expression, JointId, ParameterId, PointId, Span, SpeedId,
};

index!(
    /// A free body, in the order of `Mechanism::free`.
    FreeId
);

/// Rigid bodies and the hinges between them.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Mechanism {
    /// Name, an identifier.
    pub name: String,
    /// Gravity in the base frame, m/s^2.
    pub gravity: [Expression; 3],
    /// Bodies, in file order.
    pub bodies: Vec<Body>,
    /// Joints, in file order.
    pub joints: Vec<Joint>,
    /// Declared parameters, then those made by `tunable`.
    pub parameters: Vec<Parameter>,
    /// Input names.
    pub inputs: Vec<String>,
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
    /// Guess of the initial q, one per joint, rad.
    pub initial_q: Vec<f64>,
    /// Joints whose guess was given in the file: assembly moves these least.
    pub initial_given: Vec<JointId>,
    /// Initial u, one per joint, rad/s.
    pub initial_u: Vec<f64>,
    /// The free bodies, in file order.
    pub free: Vec<FreeBody>,
    /// Joints at which loops are cut.
    pub cuts: Vec<JointId>,
    /// The air, which resists moving plates.
    pub air: Option<Air>,
    /// Largest rounding error of each coordinate of a hinge line, m.
    pub tolerance: f64,
    /// Diagonal of the flat bounding box over plates, hinge lines, centres of mass and points, m.
    pub size: f64,
}

/// A body that moves in all six directions, which no hinge connects with the ground.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct FreeBody {
    /// The body.
    pub body: BodyId,
    /// Coordinates at the start: the displacement of its centre of mass from where it is drawn, m, and its
    /// orientation, the unit quaternion w x y z.
    pub q: [f64; COORDINATES],
    /// Speeds at the start: the velocity of its centre of mass in the base frame, m/s, and its angular
    /// velocity in its own frame, rad/s.
    pub u: [f64; SPEEDS],
}

impl Mechanism {
    /// Returns the number of coordinates q.
    pub fn coordinates(&self) -> usize {
        self.joints.len() + COORDINATES * self.free.len()
    }

    /// Returns the number of speeds u.
    pub fn speeds(&self) -> usize {
        self.joints.len() + SPEEDS * self.free.len()
    }

    /// Returns the first coordinate of a free body; the others follow.
    pub fn coordinate_of(&self, free: FreeId) -> CoordinateId {
        CoordinateId(self.joints.len() + COORDINATES * free.index())
    }

    /// Returns the first speed of a free body; the others follow.
    pub fn speed_of(&self, free: FreeId) -> SpeedId {
        SpeedId(self.joints.len() + SPEEDS * free.index())
    }

    /// Returns a name for each speed: `knee`, `hull_vx`.
    pub fn speed_labels(&self) -> Vec<String> {
        let joints = self.joints.iter().map(|joint| joint.name.clone());
        let free = self.free.iter().flat_map(|free| {
            let body = &self.bodies[free.body.index()].name;
            SPEED_NAMES.map(|part| format!("{body}_{part}"))
        });
        joints.chain(free).collect()
    }
}

/// Air, which resists plates by density drag v^2 / 2 per area, where v is the speed along the
/// plate's normal.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Air {
    /// Density, kg/m^3.
    pub density: Expression,
    /// Drag coefficient.
    pub drag: Expression,
}

/// A rigid body; all fixed bodies together are the ground.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Body {
    /// Its name.
    pub name: String,
    /// Whether it is part of the ground.
    pub fixed: bool,
    /// Mass, centre of mass and inertia.
    pub mass_properties: MassProperties,
    /// The parameter that replaces `mass` if the mass is tunable (the inertia scales with it).
    pub mass_parameter: Option<ParameterId>,
    /// Its plates, bottom to top; none if its mass is given directly.
    pub sheets: Vec<Sheet>,
    /// Positions of its point masses in the flat state, m.
    pub point_masses: Vec<Vector3<f64>>,
    /// The area of its plates as points, if there is air.
    pub surface: Vec<SurfacePoint>,
    /// Position of its entry in the file.
    pub span: Span,
}

/// A flat piece of one layer of the layup: a polygon with holes.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Sheet {
    /// Its material's name.
    pub material: String,
    /// Heights of its lower and upper face, m.
    pub z: [f64; 2],
    /// Vertices in the flat state, m; the last is joined to the first; either orientation.
    pub outline: Vec<[f64; 2]>,
    /// Holes, in the same form as the outline.
    pub holes: Vec<Vec<[f64; 2]>>,
}

/// A part of a body's area.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfacePoint {
    /// Position in the flat state, m.
    pub at: Vector3<f64>,
    /// Area, m^2.
    pub area: f64,
}

/// Mass, centre of mass and inertia of a rigid body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(bound = "T: nalgebra::Scalar + Serialize + serde::de::DeserializeOwned")]
pub struct MassProperties<T = f64> {
    /// Mass, kg.
    pub mass: T,
    /// Centre of mass in the flat state, m.
    pub com: Vector3<T>,
    /// Inertia about the centre of mass, flat axes, kg m^2.
    pub inertia: Matrix3<T>,
}

/// A revolute hinge. q turns `bodies[1]` relative to `bodies[0]` about `direction` (right hand).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Joint {
    /// Its name.
    pub name: String,
    /// First and second body.
    pub bodies: [BodyId; 2],
    /// First point of the hinge line in the flat state, m.
    pub point: Vector3<f64>,
    /// Unit vector from the first to the second point; its z component is exactly 0.
    pub direction: Vector3<f64>,
    /// Length of the hinge line, m.
    pub length: f64,
    /// Stiffness, N m/rad.
    pub stiffness: Expression,
    /// Damping, N m s/rad.
    pub damping: Expression,
    /// Rest angle, rad.
    pub rest: Expression,
    /// Cubic part of the spring, N m/rad^3: the torque is -k bend - k3 bend^3, bend = q - rest.
    pub cubic_stiffness: Expression,
    /// Dry friction.
    pub friction: Option<Friction>,
    /// Largest bend in either direction at which the hinge is elastic, rad; infinite if it is not
    /// known.
    pub linear_range: f64,
    /// Torque on `bodies[1]` about `direction`, N m.
    pub torque: Expression,
    /// Prescribed angle, rad: a function of t, parameters and inputs.
    pub drive: Option<Expression>,
    /// Allowed angles, rad; infinite without limits.
    pub limits: [f64; 2],
    /// Angle of the finished fold, rad.
    pub fold: Option<f64>,
    /// Position of its entry in the file.
    pub span: Span,
}

/// Coulomb's friction, smoothed: the torque is -torque tanh(u / speed).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Friction {
    /// Torque, N m.
    pub torque: Expression,
    /// Speed, rad/s.
    pub speed: f64,
}

/// A number that stays a symbol.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Parameter {
    /// Its name.
    pub name: String,
    /// Default, SI.
    pub value: f64,
    /// One line for its documentation, with the unit if it is known.
    pub doc: String,
}

/// An output point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Point {
    /// Its name.
    pub name: String,
    /// The body it is fixed to.
    pub body: BodyId,
    /// Position in the flat state, m.
    pub at: Vector3<f64>,
}

/// A force at a point.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Force {
    /// Its name.
    pub name: String,
    /// The point at which it acts.
    pub point: PointId,
    /// Components in the base frame, N.
    pub force: [Expression; 3],
}

/// Points that may touch a plane. A point at the depth d behind the plane is pushed along the normal with
/// f = k d max(0, 1 + c d'), and against its sliding velocity v with mu f v / sqrt(v^2 + s^2).
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Contact {
    /// Its name.
    pub name: String,
    /// The plane.
    pub plane: Plane,
    /// The points, body by body.
    pub points: Vec<ContactPoint>,
    /// Stiffness k of each point, N/m.
    pub stiffness: Expression,
    /// What the stiffness follows from, if the file does not give it.
    pub default: Option<DefaultStiffness>,
    /// Dissipation c, s/m.
    pub dissipation: Expression,
    /// Coefficient of friction mu.
    pub friction: Expression,
    /// Slip speed s, m/s.
    pub slip_speed: f64,
}

/// The plane of a contact.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Plane {
    /// The body that carries it; `None` for the ground.
    pub body: Option<BodyId>,
    /// A point of it in the flat state, m.
    pub point: Vector3<f64>,
    /// Unit vector in which it pushes, in the flat state.
    pub normal: Vector3<f64>,
    /// Where it ends, if it does.
    pub outline: Option<PlateOutline>,
}

/// The edge and the thickness of a convex plate.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct PlateOutline {
    /// Vertices in the flat state, counterclockwise, m.
    pub vertices: Vec<[f64; 2]>,
    /// Thickness, m.
    pub thickness: f64,
}

/// A point that may touch a plane.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct ContactPoint {
    /// Its name: the contact, then the output point or the body and the number of the corner.
    pub name: String,
    /// The body it is fixed to.
    pub body: BodyId,
    /// Position in the flat state, m.
    pub at: Vector3<f64>,
}

/// What the default of a contact's stiffness follows from.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct DefaultStiffness {
    /// Mass of all moving bodies, kg.
    pub mass: f64,
    /// Gravity, m/s^2.
    pub gravity: f64,
    /// Thickness of the layup, m.
    pub thickness: f64,
}

impl PlateOutline {
    /// Returns, for each edge, the inward unit normal and its product with a point of the edge, m: a point x of
    /// the sheet is within the outline by the smallest of normal . x - product.
    pub fn edges(&self) -> impl Iterator<Item = ([f64; 2], f64)> {
        let ends = self.vertices.iter().zip(self.vertices.iter().cycle().skip(1));
        ends.map(|([x, y], [to_x, to_y])| {
            let (along_x, along_y) = (to_x - x, to_y - y);
            let length = crate::arithmetic::hypot(along_x, along_y);
            let inward = [-along_y / length, along_x / length];
            (inward, inward[0] * x + inward[1] * y)
        })
    }
}

impl DefaultStiffness {
    /// Returns the stiffness k, N/m, with which one point that carries the weight sinks in by a small share of the
    /// thickness.
    pub fn stiffness(&self) -> f64 {
        self.mass * self.gravity / (super::SINKING * self.thickness)
    }
}
