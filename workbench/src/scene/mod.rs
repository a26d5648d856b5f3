//! The appearance of a mechanism: solids in flat coordinates, hinge lines, points, springs, contacts. The pictures
//! (`picture/`) and the viewer page (`page/`) are drawn from it.

mod mesh;
mod palette;
mod poses;
mod solid;
mod touch;

pub use mesh::{Mesh, Triangle};
pub use palette::Rgb;
pub use poses::{Moment, Placement, moment_at};
pub use touch::{Band, ContactPlane, ForceScale, Wall, round_up};

use nalgebra::Vector3;

use crate::motion::{Motion, Pose};
use lamc::laminate::Mechanism;

/// A mechanism as it is drawn. Flat coordinates, m.
#[derive(Clone, Debug)]
pub struct Scene {
    /// The model's name.
    pub name: String,
    /// Bodies, in the order of the poses.
    pub bodies: Vec<Solid>,
    /// Hinge lines, in the order of q.
    pub hinges: Vec<HingeLine>,
    /// Output points.
    pub points: Vec<Marker>,
    /// Springs between points, and tendons.
    pub bands: Vec<Band>,
    /// Contact points, in the order of the recorded forces.
    pub contacts: Vec<Marker>,
    /// The planes that they touch, but for plates.
    pub planes: Vec<ContactPlane>,
    /// The visible materials and their colours.
    pub materials: Vec<(String, Rgb)>,
    /// Diagonal of the flat bounding box, m.
    pub size: f64,
}

/// A body with its surface.
#[derive(Clone, Debug)]
pub struct Solid {
    /// Its name.
    pub name: String,
    /// Whether it is part of the ground.
    pub fixed: bool,
    /// Its surface.
    pub mesh: Mesh,
}

/// The line about which two bodies turn.
#[derive(Clone, Debug)]
pub struct HingeLine {
    /// The joint's name.
    pub name: String,
    /// The body that carries it: the first of the joint.
    pub body: usize,
    /// Both ends, flat coordinates, m.
    pub ends: [Vector3<f64>; 2],
}

/// A point fixed to a body.
#[derive(Clone, Debug)]
pub struct Marker {
    /// Its name.
    pub name: String,
    /// The body.
    pub body: usize,
    /// Flat coordinates, m.
    pub at: Vector3<f64>,
}

/// The number of poses from which the extent of a motion is computed.
const MOST_SAMPLES: usize = 120;

impl Scene {
    /// Creates the scene of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let materials = palette::of_materials(
            mechanism.bodies.iter().flat_map(|body| &body.sheets).map(|sheet| &*sheet.material),
        );
        let end = |joint: &lamc::laminate::Joint, share: f64| {
            joint.point + joint.direction * (share * joint.length)
        };
        let hinges: Vec<_> = mechanism
            .joints
            .iter()
            .map(|joint| HingeLine {
                name: joint.name.clone(),
                body: joint.bodies[0].index(),
                ends: [end(joint, 0.0), end(joint, 1.0)],
            })
            .collect();
        let bodies = mechanism.bodies.iter().enumerate().map(|(index, body)| {
            let held = mechanism
                .joints
                .iter()
                .filter(|joint| joint.bodies.iter().any(|id| id.index() == index));
            let middles: Vec<_> = held.map(|joint| end(joint, 0.5)).collect();
            Solid {
                name: body.name.clone(),
                fixed: body.fixed,
                mesh: solid::mesh(body, &middles, &materials, mechanism.size),
            }
        });
        let points = mechanism.points.iter().map(|point| Marker {
            name: point.name.clone(),
            body: point.body.index(),
            at: point.at,
        });
        Self {
            name: mechanism.name.clone(),
            bodies: bodies.collect(),
            hinges,
            points: points.collect(),
            bands: touch::bands(mechanism),
            contacts: touch::contacts(mechanism),
            planes: touch::planes(mechanism),
            materials,
            size: mechanism.size,
        }
    }

    /// The positions of vertices, ends of hinges and points at given poses of the bodies, base
    /// frame, m.
    pub fn positions(&self, poses: &[Pose]) -> Vec<Vector3<f64>> {
        let mut all = Vec::new();
        for (index, body) in self.bodies.iter().enumerate() {
            let placement = Placement::of(poses, index);
            all.extend(body.mesh.vertices.iter().map(|vertex| placement.apply(vertex)));
        }
        for hinge in &self.hinges {
            let placement = Placement::of(poses, hinge.body);
            all.extend(hinge.ends.iter().map(|end| placement.apply(end)));
        }
        for point in &self.points {
            all.push(Placement::of(poses, point.body).apply(&point.at));
        }
        all
    }

    /// The same positions in the course of a motion, base frame, m.
    pub fn swept(&self, motion: &Motion) -> Vec<Vector3<f64>> {
        let every = motion.samples.len().div_ceil(MOST_SAMPLES).max(1);
        let looks = motion.samples.iter().step_by(every).chain(motion.samples.last());
        looks.flat_map(|sample| self.positions(&sample.poses)).collect()
    }

    /// The lower and the upper corner of the box around a motion, base frame, m.
    pub fn extent(&self, motion: &Motion) -> [Vector3<f64>; 2] {
        box_around(&self.swept(motion))
    }
}

/// The lower and the upper corner of the box around points, m.
pub fn box_around(points: &[Vector3<f64>]) -> [Vector3<f64>; 2] {
    let first = points.first().copied().unwrap_or_default();
    points.iter().fold([first; 2], |[low, high], point| [low.inf(point), high.sup(point)])
}
