//! Phase 2, kinematics: placements, velocities, velocity-product accelerations and partial velocities
//! of every node. They are relative to the ground and, for the sides of each loop, relative to the body
//! at which the two sides meet.

use std::collections::BTreeMap;

use super::binder::Binder;
use super::frame::{Frame, Frames};
use super::free::Free;
use super::link::{Freedom, Link, links};
use super::motion::Motion;
use super::placement::Placement;
use super::vector::{Vector, zero};
use crate::source::BodyId;
use crate::source::free::SPEEDS;
use crate::symbolic::Expr;
use crate::topology::{Loop, LoopId, Node, NodeId, Topology};

/// The kinematics of the tree and of the loops.
pub struct Kinematics {
    /// The links of the tree, then those of the copies in loops.
    links: Vec<Link>,
    /// Number of nodes of the tree.
    nodes: usize,
    /// The subtree relative to the ground first, then the subtrees that loops need relative to other
    /// nodes.
    subtrees: Vec<Subtree>,
    /// Partial velocities by the node's own speeds, by node.
    partial: Vec<Vec<PartialVelocity>>,
    loops: Vec<LoopKinematics>,
}

/// Nodes with their placements and motions relative to a common ancestor.
pub struct Subtree {
    /// What the nodes are relative to.
    base: Base,
    /// The nodes, parents before their children. The map has the parent of every node, unless it is the
    /// ancestor.
    relatives: BTreeMap<NodeId, Relative>,
}

/// What a subtree is relative to.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Base {
    /// A node of the tree, or `None` for the ground.
    Node(Option<NodeId>),
    /// The body at which the sides of a loop of copies meet.
    Meeting(LoopId),
}

/// Placement and motion of a node relative to an ancestor.
#[derive(Clone)]
pub struct Relative {
    pub placement: Placement,
    pub motion: Motion,
}

/// Partial velocities dw/du and dv/du of a node by one of its own speeds.
pub struct PartialVelocity {
    pub omega: Vector,
    pub velocity: Vector,
}

/// The two sides of a loop, from the node at which they meet to the cut body and its ghost.
pub struct LoopKinematics {
    /// The common ancestor, or `None` for the ground and for a loop of copies.
    pub ancestor: Option<NodeId>,
    /// Whether the sides are paths of the tree, not of copies.
    pub is_in_tree: bool,
    pub ghost: Side,
    pub original: Side,
    /// Index of the ancestor's subtree in `Kinematics::subtrees`.
    pub subtree: usize,
}

/// One side of a loop.
pub struct Side {
    pub tip: NodeId,
    /// The nodes beyond the common ancestor, up to the tip. The path is empty if the tip is the
    /// ancestor.
    pub path: Vec<NodeId>,
}

impl Relative {
    /// Returns the placement and motion of the ancestor relative to itself.
    fn identity() -> Self {
        Self { placement: Placement::identity(), motion: Motion::rest() }
    }

    /// Derives the placement and motion of a node from those of its parent.
    fn new(binder: &mut Binder, link: &Link, parent: &Self) -> Self {
        Self {
            motion: Motion::new(binder, link, &parent.motion),
            placement: Placement::new(binder, link, &parent.placement),
        }
    }
}

impl PartialVelocity {
    /// Returns those of a free body: by the velocity of its centre of mass, and by its angular velocity.
    fn of_free(free: &Free) -> [Self; SPEEDS] {
        let unit = |k: usize| -> Vector {
            std::array::from_fn(|i| if i == k { Expr::one() } else { Expr::zero() })
        };
        std::array::from_fn(|k| {
            let (velocity, omega) = match k {
                0..3 => (unit(k), zero()),
                _ => (zero(), unit(k - 3)),
            };
            Self { velocity: free.velocity_of_origin(&velocity, &omega), omega }
        })
    }
}

impl LoopKinematics {
    /// Returns both sides with the sign of their closure forces, which is positive for the ghost.
    pub fn sides(&self) -> [(&Side, f64); 2] {
        [(&self.ghost, 1.0), (&self.original, -1.0)]
    }
}

impl Subtree {
    /// Creates a subtree that contains only what it is relative to.
    fn new(base: Base) -> Self {
        Self { base, relatives: BTreeMap::new() }
    }

    /// Adds the node of a link whose parent is the ancestor or was added before.
    fn add(&mut self, binder: &mut Binder, link: &Link) {
        if !self.relatives.contains_key(&link.node) {
            let relative = match link.parent.and_then(|parent| self.relatives.get(&parent)) {
                Some(parent) => Relative::new(binder, link, parent),
                None => Relative::new(binder, link, &Relative::identity()),
            };
            self.relatives.insert(link.node, relative);
        }
    }

