//! The sides of every loop: loops are the shortest ones, whatever the tree.
//!
//! Each loop of the tree is closed by one joint, and each of the shortest loops is given one of these
//! joints that is in it. Where both are the same loop, its sides are paths of the tree. Otherwise the
//! loop has copies of its bodies on both sides, from the body opposite the closing joint.

use std::collections::BTreeSet;

use super::cycles;
use super::graph::{Connection, LoopId, Node, NodeId};
use super::tree::{Cut, Tree};
use crate::laminate::Mechanism;
use crate::source::{BodyId, JointId};

/// Returns the cuts of the shortest loops, in the order of the joints that close them, and the copies
/// of bodies along their sides.
pub fn shortest(mechanism: &Mechanism, tree: &Tree) -> (Vec<Cut>, Vec<Node>) {
    let around = |cut: &Cut| -> BTreeSet<JointId> {
        let path = cut.sides.iter().flatten();
        path.filter_map(|node| tree.nodes[node.index()].joint()).collect()
    };
    let of_tree: Vec<_> = tree.cuts.iter().map(around).collect();
    let cycles = cycles::shortest(mechanism);
    let Some(closed_by) = matched(tree, &of_tree, &cycles) else {
        return (tree.cuts.clone(), Vec::new());
    };
    let mut copies = Vec::new();
    let mut cuts = Vec::new();
    for (index, cut) in tree.cuts.iter().enumerate() {
        let cycle = &cycles[closed_by[index]];
        let is_of_tree = cycle.iter().copied().collect::<BTreeSet<_>>() == of_tree[index];
        cuts.push(if is_of_tree {
            cut.clone()
        } else {
            copied(mechanism, tree, LoopId(index), cut, cycle, &mut copies)
        });
    }
    (cuts, copies)
}

/// Returns for each loop of the tree one of the cycles that its joint is in, each cycle once and the
/// same loop where it is among them; nothing if there is no such assignment.
fn matched(
    tree: &Tree,
    of_tree: &[BTreeSet<JointId>],
    cycles: &[Vec<JointId>],
) -> Option<Vec<usize>> {
    let mut taken_by: Vec<Option<usize>> = vec![None; cycles.len()];
    let same = |index: usize, cycle: &Vec<JointId>| {
        cycle.len() == of_tree[index].len() && cycle.iter().all(|j| of_tree[index].contains(j))
    };
    let mut waiting = Vec::new();
    for index in 0..of_tree.len() {
        match cycles.iter().position(|cycle| same(index, cycle)) {
            Some(cycle) => taken_by[cycle] = Some(index),
            None => waiting.push(index),
        }
    }
    let candidates: Vec<Vec<usize>> = tree
        .cuts
        .iter()
        .map(|cut| (0..cycles.len()).filter(|&c| cycles[c].contains(&cut.joint)).collect())
        .collect();
    for index in waiting {
        let mut tried = vec![false; cycles.len()];
        if !assign(index, &candidates, &mut taken_by, &mut tried) {
            return None;
        }
    }
    let mut closed_by = vec![0; of_tree.len()];
    for (cycle, index) in taken_by.iter().enumerate() {
        closed_by[(*index)?] = cycle;
    }
    Some(closed_by)
}

/// Gives a loop of the tree a cycle, and those that had it another one (H. W. Kuhn, "The Hungarian
/// method for the assignment problem", 1955). Returns false if this is not possible.
fn assign(
    index: usize,
    candidates: &[Vec<usize>],
    taken_by: &mut [Option<usize>],
    tried: &mut [bool],
) -> bool {
    for &cycle in &candidates[index] {
        if std::mem::replace(&mut tried[cycle], true) {
            continue;
        }
        let is_free = match taken_by[cycle] {
            None => true,
            Some(other) => assign(other, candidates, taken_by, tried),
        };
        if is_free {
            taken_by[cycle] = Some(index);
            return true;
        }
    }
    false
}

/// Walks both sides of a cycle, from the body opposite its closing joint, and appends their copies.
fn copied(
    mechanism: &Mechanism,
    tree: &Tree,
    id: LoopId,
    cut: &Cut,
    cycle: &[JointId],
    copies: &mut Vec<Node>,
) -> Cut {
    let at = cycle.iter().position(|joint| *joint == cut.joint).unwrap_or_default();
    let mut around: Vec<JointId> = [&cycle[at..], &cycle[..at]].concat();
    let ghost = &tree.nodes[cut.ghost.index()];
    // The way around begins at the cut body, across the closing joint.
    let next = across(mechanism, cut.joint, ghost.body);
    if around.len() > 2 && !touches(mechanism, around[1], next) {
        around[1..].reverse();
    }
    // Bodies around the loop: the cut body, those between the joints, the cut body again.
    let mut bodies = vec![ghost.body];
    for joint in &around {
        bodies.push(across(mechanism, *joint, bodies[bodies.len() - 1]));
    }
    let meeting = around.len().div_ceil(2);
    let mut side = |steps: &mut dyn Iterator<Item = (JointId, BodyId)>| {
        let mut path: Vec<NodeId> = Vec::new();
        for (joint, body) in steps {
            let [first, _] = mechanism.joints[joint.index()].bodies;
            let sense = if same(mechanism, first, body) { -1.0 } else { 1.0 };
            let node = NodeId(tree.nodes.len() + copies.len());
            let parent = path.last().copied();
            let connection = Connection::Hinge(joint);
            copies.push(Node { connection, body, ghost: Some(id), parent, sense, share: 0.0 });
            path.push(node);
        }
        path
    };
    let ghost_side = side(&mut (0..meeting).rev().map(|k| (around[k], bodies[k])));
    let original_side = side(&mut (meeting..around.len()).map(|k| (around[k], bodies[k + 1])));
    let tip = |path: &[NodeId], other: NodeId| path.last().copied().unwrap_or(other);
    Cut {
        joint: cut.joint,
        ghost: tip(&ghost_side, cut.ghost),
        original: tip(&original_side, cut.original),
        sides: [ghost_side, original_side],
    }
}

/// Returns whether two bodies are the same or both fixed.
fn same(mechanism: &Mechanism, a: BodyId, b: BodyId) -> bool {
    let fixed = |body: BodyId| mechanism.bodies[body.index()].fixed;
    a == b || (fixed(a) && fixed(b))
}

fn touches(mechanism: &Mechanism, joint: JointId, body: BodyId) -> bool {
    mechanism.joints[joint.index()].bodies.iter().any(|end| same(mechanism, *end, body))
}

/// Returns the body on the other side of a joint.
fn across(mechanism: &Mechanism, joint: JointId, body: BodyId) -> BodyId {
    let [first, second] = mechanism.joints[joint.index()].bodies;
    if same(mechanism, first, body) { second } else { first }
}
