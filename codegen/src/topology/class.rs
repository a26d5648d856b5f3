//! What the hinge lines of a loop have in common, and the points and rows that follow.
//!
//! A ghost moves against its original like a rigid body: six numbers, of which the rows of P1
//! (x y z), P2 (y z) and P3 (z) are an invertible function. Where all hinge lines are parallel the
//! relative motion stays in a plane (three of the six are always zero); where they meet in one
//! point it is a turn about it (again three).

use nalgebra::{Matrix3, Vector3};

use super::graph::{Loop, LoopClass, LoopId, Row, Topology};
use super::tree::{Closing, joints_around};
use crate::laminate::{Joint, Mechanism};
use crate::source::{Diagnostic, JointId};

/// Lines are parallel, or meet, when they miss by less: rad, or fraction of the size.
const EXACT: f64 = 1e-10;
/// They nearly do when they miss by less.
const NEAR: f64 = 1e-2;

/// Fills in the loops that the closings make.
pub fn classify(topology: &mut Topology, closings: &[Closing]) {
    for closing in closings {
        let joints = joints_around(&topology.nodes, closing);
        let mechanism = &topology.mechanism;
        let lines: Vec<&Joint> = joints.iter().map(|j| &mechanism.joints[j.index()]).collect();
        let (class, near_miss) = class_of(mechanism, &lines);
        if let Some(near_miss) = near_miss {
            let id = LoopId(topology.loops.len());
            let offender = &mechanism.joints[joints[near_miss.line].index()];
            let message = format!("the hinge lines of loop {} {}", id.index(), near_miss.what);
            topology.warnings.push(
                Diagnostic::warning("near-miss", offender.span, message)
                    .label(format!("`{}` misses most", offender.name))
                    .hint("drawn exactly, the loop could move; as drawn it is taken at its word"),
            );
        }
        let closed = make(mechanism, closing, joints, class);
        topology.loops.push(closed);
    }
}

/// Lines that nearly have something in common.
struct NearMiss {
    what: String,
    /// Which line misses most.
    line: usize,
}

fn class_of(mechanism: &Mechanism, lines: &[&Joint]) -> (LoopClass, Option<NearMiss>) {
    let first = lines[0].direction;
    let angles = lines.iter().map(|line| line.direction.cross(&first).norm());
    let (crooked, angle) = largest(angles);
    if angle <= EXACT {
        return (LoopClass::Planar { normal: first }, None);
    }
    let centre = nearest_point(lines);
    let misses = lines.iter().map(|line| (centre - line.point).cross(&line.direction).norm());
    let (far, miss) = largest(misses);
    if miss <= EXACT * mechanism.size {
        // Drawn lines mostly share an end point: then the centre is exactly that.
        let end = lines[0].point;
        let exact = if (end - centre).norm() <= EXACT * mechanism.size { end } else { centre };
        return (LoopClass::Spherical { centre: exact }, None);
    }
    let near_miss = if miss <= NEAR * mechanism.size {
        let what = format!("miss a common point by {:.3e} mm", miss * 1e3);
        Some(NearMiss { what, line: far })
    } else if angle <= NEAR {
        let what = format!("are up to {:.3e} deg from parallel", angle.to_degrees());
        Some(NearMiss { what, line: crooked })
    } else {
        None
    };
    (LoopClass::Spatial, near_miss)
}

fn largest(values: impl Iterator<Item = f64>) -> (usize, f64) {
    let larger = |best: (usize, f64), next: (usize, f64)| if next.1 > best.1 { next } else { best };
    values.enumerate().fold((0, 0.0), larger)
}

/// The point with the least sum of squared distances to the lines (not all parallel).
fn nearest_point(lines: &[&Joint]) -> Vector3<f64> {
    // Relative to one of them, so that the sums stay small.
    let origin = lines[0].point;
    let mut matrix = Matrix3::zeros();
    let mut rhs = Vector3::zeros();
    for line in lines {
        let across = Matrix3::identity() - line.direction * line.direction.transpose();
        matrix += across;
        rhs += across * (line.point - origin);
    }
    origin + matrix.try_inverse().map_or(Vector3::zeros(), |inverse| inverse * rhs)
}

fn make(mechanism: &Mechanism, closing: &Closing, joints: Vec<JointId>, class: LoopClass) -> Loop {
    let hinge = &mechanism.joints[closing.joint.index()];
    let middle = hinge.point + hinge.direction * (hinge.length / 2.0);
    // Axes along the closing hinge: its own joint then moves none of the points on its line.
    let (centre, x, z) = match class {
        LoopClass::Planar { normal } => (middle, Vector3::z().cross(&normal), normal),
        LoopClass::Spherical { centre } => (centre, hinge.direction, Vector3::z()),
        LoopClass::Spatial => (middle, hinge.direction, Vector3::z()),
    };
    let frame = Matrix3::from_columns(&[x, z.cross(&x), z]);
    let spread = joints
        .iter()
        .map(|joint| &mechanism.joints[joint.index()])
        .flat_map(|line| [line.point, line.point + line.direction * line.length])
        .map(|end| (end - centre).norm())
        .fold(0.0, f64::max);
    let arm = if spread > 0.0 { spread } else { mechanism.size };
    let row = |point, axis| Row { point, axis };
    let rows = match class {
        LoopClass::Planar { .. } => vec![row(0, 0), row(0, 1), row(1, 1)],
        LoopClass::Spherical { .. } => vec![row(1, 1), row(1, 2), row(2, 2)],
        LoopClass::Spatial => {
            vec![row(0, 0), row(0, 1), row(0, 2), row(1, 1), row(1, 2), row(2, 2)]
        }
    };
    Loop {
        joint: closing.joint,
        original: closing.original,
        ghost: closing.ghost,
        mobility: joints.len(),
        joints,
        class,
        points: [centre, centre + x * arm, centre + frame.column(1) * arm],
        frame,
        rows,
        rank: 0,
    }
}
