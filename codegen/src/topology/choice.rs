//! Spanning trees that may be cheaper than the first one.
//!
//! Every joint is a coordinate, whatever the tree, so that trees differ in their number of operations only, and in
//! rounding. What a tree costs depends on how far its bodies are from the root, because motions and forces are carried
//! from body to body, and on how many bodies have none beyond them: where several joints follow one another, sums are shared. Measured on
//! sheets of Miura-ori and of Yoshimura's pattern, a level more of one body costs some 20 operations of the acceleration,
//! and a leaf more some 50 (`estimate`). That is good enough to tell which trees are worth deriving, not to choose one.

use std::collections::BTreeSet;

use super::graph::Node;
use super::inertia;
use super::tree::Tree;
use crate::laminate::Mechanism;
use crate::source::{Diagnostics, JointId};

/// Operations of a level of one body, and of a leaf, in tens.
const LEVEL: usize = 2;
const LEAF: usize = 5;

/// A spanning tree, by the joints at which its loops are cut.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Candidate {
    /// The joints that are left for last when the tree grows.
    pub cuts: Vec<JointId>,
    /// What it costs, roughly: in tens of operations above what all trees need.
    pub estimate: usize,
}

/// Returns spanning trees: the plain one, which a breadth-first walk finds, and others that may be cheaper, from
/// the least estimate on. If the model says where to cut, there are no others.
///
/// With one loop, the others are cut at each of its other joints. With several, they are trees with the least distance
/// of each body from the root, as the plain one, and with the fewest leaves.
///
/// # Errors
/// Returns the errors of a mechanism without a tree.
pub fn candidates(mechanism: &Mechanism) -> Result<(Candidate, Vec<Candidate>), Diagnostics> {
    let plain = inertia::grow(mechanism)?;
    let candidate = |cuts: Vec<JointId>, tree: &Tree| Candidate { cuts, estimate: estimate(tree) };
    let first = candidate(mechanism.cuts.clone(), &plain);
    if !mechanism.cuts.is_empty() {
        return Ok((first, Vec::new()));
    }
    let proposed: Vec<Vec<JointId>> = match plain.cuts.as_slice() {
        [] => Vec::new(),
        [cut] => {
            let around = cut.sides.iter().flatten();
            let joints = around.filter_map(|node| plain.nodes[node.index()].joint());
            joints.collect::<BTreeSet<_>>().into_iter().map(|joint| vec![joint]).collect()
        }
        _ => [false, true].map(|reversed| compact(mechanism, reversed)).into(),
    };
    let mut known = vec![cut_joints(&plain)];
    let mut others = Vec::new();
    for cuts in proposed {
        // Not every joint can be cut: a body may hang on it, or have all of its mass on the line of another one.
        let cut = Mechanism { cuts: cuts.clone(), ..mechanism.clone() };
        let Ok(tree) = inertia::grow(&cut) else { continue };
        let found = cut_joints(&tree);
        if found == cuts && !known.contains(&found) {
            others.push(candidate(cuts, &tree));
            known.push(found);
        }
    }
    others.sort_by_key(|other| other.estimate);
    Ok((first, others))
}

/// Returns the joints that close the loops of a tree, in order.
fn cut_joints(tree: &Tree) -> Vec<JointId> {
    tree.cuts.iter().map(|cut| cut.joint).collect()
}

/// Returns what a tree costs; see [`Candidate::estimate`].
fn estimate(tree: &Tree) -> usize {
    let mut levels: Vec<usize> = Vec::with_capacity(tree.nodes.len());
    let mut leaves = vec![true; tree.nodes.len()];
    for node in &tree.nodes {
        levels.push(1 + node.parent.map_or(0, |parent| levels[parent.index()]));
        // The copy of a cut body has no body beyond it.
        if let (Some(parent), None) = (node.parent, node.ghost) {
            leaves[parent.index()] = false;
        }
    }
    let of = |index: usize, node: &Node| match node.ghost {
        Some(_) => 0,
        None => LEVEL * levels[index] + if leaves[index] { LEAF } else { 0 },
    };
    tree.nodes.iter().enumerate().map(|(index, node)| of(index, node)).sum()
}

/// Returns the joints to cut for the tree in which each body is as near to the root as possible and the fewest are
/// leaves: from level to level, as many bodies as possible get one body of the next level each (H. W. Kuhn, "The
/// Hungarian method for the assignment problem", 1955), and those that are left get any parent. Joints are tried in the
/// order of the file, or in the reversed one.
fn compact(mechanism: &Mechanism, reversed: bool) -> Vec<JointId> {
    let mut joints: Vec<usize> = (0..mechanism.joints.len()).collect();
    if reversed {
        joints.reverse();
    }
    let levels = levels(mechanism);
    // For each body, the joints that lead to the next level, with the body there.
    let mut down: Vec<Vec<(usize, usize)>> = vec![Vec::new(); mechanism.bodies.len()];
    for &joint in &joints {
        let [a, b] = mechanism.joints[joint].bodies.map(|body| body.index());
        for (here, there) in [(a, b), (b, a)] {
            if levels[here].checked_add(1) == Some(levels[there]) {
                down[here].push((joint, there));
            }
        }
    }
    let mut above: Vec<Option<(usize, usize)>> = vec![None; mechanism.bodies.len()];
    for parent in 0..down.len() {
        let mut tried = vec![false; mechanism.bodies.len()];
        assign(parent, &down, &mut above, &mut tried);
    }
    for (parent, steps) in down.iter().enumerate() {
        for &(joint, there) in steps {
            above[there].get_or_insert((parent, joint));
        }
    }
    let kept: BTreeSet<usize> = above.iter().flatten().map(|(_, joint)| *joint).collect();
    let cut = (0..mechanism.joints.len()).filter(|joint| !kept.contains(joint));
    cut.map(JointId).collect()
}

/// Gives a body one of the next level, and those that had it another one. Returns false if this is not possible.
fn assign(
    parent: usize,
    down: &[Vec<(usize, usize)>],
    above: &mut [Option<(usize, usize)>],
    tried: &mut [bool],
) -> bool {
    for &(joint, there) in &down[parent] {
        if std::mem::replace(&mut tried[there], true) {
            continue;
        }
        let is_free = match above[there] {
            None => true,
            Some((other, _)) => assign(other, down, above, tried),
        };
        if is_free {
            above[there] = Some((parent, joint));
            return true;
        }
    }
    false
}

/// Returns the number of joints from the ground or a free body to each body.
fn levels(mechanism: &Mechanism) -> Vec<usize> {
    let mut levels = vec![usize::MAX; mechanism.bodies.len()];
    let mut reached: Vec<usize> = Vec::new();
    let fixed = mechanism.bodies.iter().enumerate().filter(|(_, body)| body.fixed);
    let roots = fixed.map(|(index, _)| index);
    for root in roots.chain(mechanism.free.iter().map(|free| free.body.index())) {
        levels[root] = 0;
        reached.push(root);
    }
    let mut joints_of: Vec<Vec<usize>> = vec![Vec::new(); mechanism.bodies.len()];
    for joint in &mechanism.joints {
        let [a, b] = joint.bodies.map(|body| body.index());
        joints_of[a].push(b);
        joints_of[b].push(a);
    }
    let mut next = 0;
    while let Some(&here) = reached.get(next) {
        next += 1;
        for &there in &joints_of[here] {
            if levels[there] == usize::MAX {
                levels[there] = levels[here] + 1;
                reached.push(there);
            }
        }
    }
    levels
}
