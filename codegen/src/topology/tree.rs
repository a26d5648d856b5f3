//! The spanning tree: breadth-first from the ground over the joints in file order.
//!
//! A joint that reaches a body already in the tree closes a loop: it carries a ghost of that body.

use super::graph::{LoopId, Node, NodeId};
use crate::laminate::Mechanism;
use crate::source::codes;
use crate::source::{BodyId, Diagnostic, Diagnostics, JointId};

/// The nodes of the tree and the cut of each loop.
pub struct Tree {
    /// Parents before children.
    pub nodes: Vec<Node>,
    /// In the order of the joints that close them.
    pub cuts: Vec<Cut>,
}

/// The cut of a loop.
#[derive(Clone, Debug)]
pub struct Cut {
    /// The joint that closes the loop.
    pub joint: JointId,
    /// The original of the cut body.
    pub original: NodeId,
    /// Its ghost.
    pub ghost: NodeId,
    /// The nodes from the body at which both sides meet: down to the ghost, and down to the original.
    pub sides: [Vec<NodeId>; 2],
}

/// Grows the tree; loops are cut at the joints `to_cut`.
///
/// # Errors
/// Returns errors for joints that can never turn and for bodies that no chain of joints connects
/// with the ground.
pub fn grow(mechanism: &Mechanism, to_cut: &[JointId]) -> Result<Tree, Diagnostics> {
    refuse_dead_joints(mechanism)?;
    let bodies = &mechanism.bodies;
    let mut joints_of: Vec<Vec<JointId>> = vec![Vec::new(); bodies.len()];
    let mut joints_of_ground = Vec::new();
    for (index, joint) in mechanism.joints.iter().enumerate() {
        for body in joint.bodies {
            if bodies[body.index()].fixed {
                joints_of_ground.push(JointId(index));
            } else {
                joints_of[body.index()].push(JointId(index));
            }
        }
    }

    let mut nodes: Vec<Node> = Vec::new();
    let mut placed: Vec<Option<NodeId>> = vec![None; bodies.len()];
    let mut used = vec![false; mechanism.joints.len()];
    // The bodies that the search has reached, the ground first.
    let mut visited: Vec<Option<NodeId>> = vec![None];
    // Joints at which loops are cut come last, when all bodies are in the tree.
    for closing in [false, true] {
        let mut next = 0;
        while let Some(&parent) = visited.get(next) {
            next += 1;
            let here = parent.map(|node| nodes[node.index()].body);
            let joints = here.map_or(&joints_of_ground, |body| &joints_of[body.index()]);
            for joint in joints {
                let waits = !closing && to_cut.contains(joint);
                if waits || std::mem::replace(&mut used[joint.index()], true) {
                    continue;
                }
                let [first, second] = mechanism.joints[joint.index()].bodies;
                let is_here = |body: BodyId| match here {
                    Some(here) => body == here,
                    None => bodies[body.index()].fixed,
                };
                let (body, sense) = if is_here(first) { (second, 1.0) } else { (first, -1.0) };
                let id = NodeId(nodes.len());
                // Loops are numbered by their joints, once all are known.
                let ghost = placed[body.index()].map(|_| LoopId(0));
                if ghost.is_none() {
                    if closing {
                        return Err(closes_nothing(mechanism, *joint, body));
                    }
                    placed[body.index()] = Some(id);
                    visited.push(Some(id));
                }
                nodes.push(Node { joint: *joint, body, ghost, parent, sense, share: 1.0 });
            }
        }
    }
    refuse_bodies_out_of_reach(mechanism, &placed)?;
    let cuts = cuts(&mut nodes, &placed);
    share_mass(&mut nodes, bodies.len());
    Ok(Tree { nodes, cuts })
}

fn refuse_dead_joints(mechanism: &Mechanism) -> Result<(), Diagnostics> {
    let mut errors = Diagnostics::default();
    for joint in &mechanism.joints {
        let [first, second] = joint.bodies;
        let fixed = |body: BodyId| mechanism.bodies[body.index()].fixed;
        if first == second || (fixed(first) && fixed(second)) {
            let message =
                format!("joint `{}` connects a body with itself or two fixed ones", joint.name);
            errors.push(Diagnostic::error(codes::DEAD_JOINT, joint.span, message).hint(
                "it can never turn: remove it, or name two bodies that can turn \
                           relative to each other",
            ));
        }
    }
    if errors.has_errors() { Err(errors) } else { Ok(()) }
}

/// Reports a joint that cannot be cut, because without it a body is not connected with the ground.
fn closes_nothing(mechanism: &Mechanism, joint: JointId, body: BodyId) -> Diagnostics {
    let joint = &mechanism.joints[joint.index()];
    let body = &mechanism.bodies[body.index()].name;
    let message = format!("no loop can be cut at joint `{}`", joint.name);
    let mut errors = Diagnostics::default();
    errors.push(
        Diagnostic::error(codes::NO_LOOP, joint.span, message)
            .label(format!("without it nothing connects `{body}` with the ground"))
            .hint("choose joints that are part of a loop, one for each loop"),
    );
    errors
}

fn refuse_bodies_out_of_reach(
    mechanism: &Mechanism,
    placed: &[Option<NodeId>],
) -> Result<(), Diagnostics> {
    let mut errors = Diagnostics::default();
    for (body, node) in mechanism.bodies.iter().zip(placed) {
        if !body.fixed && node.is_none() {
            let message =
                format!("no chain of joints connects body `{}` with the ground", body.name);
            errors.push(
                Diagnostic::error(codes::OUT_OF_REACH, body.span, message)
                    .label("not connected with a fixed body")
                    .hint("add a joint to a body that is connected, or make it `fixed: true`"),
            );
        }
    }
    if errors.has_errors() { Err(errors) } else { Ok(()) }
}

/// Numbers the loops in the order of their joints and walks around each.
fn cuts(nodes: &mut [Node], placed: &[Option<NodeId>]) -> Vec<Cut> {
    let mut ghosts: Vec<NodeId> =
        (0..nodes.len()).map(NodeId).filter(|node| nodes[node.index()].ghost.is_some()).collect();
    ghosts.sort_by_key(|ghost| nodes[ghost.index()].joint);
    let mut cuts = Vec::new();
    for (index, ghost) in ghosts.into_iter().enumerate() {
        let node = &mut nodes[ghost.index()];
        node.ghost = Some(LoopId(index));
        let (joint, body) = (node.joint, node.body);
        let Some(original) = placed[body.index()] else { continue };
        let (mut ghost_path, mut original_path) = (path(nodes, ghost), path(nodes, original));
        let shared = ghost_path.iter().zip(&original_path).take_while(|(a, b)| a == b).count();
        ghost_path.drain(..shared);
        original_path.drain(..shared);
        cuts.push(Cut { joint, original, ghost, sides: [ghost_path, original_path] });
    }
    cuts
}

/// Returns the nodes from a child of the ground down to the node.
fn path(nodes: &[Node], node: NodeId) -> Vec<NodeId> {
    let parent = |node: &NodeId| nodes[node.index()].parent;
    let mut path: Vec<_> = std::iter::successors(Some(node), parent).collect();
    path.reverse();
    path
}

/// Each of the k copies of a body carries 1/k of its mass.
fn share_mass(nodes: &mut [Node], bodies: usize) {
    let mut copies = vec![0_usize; bodies];
    for node in nodes.iter() {
        copies[node.body.index()] += 1;
    }
    for node in nodes {
        node.share = 1.0 / copies[node.body.index()] as f64;
    }
}