    /// Returns the nodes with their motions, parents first.
    pub fn motions(&self) -> impl Iterator<Item = (NodeId, &Motion)> {
        self.relatives.iter().map(|(&node, relative)| (node, &relative.motion))
    }
}

impl Kinematics {
    /// Derives the kinematics.
    pub fn new(binder: &mut Binder, frames: &Frames) -> Self {
        let links = links(binder, frames);
        let nodes = binder.topology().nodes.len();
        let mut ground = Subtree::new(Base::Node(None));
        links[..nodes].iter().for_each(|link| ground.add(binder, link));
        let partial = ground
            .motions()
            .zip(&links)
            .map(|((_, motion), link)| match &link.freedom {
                Freedom::Hinge(hinge) => vec![PartialVelocity {
                    omega: motion.omega.each_ref().map(|x| binder.by_speed(x, hinge.joint)),
                    velocity: motion.velocity.each_ref().map(|x| binder.by_speed(x, hinge.joint)),
                }],
                Freedom::Free(free) => PartialVelocity::of_free(free).into(),
            })
            .collect();
        let subtrees = vec![ground];
        let mut kinematics = Self { links, nodes, subtrees, partial, loops: Vec::new() };
        for (index, closed) in binder.topology().loops.iter().enumerate() {
            kinematics.add_loop(binder, LoopId(index), closed);
        }
        kinematics
    }

    /// Adds the sides of a loop.
    fn add_loop(&mut self, binder: &mut Binder, id: LoopId, closed: &Loop) {
        let is_in_tree = binder.topology().is_in_tree(closed);
        let ancestor = closed.sides[0].first().and_then(|node| self.link(*node).parent);
        let base = if is_in_tree { Base::Node(ancestor) } else { Base::Meeting(id) };
        let known = self.subtrees.iter().position(|subtree| subtree.base == base);
        let subtree = known.unwrap_or_else(|| {
            self.subtrees.push(Subtree::new(base));
            self.subtrees.len() - 1
        });
        for node in closed.sides.iter().flatten() {
            self.subtrees[subtree].add(binder, &self.links[node.index()]);
        }
        let [ghost, original] = closed.sides.clone();
        let ghost = Side { tip: closed.ghost, path: ghost };
        let original = Side { tip: closed.original, path: original };
        self.loops.push(LoopKinematics { ancestor, is_in_tree, ghost, original, subtree });
    }

    /// Returns the links of the tree, by node.
    pub fn links(&self) -> &[Link] {
        &self.links[..self.nodes]
    }

    /// Returns the links of the copies in loops.
    pub fn copies(&self) -> &[Link] {
        &self.links[self.nodes..]
    }

    /// Returns the link of a node or of a copy.
    pub fn link(&self, node: NodeId) -> &Link {
        &self.links[node.index()]
    }

    /// Returns a node's motion relative to the ground.
    pub fn motion(&self, node: NodeId) -> &Motion {
        &self.subtrees[0].relatives[&node].motion
    }

    /// Returns a node's placement relative to the ground.
    pub fn placement(&self, node: NodeId) -> &Placement {
        &self.subtrees[0].relatives[&node].placement
    }

    /// Returns the subtrees: first the one of the ground, then those of other common ancestors of
    /// loops.
    pub fn subtrees(&self) -> &[Subtree] {
        &self.subtrees
    }

    /// Returns the placement and motion of a node on a loop, relative to the common ancestor of the
    /// loop's sides.
    pub fn on_loop(&self, closed: &LoopKinematics, node: NodeId) -> Relative {
        let relative = self.subtrees[closed.subtree].relatives.get(&node);
        relative.cloned().unwrap_or_else(Relative::identity)
    }

    /// Returns a node's partial velocities by its own speeds, with their places in u.
    pub fn partial(&self, node: NodeId) -> impl Iterator<Item = (usize, &PartialVelocity)> {
        self.link(node).speeds().zip(&self.partial[node.index()])
    }

    /// Returns the sides of a loop.
    pub fn closed(&self, id: LoopId) -> &LoopKinematics {
        &self.loops[id.index()]
    }

    /// Returns the flat frame and the placement of a body. For the ground, both are those of the base
    /// frame.
    pub fn body(&self, topology: &Topology, body: BodyId) -> (Frame, Placement) {
        match node_of(topology, body) {
            Some(node) => (self.link(node).frame.clone(), self.placement(node).clone()),
            None => (Frame::base(), Placement::identity()),
        }
    }
}

/// Returns the node of a moving body, not one of its ghosts. The ground has none.
pub fn node_of(topology: &Topology, body: BodyId) -> Option<NodeId> {
    let is_original = |node: &Node| node.body == body && node.ghost.is_none();
    topology.nodes.iter().position(is_original).map(NodeId)
}
