//! Phase 4, generalized forces: f, everything in F_r + F_r* that is not a coefficient of du/dt.
//!
//! A body's velocities depend on the speed u_r of an ancestor (or its own) joint r only through the
//! frame of joint r, so its partial velocities are those of that frame, transformed as in a rigid
//! body. Kane's sums over the bodies beyond joint r therefore reduce to one wrench (force f, moment n
//! about the frame's origin) and one pair of partial velocities:
//!
//! ```text
//! F_r + F_r* = dw_r/du_r . n_r + dv_r/du_r . f_r + tau_r
//! ```
//!
//! Wrenches are summed from the leaves to the root.

use super::binder::Binder;
use super::kinematics::{Kinematics, PartialVelocity};
use super::loads::Loads;
use super::vector::dot;
use super::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// The generalized forces of the tree.
pub struct GeneralizedForces {
    /// f, N, N m.
    pub forcing: Vec<Expr>,
}

impl GeneralizedForces {
    /// Derives the generalized forces.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics, loads: &Loads) -> Self {
        let phase = Phase::GeneralizedForce;
        let sums = gathered(binder, kinematics, phase, "subtree", loads.bias().to_vec());
        let mut forcing = vec![Expr::zero(); binder.mechanism().speeds()];
        for (link, sum) in kinematics.links().iter().zip(&sums) {
            for (speed, force) in along_speeds(kinematics, link.node, sum) {
                let name = format!("generalized_force_{}", binder.speed_name(speed));
                let force = &force + loads.torque(link.node);
                let section = Section::body(link.node, phase);
                forcing[speed] = binder.bind(section, name, force);
            }
        }
        Self { forcing }
    }
}

/// Returns, for each node, the sum of the wrenches on it and on all nodes beyond it, about the node's
/// origin.
pub fn gathered(
    binder: &mut Binder,
    kinematics: &Kinematics,
    phase: Phase,
    name: &str,
    mut wrenches: Vec<Wrench>,
) -> Vec<Wrench> {
    for link in kinematics.links().iter().rev() {
        let wrench = wrenches[link.node.index()].clone();
        let wrench = binder.wrench(link.node, phase, name, wrench);
        if let Some(parent) = link.parent {
            let carried = link.carry_wrench(binder, phase, name, &wrench);
            wrenches[parent.index()] = wrenches[parent.index()].plus(&carried);
        }
        wrenches[link.node.index()] = wrench;
    }
    wrenches
}

/// Returns the generalized forces of a wrench on a node for each of the node's own speeds, with their places in
/// u: dw/du . n + dv/du . f.
pub fn along_speeds(kinematics: &Kinematics, node: NodeId, wrench: &Wrench) -> Vec<(usize, Expr)> {
    let along = |(speed, partial): (usize, &PartialVelocity)| {
        let moment = dot(&partial.omega, &wrench.moment);
        (speed, &moment + &dot(&partial.velocity, &wrench.force))
    };
    kinematics.partial(node).map(along).collect()
}
