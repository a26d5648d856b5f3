//! Frames of the nodes, which are aligned with the hinges and have their origins on the hinge lines. Those of
//! free bodies are aligned with the drawing.
//!
//! The x axis of a node's frame lies along its hinge. The z axis points along the base frame's z in the
//! flat state, so the rotation from parent to node is a constant turn about z (the drawing is flat) and
//! one elementary turn about x. The origin may lie anywhere on the hinge line: if it is where that line
//! meets the parent's line, the offset between the origins has at most one component.

use nalgebra::{Matrix3, Vector3};

use crate::laminate::Joint;
use crate::source::JointId;
use crate::topology::{LoopClass, Node, NodeId, Topology};

/// Largest distance of an origin from the drawing, in sizes of the mechanism. A more distant origin
/// would cost digits.
const FARTHEST_ORIGIN: f64 = 4.0;
/// Differences below this, relative to the size or to 1, are rounding errors of the drawing.
const ROUNDING: f64 = 1e-14;

/// A node's frame in the flat state.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Axes of the frame as columns, in flat coordinates.
    pub axes: Matrix3<f64>,
    /// Origin, a point of the hinge line, in flat coordinates, m.
    pub origin: Vector3<f64>,
}

impl Frame {
    /// Returns the base frame.
    pub fn base() -> Self {
        Self { axes: Matrix3::identity(), origin: Vector3::zeros() }
    }

    /// Returns the components in this frame of a direction in the flat state.
    pub fn direction(&self, flat: &Vector3<f64>) -> [f64; 3] {
        let length = flat.norm();
        self.axes.tr_mul(flat).map(|x| if x.abs() <= ROUNDING * length { 0.0 } else { x }).into()
    }

    /// Returns the coordinates in this frame of a point drawn at `flat`, m. `size` is the size of the
    /// mechanism.
    pub fn coordinates(&self, flat: &Vector3<f64>, size: f64) -> [f64; 3] {
        let offset = self.axes.tr_mul(&(flat - self.origin));
        offset.map(|x| if x.abs() <= ROUNDING * size { 0.0 } else { x }).into()
    }

    /// Returns the components in this frame of a tensor given in flat axes.
    pub fn tensor(&self, flat: &Matrix3<f64>) -> Matrix3<f64> {
        let largest = flat.amax();
        let turned = self.axes.tr_mul(flat) * self.axes;
        turned.map(|x| if x.abs() <= ROUNDING * largest { 0.0 } else { x })
    }
}

/// The frame of every node of the tree and of every copy in a loop.
pub struct Frames(Vec<Frame>);

impl Frames {
    /// Places the frames.
    pub fn new(topology: &Topology) -> Self {
        let mut frames: Vec<Frame> = Vec::new();
        for (index, node) in topology.all_nodes().enumerate() {
            let Some(hinge) = joint(topology, node) else {
                let origin = origin_of_free(topology, node);
                frames.push(Frame { origin, ..Frame::base() });
                continue;
            };
            let x = hinge.direction * node.sense;
            let z = Vector3::z();
            let axes = Matrix3::from_columns(&[x, z.cross(&x), z]);
            let origin = origin(topology, &frames, NodeId(index), hinge);
            frames.push(Frame { axes, origin });
        }
        Self(frames)
    }

    /// Returns the frame of a node.
    pub fn of(&self, node: NodeId) -> &Frame {
        &self.0[node.index()]
    }

    /// Returns the frame that a node's frame is placed in: its parent's, or the base frame. For a copy in
    /// a loop the base frame has its origin at the loop, so that no digits are lost.
    pub fn above(&self, topology: &Topology, node: NodeId) -> Frame {
        let Node { parent, ghost, .. } = topology.node(node);
        match (parent, ghost) {
            (Some(parent), _) => self.of(*parent).clone(),
            (None, Some(closed)) if node.index() >= topology.nodes.len() => {
                Frame { origin: topology.loops[closed.index()].points[0], ..Frame::base() }
            }
            _ => Frame::base(),
        }
    }
}

fn joint<'a>(topology: &'a Topology, node: &Node) -> Option<&'a Joint> {
    Some(&topology.mechanism.joints[node.joint()?.index()])
}

/// Returns the origin of a free body's frame: where hinges of a loop through it meet, which makes most offsets
/// zero, or its centre of mass.
fn origin_of_free(topology: &Topology, node: &Node) -> Vector3<f64> {
    let mechanism = &topology.mechanism;
    let com = mechanism.bodies[node.body.index()].mass_properties.com;
    let is_near = |centre: &Vector3<f64>| (centre - com).norm() <= FARTHEST_ORIGIN * mechanism.size;
    let touches = |joint: &JointId| mechanism.joints[joint.index()].bodies.contains(&node.body);
    let centres = topology.loops.iter().filter_map(|closed| match closed.class {
        LoopClass::Spherical { centre } if closed.joints.iter().any(touches) => Some(centre),
        _ => None,
    });
    centres.into_iter().find(|centre| is_near(centre)).unwrap_or(com)
}

/// Returns the point of a node's hinge line that makes most components of the offsets zero.
fn origin(topology: &Topology, placed: &[Frame], id: NodeId, hinge: &Joint) -> Vector3<f64> {
    let node = topology.node(id);
    let loops = match node.ghost {
        Some(own) if id.index() >= topology.nodes.len() => {
            std::slice::from_ref(&topology.loops[own.index()])
        }
        _ => &topology.loops[..],
    };
    let size = topology.mechanism.size;
    let on_line = |point: &Vector3<f64>| {
        hinge.point + hinge.direction * hinge.direction.dot(&(point - hinge.point))
    };
    for closed in loops {
        if let LoopClass::Spherical { centre } = closed.class {
            let miss = (on_line(&centre) - centre).norm();
            if closed.joints.iter().any(|joint| node.joint() == Some(*joint))
                && miss <= ROUNDING * 10.0 * size
            {
                return centre;
            }
        }
    }
    let neighbour = match node.parent {
        Some(parent) => joint(topology, topology.node(parent)),
        None => {
            topology.all_nodes().find(|n| n.parent == Some(id)).and_then(|n| joint(topology, n))
        }
    };
    let crossing = neighbour.and_then(|other| crossing(hinge, other));
    match (crossing, node.parent) {
        (Some(point), _) if (point - hinge.point).norm() <= FARTHEST_ORIGIN * size => point,
        (_, Some(parent)) => on_line(&placed[parent.index()].origin),
        (_, None) => hinge.point,
    }
}

/// Returns the point of `hinge`'s line nearest to `other`'s line, or `None` if the lines are parallel.
fn crossing(hinge: &Joint, other: &Joint) -> Option<Vector3<f64>> {
    let normal = hinge.direction.cross(&other.direction);
    let square = normal.norm_squared();
    (square > ROUNDING).then(|| {
        let along = (other.point - hinge.point).cross(&other.direction).dot(&normal) / square;
        hinge.point + hinge.direction * along
    })
}
