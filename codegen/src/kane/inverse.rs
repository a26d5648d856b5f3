//! Phase 9, inverse dynamics: residuals of Kane's equations and of the closure at given du/dt and
//! closure forces, and the reaction of every hinge.
//!
//! ```text
//! imbalance  = f - M du/dt + J^T lambda        zero in motion
//! opening    = gamma + J du/dt                 zero in motion
//! reaction_r = -(sum of wrenches beyond r)     force and moment that the hinge transmits
//! ```
//!
//! No matrix is formed: accelerations are propagated from the root to the leaves and wrenches back
//! (J. Y. S. Luh, M. W. Walker, R. P. C. Paul, "On-line computational scheme for mechanical manipulators",
//! 1980), so the cost grows as N. The derivatives of these residuals are the derivatives of the
//! equations of motion.

use crate::program::{Phase, Section};
use std::collections::BTreeMap;

use super::binder::Binder;
use super::closure::Closure;
use super::equations::Leaf;
use super::forces::{along_speeds, gathered};
use super::inertia::{Inertias, SpatialInertia};
use super::kinematics::{Kinematics, Subtree};
use super::link::{Hinge, Link};
use super::loads::{Loads, WrenchNames};
use super::motion::Motion;
use super::vector::{Vector, cross, dot, sub};
use super::wrench::Wrench;
use crate::source::SpeedId;
use crate::symbolic::Expr;
use crate::topology::{LoopId, NodeId};

/// Given du/dt and lambda, as symbols.
pub struct Given {
    /// Given du/dt.
    accelerations: Vec<Expr>,
    /// Given lambda by row of the closure, N.
    multipliers: Vec<Expr>,
}

impl Given {
    /// Creates the symbols.
    pub fn new(binder: &mut Binder, closure: &Closure) -> Self {
        let speeds = (0..binder.mechanism().speeds()).map(SpeedId);
        let rows = 0..closure.rows().len();
        Self {
            accelerations: speeds.map(|id| binder.given(Leaf::Acceleration(id))).collect(),
            multipliers: rows.map(|row| binder.given(Leaf::Multiplier(row))).collect(),
        }
    }

    /// Takes du/dt; closure forces are zero.
    pub fn of(accelerations: Vec<Expr>) -> Self {
        Self { accelerations, multipliers: Vec::new() }
    }

    /// Returns the given du/dt.
    pub fn accelerations(&self) -> &[Expr] {
        &self.accelerations
    }
}

/// Results of inverse dynamics; see [`Equations`](super::Equations) for shapes.
pub struct InverseDynamics {
    pub imbalance: Vec<Expr>,
    pub opening: Vec<Expr>,
    pub reactions: Vec<Expr>,
}

/// The motions at given du/dt, by subtree of the kinematics.
pub struct GivenMotion(Vec<BTreeMap<NodeId, Motion>>);

impl InverseDynamics {
    /// Derives the inverse dynamics.
    pub fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        loads: &Loads,
        closure: &Closure,
        given: &Given,
    ) -> Self {
        let motion = GivenMotion::new(binder, kinematics, given);
        let mut beyond = |inertias: &[SpatialInertia], name: &'static str| {
            motion.wrenches(binder, kinematics, inertias, loads, name)
        };
        // The minimal inertia is enough for the balance, but the hinge reactions need the whole
        // inertia.
        let balance = beyond(inertias.minimal(), "balance");
        let transmitted = beyond(inertias.whole(), "transmitted");
        let closing = closing_wrenches(binder, kinematics, closure, given);
        let mut imbalance = vec![Expr::zero(); binder.mechanism().speeds()];
        let mut reactions = vec![Expr::zero(); 6 * binder.mechanism().joints.len()];
        for link in kinematics.links() {
            let index = link.node.index();
            let sum = balance[index].plus(&closing[index]);
            for (speed, along) in along_speeds(kinematics, link.node, &sum) {
                let name = format!("imbalance_{}", binder.speed_name(speed));
                let section = Section::body(link.node, Phase::InverseDynamics);
                let rotor = &link.rotor * &given.accelerations()[speed];
                let value = &(&along + loads.torque(link.node)) - &rotor;
                imbalance[speed] = binder.bind(section, name, value);
            }
            let Some(hinge) = link.hinge() else { continue };
            let sum = transmitted[index].plus(&closing[index]);
            for (k, component) in reaction(binder, link, hinge, &sum).into_iter().enumerate() {
                reactions[6 * hinge.joint.index() + k] = component;
            }
        }
        // A closure force along copies in a loop acts on the hinges between them.
        for link in kinematics.copies() {
            let Some(hinge) = link.hinge() else { continue };
            let (wrench, joint) = (&closing[link.node.index()], hinge.joint.index());
            imbalance[joint] = &imbalance[joint] + &wrench.moment[0];
            for (k, component) in reaction(binder, link, hinge, wrench).into_iter().enumerate() {
                let sum = &mut reactions[6 * joint + k];
                *sum = &*sum + &component;
            }
        }
        Self { imbalance, opening: motion.openings(kinematics, closure), reactions }
    }
}

