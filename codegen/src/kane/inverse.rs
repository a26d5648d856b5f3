//! Inverse dynamics: what is left of Kane's equations and of the closure at given du/dt and
//! closure forces, and what every hinge carries.
//!
//! ```text
//! imbalance  = f - M du/dt + J^T lambda        zero in motion
//! opening    = gamma + J du/dt                 zero in motion
//! reaction_r = -(sum of wrenches beyond r)     force and moment that the hinge passes on
//! ```
//!
//! No matrix is formed: accelerations run from the root to the leaves and wrenches back (J. Y. S.
//! Luh, M. W. Walker, R. P. C. Paul, "On-line computational scheme for mechanical manipulators",
//! 1980), so the cost grows as N. Differentiated, this is how the equations of motion change.

use super::derivation::Derivation;
use super::dynamics::{Dynamics, Wrench};
use super::inertia::Inertia;
use super::motion::Motion;
use super::section::Phase;
use super::vector::{Vector, add, cross, dot, scale, sub};
use crate::symbolic::Expr;
use crate::topology::{Loop, NodeId};

/// What [`inverse`] derives; see [`Equations`](super::Equations) for shapes.
pub struct Inverse {
    pub imbalance: Vec<Expr>,
    pub opening: Vec<Expr>,
    pub reactions: Vec<Expr>,
}

/// Derives the inverse dynamics.
pub fn inverse(d: &mut Derivation, dynamics: &Dynamics) -> Inverse {
    let nodes: Vec<NodeId> = (0..d.topology.nodes.len()).map(NodeId).collect();
    // What moves hinges is enough for the balance; hinges carry all there is.
    let moving = d.gathered("moving", &dynamics.moving);
    let carried = d.gathered("carried", &dynamics.shares);
    let closing = d.closing_wrenches();
    let mut imbalance = vec![Expr::zero(); nodes.len()];
    let mut reactions = vec![Expr::zero(); 6 * nodes.len()];
    for (index, id) in nodes.into_iter().enumerate() {
        let joint = d.joint_of(id);
        let sum = moving[index].plus(&closing[index]);
        let partial = &dynamics.partial[index];
        let along = &dot(&partial.omega, &sum.moment) + &dot(&partial.v, &sum.force);
        imbalance[joint] = &along + &d.joint_torque(joint);
        let sum = carried[index].plus(&closing[index]);
        for (k, component) in d.reaction(id, &sum).into_iter().enumerate() {
            reactions[6 * joint + k] = component;
        }
    }
    Inverse { imbalance, opening: d.openings(), reactions }
}

