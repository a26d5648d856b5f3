//! Whether every joint has inertia to turn: the mass matrix of the tree must be positive definite.
//!
//! A body with inertia about the line it hangs on resists turning, whatever hangs on it: where all
//! do, no motion of the tree is without kinetic energy, in any configuration. A body whose whole
//! mass lies on that line has to be held by what hangs on it; whether it is, the pivots of the mass
//! matrix tell. They are those of the articulated inertia (R. Featherstone, "Rigid Body Dynamics
//! Algorithms", 2008, section 7.2), from the leaves to the ground:
//!
//! ```text
//! D_j = h_j^T A_j h_j,    A_parent += A_j - (A_j h_j) (A_j h_j)^T / D_j
//! ```

use std::collections::BTreeSet;

use nalgebra::{
    Isometry3, Matrix3, SMatrix, SVector, Translation3, UnitQuaternion, Vector3, Vector6,
};

use super::graph::{Node, NodeId};
use super::tree::{self, Cut, Tree};
use crate::laminate::{Joint, MassProperties, Mechanism};
use crate::source::codes;
use crate::source::{Diagnostic, Diagnostics, JointId};

/// Over the largest moment of a body: less about its hinge line is rounding.
const SINGULAR: f64 = 1e-12;
/// Over the mechanism's size: mass within this distance of a line lies on it.
const ON_LINE: f64 = 1e-9;

/// Inertia about the base's origin of rotation and of the velocity there.
type Spatial = SMatrix<f64, 6, 6>;

/// Grows a tree all of whose joints have inertia to turn, in the initial configuration.
///
/// A body of a loop whose mass lies on one of its hinge lines need not hang on that one: where the
/// tree makes it, loops are cut elsewhere.
///
/// # Errors
/// Those of [`tree::grow`], and joints that nothing resists turning about.
pub fn grow(mechanism: &Mechanism) -> Result<Tree, Diagnostics> {
    let mut cuts = mechanism.cuts.clone();
    let mut tree = tree::grow(mechanism, &cuts)?;
    let mut idle = idle(mechanism, &tree);
    // At most one cut for each loop.
    for _ in 0..tree.cuts.len() {
        if idle.is_empty() {
            break;
        }
        let better = around(&tree, &idle).into_iter().find_map(|joint| {
            let cuts = [&cuts[..], &[joint]].concat();
            let tree = tree::grow(mechanism, &cuts).ok()?;
            let left = self::idle(mechanism, &tree);
            (left.len() < idle.len()).then_some((cuts, tree, left))
        });
        let Some(better) = better else { break };
        (cuts, tree, idle) = better;
    }
    if idle.is_empty() {
        return Ok(tree);
    }
    let nodes = idle.iter().map(|node| &tree.nodes[node.index()]);
    Err(Diagnostics(nodes.map(|node| nothing_resists(mechanism, node)).collect()))
}

/// The joints of all loops that pass through one of these nodes.
fn around(tree: &Tree, nodes: &[NodeId]) -> BTreeSet<JointId> {
    let path =
        |cut: &Cut| cut.ghost_path.iter().chain(&cut.original_path).copied().collect::<Vec<_>>();
    let paths = tree.cuts.iter().map(path);
    let through = paths.filter(|path| nodes.iter().any(|node| path.contains(node)));
    through.flatten().map(|node| tree.nodes[node.index()].joint).collect()
}

