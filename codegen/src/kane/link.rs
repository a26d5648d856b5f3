//! The hinge of a node, and the changes of frame across it.
//!
//! From the parent's frame to the node's frame there is a constant turn about z, to the hinge line, and
//! then the turn by q about x. Let R be both as one rotation, from the node's frame to the parent's
//! frame, and r the constant offset of the origins in the parent's frame:
//!
//! ```text
//! down(x) = R^T x        up(x) = R x        carried wrench: f_parent = R f, n_parent = R n + r x f_parent
//! ```

use crate::program::{Phase, Quantity, Section};
use nalgebra::Vector3;
use std::ops::Range;

use super::binder::Binder;
use super::facts::AXES;
use super::frame::{Frame, Frames};
use super::free::Free;
use super::turn::Turn;
use super::vector::{Vector, add, cross, zero};
use super::wrench::Wrench;
use crate::laminate::Number;
use crate::source::JointId;
use crate::source::free::SPEEDS;
use crate::symbolic::{Expr, Function};
use crate::topology::{Connection, NodeId};

const OFFSET: Quantity = Quantity::new("offset", "origin of its frame in its parent's frame, m");

const HINGE: Quantity = Quantity::new(
    "hinge",
    "cosine and sine of the angle about z from its parent's x axis to its hinge line",
);

const ROTOR: Quantity =
    Quantity::new("rotor_inertia", "inertia of its motor's rotor about its joint, kg m^2");

/// A node, or a copy in a loop, with what connects it with its parent.
pub struct Link {
    pub node: NodeId,
    /// The parent node, or `None` for the ground and for the body at which the sides of a loop meet.
    pub parent: Option<NodeId>,
    /// The node's frame in the flat state.
    pub frame: Frame,
    /// r: position of the node's origin in its parent's frame, m. Zero for a free body.
    pub offset: Vector,
    /// What the rotor of a motor adds to the inertia of the joint's coordinate, kg m^2.
    pub rotor: Expr,
    /// How the node moves relative to its parent.
    pub freedom: Freedom,
}

/// How a node moves relative to its parent.
pub enum Freedom {
    /// About a hinge.
    Hinge(Hinge),
    /// In all directions, relative to the ground.
    Free(Box<Free>),
}

/// A hinge.
#[derive(Clone)]
pub struct Hinge {
    pub joint: JointId,
    /// u of the joint, rad/s.
    pub speed: Expr,
    /// Turn about z, from the parent's x axis to the hinge line.
    pub line_turn: Turn,
    /// Turn about x, by q.
    pub joint_turn: Turn,
}

impl Link {
    /// Returns the hinge; a free body has none.
    pub fn hinge(&self) -> Option<&Hinge> {
        match &self.freedom {
            Freedom::Hinge(hinge) => Some(hinge),
            Freedom::Free(_) => None,
        }
    }

    /// Returns the joint; a free body has none.
    pub fn joint(&self) -> Option<JointId> {
        self.hinge().map(|hinge| hinge.joint)
    }

    /// Returns the places of its speeds in u.
    pub fn speeds(&self) -> Range<usize> {
        match &self.freedom {
            Freedom::Hinge(hinge) => hinge.joint.index()..hinge.joint.index() + 1,
            Freedom::Free(free) => free.first..free.first + SPEEDS,
        }
    }

    /// Returns the turns about the line and the joint of a node with a parent or a copy.
    pub fn turns(&self) -> (&Turn, &Turn) {
        match &self.freedom {
            Freedom::Hinge(hinge) => (&hinge.line_turn, &hinge.joint_turn),
            Freedom::Free(_) => unreachable!("nothing is carried beyond a free body"),
        }
    }
}

/// Returns the links of all nodes of the tree, then those of the copies in loops.
pub fn links(binder: &mut Binder, frames: &Frames) -> Vec<Link> {
    let topology = binder.topology();
    let mut turns: Vec<Option<Turn>> = vec![None; topology.mechanism.joints.len()];
    let mut rotors = vec![Expr::zero(); turns.len()];
    for node in binder.nodes() {
        let Some(joint) = topology.node(node).joint() else { continue };
        turns[joint.index()] = Some(joint_turn(binder, node, joint));
        let inertia = topology.mechanism.rotor_inertia(joint);
        if inertia > 0.0 {
            rotors[joint.index()] = binder.fact(node, ROTOR, inertia);
        }
    }
    let size = topology.mechanism.size;
    let mut links = Vec::with_capacity(turns.len());
    for (index, described) in topology.all_nodes().enumerate() {
        let (node, parent) = (NodeId(index), described.parent);
        let frame = frames.of(node).clone();
        let joint = match described.connection {
            Connection::Hinge(joint) => joint,
            Connection::Free(id) => {
                let freedom = Freedom::Free(Box::new(Free::new(binder, node, &frame, id)));
                links.push(Link {
                    node,
                    parent,
                    frame,
                    offset: zero(),
                    rotor: Expr::zero(),
                    freedom,
                });
                continue;
            }
        };
        let Some(joint_turn) = turns[joint.index()].clone() else { continue };
        let above = frames.above(topology, node);
        let offset = above.coordinates(&frame.origin, size);
        let offset = binder.facts_of(node, OFFSET, AXES, offset);
        let [cos, sin, _] = above.direction(&frame.axes.column(0).into_owned());
        let [cos, sin] = binder.facts_of(node, HINGE, ["cos", "sin"], [cos, sin]);
        let (speed, line_turn) = (binder.speed(joint.index()), Turn { cos, sin });
        let freedom = Freedom::Hinge(Hinge { joint, speed, line_turn, joint_turn });
        let rotor = rotors[joint.index()].clone();
        links.push(Link { node, parent, frame, offset, rotor, freedom });
    }
    links
}