impl Derivation<'_> {
    /// Motion of `node` relative to `ancestor` with alpha and a at the given du/dt.
    fn accelerated(&mut self, ancestor: Option<NodeId>, node: NodeId) -> Motion {
        if let Some(known) = self.accelerated.get(&(ancestor, node)) {
            return known.clone();
        }
        let parent = self.parent(node);
        let above = match parent.filter(|_| parent != ancestor) {
            Some(parent) => self.accelerated(ancestor, parent),
            None => Motion::rest(),
        };
        let bias = self.motion(ancestor, Some(node));
        let joint = self.joint_of(node);
        let r = self.offset(node);
        let u = self.u[joint].clone();
        let rate = self.accelerations[joint].clone();
        let carried = self.down(node, Phase::GivenAcceleration, &above.alpha);
        let [_, y, z] = &bias.omega;
        let turned = [rate, z * &u, -&(y * &u)];
        let alpha = self.bind_vector(
            node,
            Phase::GivenAcceleration,
            "alpha_moving",
            add(&carried, &turned),
        );
        let a = self.down(node, Phase::GivenAcceleration, &above.acceleration_at(&r));
        let a = self.bind_vector(node, Phase::GivenAcceleration, "a_moving", a);
        let (gradient, _) =
            self.gradient(node, Phase::GivenAcceleration, "gradient_moving", &bias.omega, &alpha);
        let motion = Motion { alpha, a, gradient, ..bias };
        self.accelerated.insert((ancestor, node), motion.clone());
        motion
    }

    /// Active and inertia wrenches of each node and all beyond it, about its origin.
    fn gathered(&mut self, name: &str, inertia: &[Inertia]) -> Vec<Wrench> {
        let mut sums =
            self.wrenches([Phase::InverseDynamics; 2], inertia, |d, id| d.accelerated(None, id));
        for id in (0..sums.len()).rev().map(NodeId) {
            let wrench =
                self.bind_wrench(id, Phase::InverseDynamics, name, sums[id.index()].clone());
            sums[id.index()] = wrench.clone();
            if let Some(parent) = self.parent(id) {
                let carried = self.carry_wrench(id, Phase::InverseDynamics, &wrench);
                sums[parent.index()] = sums[parent.index()].plus(&carried);
            }
        }
        sums
    }

    /// What the closure forces lambda contribute: along both sides of each loop, up to where they
    /// meet and cancel.
    fn closing_wrenches(&mut self) -> Vec<Wrench> {
        let mut sums = vec![Wrench::none(); self.topology.nodes.len()];
        let mut row = 0;
        let topology = self.topology;
        for closed in &topology.loops {
            let ancestor = self.common_ancestor(closed);
            let first = row;
            row += closed.rows.len();
            for (tip, sign) in [(closed.ghost, 1.0), (closed.original, -1.0)] {
                if Some(tip) == ancestor {
                    continue;
                }
                let mut wrench = self.row_forces(closed, tip, sign, first);
                let mut at = tip;
                loop {
                    wrench = self.bind_wrench(at, Phase::ClosureForce, "closing", wrench);
                    sums[at.index()] = sums[at.index()].plus(&wrench);
                    let parent = self.parent(at);
                    match parent.filter(|_| parent != ancestor) {
                        Some(parent) => {
                            wrench = self.carry_wrench(at, Phase::ClosureForce, &wrench);
                            at = parent;
                        }
                        None => break,
                    }
                }
            }
        }
        sums
    }

    /// Sum over a loop's rows of lambda along the row's direction, at the row's point.
    fn row_forces(&mut self, closed: &Loop, tip: NodeId, sign: f64, first: usize) -> Wrench {
        let mut sum = Wrench::none();
        for row in 0..closed.rows.len() {
            let Wrench { force, moment } = self.unit_wrench(closed, row, tip, sign);
            let size = self.multipliers[first + row].clone();
            sum = sum.plus(&Wrench { force: scale(&size, &force), moment: scale(&size, &moment) });
        }
        sum
    }

    /// A force of `sign` along a row's direction, at the row's point.
    pub fn unit_wrench(&mut self, closed: &Loop, row: usize, tip: NodeId, sign: f64) -> Wrench {
        let row = &closed.rows[row];
        let along = closed.frame.column(row.axis) * sign;
        let direction = self.frame(Some(tip)).direction(&along);
        let force = self.constants(direction);
        let arm = self.arm(Some(tip), &closed.points[row.point]);
        Wrench { moment: cross(&arm, &force), force }
    }

    /// gamma + J du/dt.
    fn openings(&mut self) -> Vec<Expr> {
        let mut openings = Vec::new();
        let topology = self.topology;
        for closed in &topology.loops {
            let ancestor = self.common_ancestor(closed);
            for row in &closed.rows {
                let along = closed.frame.column(row.axis).into_owned();
                let mut side = |node: NodeId| {
                    if Some(node) == ancestor {
                        return Expr::zero();
                    }
                    let direction = self.frame(Some(node)).direction(&along);
                    let direction = self.constants(direction);
                    let arm = self.arm(Some(node), &closed.points[row.point]);
                    dot(&direction, &self.accelerated(ancestor, node).acceleration_at(&arm))
                };
                openings.push(&side(closed.ghost) - &side(closed.original));
            }
        }
        openings
    }

    /// Force and moment about the hinge's first drawn point that `bodies[0]` exerts on
    /// `bodies[1]`, in the joint's frame: x along the hinge, z normal to the sheet when flat,
    /// fixed to `bodies[1]`.
    fn reaction(&mut self, node: NodeId, beyond: &Wrench) -> [Expr; 6] {
        let mechanism = self.mechanism();
        let joint = &mechanism.joints[self.joint_of(node)];
        let arm = self.arm(Some(node), &joint.point);
        let moment = sub(&beyond.moment, &cross(&arm, &beyond.force));
        let backwards = self.topology.nodes[node.index()].sense < 0.0;
        let [s, c] = self.sin_cos[self.joint_of(node)].clone();
        let turned = |[x, y, z]: &Vector| -> Vector {
            if !backwards {
                return [-x, -y, -z];
            }
            // The parent is `bodies[1]`, x points the other way, and the wrench on the node is
            // the opposite of the wrench on its parent.
            let y_parent = &(&c * y) - &(&s * z);
            let z_parent = &(&s * y) + &(&c * z);
            [-x, -&y_parent, z_parent]
        };
        let [a, b, c_] = turned(&beyond.force);
        let [d, e, f] = turned(&moment);
        [a, b, c_, d, e, f]
    }

    pub fn bind_wrench(
        &mut self,
        node: NodeId,
        phase: Phase,
        name: &str,
        wrench: Wrench,
    ) -> Wrench {
        Wrench {
            force: self.bind_vector(node, phase, &format!("force_{name}"), wrench.force),
            moment: self.bind_vector(node, phase, &format!("moment_{name}"), wrench.moment),
        }
    }
}
