//! The three-point closure: V2 - V1 = 0 for three points of every cut body (paper, eq. 9-11, as
//! vectors: the Jacobian of their squared length vanishes where it is satisfied).
//!
//! ```text
//! residual = P_ghost - P_original          nine numbers per loop
//! J du/dt  = -gamma                        the same, differentiated twice
//! ```
//!
//! Everything is relative to the nearest common ancestor of ghost and original, whose own motion
//! cancels. The rows of J are components along directions fixed to the cut body: each side is
//! written in its own copy of the frame, which is the same wherever the loop is closed.

use super::derivation::Derivation;
use super::section::{Phase, Section};
use super::vector::{Vector, cross, dot, sub};
use crate::source::JointId;
use crate::symbolic::Expr;
use crate::topology::{Loop, LoopId, NodeId};

/// What [`closure`] derives; see [`Equations`](super::Equations) for shapes.
#[derive(Default)]
pub struct Closure {
    pub jacobian: Vec<Expr>,
    pub gamma: Vec<Expr>,
    pub row_velocity: Vec<Expr>,
    pub row_residual: Vec<Expr>,
    pub residual: Vec<Expr>,
    pub residual_jacobian: Vec<Expr>,
}

/// Derives the closure of every loop.
pub fn closure(d: &mut Derivation) -> Closure {
    let mut closure = Closure::default();
    for (index, closed) in d.topology.loops.iter().enumerate() {
        let ancestor = d.common_ancestor(closed);
        d.acceleration_rows(LoopId(index), closed, ancestor, &mut closure);
        d.residuals(LoopId(index), closed, ancestor, &mut closure);
    }
    closure
}

impl Derivation<'_> {
    /// The nodes from the root down to `node`, the ground first.
    fn path(&self, node: NodeId) -> Vec<Option<NodeId>> {
        let mut path = vec![Some(node)];
        let mut at = Some(node);
        while let Some(id) = at {
            at = self.topology.nodes[id.index()].parent;
            path.push(at);
        }
        path.reverse();
        path
    }

    /// The node on which both sides of a loop meet; `None`: the ground.
    pub fn common_ancestor(&self, closed: &Loop) -> Option<NodeId> {
        let (ghost, original) = (self.path(closed.ghost), self.path(closed.original));
        let shared = ghost.iter().zip(&original).take_while(|(a, b)| a == b);
        shared.last().and_then(|(node, _)| *node)
    }

    /// Rows of J and gamma: V_ghost - V_original and its acceleration at du/dt = 0.
    fn acceleration_rows(
        &mut self,
        id: LoopId,
        closed: &Loop,
        ancestor: Option<NodeId>,
        out: &mut Closure,
    ) {
        for (number, row) in closed.rows.iter().enumerate() {
            let point = &closed.points[row.point];
            let along = closed.frame.column(row.axis).into_owned();
            let mut side = |node: NodeId| {
                let direction = self.frame(Some(node)).direction(&along);
                let direction = self.constants(direction);
                let arm = self.arm(Some(node), point);
                let motion = self.motion(ancestor, Some(node));
                (
                    dot(&direction, &motion.velocity_at(&arm)),
                    dot(&direction, &motion.acceleration_at(&arm)),
                )
            };
            let (ghost, original) = (side(closed.ghost), side(closed.original));
            let (velocity, gamma) = (&ghost.0 - &original.0, &ghost.1 - &original.1);
            for joint in (0..self.u.len()).map(JointId) {
                let entry = if closed.joints.contains(&joint) {
                    self.by_speed(Phase::ClosureJacobian, &velocity, joint)
                } else {
                    Expr::zero()
                };
                let name = &self.mechanism().joints[joint.index()].name;
                let name = format!("closure{}_{number}_{name}", id.index());
                out.jacobian.push(self.bind(
                    Section::closure(id, Phase::ClosureJacobian),
                    name,
                    entry,
                ));
            }
            let name = format!("gamma{}_{number}", id.index());
            out.gamma.push(self.bind(Section::closure(id, Phase::ClosureBias), name, gamma));
            out.row_velocity.push(velocity);
        }
    }

    /// All nine residuals and their Jacobian: joint r moves a point at P beyond it by
    /// axis_r x (P - origin_r) per radian.
    fn residuals(
        &mut self,
        id: LoopId,
        closed: &Loop,
        ancestor: Option<NodeId>,
        out: &mut Closure,
    ) {
        let mut gaps = Vec::new();
        for (number, point) in closed.points.iter().enumerate() {
            let name = |side: &str| format!("point{number}_{side}");
            let ghost = self.point_of(ancestor, closed.ghost, point, &name("ghost"));
            let original = self.point_of(ancestor, closed.original, point, &name("original"));
            let gap = sub(&ghost, &original);
            gaps.push(gap.clone());
            out.residual.extend(gap);
            let n = self.u.len();
            let mut columns = vec![super::vector::zero(); n];
            for (tip, at, sign) in [(closed.ghost, ghost, 1.0), (closed.original, original, -1.0)] {
                let sign = self.constant(sign);
                for node in self.path(tip).into_iter().rev().flatten() {
                    if Some(node) == ancestor {
                        break;
                    }
                    let joint = self.topology.nodes[node.index()].joint.index();
                    let hinge = self.placement(ancestor, Some(node));
                    let arm = sub(&at, &hinge.origin);
                    let arm = self.bind_vector(
                        node,
                        Phase::ResidualJacobian,
                        &format!("arm{}_{number}", id.index()),
                        arm,
                    );
                    let moved = cross(&hinge.axes[0], &arm);
                    columns[joint] = super::vector::scale(&sign, &moved);
                }
            }
            for row in 0..3 {
                out.residual_jacobian.extend(columns.iter().map(|column| column[row].clone()));
            }
        }
        for row in &closed.rows {
            let along = closed.frame.column(row.axis).into_owned();
            let direction = self.frame(Some(closed.ghost)).direction(&along);
            let direction = self.constants(direction);
            let along = self.placement(ancestor, Some(closed.ghost)).turn(&direction);
            out.row_residual.push(dot(&along, &gaps[row.point]));
        }
    }

    /// A point of a node relative to the ancestor, bound.
    fn point_of(
        &mut self,
        ancestor: Option<NodeId>,
        node: NodeId,
        flat: &nalgebra::Vector3<f64>,
        name: &str,
    ) -> Vector {
        let arm = self.arm(Some(node), flat);
        let position = self.placement(ancestor, Some(node)).place(&arm);
        if Some(node) == ancestor {
            return position;
        }
        self.bind_vector(node, Phase::ClosurePoint, name, position)
    }
}
