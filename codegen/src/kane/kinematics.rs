//! Phase 2, kinematics: placements, velocities, velocity-product accelerations and partial
//! velocities of every node, relative to the ground and, for the sides of each loop, relative to
//! the node on which the two sides meet.

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
    /// The tree relative to the ground first, then what loops need relative to other nodes.
    subtrees: Vec<Subtree>,
    /// By node.
    partial: Vec<PartialVelocity>,
    loops: Vec<LoopKinematics>,
}

/// Nodes relative to one ancestor of theirs.
pub struct Subtree {
    /// `None`: the ground.
    ancestor: Option<NodeId>,
    /// Parents before their children; every parent but the ancestor is there.
    relatives: BTreeMap<NodeId, Relative>,
}

/// Where a node is, and how it moves, relative to an ancestor.
#[derive(Clone)]
pub struct Relative {
    pub placement: Placement,
    pub motion: Motion,
}

/// dw/du and dv/du of a node by the speed of its own joint.
pub struct PartialVelocity {
    pub omega: Vector,
    pub velocity: Vector,
}

/// The two sides of a loop, from the node on which they meet to the cut body and its ghost.
pub struct LoopKinematics {
    /// `None`: the ground.
    pub ancestor: Option<NodeId>,
    pub ghost: Side,
    pub original: Side,
    /// Number of the subtree of the ancestor.
    pub subtree: usize,
}

/// One side of a loop.
pub struct Side {
    pub tip: NodeId,
    /// The nodes beyond the common ancestor, up to the tip; none where the tip is the ancestor.
    pub path: Vec<NodeId>,
}

impl Relative {
    /// Of the ancestor relative to itself.
    fn identity() -> Self {
        Self { placement: Placement::identity(), motion: Motion::rest() }
    }

    /// Of a node, by its parent.
    fn new(binder: &mut Binder, link: &Link, parent: &Self) -> Self {
        Self {
            motion: Motion::new(binder, link, &parent.motion),
            placement: Placement::new(binder, link, &parent.placement),
        }
    }
}

impl LoopKinematics {
    /// Both sides with the sign of their closure forces, those on the ghost positive.
    pub fn sides(&self) -> [(&Side, f64); 2] {
        [(&self.ghost, 1.0), (&self.original, -1.0)]
    }
}

impl Subtree {
    /// With nothing but the ancestor in it.
    fn new(ancestor: Option<NodeId>) -> Self {
        Self { ancestor, relatives: BTreeMap::new() }
    }

    /// Adds the node of a link, whose parent is the ancestor or was added before.
    fn add(&mut self, binder: &mut Binder, link: &Link) {
        if !self.relatives.contains_key(&link.node) {
            let relative = match link.parent.and_then(|parent| self.relatives.get(&parent)) {
                Some(parent) => Relative::new(binder, link, parent),
                None => Relative::new(binder, link, &Relative::identity()),
            };
            self.relatives.insert(link.node, relative);
        }
    }

    /// The nodes, parents first, with their motions.
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

    /// The links, by node.
    pub fn links(&self) -> &[Link] {
        &self.links
    }

    /// The link of a node.
    pub fn link(&self, node: NodeId) -> &Link {
        &self.links[node.index()]
    }

    /// A node's motion relative to the ground.
    pub fn motion(&self, node: NodeId) -> &Motion {
        &self.subtrees[0].relatives[&node].motion
    }

    /// A node's placement relative to the ground.
    pub fn placement(&self, node: NodeId) -> &Placement {
        &self.subtrees[0].relatives[&node].placement
    }

    /// The subtrees: of the ground first, then of other common ancestors of loops.
    pub fn subtrees(&self) -> &[Subtree] {
        &self.subtrees
    }

    /// A node on a loop relative to the common ancestor of the loop's sides.
    pub fn on_loop(&self, closed: &LoopKinematics, node: NodeId) -> Relative {
        let relative = self.subtrees[closed.subtree].relatives.get(&node);
        relative.cloned().unwrap_or_else(Relative::identity)
    }

    /// A node's partial velocities by the speed of its own joint.
    pub fn partial(&self, node: NodeId) -> &PartialVelocity {
        &self.partial[node.index()]
    }

    /// The sides of a loop.
    pub fn closed(&self, id: LoopId) -> &LoopKinematics {
        &self.loops[id.index()]
    }

    /// The flat frame and the placement of a body; those of the base for the ground.
    pub fn body(&self, topology: &Topology, body: BodyId) -> (Frame, Placement) {
        match node_of(topology, body) {
            Some(node) => (self.link(node).frame.clone(), self.placement(node).clone()),
            None => (Frame::base(), Placement::identity()),
        }
    }
}

/// The node of a body that moves, not of its ghosts.
pub fn node_of(topology: &Topology, body: BodyId) -> Option<NodeId> {
    let is_original = |node: &Node| node.body == body && node.ghost.is_none();
    topology.nodes.iter().position(is_original).map(NodeId)
}

/// The nodes from the root down to `tip`.
fn path_to(links: &[Link], tip: NodeId) -> Vec<NodeId> {
    let mut path: Vec<_> =
        std::iter::successors(Some(tip), |node| links[node.index()].parent).collect();
    path.reverse();
    path
}

/// The nodes beyond `ancestor` down to `tip`.
fn path_between(links: &[Link], ancestor: Option<NodeId>, tip: NodeId) -> Vec<NodeId> {
    let mut path = path_to(links, tip);
    let beyond = path.iter().position(|&node| Some(node) == ancestor).map_or(0, |at| at + 1);
    path.split_off(beyond)
}

/// The node on which the ways to two nodes part; `None`: the ground.
fn common_ancestor(links: &[Link], left: NodeId, right: NodeId) -> Option<NodeId> {
    let (left, right) = (path_to(links, left), path_to(links, right));
    let shared = left.iter().zip(&right).take_while(|(left, right)| left == right);
    shared.last().map(|(&node, _)| node)
}
