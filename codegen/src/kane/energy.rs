//! Phase 6, energies: kinetic energy, and the potential energy of gravity, springs, elastic tendons and contacts.

use super::binder::Binder;
use super::inertia::Inertias;
use super::kinematics::Kinematics;
use super::loads::{Loads, Spring};
use super::vector::{add, apply, cross, dot, scale};
use crate::program::{Phase, Section};
use crate::symbolic::Expr;

/// The energies of the tree.
pub struct Energy {
    /// Kinetic energy, J.
    pub kinetic: Expr,
    /// Potential energy, J.
    pub potential: Expr,
}

impl Energy {
    /// Derives the energies.
    pub fn new(
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &Inertias,
        loads: &Loads,
    ) -> Self {
        let kinetic = kinetic(binder, kinematics, inertias);
        let gravity = gravity(binder, kinematics, inertias, loads);
        let springs = springs(binder, kinematics, loads);
        let stored = &(&springs + loads.stored()) + loads.contacts().stored();
        Self { kinetic, potential: &gravity + &stored }
    }
}

/// Derives the kinetic energy: the sum over nodes of m v.v / 2 + v.(w x h) + w.I w / 2, and over the
/// rotors of motors of inertia u^2 / 2.
fn kinetic(binder: &mut Binder, kinematics: &Kinematics, inertias: &Inertias) -> Expr {
    let half = binder.constant(0.5);
    let mut total = Expr::zero();
    for (node, body) in binder.nodes().zip(inertias.whole()) {
        let motion = kinematics.motion(node);
        let (w, v) = (&motion.omega, &motion.velocity);
        let linear = &(&half * &body.mass) * &dot(v, v);
        let mixed = dot(v, &cross(w, &body.first_moment));
        let angular = &half * &dot(w, &apply(&body.rotational(), w));
        let energy = &(&linear + &mixed) + &angular;
        total = &total + &binder.scalar(node, Phase::KineticEnergy, "kinetic_energy", energy);
    }
    for link in kinematics.links().iter().filter(|link| !link.rotor.is_zero()) {
        let energy = &(&half * &link.rotor) * &(&link.speed * &link.speed);
        total = &total + &binder.scalar(link.node, Phase::KineticEnergy, "rotor_energy", energy);
    }
    total
}

/// Derives the potential energy of gravity: the sum over nodes of -g . (m p + A h).
fn gravity(
    binder: &mut Binder,
    kinematics: &Kinematics,
    inertias: &Inertias,
    loads: &Loads,
) -> Expr {
    let mut total = Expr::zero();
    for (node, body) in binder.nodes().zip(inertias.whole()) {
        let placement = kinematics.placement(node);
        let moment = placement.turn(&body.first_moment);
        let moment = add(&scale(&body.mass, &placement.origin), &moment);
        let energy = -&dot(loads.gravity(), &moment);
        total = &total + &binder.scalar(node, Phase::PotentialEnergy, "potential_energy", energy);
    }
    total
}

/// Derives the potential energy of the springs: the sum over joints of k bend^2 / 2 + k3 bend^4 / 4.
fn springs(binder: &mut Binder, kinematics: &Kinematics, loads: &Loads) -> Expr {
    let half = binder.constant(0.5);
    let mut total = Expr::zero();
    for link in kinematics.links() {
        let Spring { stiffness, cubic, bend } = loads.spring(link.node);
        let quarter = if cubic.is_zero() { Expr::zero() } else { binder.constant(0.25) };
        let energy =
            &(&(&half * stiffness) * &(bend * bend)) + &(&(&quarter * cubic) * &bend.power(4));
        let section = Section::body(link.node, Phase::PotentialEnergy);
        let name = format!("spring_energy_{}", binder.joint_name(link.node));
        total = &total + &binder.bind(section, name, energy);
    }
    total
}
