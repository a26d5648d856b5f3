//! Frames of the nodes, which are aligned with the hinges and have their origins on the hinge lines. Those of
//! free bodies are aligned with the drawing.
//!
//! The x axis of a node's frame lies along its hinge. The z axis points along the base frame's z in the
//! flat state, so the rotation from parent to node is a constant turn about z (the drawing is flat) and
//! one elementary turn about x. The origin may lie anywhere on the hinge line: if it is where that line
//! meets the parent's line, the offset between the origins has at most one component.

use nalgebra::{Matrix3, Vector3};
use num_traits::Zero;

use crate::laminate::{Geometry, HingeLine, Number, Real, fixed};
use crate::source::JointId;
use crate::topology::{Loop, LoopClass, Node, NodeId, Topology};

/// Largest distance of an origin from the drawing, in sizes of the mechanism. A more distant origin
/// would cost digits.
const FARTHEST_ORIGIN: f64 = 4.0;
/// Differences below this, relative to the size or to 1, are rounding errors of the drawing.
const ROUNDING: f64 = 1e-14;

/// A node's frame in the flat state.
#[derive(Clone, Debug)]
pub struct Frame {
    /// Axes of the frame as columns, in flat coordinates.
    pub axes: Matrix3<Number>,
    /// Origin, a point of the hinge line, in flat coordinates, m.
    pub origin: Vector3<Number>,
}

impl Frame {
    /// Returns the base frame.
    pub fn base() -> Self {
        Self { axes: Matrix3::identity(), origin: Vector3::zeros() }
    }

    /// Returns the components in this frame of a direction in the flat state.
    pub fn direction(&self, flat: &Vector3<Number>) -> [Number; 3] {
        let length = flat.map(|x| x.value()).norm();
        self.axes.tr_mul(flat).map(|x| x.rounded(ROUNDING * length)).into()
    }

    /// Returns the coordinates in this frame of a point drawn at `flat`, m. `size` is the size of the
    /// mechanism.
    pub fn coordinates(&self, flat: &Vector3<Number>, size: f64) -> [Number; 3] {
        let offset = self.axes.tr_mul(&(flat - &self.origin));
        offset.map(|x| x.rounded(ROUNDING * size)).into()
    }

    /// Returns the components in this frame of a tensor given in flat axes.
    pub fn tensor(&self, flat: &Matrix3<Number>) -> Matrix3<Number> {
        let largest = flat.map(|x| x.value()).amax();
        let turned = self.axes.tr_mul(flat) * &self.axes;
        turned.map(|x| x.rounded(ROUNDING * largest))
    }
}

/// The frame of every node of the tree and of every copy in a loop.
pub struct Frames(Vec<Frame>);

impl Frames {
    /// Places the frames.
    pub fn new(topology: &Topology, geometry: &Geometry) -> Self {
        let drawing = Drawing { topology, geometry };
        let mut frames: Vec<Frame> = Vec::new();
        for (index, node) in topology.all_nodes().enumerate() {
            let Some(hinge) = drawing.hinge(node) else {
                let origin = drawing.origin_of_free(node);
                frames.push(Frame { origin, ..Frame::base() });
                continue;
            };
            let x = &hinge.direction * Number::from(node.sense);
            let z = fixed(&Vector3::z());
            let y = z.cross(&x);
            let axes = Matrix3::from_columns(&[x, y, z]);
            let origin = drawing.origin(&frames, NodeId(index), &hinge);
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
                let origin = fixed(&topology.loops[closed.index()].points[0]);
                Frame { origin, ..Frame::base() }
            }
            _ => Frame::base(),
        }
    }
}

/// The hinge lines and the bodies as they are drawn.
#[derive(Clone, Copy)]
pub struct Drawing<'a> {
    pub topology: &'a Topology,
    pub geometry: &'a Geometry,
}

