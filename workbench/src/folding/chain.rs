//! The hinges around a loop, as a product of exponentials (R. W. Brockett, "Robotic manipulators and
//! the product of exponentials formula", 1984).
//!
//! Both sides of a loop start at the body at which they meet. Down the first side, and back up the
//! second, the placements multiply to
//!
//! ```text
//! T(q) = exp(s_1 q_1 X_1) exp(s_2 q_2 X_2) ... = 1        if the loop is closed
//! ```
//!
//! with the twists X of the hinges in the flat state and their senses s. With the twists where the
//! hinges are, Y_k = Ad(exp(s_1 q_1 X_1) .. exp(s_(k-1) q_(k-1) X_(k-1))) s_k X_k,
//!
//! ```text
//! log T(q + d) = log T + sum_k d_k Y_k + 1/2 sum_(i < k) d_i d_k [Y_i, Y_k] + O(d^3)
//! ```
//!
//! near a closed state (Baker, Campbell and Hausdorff). Lengths are relative to the sheet's size.

use lamc::arithmetic::larger;
use lamc::topology::{Loop, LoopClass, NodeId, Topology};
use nalgebra::{Matrix3, RealField, Rotation3, Unit, Vector3, Vector6};

/// Below this sine, the angle of a rotation is its sine.
const SMALL: f64 = 1e-8;

/// A hinge of a loop.
#[derive(Clone, Debug)]
struct Hinge {
    joint: usize,
    sense: f64,
    direction: Vector3<f64>,
    /// A point of the hinge line, relative to the loop's origin and the sheet's size.
    point: Vector3<f64>,
}

/// The hinges around a loop, in order.
#[derive(Clone, Debug)]
pub struct Chain {
    hinges: Vec<Hinge>,
    /// Number of equations: three turns, and three shifts unless all hinge lines meet in one point.
    pub rows: usize,
    /// Points of the body at which the loop is cut, relative like those of the hinges.
    points: [Vector3<f64>; 3],
    /// The point at which all hinge lines meet, m.
    pub centre: Option<Vector3<f64>>,
}

/// A loop at certain angles.
#[derive(Clone, Debug)]
pub struct Placed {
    /// log T: the turn, rad, and the shift, over the sheet's size.
    pub gap: Vector6<f64>,
    /// Y, one for each hinge, per radian.
    pub twists: Vec<Vector6<f64>>,
    /// Largest distance by which the loop is open at the cut body, over the sheet's size.
    pub open: f64,
}

impl Chain {
    /// Returns the hinges around a loop.
    pub fn new(topology: &Topology, closed: &Loop) -> Self {
        let mechanism = &topology.mechanism;
        let centre = match closed.class {
            LoopClass::Spherical { centre } => Some(centre),
            LoopClass::Planar { .. } | LoopClass::Spatial => None,
        };
        let origin = centre.unwrap_or(closed.points[0]);
        let relative = |point: Vector3<f64>| (point - origin) / mechanism.size;
        let hinge = |id: &NodeId, along: f64| {
            let node = topology.node(*id);
            let id = node.joint()?;
            let joint = &mechanism.joints[id.index()];
            Some(Hinge {
                joint: id.index(),
                sense: along * node.sense,
                direction: joint.direction,
                point: relative(joint.point),
            })
        };
        let there = closed.sides[0].iter().filter_map(|node| hinge(node, 1.0));
        let back = closed.sides[1].iter().rev().filter_map(|node| hinge(node, -1.0));
        Self {
            hinges: there.chain(back).collect(),
            rows: if centre.is_some() { 3 } else { 6 },
            points: closed.points.map(relative),
            centre,
        }
    }

    /// Returns the joints around the loop, in order.
    pub fn joints(&self) -> impl ExactSizeIterator<Item = usize> {
        self.hinges.iter().map(|hinge| hinge.joint)
    }

    /// Returns the direction of each hinge line as it is passed on the way around the loop. If the first
    /// bodies of all joints are to the right of their axes, all directions lead out of a vertex, or all
    /// lead into it.
    pub fn directions(&self) -> impl Iterator<Item = Vector3<f64>> {
        self.hinges.iter().map(|hinge| hinge.direction * hinge.sense)
    }

    /// Returns the loop at these angles.
    pub fn place(&self, q: &[f64]) -> Placed {
        let (mut turn, mut shift) = (Matrix3::identity(), Vector3::zeros());
        let mut twists = Vec::with_capacity(self.hinges.len());
        for hinge in &self.hinges {
            let axis = turn * hinge.direction * hinge.sense;
            let line = turn * hinge.point + shift;
            let moment = line.cross(&axis);
            twists.push(Vector6::new(axis.x, axis.y, axis.z, moment.x, moment.y, moment.z));
            let about = Unit::new_unchecked(hinge.direction);
            let angle = hinge.sense * q[hinge.joint];
            turn *= Rotation3::from_axis_angle(&about, angle).into_inner();
            shift = line - turn * hinge.point;
        }
        let moved = self.points.map(|point| (turn * point + shift - point).norm());
        let open = moved.into_iter().fold(0.0, larger);
        let turned = logarithm(&turn);
        let gap = Vector6::new(turned.x, turned.y, turned.z, shift.x, shift.y, shift.z);
        Placed { gap, twists, open: larger(open, turned.norm()) }
    }
}

/// Returns the rotation vector of a rotation, rad.
fn logarithm(turn: &Matrix3<f64>) -> Vector3<f64> {
    let sine = Vector3::new(
        turn[(2, 1)] - turn[(1, 2)],
        turn[(0, 2)] - turn[(2, 0)],
        turn[(1, 0)] - turn[(0, 1)],
    ) / 2.0;
    let (length, cosine) = (sine.norm(), (turn.trace() - 1.0) / 2.0);
    if length > SMALL {
        return sine * (RealField::atan2(length, cosine) / length);
    }
    match cosine > 0.0 {
        true => sine,
        // Half a turn, whatever about: far from closed.
        false => Vector3::repeat(std::f64::consts::PI),
    }
}

/// Returns the bracket of two twists.
pub fn bracket(a: &Vector6<f64>, b: &Vector6<f64>) -> Vector6<f64> {
    let parts =
        |x: &Vector6<f64>| [x.fixed_rows::<3>(0).into_owned(), x.fixed_rows::<3>(3).into_owned()];
    let ([w, v], [x, y]) = (parts(a), parts(b));
    let (turn, shift) = (w.cross(&x), w.cross(&y) + v.cross(&x));
    Vector6::new(turn.x, turn.y, turn.z, shift.x, shift.y, shift.z)
}
