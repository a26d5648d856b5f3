//! Phase 3, loads: gravity, applied forces, force elements, air drag, contacts and joint torques, and the bias force of every
//! body, which is the sum of these forces and of its inertia force at du/dt = 0.

use crate::program::{Phase, Quantity, Section};
use nalgebra::Vector3;

use super::binder::Binder;
use super::contact::Contacts;
use super::elements::{Elements, motor_torque};
use super::facts::AXES;
use super::free::Free;
use super::inertia::{Inertias, SpatialInertia};
use super::kinematics::Kinematics;
use super::link::{Freedom, Hinge, Link};
use super::motion::Motion;
use super::vector::{Vector, cross, dot, scale, sub, zero};
use super::wrench::Wrench;
use crate::laminate::{Body, fixed};
use crate::source::Expression;
use crate::symbolic::{Expr, Function};
use crate::topology::NodeId;

/// The forces and torques on the tree.
pub struct Loads {
    /// Gravity in the base frame, m/s^2.
    gravity: Vector,
    /// Wrenches of applied forces and of air drag, by node.
    applied: Vec<Wrench>,
    /// Contacts of points with planes.
    contacts: Contacts,
    /// Bias forces for the minimal inertia, by node.
    bias: Vec<Wrench>,
    /// Springs, by node. A free body has none.
    springs: Vec<Option<Spring>>,
    /// Joint torques, by node: zero for a free body.
    torques: Vec<Expr>,
    /// Potential energy of springs between points and bodies, J.
    stored: Expr,
}

/// The spring of a joint. Its torque is -k bend - k3 bend^3.
pub struct Spring {
    /// k, N m/rad.
    pub stiffness: Expr,
    /// k3, N m/rad^3.
    pub cubic: Expr,
    /// q - rest, rad.
    pub bend: Expr,
}

/// The phases and the name of the wrenches that [`Loads::on_bodies`] binds.
pub struct WrenchNames {
    /// Phase in which g - a is bound.
    pub gravity_phase: Phase,
    /// Phase in which the wrench is bound.
    pub phase: Phase,
    /// Name of the wrench.
    pub name: &'static str,
}

const APPARENT_GRAVITY: &str = "apparent_gravity";

const HALF_AREA: Quantity = Quantity::new("half_area", "half the area of a part, m^2");

const FRICTION_RATE: Quantity =
    Quantity::new("friction_rate", "one over the speed of its friction, s/rad");

impl Loads {
    /// Derives the loads.
    pub fn new(binder: &mut Binder, kinematics: &Kinematics, inertias: &Inertias) -> Self {
        let gravity = &binder.mechanism().gravity;
        let gravity = vector(binder, gravity, "gravity");
        let elements = Elements::new(binder, kinematics);
        let contacts = Contacts::new(binder, kinematics);
        let applied = applied(binder, kinematics, &elements, &contacts);
        let links = kinematics.links();
        let springs: Vec<Option<Spring>> =
            links.iter().map(|link| Some(spring(binder, link.node, link.hinge()?))).collect();
        let pairs = links.iter().zip(&springs);
        let torque = |(link, spring): (&Link, &Option<Spring>)| {
            Some(joint_torque(binder, link.node, link.hinge()?, spring.as_ref()?))
        };
        let torques = pairs.map(torque).map(|torque| torque.unwrap_or_else(Expr::zero)).collect();
        let stored = elements.energy;
        let bias = Vec::new();
        let mut loads = Self { gravity, applied, contacts, bias, springs, torques, stored };
        let names = WrenchNames {
            gravity_phase: Phase::ApparentGravity,
            phase: Phase::BiasForce,
            name: "bias",
        };
        let motion = |node: NodeId| kinematics.motion(node);
        loads.bias = loads.on_bodies(binder, kinematics, inertias.minimal(), motion, &names);
        loads
    }

    /// Returns gravity in the base frame, m/s^2.
    pub fn gravity(&self) -> &Vector {
        &self.gravity
    }

    /// Returns the bias forces for the minimal inertia, by node.
    pub fn bias(&self) -> &[Wrench] {
        &self.bias
    }

    /// Returns the contacts of points with planes.
    pub fn contacts(&self) -> &Contacts {
        &self.contacts
    }

    /// Returns the spring of a node's joint.
    pub fn spring(&self, node: NodeId) -> Option<&Spring> {
        self.springs[node.index()].as_ref()
    }

    /// Returns the potential energy of springs between points and bodies, J.
    pub fn stored(&self) -> &Expr {
        &self.stored
    }

    /// Returns tau: the torque of a node's joint on the node about the hinge, along u, N m.
    pub fn torque(&self, node: NodeId) -> &Expr {
        &self.torques[node.index()]
    }

