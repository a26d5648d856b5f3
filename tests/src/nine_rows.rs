//! All nine closure rows of every loop, differentiated twice along a motion: kinematics that are independent of
//! lamc's and take only the spanning tree and the three points from it.
//!
//! A point x of the tip goes through the hinges of its chain one after the other, from the tip to
//! the common ancestor. With R the turn by theta about e through c, w = x - c and theta' = omega
//! constant,
//!
//! ```text
//! x  <- c + R w
//! x' <- R w' + omega e x (R w)
//! x" <- R w" + 2 omega e x (R w') + omega^2 e x (e x (R w))
//! ```
//!
//! so that along q + u s the residual r has r' = J u and r" = dJ/dt u = gamma. This is exact, without finite
//! differences.

use lamc::topology::{Loop, NodeId, Topology};
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Unit, Vector3};

/// The nine residuals of every loop (ghost less original) and their derivatives along q + u s.
#[derive(Clone, Debug)]
pub struct NineRows {
    /// r, 9 L, m.
    pub residual: DVector<f64>,
    /// J u, 9 L, m/s.
    pub velocity: DVector<f64>,
    /// gamma, 9 L, m/s^2.
    pub gamma: DVector<f64>,
    /// C x 9 L: picks out of the nine rows those of [`Loop::rows`], along directions of the cut
    /// body.
    pub selection: DMatrix<f64>,
}

/// The nine rows of every loop at a state.
pub fn nine_rows(topology: &Topology, q: &[f64], u: &[f64]) -> NineRows {
    let count = topology.loops.iter().map(|closed| closed.rows.len()).sum();
    let mut selection = DMatrix::zeros(count, 9 * topology.loops.len());
    let mut rows = [Vec::new(), Vec::new(), Vec::new()];
    let mut selected = 0;
    for (index, closed) in topology.loops.iter().enumerate() {
        let chains = Chains::new(topology, closed);
        for point in closed.points {
            let ghost = carried(topology, &chains.ghost, point, q, u);
            let original = carried(topology, &chains.original, point, q, u);
            for (rows, (ghost, original)) in rows.iter_mut().zip(ghost.iter().zip(original)) {
                rows.extend(chains.axes.tr_mul(&(ghost - original)).iter());
            }
        }
        for row in &closed.rows {
            let along = closed.frame.column(row.axis).into_owned();
            let turned = carried(topology, &chains.original, along, q, u)[0]
                - carried(topology, &chains.original, Vector3::zeros(), q, u)[0];
            let components = chains.axes.tr_mul(&turned).transpose();
            let column = 9 * index + 3 * row.point;
            selection.fixed_view_mut::<1, 3>(selected, column).copy_from(&components);
            selected += 1;
        }
    }
    let [residual, velocity, gamma] = rows.map(DVector::from_vec);
    NineRows { residual, velocity, gamma, selection }
}

/// The nodes of a loop, each side from its tip down to the nearest common ancestor.
struct Chains {
    ghost: Vec<NodeId>,
    original: Vec<NodeId>,
    /// Columns: the ancestor's axes, in which lamc writes residuals. x lies along its hinge.
    axes: Matrix3<f64>,
}

impl Chains {
    fn new(topology: &Topology, closed: &Loop) -> Self {
        let [mut ghost, mut original] = [closed.ghost, closed.original].map(|tip| {
            let parent = |node: &NodeId| topology.node(*node).parent;
            std::iter::successors(Some(tip), parent).collect::<Vec<_>>()
        });
        let mut axes = Matrix3::identity();
        while let Some(&shared) = ghost.last().filter(|&node| original.last() == Some(node)) {
            let node = topology.node(shared);
            let x = topology.mechanism.joints[node.joint().unwrap().index()].direction * node.sense;
            axes = Matrix3::from_columns(&[x, Vector3::z().cross(&x), Vector3::z()]);
            ghost.pop();
            original.pop();
        }
        Self { ghost, original, axes }
    }
}

/// Position, velocity and acceleration of a point drawn at `point`, carried by a chain of nodes
/// from its tip down.
fn carried(
    topology: &Topology,
    chain: &[NodeId],
    point: Vector3<f64>,
    q: &[f64],
    u: &[f64],
) -> [Vector3<f64>; 3] {
    let (mut x, mut v, mut a) = (point, Vector3::zeros(), Vector3::zeros());
    for node in chain {
        let node = topology.node(*node);
        let joint = &topology.mechanism.joints[node.joint().unwrap().index()];
        let e = joint.direction;
        let theta = node.sense * q[node.joint().unwrap().index()];
        let omega = node.sense * u[node.joint().unwrap().index()];
        let turn = Rotation3::from_axis_angle(&Unit::new_normalize(e), theta);
        let (w, dw, ddw) = (turn * (x - joint.point), turn * v, turn * a);
        x = joint.point + w;
        v = dw + omega * e.cross(&w);
        a = ddw + 2.0 * omega * e.cross(&dw) + omega * omega * e.cross(&e.cross(&w));
    }
    [x, v, a]
}