/// The nodes that nothing resists turning about the joint they hang on.
fn idle(mechanism: &Mechanism, tree: &Tree) -> Vec<NodeId> {
    let properties = |node: &Node| &mechanism.bodies[node.body.index()].mass_properties;
    let joint = |node: &Node| &mechanism.joints[node.joint.index()];
    let bare: Vec<bool> = tree
        .nodes
        .iter()
        .map(|node| {
            let about = moment(properties(node), joint(node));
            about <= rounding(properties(node), mechanism.size)
        })
        .collect();
    let mut idle = Vec::new();
    if !bare.contains(&true) {
        return idle;
    }
    let poses = poses(mechanism, tree);
    let mut articulated: Vec<Spatial> = tree
        .nodes
        .iter()
        .zip(&poses)
        .map(|(node, pose)| spatial(properties(node), pose) * node.share)
        .collect();
    let mut composite = articulated.clone();
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let turn = turning(joint(node), &poses[index]);
        let momentum = articulated[index] * turn;
        let pivot = momentum.dot(&turn);
        let rigid = (composite[index] * turn).dot(&turn);
        let held = pivot > rounding(properties(node), mechanism.size).max(SINGULAR * rigid);
        if bare[index] && !held {
            idle.push(NodeId(index));
        }
        if let Some(parent) = node.parent {
            let whole = composite[index];
            composite[parent.index()] += whole;
            let mut left = articulated[index];
            if held {
                left -= momentum * momentum.transpose() / pivot;
            }
            articulated[parent.index()] += left;
        }
    }
    idle.reverse();
    idle
}

/// A body's inertia about a hinge line, kg m^2.
fn moment(body: &MassProperties, joint: &Joint) -> f64 {
    (body.inertia_about(&joint.point) * joint.direction).dot(&joint.direction)
}

/// What inertia about a line is rounding, kg m^2.
fn rounding(body: &MassProperties, size: f64) -> f64 {
    let largest = body.inertia.symmetric_eigenvalues().amax();
    let near = ON_LINE * size;
    (SINGULAR * largest).max(body.mass * near * near)
}

/// Where each node is in the initial configuration.
fn poses(mechanism: &Mechanism, tree: &Tree) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(tree.nodes.len());
    for node in &tree.nodes {
        let joint = &mechanism.joints[node.joint.index()];
        let angle = node.sense * mechanism.initial_q[node.joint.index()];
        let turn = UnitQuaternion::from_scaled_axis(joint.direction * angle);
        let about = Translation3::from(joint.point) * turn * Translation3::from(-joint.point);
        let parent = node.parent.map_or(Isometry3::identity(), |parent| poses[parent.index()]);
        poses.push(parent * about);
    }
    poses
}

/// m X^T X + diag(I, 0), X the velocity of the centre of mass by rotation and velocity.
fn spatial(body: &MassProperties, pose: &Isometry3<f64>) -> Spatial {
    let com = pose.rotation * body.com + pose.translation.vector;
    let rotation = pose.rotation.to_rotation_matrix();
    let mut velocity = SMatrix::<f64, 3, 6>::zeros();
    velocity.fixed_view_mut::<3, 3>(0, 0).copy_from(&-com.cross_matrix());
    velocity.fixed_view_mut::<3, 3>(0, 3).copy_from(&Matrix3::identity());
    let mut spatial = velocity.transpose() * velocity * body.mass;
    let central = rotation.matrix() * body.inertia * rotation.matrix().transpose();
    let mut turning = spatial.fixed_view_mut::<3, 3>(0, 0);
    turning += central;
    spatial
}

/// Rotation and velocity at the base's origin of a turn about the joint's line, which moves with
/// its bodies.
fn turning(joint: &Joint, pose: &Isometry3<f64>) -> Vector6<f64> {
    let direction: Vector3<f64> = pose.rotation * joint.direction;
    let point = pose.rotation * joint.point + pose.translation.vector;
    let velocity = point.cross(&direction);
    SVector::from_iterator(direction.iter().chain(velocity.iter()).copied())
}

fn nothing_resists(mechanism: &Mechanism, node: &Node) -> Diagnostic {
    let joint = &mechanism.joints[node.joint.index()];
    let body = &mechanism.bodies[node.body.index()].name;
    let message = format!("nothing resists turning about `{}`", joint.name);
    Diagnostic::error(codes::SINGULAR_INERTIA, joint.span, message)
        .label(format!("all mass of `{body}` lies on this hinge line"))
        .hint(format!("give `{body}` an `outline`, or mass beside the line"))
}
