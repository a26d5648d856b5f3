//! Which body of a connection is the parent.
//!
//! The order of a connection's two ids has no meaning. A breadth-first search from the ground (all
//! fixed bodies as one) visits the connections in file order. In each connection the body that is
//! reached first becomes the parent. A connection to a body that was visited before closes a loop;
//! its parent is the body from which the search came.

use std::collections::VecDeque;

use crate::source::ids::BodyId;
use crate::source::model::Joint;

/// Orders the bodies of every joint: parent, child. Joints that are not connected with the ground
/// stay as they are.
pub(super) fn orient(joints: &mut [Joint], fixed: &[BodyId], bodies: usize) {
    let ends: Vec<[usize; 2]> = {
        // The ground is one node of the graph: the first fixed body represents all of them.
        let ground = fixed.first();
        let node = |body: BodyId| match ground {
            Some(ground) if fixed.contains(&body) => ground.index(),
            _ => body.index(),
        };
        joints.iter().map(|joint| joint.bodies.each_ref().map(|body| node(body.value))).collect()
    };
    let mut at: Vec<Vec<usize>> = vec![Vec::new(); bodies];
    for (joint, ends) in ends.iter().enumerate() {
        ends.iter().for_each(|&body| at[body].push(joint));
    }
    let mut walked = vec![false; joints.len()];
    let mut visited = vec![false; bodies];
    let mut queue: VecDeque<usize> = fixed.first().map(|body| body.index()).into_iter().collect();
    queue.iter().for_each(|&body| visited[body] = true);
    while let Some(parent) = queue.pop_front() {
        for &joint in &at[parent] {
            if std::mem::replace(&mut walked[joint], true) {
                continue;
            }
            let [first, second] = ends[joint];
            let child = if first == parent { second } else { first };
            if first != parent {
                joints[joint].bodies.swap(0, 1);
            }
            if !std::mem::replace(&mut visited[child], true) {
                queue.push_back(child);
            }
        }
    }
}
