//! Phase 8, outputs: poses of the bodies, positions of the output points, angles of driven joints.

use nalgebra::Vector3;

use super::binder::Binder;
use super::kinematics::Kinematics;
use super::vector::Vector;
use crate::source::BodyId;
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

/// Per body: R row-major, then p, so that the point drawn at x lies at R x + p.
fn poses(binder: &mut Binder, kinematics: &Kinematics) -> Vec<Expr> {
    let (topology, size) = (binder.topology(), binder.mechanism().size);
    let mut poses = Vec::new();
    for body in 0..binder.mechanism().bodies.len() {
        let (frame, placement) = kinematics.body(topology, BodyId(body));
        let columns: [Vector; 3] = std::array::from_fn(|k| {
            let flat = frame.axes.row(k).transpose();
            placement.turn(&binder.constants(flat.into()))
        });
        let drawn_at_zero = binder.constants(frame.coordinates(&Vector3::zeros(), size));
        let p = placement.place(&drawn_at_zero);
        for row in 0..3 {
            poses.extend(columns.iter().map(|column| column[row].clone()));
        }
        poses.extend(p);
    }
    poses
}

/// Positions of the output points in the base frame, m.
fn points(binder: &mut Binder, kinematics: &Kinematics) -> Vec<Expr> {
    let (topology, size) = (binder.topology(), binder.mechanism().size);
    let mut positions = Vec::new();
    for point in &binder.mechanism().points {
        let (frame, placement) = kinematics.body(topology, point.body);
        let arm = binder.constants(frame.coordinates(&point.at, size));
        positions.extend(placement.place(&arm));
    }
    positions
}

/// Prescribed angles of the driven joints, in their order, rad.
fn drives(binder: &mut Binder) -> Vec<Expr> {
    let joints = &binder.mechanism().joints;
    let driven = joints.iter().filter_map(|joint| Some((joint, joint.drive.as_ref()?)));
    driven
        .map(|(joint, drive)| {
            binder.formula(drive, &format!("drive_{}", joint.name), Some(joint.span))
        })
        .collect()
}
