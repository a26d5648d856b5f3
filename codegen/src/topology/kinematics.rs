//! Numeric kinematics of the tree, independent of the symbolic equations: closure residuals and
//! their Jacobian, and closed configurations by Levenberg-Marquardt.

use std::f64::consts::PI;

use nalgebra::{
    DMatrix, DVector, Isometry3, Rotation3, Translation3, Unit, UnitQuaternion, Vector3,
};

use super::graph::{NodeId, Topology};

/// Steps of one descent.
const STEPS: usize = 100;

/// Where every node is: the point drawn at x lies at T x.
fn placements(topology: &Topology, q: &[f64]) -> Vec<Isometry3<f64>> {
    let mut placed: Vec<Isometry3<f64>> = Vec::with_capacity(topology.nodes.len());
    for node in &topology.nodes {
        let hinge = &topology.mechanism.joints[node.joint.index()];
        let axis = Unit::new_unchecked(hinge.direction);
        let turn = Rotation3::from_axis_angle(&axis, node.sense * q[node.joint.index()]);
        let turn = UnitQuaternion::from_rotation_matrix(&turn);
        let about = Translation3::from(hinge.point - turn * hinge.point);
        let parent = node.parent.map_or(Isometry3::identity(), |parent| placed[parent.index()]);
        placed.push(parent * Isometry3::from_parts(about, turn));
    }
    placed
}

/// Nine residuals per loop (ghost less original of P1, P2, P3, base frame, m) and their Jacobian.
pub fn closure(topology: &Topology, q: &[f64]) -> (DVector<f64>, DMatrix<f64>) {
    let placed = placements(topology, q);
    let mut residual = DVector::zeros(9 * topology.loops.len());
    let mut jacobian = DMatrix::zeros(9 * topology.loops.len(), q.len());
    for (index, closed) in topology.loops.iter().enumerate() {
        for (k, point) in closed.points.iter().enumerate() {
            let row = 9 * index + 3 * k;
            for (tip, sign) in [(closed.ghost, 1.0), (closed.original, -1.0)] {
                let at = placed[tip.index()] * nalgebra::Point3::from(*point);
                let mut part = residual.rows_mut(row, 3);
                part += at.coords * sign;
                let up = |id: &NodeId| topology.nodes[id.index()].parent;
                for id in std::iter::successors(Some(tip), up) {
                    let node = &topology.nodes[id.index()];
                    let hinge = &topology.mechanism.joints[node.joint.index()];
                    if !closed.joints.contains(&node.joint) {
                        break;
                    }
                    let place = &placed[id.index()];
                    let axis = place * (hinge.direction * node.sense);
                    let arm = at.coords - (place * nalgebra::Point3::from(hinge.point)).coords;
                    let moved: Vector3<f64> = axis.cross(&arm) * sign;
                    let mut column = jacobian.view_mut((row, node.joint.index()), (3, 1));
                    column += moved;
                }
            }
        }
    }
    (residual, jacobian)
}

/// A closed configuration near a guess, within limits (half a turn where there are none).
pub fn assemble(topology: &Topology, guess: &[f64]) -> Option<Vec<f64>> {
    let tolerance = 1e-13 * topology.mechanism.size;
    let joints = &topology.mechanism.joints;
    let clamp = |q: &mut DVector<f64>| {
        for (q, joint) in q.iter_mut().zip(joints) {
            *q = q.clamp(joint.limits[0].max(-PI), joint.limits[1].min(PI));
        }
    };
    let mut q = DVector::from_column_slice(guess);
    clamp(&mut q);
    let (mut residual, mut jacobian) = closure(topology, q.as_slice());
    let mut damping = 1e-3;
    for _ in 0..STEPS {
        if residual.amax() <= tolerance || damping > 1e8 {
            break;
        }
        let gradient = jacobian.tr_mul(&residual);
        let mut normal = jacobian.tr_mul(&jacobian);
        let scale = normal.diagonal().amax();
        normal.iter_mut().step_by(q.len() + 1).for_each(|x| *x += damping * scale);
        let Some(factor) = normal.cholesky() else {
            damping *= 10.0;
            continue;
        };
        let mut step = factor.solve(&gradient);
        let longest = step.amax();
        if longest > 0.5 {
            step *= 0.5 / longest;
        }
        let mut trial = &q - step;
        clamp(&mut trial);
        let (now, slope) = closure(topology, trial.as_slice());
        if now.norm_squared() < residual.norm_squared() {
            (q, residual, jacobian) = (trial, now, slope);
            damping = (damping * 0.1).max(1e-15);
        } else {
            damping *= 10.0;
        }
    }
    (residual.amax() <= 1e-10 * topology.mechanism.size).then(|| q.as_slice().to_vec())
}
