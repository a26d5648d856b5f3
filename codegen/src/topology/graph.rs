//! The spanning tree and its loops.
//!
//! Every joint has exactly one node, the body (or copy of a body) whose parent joint it is, and
//! every free body has one, without a parent. A joint that closes a loop carries a ghost: a second
//! copy of a body that is already in the tree, which must coincide with the original.
//!
//! The loops are the shortest ones. A loop whose two sides are not paths of the tree has copies of
//! its bodies of its own, which carry no mass: its closure depends only on the joints around it.

use std::fmt;
use std::ops::Range;

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::laminate::{FreeId, Mechanism, Real};
use crate::source::free::SPEEDS;
use crate::source::ids::index;
use crate::source::{BodyId, Diagnostics, JointId};

index!(
    /// A node of the spanning tree, or beyond these a copy of a body in a loop; parents come before
    /// children.
    NodeId
);
index!(
    /// A closed loop, in the order of the joints that close them.
    LoopId
);

/// A mechanism with its spanning tree and loops.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Topology {
    /// The mechanism.
    pub mechanism: Mechanism,
    /// Nodes of the spanning tree; parents before children.
    pub nodes: Vec<Node>,
    /// Copies of bodies along the sides of loops whose sides are not paths of the tree, relative to
    /// the body at which the sides meet; parents before children. Their numbers follow those of the
    /// nodes.
    pub copies: Vec<Node>,
    /// Loops.
    pub loops: Vec<Loop>,
    /// Generic rank of the closure Jacobian of all loops together.
    pub rank: usize,
    /// Degrees of freedom: number of speeds minus `rank`. They are fewer if loops close in isolated
    /// configurations only, although they have fewer equations than joints, and by the number of `infinitesimal` joints.
    pub mobility: usize,
    /// How the speeds of all joints follow from independent ones, if pivots were found that suit the
    /// motion; nothing without loops.
    pub reduction: Option<Reduction>,
    /// Joint angles of one closed configuration away from the flat state, if one was found.
    pub assembled: Option<Vec<f64>>,
    /// Joints that turn in infinitesimal motions, to which no finite motion belongs: as many as these motions have
    /// dimensions.
    pub infinitesimal: Vec<JointId>,
    /// Whether some of these turn in finite motions as well, so that they cannot be held.
    pub is_shaky: bool,
    /// Warnings (near misses, immobile loops).
    pub warnings: Diagnostics,
    /// What the tree was compared with; nothing if it was not compared.
    pub comparison: Option<Comparison>,
}

/// What trees cost that were derived: operations of an acceleration.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Comparison {
    /// How many trees were derived.
    pub derived: usize,
    /// Operations of the chosen tree: none of the others has fewer.
    pub chosen: usize,
    /// Operations of the breadth-first tree.
    pub plain: usize,
}

/// An elimination of the dependent speeds, with the same pivots at every state.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Reduction {
    /// The joints whose speeds are independent, in order.
    pub independent: Vec<JointId>,
    /// The pivots, in the order of the elimination. Closure rows that are none follow from the others.
    pub pivots: Vec<Pivot>,
}

/// A closure row and the joint whose speed it determines.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Pivot {
    /// Number of the row among those of all loops.
    pub row: usize,
    /// The joint.
    pub joint: JointId,
}

/// What connects a node with its parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Connection {
    /// A hinge.
    Hinge(JointId),
    /// Nothing: the node is a free body, and its parent is the ground.
    Free(FreeId),
}

/// A body, or the ghost of a body, with its parent joint.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Node {
    /// Its parent joint, or that it is free.
    pub connection: Connection,
    /// The body, or the body of which it is a copy.
    pub body: BodyId,
    /// The loop whose ghost it is; `None` for an original. A copy in a loop has that loop.
    pub ghost: Option<LoopId>,
    /// The parent node; `None` for the ground, and for a copy next to the body at which the sides of
    /// its loop meet.
    pub parent: Option<NodeId>,
    /// +1 when the node is the joint's second body, -1 when it is the first: the node turns by
    /// `sense * q` about the joint's direction, relative to its parent.
    pub sense: f64,
    /// Its share of the body's mass and inertia: 1 / number of nodes with the body, 0 for a copy in a
    /// loop.
    pub share: f64,
}

