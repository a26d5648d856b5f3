//! Check that every joint moves some inertia: the mass matrix of the tree must be positive
//! definite.
//!
//! A body with inertia about the line of its parent joint resists rotation, whatever its children
//! are. If all bodies do, every motion of the tree has kinetic energy in any configuration. If the
//! whole mass of a body lies on that line, its children must provide the inertia; the pivots of the
//! mass matrix show whether they do. These are the pivots of the articulated inertia (R.
//! Featherstone, "Rigid Body Dynamics Algorithms", 2008, section 7.2), from the leaves to the
//! ground:
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

/// Moments about a hinge line below this fraction of the body's largest moment are rounding errors.
const SINGULAR: f64 = 1e-12;
/// Mass within this distance of a line, relative to the mechanism's size, lies on the line.
const ON_LINE: f64 = 1e-9;

/// Spatial inertia about the origin of the base frame.
type Spatial = SMatrix<f64, 6, 6>;

/// Grows a tree in which every joint moves some inertia, in the initial configuration.
///
/// If the mass of a body in a loop lies on one of its hinge lines, another hinge can be its parent
/// joint. If the tree chose that hinge, loops are cut at other joints.
///
/// # Errors
/// Returns the errors of [`tree::grow`], and joints about which nothing resists rotation.
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

/// Returns the joints of all loops that pass through one of these nodes.
fn around(tree: &Tree, nodes: &[NodeId]) -> BTreeSet<JointId> {
    let path = |cut: &Cut| cut.sides.concat();
    let paths = tree.cuts.iter().map(path);
    let through = paths.filter(|path| nodes.iter().any(|node| path.contains(node)));
    through.flatten().filter_map(|node| tree.nodes[node.index()].joint()).collect()
}

/// Returns the nodes for which nothing resists rotation about their parent joint, and free bodies that nothing
/// keeps from turning about some axis.
fn idle(mechanism: &Mechanism, tree: &Tree) -> Vec<NodeId> {
    let properties = |node: &Node| &mechanism.bodies[node.body.index()].mass_properties;
    let joint = |node: &Node| Some(&mechanism.joints[node.joint()?.index()]);
    let rotor = |node: &Node| node.joint().map_or(0.0, |joint| mechanism.rotor_inertia(joint));
    let bare: Vec<bool> = tree
        .nodes
        .iter()
        .map(|node| {
            let about = match joint(node) {
                Some(joint) => moment(properties(node), joint) + rotor(node),
                None => least(&properties(node).inertia),
            };
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
        let Some(joint) = joint(node) else {
            let left = about_com(&articulated[index]);
            if bare[index] && least(&left) <= rounding(properties(node), mechanism.size) {
                idle.push(NodeId(index));
            }
            continue;
        };
        let turn = turning(joint, &poses[index]);
        let momentum = articulated[index] * turn;
        let pivot = momentum.dot(&turn) + rotor(node);
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

/// Returns the least principal moment.
fn least(inertia: &Matrix3<f64>) -> f64 {
    inertia.symmetric_eigenvalues().min()
}

/// Returns the rotational inertia that is left when the body may move in all directions, kg m^2.
fn about_com(spatial: &Spatial) -> Matrix3<f64> {
    let [turning, coupling, moving] =
        [(0, 0), (0, 3), (3, 3)].map(|at| spatial.fixed_view::<3, 3>(at.0, at.1).into_owned());
    match moving.try_inverse() {
        Some(inverse) => turning - coupling * inverse * coupling.transpose(),
        None => Matrix3::zeros(),
    }
}

/// Returns a body's inertia about a hinge line, kg m^2.
fn moment(body: &MassProperties, joint: &Joint) -> f64 {
    (body.inertia_about(&joint.point) * joint.direction).dot(&joint.direction)
}

/// Returns the inertia about a line below which it is a rounding error, kg m^2.
fn rounding(body: &MassProperties, size: f64) -> f64 {
    let largest = body.inertia.symmetric_eigenvalues().amax();
    let near = ON_LINE * size;
    (SINGULAR * largest).max(body.mass * near * near)
}

/// Returns the pose of each node in the initial configuration.
fn poses(mechanism: &Mechanism, tree: &Tree) -> Vec<Isometry3<f64>> {
    let mut poses: Vec<Isometry3<f64>> = Vec::with_capacity(tree.nodes.len());
    for node in &tree.nodes {
        // Where a free body is does not matter.
        let Some(id) = node.joint() else {
            poses.push(Isometry3::identity());
            continue;
        };
        let joint = &mechanism.joints[id.index()];
        let angle = node.sense * mechanism.initial_q[id.index()];
        let turn = UnitQuaternion::from_scaled_axis(joint.direction * angle);
        let about = Translation3::from(joint.point) * turn * Translation3::from(-joint.point);
        let parent = node.parent.map_or(Isometry3::identity(), |parent| poses[parent.index()]);
        poses.push(parent * about);
    }
    poses
}

/// m X^T X + diag(I, 0), where X maps rotation and velocity to the velocity of the centre of mass.
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

/// Returns angular velocity and velocity at the base's origin of a rotation about the joint's line,
/// which moves with its bodies.
fn turning(joint: &Joint, pose: &Isometry3<f64>) -> Vector6<f64> {
    let direction: Vector3<f64> = pose.rotation * joint.direction;
    let point = pose.rotation * joint.point + pose.translation.vector;
    let velocity = point.cross(&direction);
    SVector::from_iterator(direction.iter().chain(velocity.iter()).copied())
}

fn nothing_resists(mechanism: &Mechanism, node: &Node) -> Diagnostic {
    let body = &mechanism.bodies[node.body.index()];
    let Some(joint) = node.joint().map(|joint| &mechanism.joints[joint.index()]) else {
        let message = format!("nothing resists a rotation of the free body `{}`", body.name);
        return Diagnostic::error(codes::SINGULAR_INERTIA, body.span, message)
            .label("all its mass lies on one line")
            .hint("give it an `outline`, or mass away from this line");
    };
    let body = &body.name;
    let message = format!("the moment of inertia about `{}` is zero", joint.name);
    Diagnostic::error(codes::SINGULAR_INERTIA, joint.span, message)
        .label(format!("all mass of `{body}` lies on this hinge line"))
        .hint(format!("give `{body}` an `outline`, or add mass away from the hinge line"))
}
