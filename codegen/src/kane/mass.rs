//! Phase 5, mass matrix: M, the coefficients of du/dt in -F_r*.
//!
//! The matrix is computed from composite bodies (mass m, first moment h, second moments S about the
//! origin, I = tr(S) - S), which are summed from the leaves to the root. With the partial velocities of
//! joint s,
//!
//! ```text
//! f_s = dw_s x h + m dv_s        n_s = I dw_s + h x dv_s        M_rs = dw_r . n_s + dv_r . f_s
//! ```
//!
//! where the rotor of a joint's motor adds its inertia to M_ss (R. Featherstone, "Rigid Body Dynamics Algorithms", 2008,
//! 9.6), and where (f_s, n_s) is carried to every ancestor r (Walker & Orin 1982). The cost of one entry does not
//! depend on the number of bodies beyond it, so the total cost grows as N^2.

use super::binder::Binder;
use super::forces::along_speeds;
use super::inertia::{Inertias, SpatialInertia};
use super::kinematics::Kinematics;
use super::link::{Freedom, Link};
use super::vector::{Vector, add, cross, dot, scale, twice_symmetric};
use super::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;

/// A tree is deep if the mean number of speeds from the ground to a node is greater than this.
const DEEP: usize = 8;

/// The mass matrix of the tree.
pub struct MassMatrix {
    n: usize,
    entries: Vec<Expr>,
}

impl MassMatrix {
    /// Derives the mass matrix.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics, inertias: &Inertias) -> Self {
        let links = kinematics.links();
        let mut composites = inertias.minimal().to_vec();
        let n = binder.mechanism().speeds();
        let mut matrix = Self { n, entries: vec![Expr::zero(); n * n] };
        // A wrench can be carried from node to node and combined with each hinge in the hinge's own
        // frame. If it is carried to the ground instead, combining it with a hinge takes a third of the
        // operations, but carrying it there costs extra. This pays off only in deep trees.
        let is_deep = binder.topology().depths().iter().sum::<usize>() > DEEP * links.len();
        for link in links.iter().rev() {
            let composite = composites[link.node.index()].clone();
            let composite = bind_composite(binder, link, composite);
            for (speed, partial) in kinematics.partial(link.node) {
                let wrench = composite.wrench(&partial.omega, &partial.velocity);
                if is_deep {
                    matrix.column_at_ground(binder, kinematics, link, speed, wrench);
                } else {
                    matrix.column(binder, kinematics, link, speed, wrench);
                }
            }
            if let Some(parent) = link.parent {
                let carried = carry_composite(binder, link, &composite);
                composites[parent.index()] = composites[parent.index()].plus(&carried);
            }
        }
        matrix
    }

    /// Returns M, N x N row-major, kg m^2.
    pub fn entries(&self) -> &[Expr] {
        &self.entries
    }

    /// Computes the entries of a speed's column, from its node's own rows to the rows of the root, by carrying
    /// the wrench that a unit du/dt requires from node to node.
    fn column(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        link: &Link,
        speed: usize,
        mut wrench: Wrench,
    ) {
        let name = format!("inertia_{}", binder.speed_name(speed));
        let mut at = link;
        loop {
            for (row, entry) in along_speeds(kinematics, at.node, &wrench) {
                self.set(binder, link, [row, speed], entry);
            }
            let Some(parent) = at.parent else { break };
            wrench = at.carry_wrench(binder, Phase::MassMatrix, &name, &wrench);
            at = kinematics.link(parent);
        }
    }

    /// Computes the same entries with the wrench and the hinges about the ground's origin.
    fn column_at_ground(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        link: &Link,
        speed: usize,
        wrench: Wrench,
    ) {
        for (row, entry) in along_speeds(kinematics, link.node, &wrench) {
            self.set(binder, link, [row, speed], entry);
        }
        let Wrench { force, moment } = at_ground(binder, kinematics, link, speed, &wrench);
        let mut at = link.parent;
        while let Some(node) = at {
            // Partial velocities at the ground's origin, in the base frame.
            let placement = kinematics.placement(node);
            let above = kinematics.link(node);
            let mut about = |axis: &Vector, point: &Vector| {
                let velocity = cross(point, axis);
                let name = "partial_velocity_at_ground";
                let velocity = binder.vector(node, Phase::MassMatrix, name, velocity);
                &dot(axis, &moment) + &dot(&velocity, &force)
            };
            let entries = match &above.freedom {
                Freedom::Hinge(_) => vec![about(&placement.axes[0], &placement.origin)],
                Freedom::Free(free) => {
                    let turning = free.axes.each_ref().map(|axis| about(axis, &free.position));
                    force.iter().cloned().chain(turning).collect()
                }
            };
            for (row, entry) in above.speeds().zip(entries) {
                self.set(binder, link, [row, speed], entry);
            }
            at = above.parent;
        }
    }

    /// Binds an entry of a node's column, and stores it in both symmetric places.
    fn set(&mut self, binder: &mut Binder, column: &Link, [r, c]: [usize; 2], entry: Expr) {
        let entry = if r == c { &entry + &column.rotor } else { entry };
        let name = format!("mass_{}_{}", binder.speed_name(r), binder.speed_name(c));
        let entry = binder.bind(Section::body(column.node, Phase::MassMatrix), name, entry);
        self.entries[r * self.n + c] = entry.clone();
        self.entries[c * self.n + r] = entry;
    }
}

/// Returns the momentum of all that moves with a speed about the ground's origin, in the base frame.
pub fn at_ground(
    binder: &mut Binder,
    kinematics: &Kinematics,
    link: &Link,
    speed: usize,
    wrench: &Wrench,
) -> Wrench {
    let (node, phase) = (link.node, Phase::MassMatrix);
    let name = format!("inertia_{}_at_ground", binder.speed_name(speed));
    let placement = kinematics.placement(node);
    let force = placement.turn(&wrench.force);
    let force = binder.vector(node, phase, &format!("{name}_force"), force);
    let moment = add(&placement.turn(&wrench.moment), &cross(&placement.origin, &force));
    let moment = binder.vector(node, phase, &format!("{name}_moment"), moment);
    Wrench { force, moment }
}

/// Binds the composite of a node and all beyond it.
pub fn bind_composite(binder: &mut Binder, link: &Link, body: SpatialInertia) -> SpatialInertia {
    let (node, phase) = (link.node, Phase::CompositeInertia);
    SpatialInertia {
        mass: binder.scalar(node, phase, "composite_mass", body.mass),
        first_moment: binder.vector(node, phase, "composite_first_moment", body.first_moment),
        second_moment: binder.tensor(node, phase, "composite_second_moment", body.second_moment),
    }
}

/// Returns the same composite about the parent's origin, in the parent's frame.
pub fn carry_composite(binder: &mut Binder, link: &Link, body: &SpatialInertia) -> SpatialInertia {
    let (node, phase, r) = (link.node, Phase::CompositeInertia, &link.offset);
    let first = link.up(binder, phase, "composite_first_moment", &body.first_moment);
    let first = binder.vector(node, phase, "composite_first_moment_in_parent", first);
    let name = "composite_second_moment";
    let turned = link.turn_tensor(binder, phase, name, &body.second_moment);
    // The second moment is int (x + r)(x + r)^T dm.
    let half = binder.constant(0.5);
    let middle = add(&first, &scale(&(&half * &body.mass), r));
    SpatialInertia {
        mass: body.mass.clone(),
        first_moment: add(&first, &scale(&body.mass, r)),
        second_moment: add(&turned, &twice_symmetric(r, &middle)),
    }
}
