//! Phase 6, momentum: of all moving bodies together, in the base frame.
//!
//! ```text
//! c = sum(m p + A h) / sum m        P = sum A (m v + w x h)
//! L = sum A (I w + h x v) + (p - c) x A (m v + w x h)        about c
//! ```

use super::binder::Binder;
use super::inertia::Inertias;
use super::kinematics::Kinematics;
use super::vector::{Vector, add, cross, scale, sub, zero};
use crate::program::{Phase, Section};
use crate::symbolic::Expr;

/// The momentum of the tree.
pub struct Momentum {
    /// c (m), P (kg m/s) and L (kg m^2/s).
    pub components: Vec<Expr>,
}

impl Momentum {
    /// Derives the momentum.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics, inertias: &Inertias) -> Self {
        let phase = Phase::Momentum;
        let (mut mass, mut moment) = (Expr::zero(), zero());
        for (node, body) in binder.nodes().zip(inertias.whole()) {
            let placement = kinematics.placement(node);
            let first = placement.turn(&body.first_moment);
            mass = &mass + &body.mass;
            moment = add(&moment, &add(&scale(&body.mass, &placement.origin), &first));
        }
        let all = Section::mechanism(phase);
        let inverse = binder.bind(all, "inverse_mass".to_owned(), mass.power(-1));
        let mut axes = ["x", "y", "z"].into_iter();
        let centre: Vector = scale(&inverse, &moment).map(|component| {
            let name = format!("centre_of_mass_{}", axes.next().unwrap_or_default());
            binder.bind(all, name, component)
        });
        let (mut linear, mut angular) = (zero(), zero());
        for (node, body) in binder.nodes().zip(inertias.whole()) {
            let (placement, motion) = (kinematics.placement(node), kinematics.motion(node));
            let own = body.wrench(&motion.omega, &motion.velocity);
            let own = binder.wrench(node, phase, "momentum", own);
            let force = placement.turn(&own.force);
            let force = binder.vector(node, phase, "linear_momentum", force);
            let arm = sub(&placement.origin, &centre);
            let about = add(&placement.turn(&own.moment), &cross(&arm, &force));
            let about = binder.vector(node, phase, "angular_momentum", about);
            linear = add(&linear, &force);
            angular = add(&angular, &about);
        }
        Self { components: [centre, linear, angular].concat() }
    }
}
