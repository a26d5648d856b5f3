//! The spanning tree: breadth-first from the ground and the free bodies over the joints in file order.
//!
//! A joint that reaches a body already in the tree closes a loop: it carries a ghost of that body.

use super::graph::{Connection, LoopId, Node, NodeId};
use crate::laminate::{FreeBody, FreeId, Mechanism};
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
/// Returns errors for joints that can never turn, for bodies that no chain of joints connects
/// with the ground or a free body, and for free bodies that one connects with either.
pub fn grow(mechanism: &Mechanism, to_cut: &[JointId]) -> Result<Tree, Diagnostics> {
    refuse_dead_joints(mechanism)?;
    let bodies = &mechanism.bodies;
    let (joints_of_ground, joints_of) = joints_by_body(mechanism);
    let mut nodes: Vec<Node> = Vec::new();
    let mut placed: Vec<Option<NodeId>> = vec![None; bodies.len()];
    let mut used = vec![false; mechanism.joints.len()];
    // The bodies that the search has reached, the ground and the free bodies first.
    let mut visited: Vec<Option<NodeId>> = vec![None];
    for (node, body) in free_bodies(mechanism) {
        placed[body.index()] = Some(NodeId(nodes.len()));
        visited.push(Some(NodeId(nodes.len())));
        nodes.push(node);
    }
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
                let connection = Connection::Hinge(*joint);
                nodes.push(Node { connection, body, ghost, parent, sense, share: 1.0 });
            }
        }
    }
    refuse_bodies_out_of_reach(mechanism, &placed)?;
    refuse_held_bodies(mechanism, &nodes)?;
    let cuts = cuts(&mut nodes, &placed);
    share_mass(&mut nodes, bodies.len());
    Ok(Tree { nodes, cuts })
}

/// Returns the joints of the ground, and those of each other body.
fn joints_by_body(mechanism: &Mechanism) -> (Vec<JointId>, Vec<Vec<JointId>>) {
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
    (joints_of_ground, joints_of)
}

/// Returns the node of each free body, with the body.
fn free_bodies(mechanism: &Mechanism) -> impl Iterator<Item = (Node, BodyId)> {
    mechanism.free.iter().enumerate().map(|(index, &FreeBody { body, .. })| {
        let connection = Connection::Free(FreeId(index));
        (Node { connection, body, ghost: None, parent: None, sense: 1.0, share: 1.0 }, body)
    })
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
                    .label("not connected with a fixed or a free body")
                    .hint(
                        "add a joint to a body that is connected, or make it `fixed: true` or \
                         `free: true`",
                    ),
            );
        }
    }
    if errors.has_errors() { Err(errors) } else { Ok(()) }
}

/// Refuses free bodies that joints connect with the ground or with each other: such a joint, and no other,
/// closes a way from the ground to the ground.
fn refuse_held_bodies(mechanism: &Mechanism, nodes: &[Node]) -> Result<(), Diagnostics> {
    let root = |mut node: NodeId| loop {
        match nodes[node.index()].parent {
            Some(parent) => node = parent,
            None => break nodes[node.index()].connection,
        }
    };
    let free = |connection| match connection {
        Connection::Free(free) => Some(free),
        Connection::Hinge(_) => None,
    };
    let mut errors = Diagnostics::default();
    for (index, ghost) in nodes.iter().enumerate().filter(|(_, node)| node.ghost.is_some()) {
        let is_original = |node: &&Node| node.ghost.is_none() && node.body == ghost.body;
        let Some(original) = nodes.iter().position(|node| is_original(&node)) else { continue };
        let [here, there] = [index, original].map(|node| free(root(NodeId(node))));
        let (Some(held), Some(joint)) = (there.max(here).filter(|_| here != there), ghost.joint())
        else {
            continue;
        };
        let body = &mechanism.bodies[mechanism.free[held.index()].body.index()];
        let other = match here.min(there) {
            Some(other) => {
                let body = mechanism.free[other.index()].body;
                format!("the free body `{}`", mechanism.bodies[body.index()].name)
            }
            None => "the ground".to_owned(),
        };
        let message = format!("joints connect the free body `{}` with {other}", body.name);
        let joint = &mechanism.joints[joint.index()];
        errors.push(
            Diagnostic::error(codes::HELD_BODY, body.span, message)
                .label("its joints already say how it moves")
                .also(joint.span, format!("`{}` closes the connection", joint.name))
                .hint("leave out its `free: true`: it moves as the joints let it"),
        );
        break;
    }
    if errors.has_errors() { Err(errors) } else { Ok(()) }
}

/// Numbers the loops in the order of their joints and walks around each.
fn cuts(nodes: &mut [Node], placed: &[Option<NodeId>]) -> Vec<Cut> {
    let closes = |node: &Node| node.ghost.and(node.joint());
    let mut ghosts: Vec<(JointId, NodeId)> = nodes
        .iter()
        .enumerate()
        .filter_map(|(index, node)| Some((closes(node)?, NodeId(index))))
        .collect();
    ghosts.sort();
    let mut cuts = Vec::new();
    for (index, (joint, ghost)) in ghosts.into_iter().enumerate() {
        let node = &mut nodes[ghost.index()];
        node.ghost = Some(LoopId(index));
        let body = node.body;
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