/// Binds sin q and cos q of a node's joint.
fn joint_turn(binder: &mut Binder, node: NodeId, joint: JointId) -> Turn {
    let name = binder.joint_name(joint);
    let q = [binder.coordinate(joint.index())];
    let section = Section::body(node, Phase::HingeAngle);
    let sin = binder.bind(section, format!("sin_{name}"), Expr::apply(Function::Sin, &q));
    let cos = binder.bind(section, format!("cos_{name}"), Expr::apply(Function::Cos, &q));
    Turn { cos, sin }
}

impl Link {
    /// Returns R^T x: the components in the node's frame of a vector given in the parent's frame.
    /// `name` is the name of the vector.
    pub fn down(&self, binder: &mut Binder, phase: Phase, name: &str, v: &Vector) -> Vector {
        let Hinge { line_turn, joint_turn, .. } = match &self.freedom {
            Freedom::Hinge(hinge) => hinge,
            Freedom::Free(free) => return free.down(v),
        };
        let [x, y, z] = v;
        let [x, y] = line_turn.back(x, y);
        let y = self.on_hinge(binder, phase, name, y);
        let [y, z] = joint_turn.back(&y, z);
        [x, y, z]
    }

    /// Returns R x: the components in the parent's frame of a vector given in the node's frame. `name`
    /// is the name of the vector.
    pub fn up(&self, binder: &mut Binder, phase: Phase, name: &str, v: &Vector) -> Vector {
        let ([x, y, z], (line_turn, joint_turn)) = (v, self.turns());
        let [y, z] = joint_turn.forth(y, z);
        let y = self.on_hinge(binder, phase, name, y);
        let [x, y] = line_turn.forth(x, &y);
        [x, y, z]
    }

    /// Binds the y component between the two turns, in axes along the hinge line, before the turn by q.
    fn on_hinge(&self, binder: &mut Binder, phase: Phase, name: &str, y: Expr) -> Expr {
        let [y] = binder.components(self.node, phase, &format!("{name}_on_hinge"), ["y"], [y]);
        y
    }

    /// Returns the same wrench about the parent's origin, in the parent's frame.
    pub fn carry_wrench(
        &self,
        binder: &mut Binder,
        phase: Phase,
        name: &str,
        wrench: &Wrench,
    ) -> Wrench {
        let [f, n] = [format!("{name}_force"), format!("{name}_moment")];
        let force = self.up(binder, phase, &f, &wrench.force);
        let force = binder.vector(self.node, phase, &format!("{f}_in_parent"), force);
        let moment = self.up(binder, phase, &n, &wrench.moment);
        let moment = add(&moment, &cross(&self.offset, &force));
        let moment = binder.vector(self.node, phase, &format!("{n}_in_parent"), moment);
        Wrench { force, moment }
    }

    /// Returns the components in the node's frame of a direction in the flat state. `name` is the name
    /// of the direction.
    pub fn direction(
        &self,
        binder: &mut Binder,
        name: &'static str,
        flat: &Vector3<Number>,
    ) -> Vector {
        let meaning = "components of a direction in this body's frame";
        let components = self.frame.direction(flat);
        binder.facts_of(self.node, Quantity::new(name, meaning), AXES, components)
    }

    /// Returns the coordinates in the node's frame of a point drawn at `flat`, m. `name` is the name of
    /// the point.
    pub fn point(&self, binder: &mut Binder, name: &'static str, flat: &Vector3<Number>) -> Vector {
        let meaning = "coordinates of a point in this body's frame, m";
        let coordinates = self.frame.coordinates(flat, binder.mechanism().size);
        binder.facts_of(self.node, Quantity::new(name, meaning), AXES, coordinates)
    }
}