    /// Returns, by node, the sum of gravity, applied forces and inertia forces for a given motion of
    /// the nodes. These are the terms of F_r and F_r* without their partial velocities.
    pub fn on_bodies<'m>(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &[SpatialInertia],
        motion_of: impl Fn(NodeId) -> &'m Motion,
        names: &WrenchNames,
    ) -> Vec<Wrench> {
        let at_root =
            |free: &Free, motion: &Motion| sub(&free.down(&self.gravity), &motion.acceleration);
        self.with_roots(binder, kinematics, inertias, motion_of, at_root, names)
    }

    /// Returns the same wrenches as seen from the origins of free bodies: g - a is zero there.
    pub fn on_falling_bodies<'m>(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &[SpatialInertia],
        motion_of: impl Fn(NodeId) -> &'m Motion,
        names: &WrenchNames,
    ) -> Vec<Wrench> {
        let at_root = |_: &Free, _: &Motion| zero();
        self.with_roots(binder, kinematics, inertias, motion_of, at_root, names)
    }

    /// Returns these wrenches for given g - a at the origins of free bodies.
    fn with_roots<'m>(
        &self,
        binder: &mut Binder,
        kinematics: &Kinematics,
        inertias: &[SpatialInertia],
        motion_of: impl Fn(NodeId) -> &'m Motion,
        at_root: impl Fn(&Free, &Motion) -> Vector,
        names: &WrenchNames,
    ) -> Vec<Wrench> {
        let rest = Motion::rest();
        let mut apparent: Vec<Vector> = Vec::with_capacity(inertias.len());
        let mut wrenches = Vec::with_capacity(inertias.len());
        for (link, inertia) in kinematics.links().iter().zip(inertias) {
            let node = link.node;
            let phase = names.gravity_phase;
            let gravity = match (&link.freedom, link.parent) {
                (Freedom::Free(free), _) => {
                    let gravity = at_root(free, motion_of(node));
                    binder.vector(node, phase, APPARENT_GRAVITY, gravity)
                }
                (_, None) => apparent_gravity(binder, link, &self.gravity, &rest, phase),
                (_, Some(parent)) => {
                    let above = &apparent[parent.index()];
                    apparent_gravity(binder, link, above, motion_of(parent), phase)
                }
            };
            let wrench = inertial_wrench(inertia, motion_of(node), &gravity);
            let wrench = wrench.plus(&self.applied[node.index()]);
            wrenches.push(binder.wrench(node, names.phase, names.name, wrench));
            apparent.push(gravity);
        }
        wrenches
    }
}

/// Returns g - a at a node's origin in the node's components, m/s^2, from g - a of its parent (or of
/// the base) and the parent's motion relative to the ground.
fn apparent_gravity(
    binder: &mut Binder,
    link: &Link,
    above: &Vector,
    parent: &Motion,
    phase: Phase,
) -> Vector {
    let at_origin = sub(above, &parent.relative_acceleration(&link.offset));
    let at_origin = binder.vector(link.node, phase, "apparent_gravity_in_parent", at_origin);
    let here = link.down(binder, phase, APPARENT_GRAVITY, &at_origin);
    binder.vector(link.node, phase, APPARENT_GRAVITY, here)
}

/// Returns the wrench of gravity and inertia, from the second moments S of the node and the E of its
/// motion:
///
/// ```text
/// f = m (g - a) - E h        n_i = (h x (g - a))_i - sum_jk eps_ijk (E S)_kj
/// ```
fn inertial_wrench(inertia: &SpatialInertia, motion: &Motion, gravity: &Vector) -> Wrench {
    let SpatialInertia { mass, first_moment: h, second_moment } = inertia;
    let [sxx, sxy, sxz, syy, syz, szz] = second_moment;
    let [[_, xy, xz], [yx, _, yz], [zx, zy, _]] = &motion.gradient;
    // The result depends only on differences between the diagonal entries of E.
    let [x, y, z] = &motion.squares;
    let twist = [
        &(&(&(zx * sxy) - &(yx * sxz)) + &(&(zy * syy) - &(yz * szz))) + &(&(z - y) * syz),
        &(&(&(xz * szz) - &(zx * sxx)) + &(&(xy * syz) - &(zy * sxy))) + &(&(x - z) * sxz),
        &(&(&(yx * sxx) - &(xy * syy)) + &(&(yz * sxz) - &(xz * syz))) + &(&(y - x) * sxy),
    ];
    Wrench {
        force: sub(&scale(mass, gravity), &motion.relative_acceleration(h)),
        moment: sub(&cross(h, gravity), &twist),
    }
}

