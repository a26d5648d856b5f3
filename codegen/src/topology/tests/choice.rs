//! The trees that may be cheaper: the same for the same file, the one with the least estimate first.

use super::{Hinge, hinge, mechanism};
use crate::laminate::Mechanism;
use crate::source::JointId;
use crate::topology::choice::candidates;
use crate::topology::{Topology, build};

/// Hinges between the plates of a sheet of `side` x `side` squares, numbered by rows; plate 0 is the ground.
fn sheet(side: usize) -> Vec<Hinge> {
    let mut hinges = Vec::new();
    for row in 0..side {
        for column in 0..side {
            let (here, x, y) = (row * side + column, column as f64, row as f64);
            if column + 1 < side {
                hinges.push(hinge([here, here + 1], [x + 1.0, y], [x + 1.0, y + 1.0]));
            }
            if row + 1 < side {
                hinges.push(hinge([here, here + side], [x, y + 1.0], [x + 1.0, y + 1.0]));
            }
        }
    }
    hinges
}

fn build_cut(mechanism: &Mechanism, cuts: &[JointId]) -> Topology {
    build(Mechanism { cuts: cuts.to_vec(), ..mechanism.clone() }).unwrap()
}

/// Bodies of the tree beyond which there is no other.
fn leaves(topology: &Topology) -> usize {
    let is_leaf = |index: usize| {
        let mut others = topology.nodes.iter().filter(|node| node.ghost.is_none());
        topology.nodes[index].ghost.is_none()
            && !others.any(|node| node.parent.is_some_and(|parent| parent.index() == index))
    };
    (0..topology.nodes.len()).filter(|index| is_leaf(*index)).count()
}

/// A comb has one leaf per row, in whichever order the file has the hinges; the walk finds it only in some orders.
#[test]
fn sheets_have_a_tree_with_few_leaves() {
    let mut found = Vec::new();
    for stride in [1, 5, 7, 11] {
        let hinges = sheet(4);
        let count = hinges.len();
        let shuffled = (0..count).map(|k| hinges[k * stride % count]).collect::<Vec<_>>();
        let mechanism = mechanism(&shuffled);
        let trees = candidates(&mechanism).unwrap();
        assert_eq!(trees, candidates(&mechanism).unwrap());
        let (plain, others) = trees;
        assert!(plain.cuts.is_empty() && others.is_sorted_by_key(|it| it.estimate));
        let tree = |cuts: &[JointId]| build_cut(&mechanism, cuts);
        let plain = tree(&plain.cuts);
        let best = others.first().map_or(plain.clone(), |it| tree(&it.cuts));
        assert_eq!(best.mobility, plain.mobility);
        let least = leaves(&best).min(leaves(&plain));
        assert_eq!(least, 4, "stride {stride}");
        found.push(leaves(&plain));
    }
    assert!(found.iter().any(|leaves| *leaves > 4), "{found:?}");
}

/// Every other joint of a loop is a place to cut it; what the model asks for is not compared with anything.
#[test]
fn a_loop_can_be_cut_at_each_of_its_joints() {
    let at = |k: usize| [k as f64, (k * k % 5) as f64];
    let around: Vec<Hinge> =
        (0..6).map(|k| hinge([k, (k + 1) % 6], at(k), [k as f64 + 0.3, 9.0])).collect();
    let mut mechanism = mechanism(&around);
    let (first, found) = candidates(&mechanism).unwrap();
    assert_eq!(found.len(), 5);
    let plain = build_cut(&mechanism, &[]).loops[0].joint;
    let mut cuts: Vec<JointId> = found.iter().map(|it| it.cuts[0]).collect();
    cuts.push(plain);
    cuts.sort();
    assert_eq!(cuts, (0..6).map(JointId).collect::<Vec<_>>());
    assert!(found.iter().all(|it| it.estimate >= first.estimate));
    for candidate in &found {
        let topology = build_cut(&mechanism, &candidate.cuts);
        assert_eq!([topology.loops[0].joint].as_slice(), candidate.cuts);
    }
    mechanism.cuts = vec![JointId(2)];
    assert!(candidates(&mechanism).unwrap().1.is_empty());
}
