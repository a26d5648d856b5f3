//! Phase 2, kinematics: placements, velocities, velocity-product accelerations and partial velocities
//! of every node. They are relative to the ground and, for the sides of each loop, relative to the node
//! at which the two sides meet.

use std::collections::BTreeMap;

use super::binder::Binder;
use super::frame::{Frame, Frames};
use super::link::{Link, links};
use super::motion::Motion;
use super::placement::Placement;
use super::vector::Vector;
use crate::source::BodyId;
use crate::topology::{Loop, LoopId, Node, NodeId, Topology};

/// The kinematics of the tree and of the loops.
pub struct Kinematics {
    links: Vec<Link>,
    /// The subtree relative to the ground first, then the subtrees that loops need relative to other
    /// nodes.
    subtrees: Vec<Subtree>,
    /// Partial velocities, by node.
    partial: Vec<PartialVelocity>,
    loops: Vec<LoopKinematics>,
}

/// Nodes with their placements and motions relative to a common ancestor.
pub struct Subtree {
    /// The ancestor, or `None` for the ground.
    ancestor: Option<NodeId>,
    /// The nodes, parents before their children. The map has the parent of every node, unless it is the
    /// ancestor.
    relatives: BTreeMap<NodeId, Relative>,
}

/// Placement and motion of a node relative to an ancestor.
#[derive(Clone)]
pub struct Relative {
    pub placement: Placement,
    pub motion: Motion,
}

/// Partial velocities dw/du and dv/du of a node by the speed of its own joint.
pub struct PartialVelocity {
    pub omega: Vector,
    pub velocity: Vector,
}

/// The two sides of a loop, from the node at which they meet to the cut body and its ghost.
pub struct LoopKinematics {
    /// The common ancestor, or `None` for the ground.
    pub ancestor: Option<NodeId>,
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

impl LoopKinematics {
    /// Returns both sides with the sign of their closure forces, which is positive for the ghost.
    pub fn sides(&self) -> [(&Side, f64); 2] {
        [(&self.ghost, 1.0), (&self.original, -1.0)]
    }
}

impl Subtree {
    /// Creates a subtree that contains only the ancestor.
    fn new(ancestor: Option<NodeId>) -> Self {
        Self { ancestor, relatives: BTreeMap::new() }
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
        let mut ground = Subtree::new(None);
        links.iter().for_each(|link| ground.add(binder, link));
        let partial = ground
            .motions()
            .zip(&links)
            .map(|((_, motion), link)| PartialVelocity {
                omega: motion.omega.each_ref().map(|x| binder.by_speed(x, link.joint)),
                velocity: motion.velocity.each_ref().map(|x| binder.by_speed(x, link.joint)),
            })
            .collect();
        let mut kinematics = Self { links, subtrees: vec![ground], partial, loops: Vec::new() };
        for closed in &binder.topology().loops {
            kinematics.add_loop(binder, closed);
        }
        kinematics
    }

    /// Adds the sides of a loop.
    fn add_loop(&mut self, binder: &mut Binder, closed: &Loop) {
        let links = &self.links;
        let ancestor = common_ancestor(links, closed.ghost, closed.original);
        let known = self.subtrees.iter().position(|subtree| subtree.ancestor == ancestor);
        let subtree = known.unwrap_or_else(|| {
            self.subtrees.push(Subtree::new(ancestor));
            self.subtrees.len() - 1
        });
        let [ghost, original] = [closed.ghost, closed.original].map(|tip| {
            let path = path_between(links, ancestor, tip);
            for node in &path {
                self.subtrees[subtree].add(binder, &links[node.index()]);
            }
            Side { tip, path }
        });
        self.loops.push(LoopKinematics { ancestor, ghost, original, subtree });
    }

    /// Returns the links, by node.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// Returns the link of a node.
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

    /// Returns a node's partial velocities by the speed of its own joint.
    pub fn partial(&self, node: NodeId) -> &PartialVelocity {
        &self.partial[node.index()]
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

/// Returns the nodes from the root down to `tip`.
fn path_to(links: &[Link], tip: NodeId) -> Vec<NodeId> {
    let mut path: Vec<_> =
        std::iter::successors(Some(tip), |node| links[node.index()].parent).collect();
    path.reverse();
    path
}

/// Returns the nodes beyond `ancestor` down to `tip`.
fn path_between(links: &[Link], ancestor: Option<NodeId>, tip: NodeId) -> Vec<NodeId> {
    let mut path = path_to(links, tip);
    let beyond = path.iter().position(|&node| Some(node) == ancestor).map_or(0, |at| at + 1);
    path.split_off(beyond)
}

/// Returns the node at which the paths to two nodes separate, or `None` for the ground.
fn common_ancestor(links: &[Link], left: NodeId, right: NodeId) -> Option<NodeId> {
    let (left, right) = (path_to(links, left), path_to(links, right));
    let shared = left.iter().zip(&right).take_while(|(left, right)| left == right);
    shared.last().map(|(&node, _)| node)
}
