//! Composite rigid bodies on free bodies: what the joints' accelerations and those of a free body need from
//! each other, in the free body's own frame.
//!
//! In that frame the inertia of a free body with all that hangs on it is that of one rigid body (mass m, first
//! moment h, second moments S), and each joint has a momentum (f, n) about the origin per unit of its speed. No
//! entry has the orientation in it, and m is a number (M. W. Walker, D. E. Orin, "Efficient dynamic computer
//! simulation of robotic mechanisms", 1982; for a free base R. Featherstone, "Rigid Body Dynamics Algorithms",
//! 2008, 9.3).

use super::binder::Binder;
use super::forces::along_speeds;
use super::inertia::{Inertias, SpatialInertia};
use super::kinematics::Kinematics;
use super::link::{Freedom, Link};
use super::mass::{bind_composite, carry_composite};
use super::wrench::Wrench;
use crate::program::{Phase, Section};
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// The inertia of joints and free bodies.
pub struct Composites {
    /// M of the joints, by row and column, kg m^2.
    pub joints: Vec<Vec<Expr>>,
    /// By joint, the node of the free body that it hangs on, and the momentum about its origin, in its frame,
    /// per unit of the joint's speed. Joints that hang on the ground have none.
    pub momenta: Vec<Option<(NodeId, Wrench)>>,
    /// The free bodies with all that hangs on them, about the origin of their frame, in their frame.
    pub bodies: Vec<(NodeId, SpatialInertia)>,
}

impl Composites {
    /// Derives the inertia from the leaves to the roots.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics, inertias: &Inertias) -> Self {
        let joints = binder.mechanism().joints.len();
        let mut composites = inertias.minimal().to_vec();
        let mut found = Self {
            joints: vec![vec![Expr::zero(); joints]; joints],
            momenta: vec![None; joints],
            bodies: Vec::new(),
        };
        for link in kinematics.links().iter().rev() {
            let composite = composites[link.node.index()].clone();
            let composite = bind_composite(binder, link, composite);
            if let Freedom::Free(_) = &link.freedom {
                found.bodies.push((link.node, composite));
                continue;
            }
            found.column(binder, kinematics, link, &composite);
            if let Some(parent) = link.parent {
                let carried = carry_composite(binder, link, &composite);
                composites[parent.index()] = composites[parent.index()].plus(&carried);
            }
        }
        found
    }

    /// Carries the momentum per unit of a hinge's speed to the root.
    fn column(
        &mut self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        link: &Link,
        composite: &SpatialInertia,
    ) {
        for (speed, partial) in kinematics.partial(link.node) {
            let mut wrench = composite.wrench(&partial.omega, &partial.velocity);
            let name = format!("inertia_{}", binder.speed_name(speed));
            let mut at = link;
            loop {
                if let Freedom::Free(_) = &at.freedom {
                    self.momenta[speed] = Some((at.node, wrench));
                    break;
                }
                for (row, entry) in along_speeds(kinematics, at.node, &wrench) {
                    let entry = if row == speed { &entry + &link.rotor } else { entry };
                    let name =
                        format!("mass_{}_{}", binder.speed_name(row), binder.speed_name(speed));
                    let section = Section::body(at.node, Phase::MassMatrix);
                    let entry = binder.bind(section, name, entry);
                    self.joints[row][speed] = entry.clone();
                    self.joints[speed][row] = entry;
                }
                let Some(parent) = at.parent else { break };
                wrench = at.carry_wrench(binder, Phase::MassMatrix, &name, &wrench);
                at = kinematics.link(parent);
            }
        }
    }
}
