//! Trees, loops and mobilities of mechanisms known from the literature.

mod choice;
mod classes;
mod inertia;
mod known;
mod rounded;
mod sheets;
mod trees;

use crate::compare::largest;
use nalgebra::{
    DMatrix, DVector, Isometry3, Matrix3, Point3, Translation3, UnitQuaternion, Vector3,
};

use super::{Loop, Topology, build};
use crate::laminate::{Body, Joint, MassProperties, Mechanism};
use crate::source::{BodyId, Diagnostics, Expression, Span};

/// A hinge between two bodies (0 is the ground) along a line at a height.
#[derive(Clone, Copy)]
pub struct Hinge {
    pub bodies: [usize; 2],
    pub line: [[f64; 2]; 2],
    pub z: f64,
}

pub fn hinge(bodies: [usize; 2], from: [f64; 2], to: [f64; 2]) -> Hinge {
    Hinge { bodies, line: [from, to], z: 0.0 }
}

/// A hinge from a point under an angle, 0.1 long, at a height.
pub fn ray(bodies: [usize; 2], from: [f64; 2], angle: f64, z: f64) -> Hinge {
    let to = [from[0] + 0.1 * angle.cos(), from[1] + 0.1 * angle.sin()];
    Hinge { bodies, line: [from, to], z }
}

pub fn mechanism(hinges: &[Hinge]) -> Mechanism {
    let bodies = hinges.iter().flat_map(|hinge| hinge.bodies).max().unwrap() + 1;
    let body = |index: usize| Body {
        name: format!("b{index}"),
        fixed: index == 0,
        mass_properties: MassProperties {
            mass: 1.0,
            com: Vector3::zeros(),
            inertia: Matrix3::identity(),
        },
        mass_parameter: None,
        sheets: Vec::new(),
        point_masses: Vec::new(),
        surface: Vec::new(),
        span: Span { start: index, end: index + 1 },
    };
    let joint = |(index, hinge): (usize, &Hinge)| {
        let [from, to] = hinge.line.map(|end| Vector3::new(end[0], end[1], hinge.z));
        Joint {
            name: format!("j{index}"),
            bodies: hinge.bodies.map(BodyId),
            point: from,
            direction: (to - from).normalize(),
            length: (to - from).norm(),
            stiffness: Expression::ZERO,
            damping: Expression::ZERO,
            rest: Expression::ZERO,
            cubic_stiffness: crate::source::Expression::ZERO,
            friction: None,
            linear_range: f64::INFINITY,
            torque: Expression::ZERO,
            drive: None,
            limits: [f64::NEG_INFINITY, f64::INFINITY],
            fold: None,
            span: Span { start: 100 + index, end: 101 + index },
        }
    };
    let joints: Vec<Joint> = hinges.iter().enumerate().map(joint).collect();
    let ends = |joint: &Joint| [joint.point, joint.point + joint.direction * joint.length];
    let ends: Vec<_> = joints.iter().flat_map(ends).collect();
    let low = ends.iter().fold(ends[0], |a, b| a.inf(b));
    let high = ends.iter().fold(ends[0], |a, b| a.sup(b));
    Mechanism {
        tolerance: 0.0,
        cuts: Vec::new(),
        name: "test".into(),
        gravity: [Expression::ZERO, Expression::ZERO, Expression::ZERO],
        bodies: (0..bodies).map(body).collect(),
        initial_q: vec![0.0; joints.len()],
        initial_u: vec![0.0; joints.len()],
        free: Vec::new(),
        air: None,
        joints,
        parameters: Vec::new(),
        inputs: Vec::new(),
        points: Vec::new(),
        forces: Vec::new(),
        elements: Default::default(),
        contacts: Vec::new(),
        controllers: Vec::new(),
        initial_given: Vec::new(),
        size: (high - low).norm(),
    }
}

pub fn topology(hinges: &[Hinge]) -> Topology {
    build(mechanism(hinges)).unwrap()
}

pub fn codes(warnings: &Diagnostics) -> Vec<&'static str> {
    warnings.0.iter().map(|warning| warning.code.name).collect()
}

/// The pose of every node, hinge by hinge: written apart from what it checks.
fn poses(topology: &Topology, q: &[f64]) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::new();
    for node in topology.all_nodes() {
        let id = node.joint().unwrap();
        let joint = &topology.mechanism.joints[id.index()];
        let turn = joint.direction * (node.sense * q[id.index()]);
        let about = Translation3::from(joint.point)
            * UnitQuaternion::from_scaled_axis(turn)
            * Translation3::from(-joint.point);
        let parent = node.parent.map_or(Isometry3::identity(), |parent| poses[parent.index()]);
        poses.push(parent * about);
    }
    poses
}

/// The largest distance between points of a ghost and of its original, m.
pub fn largest_gap(topology: &Topology, q: &[f64]) -> f64 {
    let poses = poses(topology, q);
    let gap = |closed: &Loop, at: [f64; 3]| {
        let at = Point3::from(at);
        (poses[closed.ghost.index()] * at - poses[closed.original.index()] * at).norm()
    };
    let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    let pairs = topology.loops.iter().flat_map(|closed| points.map(|at| (closed, at)));
    largest(pairs.map(|(closed, at)| gap(closed, at)))
}

/// The rank of the chosen closure rows of all loops at a closed configuration, by differences of
/// poses along the directions of each original's frame.
pub fn rank_of_rows(topology: &Topology, q: &[f64]) -> usize {
    let closed = poses(topology, q);
    let residuals = |q: &[f64]| -> Vec<f64> {
        let moved = poses(topology, q);
        let rows = topology.loops.iter().flat_map(|l| l.rows.iter().map(move |row| (l, row)));
        rows.map(|(l, row)| {
            let at = Point3::from(l.points[row.point]);
            let gap = moved[l.ghost.index()] * at - moved[l.original.index()] * at;
            let along = closed[l.original.index()] * l.frame.column(row.axis).into_owned();
            gap.dot(&along)
        })
        .collect()
    };
    const H: f64 = 1e-5;
    let columns: Vec<DVector<f64>> = (0..q.len())
        .map(|joint| {
            let [ahead, behind] = [H, -H].map(|h| {
                let mut q = q.to_vec();
                q[joint] += h;
                DVector::from(residuals(&q))
            });
            (ahead - behind) / (2.0 * H)
        })
        .collect();
    let values = DMatrix::from_columns(&columns).singular_values();
    // Differences are good to H^2.
    values.iter().filter(|value| **value > 1e-6 * largest(&values)).count()
}