/// A loop: the ghost must coincide with the original.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Loop {
    /// The joint that closes it; each closes one loop.
    pub joint: JointId,
    /// The original of the cut body.
    pub original: NodeId,
    /// Its ghost, whose parent joint is `joint`.
    pub ghost: NodeId,
    /// The sides of the loop, from the body at which they meet: the nodes down to the ghost, and those
    /// down to the original. The second side is empty if the sides meet at the original.
    pub sides: [Vec<NodeId>; 2],
    /// The joints around the loop: from the ghost up to the body at which the sides meet, then down to
    /// the original.
    pub joints: Vec<JointId>,
    /// Class of the hinge lines in the flat state.
    pub class: LoopClass,
    /// Three points P1, P2, P3 fixed to the cut body, in the flat state, m.
    pub points: [Vector3<f64>; 3],
    /// Columns: directions x, y, z fixed to the cut body (flat axes) along which the closure rows
    /// are taken. P2 - P1 is along x, P3 - P1 is in the plane of x and y.
    pub frame: Matrix3<f64>,
    /// The rows that the acceleration uses: those of P1 x y z, P2 y z, P3 z that are not
    /// identically zero for the class.
    pub rows: Vec<Row>,
    /// Generic rank of this loop's closure Jacobian alone.
    pub rank: usize,
    /// Number of the loop's joints minus `rank`; 0 if it closes in isolated configurations only
    /// (four hinges in a row on one sheet).
    pub mobility: usize,
}

/// One closure row: component `axis` (0 x, 1 y, 2 z of [`Loop::frame`]) of point `point` (0..3).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Row {
    /// Which of the three points.
    pub point: usize,
    /// Which direction of the frame.
    pub axis: usize,
}

/// Class of a loop by its hinge lines.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum LoopClass {
    /// All hinge lines parallel.
    Planar {
        /// Their common direction.
        normal: Vector3<f64>,
    },
    /// All hinge lines through one point.
    Spherical {
        /// That point, in the flat state, m.
        centre: Vector3<f64>,
    },
    /// Any other hinge lines.
    Spatial,
}

impl LoopClass {
    /// Returns three points of the closure equations of a loop of this class, and the directions x, y, z as
    /// columns. `along` is the direction of the closing hinge in the sense of the ghost, P1 is `origin`: the centre
    /// of a spherical loop, otherwise a point of the closing hinge.
    ///
    /// The closing hinge is an axis of the frame, so that its rotation affects fewer rows.
    pub fn places<T: Real>(
        &self,
        along: &Vector3<T>,
        origin: &Vector3<T>,
        length: f64,
    ) -> ([Vector3<T>; 3], Matrix3<T>) {
        let up = Vector3::z();
        let across = up.cross(along);
        let [x, y, z] = match self {
            Self::Planar { .. } => [across.clone(), up.clone(), across.cross(&up)],
            Self::Spherical { .. } | Self::Spatial => [along.clone(), across, up],
        };
        let length = T::from(length);
        let points = [origin.clone(), origin + &x * length.clone(), origin + &y * length];
        (points, Matrix3::from_columns(&[x, y, z]))
    }
}

impl fmt::Display for LoopClass {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Planar { .. } => "planar",
            Self::Spherical { .. } => "spherical",
            Self::Spatial => "spatial",
        })
    }
}

impl fmt::Display for Loop {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { class, rank, mobility, .. } = self;
        write!(f, "{class}, 9 equations, {rank} independent, mobility {mobility}")
    }
}

impl Node {
    /// Returns its parent joint; a free body has none.
    pub fn joint(&self) -> Option<JointId> {
        match self.connection {
            Connection::Hinge(joint) => Some(joint),
            Connection::Free(_) => None,
        }
    }