impl Drawing<'_> {
    fn line(&self, joint: JointId) -> HingeLine {
        self.geometry.line(&self.topology.mechanism, joint)
    }

    fn hinge(&self, node: &Node) -> Option<HingeLine> {
        Some(self.line(node.joint()?))
    }

    /// Returns the point through which the hinges of a spherical loop go.
    pub fn centre(&self, closed: &Loop) -> Option<Vector3<Number>> {
        let LoopClass::Spherical { centre } = closed.class else { return None };
        if !closed.joints.iter().any(|joint| self.geometry.moves(*joint)) {
            return Some(fixed(&centre));
        }
        let lines: Vec<HingeLine> = closed.joints.iter().map(|joint| self.line(*joint)).collect();
        Some(nearest_point(&lines))
    }

    /// Returns the points and, as columns, the directions of a loop's closure equations.
    pub fn closure(&self, closed: &Loop) -> ([Vector3<Number>; 3], Matrix3<Number>) {
        if !closed.joints.iter().any(|joint| self.geometry.moves(*joint)) {
            return (closed.points.each_ref().map(fixed), closed.frame.map(Number::from));
        }
        let closing = self.line(closed.joint);
        let origin = self.centre(closed).unwrap_or(closing.point);
        let sense = self.topology.node(closed.ghost).sense;
        let length = (closed.points[1] - closed.points[0]).norm();
        closed.class.places(&(closing.direction * Number::from(sense)), &origin, length)
    }

    /// Returns the origin of a free body's frame: where hinges of a loop through it meet, which makes most
    /// offsets zero, or its centre of mass.
    fn origin_of_free(&self, node: &Node) -> Vector3<Number> {
        let mechanism = &self.topology.mechanism;
        let com = self.geometry.mass_properties(mechanism, node.body).com;
        let is_near =
            |centre: &Vector3<Number>| distance(centre, &com) <= FARTHEST_ORIGIN * mechanism.size;
        let touches = |joint: &JointId| mechanism.joints[joint.index()].bodies.contains(&node.body);
        let mut centres =
            self.topology.loops.iter().filter_map(|closed| {
                closed.joints.iter().any(touches).then(|| self.centre(closed))?
            });
        centres.find(is_near).unwrap_or(com)
    }

    /// Returns the point of a node's hinge line that makes most components of the offsets zero.
    fn origin(&self, placed: &[Frame], id: NodeId, hinge: &HingeLine) -> Vector3<Number> {
        let topology = self.topology;
        let node = topology.node(id);
        let loops = match node.ghost {
            Some(own) if id.index() >= topology.nodes.len() => {
                std::slice::from_ref(&topology.loops[own.index()])
            }
            _ => &topology.loops[..],
        };
        let size = topology.mechanism.size;
        let HingeLine { point, direction } = hinge;
        let on_line = |other: &Vector3<Number>| point + direction * direction.dot(&(other - point));
        for closed in loops
            .iter()
            .filter(|closed| closed.joints.iter().any(|joint| node.joint() == Some(*joint)))
        {
            let Some(centre) = self.centre(closed) else { continue };
            let miss = (on_line(&centre) - &centre).map(|x| x.magnitude()).norm();
            if miss <= ROUNDING * 10.0 * size {
                return centre;
            }
        }
        let neighbour = match node.parent {
            Some(parent) => Some(topology.node(parent)),
            None => topology.all_nodes().find(|n| n.parent == Some(id)),
        };
        // Where lines move, they may become parallel.
        let moves = |node: &Node| node.joint().is_some_and(|joint| self.geometry.moves(joint));
        let neighbour = neighbour.filter(|other| !moves(other) && !moves(node));
        let crossing = neighbour.and_then(|other| crossing(hinge, &self.hinge(other)?));
        match (crossing, node.parent) {
            (Some(at), _) if distance(&at, point) <= FARTHEST_ORIGIN * size => at,
            (_, Some(parent)) => on_line(&placed[parent.index()].origin),
            (_, None) => point.clone(),
        }
    }
}

/// Returns the distance of two points at the defaults of the parameters, m.
fn distance(a: &Vector3<Number>, b: &Vector3<Number>) -> f64 {
    (a - b).map(|x| x.value()).norm()
}

/// Returns the point nearest to all lines, which are not parallel: sum (1 - d d^T) (x - p) = 0, which for flat lines
/// separates into a problem in the plane and the mean height.
fn nearest_point(lines: &[HingeLine]) -> Vector3<Number> {
    let near = &lines[0].point;
    let (mut xx, mut xy, mut yy) = (Number::zero(), Number::zero(), Number::zero());
    let (mut right_x, mut right_y, mut height) = (Number::zero(), Number::zero(), Number::zero());
    for HingeLine { point, direction } in lines {
        let (x, y) = (-direction.y.clone(), direction.x.clone());
        let offset = point - near;
        let off = x.clone() * offset.x.clone() + y.clone() * offset.y.clone();
        right_x += x.clone() * off.clone();
        right_y += y.clone() * off;
        xx += x.clone() * x.clone();
        xy += x * y.clone();
        yy += y.clone() * y;
        height += offset.z.clone();
    }
    let determinant = xx.clone() * yy.clone() - xy.clone() * xy.clone();
    let x = (yy * right_x.clone() - xy.clone() * right_y.clone()) / determinant.clone();
    let y = (xx * right_y - xy * right_x) / determinant;
    near + Vector3::new(x, y, height / Number::from(lines.len() as f64))
}

/// Returns the point of `hinge`'s line nearest to `other`'s line, or `None` if the lines are parallel.
fn crossing(hinge: &HingeLine, other: &HingeLine) -> Option<Vector3<Number>> {
    let normal = hinge.direction.cross(&other.direction);
    let square = normal.dot(&normal);
    (square.magnitude() > ROUNDING).then(|| {
        let along = (&other.point - &hinge.point).cross(&other.direction).dot(&normal) / square;
        &hinge.point + &hinge.direction * along
    })
}
