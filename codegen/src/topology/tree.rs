//! The spanning tree: breadth-first from the ground over the joints in file order.

use std::collections::VecDeque;

use super::graph::{LoopId, Node, NodeId};
use crate::laminate::Mechanism;
use crate::source::{BodyId, Diagnostic, Diagnostics, JointId};

/// A joint that closes a loop: the ghost hangs on it.
#[derive(Clone, Copy, Debug)]
pub struct Closing {
    /// The joint.
    pub joint: JointId,
    /// The original of the cut body.
    pub original: NodeId,
    /// Its ghost.
    pub ghost: NodeId,
}

/// Nodes (parents before children) and the joints that close loops, in the order reached.
///
/// A body that a second joint reaches is cut: the joint carries a ghost of it, and original and
/// ghosts share its mass equally. The ground is never cut: it is where the walk begins.
pub fn span(mechanism: &Mechanism) -> Result<(Vec<Node>, Vec<Closing>), Diagnostics> {
    let is_fixed = |body: BodyId| mechanism.bodies[body.index()].fixed;
    let mut nodes: Vec<Node> = Vec::new();
    let mut closings = Vec::new();
    let mut used = vec![false; mechanism.joints.len()];
    let mut place: Vec<Option<NodeId>> = vec![None; mechanism.bodies.len()];
    // `None` is the ground, all fixed bodies together.
    let mut queue: VecDeque<Option<BodyId>> = VecDeque::from([None]);
    while let Some(from) = queue.pop_front() {
        for (index, joint) in mechanism.joints.iter().enumerate() {
            if used[index] {
                continue;
            }
            let is_here = |body: BodyId| match from {
                None => is_fixed(body),
                Some(from) => body == from,
            };
            // The node is the joint's second body, or its first turned the other way.
            let (body, sense) = match joint.bodies.map(is_here) {
                [true, false] => (joint.bodies[1], 1.0),
                [false, true] => (joint.bodies[0], -1.0),
                _ => continue,
            };
            used[index] = true;
            let id = NodeId(nodes.len());
            let original = place[body.index()];
            nodes.push(Node {
                joint: JointId(index),
                body,
                ghost: original.map(|_| LoopId(closings.len())),
                parent: from.and_then(|from| place[from.index()]),
                sense,
                share: 1.0,
            });
            match original {
                Some(original) => {
                    closings.push(Closing { joint: JointId(index), original, ghost: id });
                }
                None => {
                    place[body.index()] = Some(id);
                    queue.push_back(Some(body));
                }
            }
        }
    }
    let mut problems = Diagnostics::default();
    for (body, place) in mechanism.bodies.iter().zip(&place) {
        if !body.fixed && place.is_none() {
            let message = format!("no chain of joints connects body `{}` to the ground", body.name);
            problems.push(
                Diagnostic::error("out-of-reach", body.span, message).hint(
                    "join it, by way of other bodies if need be, to a body with `fixed: true`",
                ),
            );
        }
    }
    if problems.has_errors() {
        return Err(problems);
    }
    for index in 0..nodes.len() {
        let copies = nodes.iter().filter(|node| node.body == nodes[index].body).count();
        nodes[index].share = 1.0 / copies as f64;
    }
    Ok((nodes, closings))
}

/// The joints around a loop: from the ghost up to the common ancestor, then down to the original.
pub fn joints_around(nodes: &[Node], closing: &Closing) -> Vec<JointId> {
    let path = |tip: NodeId| {
        let up = |id: &NodeId| nodes[id.index()].parent;
        std::iter::successors(Some(tip), up).collect::<Vec<_>>()
    };
    let (ghost, original) = (path(closing.ghost), path(closing.original));
    let joint = |id: &NodeId| nodes[id.index()].joint;
    let up = ghost.iter().filter(|id| !original.contains(id)).map(joint);
    let down = original.iter().rev().filter(|id| !ghost.contains(id)).map(joint);
    up.chain(down).collect()
}