/// Returns, by node, the wrenches of forces at points, of force elements, of the air and of contacts. Ghosts carry none.
fn applied(
    binder: &mut Binder,
    kinematics: &Kinematics,
    elements: &Elements,
    contacts: &Contacts,
) -> Vec<Wrench> {
    let mechanism = binder.mechanism();
    let pressure = mechanism.air.as_ref().map(|air| {
        let density = binder.formula(&air.density, "air_density", None);
        let drag = binder.formula(&air.drag, "air_drag", None);
        let section = Section::mechanism(Phase::AirDrag);
        binder.bind(section, "air_pressure".into(), &density * &drag)
    });
    let forces: Vec<Vector> = mechanism
        .forces
        .iter()
        .map(|applied| {
            let name = format!("force_{}", applied.name);
            vector(binder, &applied.force, &name)
        })
        .collect();
    let topology = binder.topology();
    let mut wrenches = Vec::with_capacity(kinematics.links().len());
    for (link, node) in kinematics.links().iter().zip(&topology.nodes) {
        let mut sum = elements.wrenches[link.node.index()].clone();
        if node.ghost.is_none() {
            if let Some(pressure) = &pressure {
                let body = &mechanism.bodies[node.body.index()];
                let motion = kinematics.motion(link.node);
                sum = sum.plus(&drag(binder, link, body, motion, pressure));
            }
            for (applied, force) in mechanism.forces.iter().zip(&forces) {
                let point = &mechanism.points[applied.point.index()];
                if point.body == node.body {
                    let axes = &kinematics.placement(link.node).axes;
                    let here = axes.each_ref().map(|axis| dot(axis, force));
                    let name = format!("force_{}", applied.name);
                    let here = binder.vector(link.node, Phase::AppliedForce, &name, here);
                    let at = binder.geometry().point(mechanism, applied.point);
                    let arm = link.point(binder, "force_point", &at);
                    sum = sum.plus(&Wrench::at(&arm, here));
                }
            }
        }
        wrenches.push(sum.plus(contacts.on(link.node)));
    }
    wrenches
}

/// Returns the components of a vector of the model, which are formulas.
fn vector(binder: &mut Binder, components: &[Expression; 3], name: &str) -> Vector {
    let mut axes = AXES.into_iter();
    components.each_ref().map(|component| {
        let axis = axes.next().unwrap_or_default();
        binder.formula(component, &format!("{name} {axis}"), None)
    })
}

/// Returns the force of the air on the plates of a node: density drag |v| v / 2 per area, against the
/// speed v along the normal. `pressure` is the density times the drag coefficient, kg/m^3.
fn drag(binder: &mut Binder, link: &Link, body: &Body, motion: &Motion, pressure: &Expr) -> Wrench {
    let mut sum = Wrench::zero();
    let (node, phase) = (link.node, Phase::AirDrag);
    let normal = link.direction(binder, "normal", &fixed(&Vector3::z()));
    for (index, point) in body.surface.iter().enumerate() {
        let arm = link.point(binder, "surface", &fixed(&point.at));
        let speed = dot(&normal, &motion.velocity_at(&arm));
        let speed = binder.scalar(node, phase, &format!("normal_speed_{index}"), speed);
        let size = Expr::apply(Function::Abs, std::slice::from_ref(&speed));
        let size = binder.scalar(node, phase, &format!("normal_speed_size_{index}"), size);
        let half_area = binder.fact(node, HALF_AREA, 0.5 * point.area);
        let drag = -&(&(&half_area * pressure) * &(&size * &speed));
        let drag = binder.scalar(node, phase, &format!("drag_{index}"), drag);
        sum = sum.plus(&Wrench::at(&arm, scale(&drag, &normal)));
    }
    sum
}

/// Returns the torque tau of a joint, N m.
fn joint_torque(binder: &mut Binder, node: NodeId, hinge: &Hinge, spring: &Spring) -> Expr {
    let u = &hinge.speed;
    let joint = &binder.mechanism().joints[hinge.joint.index()];
    let (name, span) = (&joint.name, Some(joint.span));
    let torque = binder.formula(&joint.torque, &format!("torque_{name}"), span);
    let damping = binder.formula(&joint.damping, &format!("damping_{name}"), span);
    let Spring { stiffness, cubic, bend } = spring;
    let linear = &(&torque - &(stiffness * bend)) - &(&damping * u);
    let stiffened = &linear - &(cubic * &bend.power(3));
    let stiffened = &stiffened + &motor_torque(binder, node, hinge);
    match &joint.friction {
        None => stiffened,
        Some(friction) => {
            let torque = binder.formula(&friction.torque, &format!("friction_{name}"), span);
            let speed = binder.fact(node, FRICTION_RATE, 1.0 / friction.speed);
            let sense = Expr::apply(Function::Tanh, &[&speed * u]);
            let section = Section::body(node, Phase::JointTorque);
            let sense = binder.bind(section, format!("friction_sense_{name}"), sense);
            &stiffened - &(&torque * &sense)
        }
    }
}

/// Returns the spring of a joint.
fn spring(binder: &mut Binder, node: NodeId, hinge: &Hinge) -> Spring {
    let q = binder.coordinate(hinge.joint.index());
    let hinge = &binder.mechanism().joints[hinge.joint.index()];
    let (name, span) = (&hinge.name, Some(hinge.span));
    let stiffness = binder.formula(&hinge.stiffness, &format!("stiffness_{name}"), span);
    let cubic = binder.formula(&hinge.cubic_stiffness, &format!("cubic_stiffness_{name}"), span);
    let rest = binder.formula(&hinge.rest, &format!("rest_{name}"), span);
    let mut bend = &q - &rest;
    if !cubic.is_zero() {
        let section = Section::body(node, Phase::JointTorque);
        bend = binder.bind(section, format!("bend_{name}"), bend);
    }
    Spring { stiffness, cubic, bend }
}