    /// Returns the speeds with which it moves relative to its parent.
    pub fn speeds(&self, mechanism: &Mechanism) -> Range<usize> {
        let (first, count) = match self.connection {
            Connection::Hinge(joint) => (joint.speed(), 1),
            Connection::Free(free) => (mechanism.speed_of(free), SPEEDS),
        };
        first.index()..first.index() + count
    }
}

impl Topology {
    /// Returns the number of speeds on which the motion of each node depends.
    pub fn depths(&self) -> Vec<usize> {
        let mut depths: Vec<usize> = Vec::with_capacity(self.nodes.len());
        for node in &self.nodes {
            let above = node.parent.map_or(0, |parent| depths[parent.index()]);
            depths.push(above + node.speeds(&self.mechanism).len());
        }
        depths
    }

    /// Returns a node of the tree or a copy in a loop.
    pub fn node(&self, id: NodeId) -> &Node {
        let copy = id.index().checked_sub(self.nodes.len());
        copy.map_or_else(|| &self.nodes[id.index()], |copy| &self.copies[copy])
    }

    /// Returns the nodes of the tree and after them the copies in loops.
    pub fn all_nodes(&self) -> impl Iterator<Item = &Node> {
        self.nodes.iter().chain(&self.copies)
    }

    /// Returns whether the sides of a loop are paths of the spanning tree.
    pub fn is_in_tree(&self, closed: &Loop) -> bool {
        closed.ghost.index() < self.nodes.len()
    }

    /// Returns the names of all nodes: the names of their bodies, for ghosts with the loop they
    /// close, for copies in a loop with the loop.
    pub fn node_names(&self) -> Vec<String> {
        let name = |node: &Node| &self.mechanism.bodies[node.body.index()].name;
        let mut names: Vec<String> = self
            .nodes
            .iter()
            .map(|node| match node.ghost {
                None => name(node).clone(),
                Some(closed) => format!("{}_ghost{}", name(node), closed.index()),
            })
            .collect();
        for (index, copy) in (self.nodes.len()..).map(NodeId).zip(&self.copies) {
            let Some(closed) = copy.ghost else { continue };
            let ghost = if self.loops[closed.index()].ghost == index { "_ghost" } else { "" };
            names.push(format!("{}{ghost}_in_loop{}", name(copy), closed.index()));
        }
        names
    }

    /// Returns what is different in the structure of another topology of the same bodies and joints: the tree, the kinds
    /// of loops, ranks and mobility. Lengths and angles are not part of it.
    pub fn difference(&self, other: &Self) -> Option<String> {
        let tree = |it: &Self| {
            let nodes = it.nodes.iter().chain(&it.copies);
            nodes.map(|node| (node.connection, node.body, node.parent)).collect::<Vec<_>>()
        };
        let cuts = |it: &Self| it.loops.iter().map(|it| it.joint).collect::<Vec<_>>();
        if tree(self) != tree(other) || cuts(self) != cuts(other) {
            return Some("other joints close the loops".to_owned());
        }
        for (index, (here, there)) in self.loops.iter().zip(&other.loops).enumerate() {
            let kind = |it: &Loop| (std::mem::discriminant(&it.class), it.rank, it.mobility);
            if kind(here) != kind(there) || here.rows != there.rows {
                return Some(format!("loop {index} is {here} by default, and {there} there"));
            }
        }
        let whole = |it: &Self| (it.rank, it.mobility);
        (whole(self) != whole(other)).then(|| {
            let [(_, here), (_, there)] = [self, other].map(whole);
            format!("the mobility is {here} by default, and {there} there")
        })
    }

    /// Returns one line per loop: `loop 0: spherical, 9 equations, 3 independent, mobility 3`.
    pub fn summary_lines(&self) -> Vec<String> {
        self.loops.iter().enumerate().map(|(i, l)| format!("loop {i}: {l}")).collect()
    }
}
