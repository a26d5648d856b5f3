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
use super::forces::along_hinge;
use super::inertia::{Inertias, SpatialInertia};
use super::kinematics::Kinematics;
use super::link::Link;
use super::vector::{add, cross, dot, scale, twice_symmetric};
use super::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;

/// A tree is deep if the mean number of hinges from the ground to a node is greater than this.
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
        let n = composites.len();
        let mut matrix = Self { n, entries: vec![Expr::zero(); n * n] };
        // A wrench can be carried from node to node and combined with each hinge in the hinge's own
        // frame. If it is carried to the ground instead, combining it with a hinge takes a third of the
        // operations, but carrying it there costs extra. This pays off only in deep trees.
        let is_deep = binder.topology().depths().iter().sum::<usize>() > DEEP * n;
        for link in links.iter().rev() {
            let composite = composites[link.node.index()].clone();
            let composite = bind_composite(binder, link, composite);
            if is_deep {
                matrix.column_at_ground(binder, kinematics, link, &composite);
            } else {
                matrix.column(binder, kinematics, link, &composite);
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

    /// Computes the entries of a joint's column, from its own row to the row of the root, by carrying
    /// the wrench from node to node.
    fn column(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        link: &Link,
        composite: &SpatialInertia,
    ) {
        let name = format!("inertia_{}", binder.joint_name(link.node));
        let mut wrench = unit_wrench(kinematics, link, composite);
        let mut at = link;
        loop {
            let entry = along_hinge(kinematics, at.node, &wrench);
            self.set(binder, at, link, entry);
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
        composite: &SpatialInertia,
    ) {
        let name = format!("inertia_{}_at_ground", binder.joint_name(link.node));
        let wrench = unit_wrench(kinematics, link, composite);
        let entry = along_hinge(kinematics, link.node, &wrench);
        self.set(binder, link, link, entry);
        let placement = kinematics.placement(link.node);
        let force = placement.turn(&wrench.force);
        let force = binder.vector(link.node, Phase::MassMatrix, &format!("{name}_force"), force);
        let moment = add(&placement.turn(&wrench.moment), &cross(&placement.origin, &force));
        let moment = binder.vector(link.node, Phase::MassMatrix, &format!("{name}_moment"), moment);
        let mut at = link.parent;
        while let Some(node) = at {
            // Partial velocities of the hinge at the ground's origin, in the base frame.
            let placement = kinematics.placement(node);
            let [axis, ..] = &placement.axes;
            let velocity = cross(&placement.origin, axis);
            let name = "partial_velocity_at_ground";
            let velocity = binder.vector(node, Phase::MassMatrix, name, velocity);
            let entry = &dot(axis, &moment) + &dot(&velocity, &force);
            self.set(binder, kinematics.link(node), link, entry);
            at = kinematics.link(node).parent;
        }
    }

    /// Binds an entry, and stores it in both symmetric places.
    fn set(&mut self, binder: &mut Binder, row: &Link, column: &Link, entry: Expr) {
        let entry = if row.node == column.node { &entry + &row.rotor } else { entry };
        let [r, c] = [row, column].map(|link| binder.joint_name(link.node));
        let section = Section::body(column.node, Phase::MassMatrix);
        let entry = binder.bind(section, format!("mass_{r}_{c}"), entry);
        let [r, c] = [row, column].map(|link| link.joint.index());
        self.entries[r * self.n + c] = entry.clone();
        self.entries[c * self.n + r] = entry;
    }
}

/// Returns the wrench that a unit du/dt of a hinge requires.
fn unit_wrench(kinematics: &Kinematics, link: &Link, composite: &SpatialInertia) -> Wrench {
    let partial = kinematics.partial(link.node);
    composite.wrench(&partial.omega, &partial.velocity)
}

fn bind_composite(binder: &mut Binder, link: &Link, body: SpatialInertia) -> SpatialInertia {
    let (node, phase) = (link.node, Phase::CompositeInertia);
    SpatialInertia {
        mass: binder.scalar(node, phase, "composite_mass", body.mass),
        first_moment: binder.vector(node, phase, "composite_first_moment", body.first_moment),
        second_moment: binder.tensor(node, phase, "composite_second_moment", body.second_moment),
    }
}

/// Returns the same composite about the parent's origin, in the parent's frame.
fn carry_composite(binder: &mut Binder, link: &Link, body: &SpatialInertia) -> SpatialInertia {
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
