//! The walk: order, senses, ghosts, shares, paths; what cannot be spanned.

use super::{Hinge, codes, hinge, mechanism, topology};
use crate::source::JointId;
use crate::topology::{LoopId, NodeId, Topology, build};

/// Parallel hinges along y, apart along x: the walk does not look at geometry.
fn row(bodies: &[[usize; 2]]) -> Vec<Hinge> {
    let at = |(i, bodies): (usize, &[usize; 2])| {
        hinge(*bodies, [i as f64, 0.1 * (i * i) as f64], [i as f64, 1.0 + 0.1 * (i * i) as f64])
    };
    bodies.iter().enumerate().map(at).collect()
}

fn joints(topology: &Topology, index: usize) -> Vec<usize> {
    topology.loops[index].joints.iter().map(|joint| joint.index()).collect()
}

fn assert_consistent(topology: &Topology) {
    let mut joints: Vec<_> =
        topology.nodes.iter().filter_map(|node| Some(node.joint()?.index())).collect();
    joints.sort();
    assert_eq!(joints, (0..topology.mechanism.joints.len()).collect::<Vec<_>>());
    for (index, node) in topology.nodes.iter().enumerate() {
        assert!(node.parent.is_none_or(|parent| parent.index() < index));
        let copies = topology.nodes.iter().filter(|other| other.body == node.body).count();
        assert_eq!(node.share, 1.0 / copies as f64);
        let Some(joint) = node.joint() else { continue };
        let joint = &topology.mechanism.joints[joint.index()];
        let [from, to] = if node.sense > 0.0 { [0, 1] } else { [1, 0] };
        assert_eq!(joint.bodies[to], node.body);
        match node.parent {
            Some(parent) => assert_eq!(joint.bodies[from], topology.nodes[parent.index()].body),
            None => assert!(topology.mechanism.bodies[joint.bodies[from].index()].fixed),
        }
    }
    for (index, closed) in topology.loops.iter().enumerate() {
        let [ghost, original] = [closed.ghost, closed.original].map(|tip| topology.node(tip));
        assert_eq!((ghost.ghost, ghost.joint()), (Some(LoopId(index)), Some(closed.joint)));
        assert_eq!(original.ghost, (!topology.is_in_tree(closed)).then_some(LoopId(index)));
        assert_eq!(ghost.body, original.body);
        assert_eq!(closed.joints[0], closed.joint);
    }
    assert!(topology.loops.is_sorted_by_key(|closed| closed.joint));
}

#[test]
fn chain_in_either_sense() {
    let topology = topology(&row(&[[1, 2], [1, 0], [3, 2]]));
    assert_consistent(&topology);
    let nodes: Vec<_> =
        topology.nodes.iter().filter_map(|n| Some((n.joint()?.index(), n.sense))).collect();
    assert_eq!(nodes, [(1, -1.0), (0, 1.0), (2, -1.0)]);
    assert_eq!((topology.rank, topology.mobility), (0, 3));
    assert_eq!(topology.assembled, None);
    assert!(topology.loops.is_empty() && topology.warnings.0.is_empty());
}

#[test]
fn loop_is_cut_where_it_closes() {
    // Ground - b1 - b2 - b3 - ground: b1 and b3 are reached first, then b1 reaches b2, b3 again.
    for closing in [[3, 2], [2, 3]] {
        let topology = topology(&row(&[[0, 1], [1, 2], closing, [0, 3]]));
        assert_consistent(&topology);
        let order: Vec<_> =
            topology.nodes.iter().filter_map(|node| Some(node.joint()?.index())).collect();
        assert_eq!(order, [0, 3, 1, 2]);
        let ghost = &topology.nodes[3];
        assert_eq!((ghost.body.index(), ghost.parent, ghost.share), (2, Some(NodeId(1)), 0.5));
        assert_eq!(ghost.sense, if closing == [3, 2] { 1.0 } else { -1.0 });
        assert_eq!(joints(&topology, 0), [2, 3, 0, 1]);
        assert_eq!(topology.node_names(), ["b1", "b3", "b2", "b2_ghost0"]);
    }
}

#[test]
fn several_fixed_bodies_are_one_ground() {
    let mut mechanism = mechanism(&row(&[[0, 1], [1, 2], [2, 3], [3, 4]]));
    mechanism.bodies[4].fixed = true;
    let topology = build(mechanism).unwrap();
    assert_consistent(&topology);
    assert_eq!(topology.loops.len(), 1);
    let cut = topology.nodes[topology.loops[0].ghost.index()].body;
    assert_eq!(cut.index(), 2);
    assert_eq!(joints(&topology, 0), [2, 3, 0, 1]);
}

#[test]
fn several_loops_through_one_body() {
    // b3 hangs on three legs: two ghosts, three copies.
    let legs = [[0, 1], [0, 2], [0, 4], [1, 3], [2, 3], [4, 3]];
    let topology = topology(&row(&legs));
    assert_consistent(&topology);
    assert_eq!(topology.loops.len(), 2);
    let shares: Vec<_> = topology.nodes.iter().filter(|n| n.body.index() == 3).collect();
    assert_eq!(shares.len(), 3);
    assert!(shares.iter().all(|node| node.share == 1.0 / 3.0));
    assert_eq!(joints(&topology, 0), [4, 1, 0, 3]);
    assert_eq!(joints(&topology, 1), [5, 2, 0, 3]);
}

#[test]
fn loop_that_does_not_pass_the_ground() {
    // b1 carries a loop b1 - b2 - b3 - b4 - b1.
    let topology = topology(&row(&[[0, 1], [1, 2], [2, 3], [3, 4], [4, 1]]));
    assert_consistent(&topology);
    let mut around = joints(&topology, 0);
    around.sort();
    assert_eq!(around, [1, 2, 3, 4]);
}

#[test]
fn bodies_out_of_reach_are_all_named() {
    let errors = build(mechanism(&row(&[[0, 1], [2, 3]]))).unwrap_err();
    assert_eq!(codes(&errors), ["out-of-reach", "out-of-reach"]);
    assert_eq!(errors.0[1].span.unwrap().start, 3);
    let mut free = mechanism(&row(&[[0, 1]]));
    free.bodies[0].fixed = false;
    assert_eq!(codes(&build(free).unwrap_err()), ["out-of-reach", "out-of-reach"]);
}

#[test]
fn joints_that_can_never_turn_are_refused() {
    let mut both_fixed = mechanism(&row(&[[0, 1]]));
    both_fixed.bodies[1].fixed = true;
    assert_eq!(codes(&build(both_fixed).unwrap_err()), ["dead-joint"]);
    assert_eq!(codes(&build(mechanism(&row(&[[0, 1], [1, 1]]))).unwrap_err()), ["dead-joint"]);
}

#[test]
fn same_input_same_output() {
    let hinges = row(&[[0, 1], [1, 2], [2, 3], [3, 4], [4, 0]]);
    let [first, second] = [topology(&hinges), topology(&hinges)];
    assert_eq!(first.assembled, second.assembled);
    assert_eq!(first.loops[0].joint, JointId(2));
}