impl GivenMotion {
    fn new(binder: &mut Binder, kinematics: &Kinematics, given: &Given) -> Self {
        let subtrees = kinematics.subtrees().iter();
        Self(subtrees.map(|subtree| on_subtree(binder, kinematics, given, subtree)).collect())
    }

    /// Derives the motions of the nodes relative to the ground only.
    pub fn on_tree(binder: &mut Binder, kinematics: &Kinematics, given: &Given) -> Self {
        let tree = &kinematics.subtrees()[..1];
        Self(tree.iter().map(|tree| on_subtree(binder, kinematics, given, tree)).collect())
    }

    /// Returns the motion of a node of the tree relative to the ground.
    pub fn of(&self, node: NodeId) -> &Motion {
        &self.0[0][&node]
    }

    /// Returns the active and inertia wrenches of each node and all nodes beyond it, about the node's
    /// origin.
    fn wrenches(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &[SpatialInertia],
        loads: &Loads,
        name: &'static str,
    ) -> Vec<Wrench> {
        let phase = Phase::InverseDynamics;
        let names = WrenchNames { gravity_phase: phase, phase, name: "net" };
        let motion = |node: NodeId| self.of(node);
        let wrenches = loads.on_bodies(binder, kinematics, inertias, motion, &names);
        gathered(binder, kinematics, phase, name, wrenches)
    }

    /// Returns gamma + J du/dt.
    fn openings(&self, kinematics: &Kinematics, closure: &Closure) -> Vec<Expr> {
        let opening = |row: &super::closure::Row| {
            let closed = kinematics.closed(row.closed);
            let [ghost, original] =
                [(&closed.ghost, &row.ghost), (&closed.original, &row.original)].map(
                    |(side, row)| match self.0[closed.subtree].get(&side.tip) {
                        Some(motion) => dot(&row.direction, &motion.acceleration_at(&row.arm)),
                        None => Expr::zero(),
                    },
                );
            &ghost - &original
        };
        closure.rows().iter().map(opening).collect()
    }
}

/// Derives the motions of the nodes of a subtree at given du/dt.
fn on_subtree(
    binder: &mut Binder,
    kinematics: &Kinematics,
    given: &Given,
    subtree: &Subtree,
) -> BTreeMap<NodeId, Motion> {
    let rest = Motion::rest();
    let mut motions: BTreeMap<NodeId, Motion> = BTreeMap::new();
    for (node, motion) in subtree.motions() {
        let link = kinematics.link(node);
        let parent = link.parent.and_then(|parent| motions.get(&parent)).unwrap_or(&rest);
        let motion = motion.at_given(binder, link, parent, given.accelerations());
        motions.insert(node, motion);
    }
    motions
}

/// Returns the contribution of the closure forces lambda along both sides of each loop, up to the body at
/// which they meet, where they cancel.
fn closing_wrenches(
    binder: &mut Binder,
    kinematics: &Kinematics,
    closure: &Closure,
    given: &Given,
) -> Vec<Wrench> {
    let nodes = kinematics.links().len() + kinematics.copies().len();
    let mut sums = vec![Wrench::zero(); nodes];
    for index in 0..binder.topology().loops.len() {
        let id = LoopId(index);
        for (which, (side, sign)) in kinematics.closed(id).sides().into_iter().enumerate() {
            let mut wrench = Wrench::zero();
            for (number, row) in closure.rows_of(id) {
                let unit = row.sides()[which].unit_wrench(sign);
                wrench = wrench.plus(&unit.times(&given.multipliers[number]));
            }
            for (place, &node) in side.path.iter().enumerate().rev() {
                wrench = binder.wrench(node, Phase::ClosureForce, "closure", wrench);
                sums[node.index()] = sums[node.index()].plus(&wrench);
                if place > 0 {
                    let link = kinematics.link(node);
                    wrench = link.carry_wrench(binder, Phase::ClosureForce, "closure", &wrench);
                }
            }
        }
    }
    sums
}

/// Returns the force and the moment about the hinge's first drawn point that `bodies[0]` exerts on
/// `bodies[1]`, in the joint's frame: x along the hinge, z normal to the sheet when flat, fixed to
/// `bodies[1]`.
fn reaction(binder: &mut Binder, link: &Link, hinge: &Hinge, beyond: &Wrench) -> [Expr; 6] {
    let point = binder.geometry().line(binder.mechanism(), hinge.joint).point;
    let arm = link.point(binder, "hinge_point", &point);
    let moment = sub(&beyond.moment, &cross(&arm, &beyond.force));
    let backwards = binder.topology().node(link.node).sense < 0.0;
    let turned = |[x, y, z]: &Vector| -> Vector {
        if !backwards {
            return [-x, -y, -z];
        }
        // The parent is `bodies[1]`, x points the other way, and the wrench on the node is the opposite
        // of the wrench on its parent.
        let [y, z] = hinge.joint_turn.forth(y, z);
        [-x, -&y, z]
    };
    let [fx, fy, fz] = turned(&beyond.force);
    let [nx, ny, nz] = turned(&moment);
    [fx, fy, fz, nx, ny, nz]
}
