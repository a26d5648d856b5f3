//! Phase 8, outputs: poses of the bodies, positions of the output points, angles of driven joints.

use crate::program::{Quantity, Subject};
use nalgebra::Vector3;

use super::binder::Binder;
use super::facts::AXES;
use super::kinematics::{Kinematics, node_of};
use super::vector::Vector;
use crate::laminate::Number;
use crate::source::{BodyId, PointId};
use crate::symbolic::Expr;

/// Outputs of the model in addition to the motion; see [`Equations`](super::Equations) for shapes.
pub struct Outputs {
    pub poses: Vec<Expr>,
    pub points: Vec<Expr>,
    pub drives: Vec<Expr>,
}

impl Outputs {
    /// Derives the outputs.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics) -> Self {
        Self {
            poses: poses(binder, kinematics),
            points: points(binder, kinematics),
            drives: drives(binder),
        }
    }
}

/// The owner of numbers: a body, which may be part of the ground.
struct Owner<'a> {
    subject: Subject,
    name: &'a str,
}

impl<'a> Owner<'a> {
    fn new(binder: &Binder<'a>, body: BodyId) -> Self {
        let subject = Subject::of(node_of(binder.topology(), body));
        Self { subject, name: &binder.mechanism().bodies[body.index()].name }
    }

    /// Returns the components of a vector in the frame of the body. The facts are named after the
    /// vector.
    fn vector(
        &self,
        binder: &mut Binder,
        name: &'static str,
        meaning: &'static str,
        components: [Number; 3],
    ) -> Vector {
        let quantity = Quantity::new(name, meaning);
        binder.facts_about(self.subject, self.name, quantity, AXES, components)
    }
}

/// Derives the pose of each body: R row-major, then p, so that the point drawn at x lies at R x + p.
fn poses(binder: &mut Binder, kinematics: &Kinematics) -> Vec<Expr> {
    const DRAWN: [&str; 3] = ["drawn_x", "drawn_y", "drawn_z"];
    let (topology, size) = (binder.topology(), binder.mechanism().size);
    let mut poses = Vec::new();
    for body in (0..binder.mechanism().bodies.len()).map(BodyId) {
        let owner = Owner::new(binder, body);
        let (frame, placement) = kinematics.body(topology, body);
        let columns: [Vector; 3] = std::array::from_fn(|k| {
            let flat: Vector3<Number> = frame.axes.row(k).transpose();
            let meaning = "axis of the drawing, in the frame of the body";
            placement.turn(&owner.vector(binder, DRAWN[k], meaning, flat.into()))
        });
        let origin = frame.coordinates(&Vector3::zeros(), size);
        let meaning = "origin of the drawing, in the frame of the body, m";
        let p = placement.place(&owner.vector(binder, "drawn_origin", meaning, origin));
        for row in 0..3 {
            poses.extend(columns.iter().map(|column| column[row].clone()));
        }
        poses.extend(p);
    }
    poses
}

/// Derives the positions of the output points in the base frame, m.
fn points(binder: &mut Binder, kinematics: &Kinematics) -> Vec<Expr> {
    let (topology, size) = (binder.topology(), binder.mechanism().size);
    let mut positions = Vec::new();
    for (index, point) in binder.mechanism().points.iter().enumerate() {
        let owner = Owner { name: &point.name, ..Owner::new(binder, point.body) };
        let (frame, placement) = kinematics.body(topology, point.body);
        let flat = binder.geometry().point(binder.mechanism(), PointId(index));
        let (at, meaning) = (frame.coordinates(&flat, size), "in the frame of its body, m");
        positions.extend(placement.place(&owner.vector(binder, "point", meaning, at)));
    }
    positions
}

/// Derives the prescribed angles of the driven joints, in the order of the joints, rad.
fn drives(binder: &mut Binder) -> Vec<Expr> {
    let joints = &binder.mechanism().joints;
    let driven = joints.iter().filter_map(|joint| Some((joint, joint.drive.as_ref()?)));
    driven
        .map(|(joint, drive)| {
            binder.formula(drive, &format!("drive_{}", joint.name), Some(joint.span))
        })
        .collect()
}
