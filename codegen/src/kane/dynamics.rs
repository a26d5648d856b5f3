//! F_r + F_r* = 0: the mass matrix, the forcing, and the energies.
//!
//! A body's velocities depend on the speed u_r of an ancestor (or its own) joint r only through
//! the frame that hangs on r, so its partial velocities are those of that frame, carried over as
//! by a rigid body. Summed over the bodies beyond joint r, Kane's sums are therefore one wrench
//! (force f, moment n about the frame's origin) against one pair of partial velocities:
//!
//! ```text
//! F_r + F_r* = domega_r/du_r . n_r + dv_r/du_r . f_r + tau_r
//! ```
//!
//! Wrenches are gathered from the leaves to the root. The coefficients of du/dt are gathered the
//! same way from composite bodies (mass m, first moment h, inertia I about the origin): with the
//! partial accelerations of joint s, f = partial_omega x h + m partial_v,
//! n = I partial_omega + h x partial_v, carried to every ancestor r (Walker & Orin 1982; one entry
//! costs the same whatever lies beyond it, so the whole grows as N^2).

use std::array;

use super::derivation::Derivation;
use super::equations::Section;
use super::motion::Motion;
use super::vector::{Tensor, Vector, add, apply, cross, dot, scale, shift, sub, zero};
use crate::symbolic::{Expr, Function};
use crate::topology::NodeId;

/// What [`dynamics`] derives.
pub struct Dynamics {
    /// M, N x N row-major.
    pub mass: Vec<Expr>,
    /// f, N.
    pub forcing: Vec<Expr>,
    /// J.
    pub kinetic_energy: Expr,
    /// J.
    pub potential_energy: Expr,
    /// By node.
    pub partial: Vec<PartialVelocity>,
    /// By node: its share of its body.
    pub inertia: Vec<Inertia>,
}

/// Inertia of a body or a composite about its frame's origin, in its frame.
#[derive(Clone)]
pub struct Inertia {
    /// kg.
    mass: Expr,
    /// Mass times centre of mass, kg m.
    moment: Vector,
    /// About the origin, kg m^2.
    inertia: Tensor,
}

/// Force and moment about the frame's origin, in the frame.
#[derive(Clone)]
pub struct Wrench {
    pub force: Vector,
    pub moment: Vector,
}

/// A joint's spring: its torque is -k bend - k3 bend^3.
struct Spring {
    /// k, N m/rad.
    stiffness: Expr,
    /// k3, N m/rad^3.
    cubic: Expr,
    /// q - rest, rad.
    bend: Expr,
}

/// dv/du and domega/du of a node by the speed of its own joint.
pub struct PartialVelocity {
    pub omega: Vector,
    pub v: Vector,
}

/// Derives M, f and the energies of the tree.
pub fn dynamics(d: &mut Derivation) -> Dynamics {
    let nodes: Vec<NodeId> = (0..d.topology.nodes.len()).map(NodeId).collect();
    let partial: Vec<_> = nodes.iter().map(|&node| d.partial_velocity(node)).collect();
    let inertia: Vec<_> = nodes.iter().map(|&node| d.inertia(node)).collect();
    let mut wrenches = Vec::with_capacity(nodes.len());
    for &node in &nodes {
        let motion = d.motion(None, Some(node));
        wrenches.push(d.wrench(node, &inertia, &motion));
    }
    Dynamics {
        forcing: d.forcing(&partial, wrenches),
        mass: d.mass_matrix(&partial, inertia.clone()),
        kinetic_energy: d.kinetic_energy(&inertia),
        potential_energy: d.potential_energy(&inertia),
        partial,
        inertia,
    }
}

impl Derivation<'_> {
    /// The index of a node's joint.
    pub fn joint_of(&self, node: NodeId) -> usize {
        self.topology.nodes[node.index()].joint.index()
    }

    fn partial_velocity(&mut self, node: NodeId) -> PartialVelocity {
        let joint = self.topology.nodes[node.index()].joint;
        let motion = self.motion(None, Some(node));
        PartialVelocity {
            omega: motion.omega.map(|x| self.by_speed(&x, joint)),
            v: motion.v.map(|x| self.by_speed(&x, joint)),
        }
    }

    /// The node's share of its body.
    fn inertia(&mut self, node: NodeId) -> Inertia {
        let (share, body) = {
            let node = &self.topology.nodes[node.index()];
            (node.share, &self.mechanism().bodies[node.body.index()])
        };
        let properties = &body.mass_properties;
        let frame = self.frame(Some(node));
        let com = frame.coordinates(&properties.com, self.mechanism().size);
        let central = frame.tensor(&properties.inertia);
        // With a tunable mass everything below is per kilogram, and scales with the parameter.
        let unit = if body.mass_parameter.is_some() { 1.0 / properties.mass } else { 1.0 };
        let mass = properties.mass * share * unit;
        let com_vector = nalgebra::Vector3::from(com);
        let about_origin = central * (share * unit)
            + (nalgebra::Matrix3::identity() * com_vector.norm_squared()
                - com_vector * com_vector.transpose())
                * mass;
        let i = about_origin;
        let tensor = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)].map(|at| i[at]);
        let scale_by = match body.mass_parameter {
            Some(parameter) => self.parameters[parameter.index()].clone(),
            None => Expr::one(),
        };
        let mass_unit = self.constant(mass);
        let moment = self.constants(com.map(|x| x * mass));
        let tensor = self.constants(tensor);
        Inertia {
            mass: &scale_by * &mass_unit,
            moment: scale(&scale_by, &moment),
            inertia: scale(&scale_by, &tensor),
        }
    }

    /// Gravity in the node's frame, m/s^2.
    fn gravity(&mut self, node: Option<NodeId>) -> Vector {
        match node {
            None => {
                let gravity = self.mechanism().gravity.clone();
                array::from_fn(|i| self.scalar(&gravity[i], "gravity", None))
            }
            Some(id) => {
                let above = self.gravity(self.topology.nodes[id.index()].parent);
                let here = self.down(id, &above);
                self.bind_vector(id, "gravity", here)
            }
        }
    }

    /// Gravity, forces at points and inertia on one node in motion: the summands of F_r and F_r*
    /// without their partial velocities.
    pub fn wrench(&mut self, node: NodeId, inertia: &[Inertia], motion: &Motion) -> Wrench {
        let Inertia { mass, moment: h, inertia: i } = inertia[node.index()].clone();
        let gravity = self.gravity(Some(node));
        let free = self.bind_vector(node, "free_fall", sub(&gravity, &motion.a));
        let omega = &motion.omega;
        let swirl = add(&cross(&motion.alpha, &h), &cross(omega, &cross(omega, &h)));
        let spin = self.bind_vector(node, "spin", apply(&i, omega));
        let torque = add(&apply(&i, &motion.alpha), &cross(omega, &spin));
        let mut force = sub(&scale(&mass, &free), &swirl);
        let mut moment = sub(&cross(&h, &free), &torque);
        let mechanism = self.mechanism();
        let body = self.topology.nodes[node.index()].body;
        for applied in &mechanism.forces {
            let point = &mechanism.points[applied.point.index()];
            if point.body == body && self.topology.nodes[node.index()].ghost.is_none() {
                let name = format!("force_{}", applied.name);
                let components = applied.force.clone();
                let at_base = components.map(|component| self.scalar(&component, &name, None));
                let axes = self.placement(None, Some(node)).axes;
                let here = axes.map(|axis| dot(&axis, &at_base));
                let here = self.bind_vector(node, &name, here);
                let arm = self.arm(Some(node), &point.at);
                moment = add(&moment, &cross(&arm, &here));
                force = add(&force, &here);
            }
        }
        if self.topology.nodes[node.index()].ghost.is_none() {
            let drag = self.drag(node, motion);
            force = add(&force, &drag.force);
            moment = add(&moment, &drag.moment);
        }
        Wrench { force, moment }
    }

    /// What the air does to the plates of a node: density drag |v| v / 2 per area against the speed
    /// v along the normal.
    fn drag(&mut self, node: NodeId, motion: &Motion) -> Wrench {
        let mut sum = Wrench { force: zero(), moment: zero() };
        let mechanism = self.mechanism();
        let body = &mechanism.bodies[self.topology.nodes[node.index()].body.index()];
        let Some(air) = mechanism.air.as_ref().filter(|_| !body.surface.is_empty()) else {
            return sum;
        };
        let density = self.scalar(&air.density, "air_density", None);
        let drag = self.scalar(&air.drag, "air_drag", None);
        let pressure = self.bind(Section::Mechanism, "air_pressure".into(), &density * &drag);
        let normal = self.frame(Some(node)).direction(&nalgebra::Vector3::z());
        let normal = self.constants(normal);
        for (index, point) in body.surface.iter().enumerate() {
            let arm = self.arm(Some(node), &point.at);
            let speed = dot(&normal, &motion.velocity_at(&arm));
            let speed = self.bind_scalar(node, &format!("wind_{index}"), speed);
            let size = Expr::apply(Function::Abs, std::slice::from_ref(&speed));
            let size = self.bind_scalar(node, &format!("wind_size_{index}"), size);
            let half_area = self.constant(0.5 * point.area);
            let push = -&(&(&half_area * &pressure) * &(&size * &speed));
            let push = self.bind_scalar(node, &format!("drag_{index}"), push);
            let force = scale(&push, &normal);
            sum.moment = add(&sum.moment, &cross(&arm, &force));
            sum.force = add(&sum.force, &force);
        }
        sum
    }

    /// tau_r: the joint's own torque on the child about the hinge, along u_r, N m.
    pub fn joint_torque(&mut self, joint: usize) -> Expr {
        let hinge = &self.mechanism().joints[joint];
        let name = &hinge.name;
        let span = Some(hinge.span);
        let torque = self.scalar(&hinge.torque, &format!("torque_{name}"), span);
        let damping = self.scalar(&hinge.damping, &format!("damping_{name}"), span);
        let Spring { stiffness, cubic, bend } = self.spring(joint);
        let u = self.u[joint].clone();
        let linear = &(&torque - &(&stiffness * &bend)) - &(&damping * &u);
        let stiffened = &linear - &(&cubic * &bend.power(3));
        match &hinge.friction {
            None => stiffened,
            Some(friction) => {
                let torque = self.scalar(&friction.torque, &format!("friction_{name}"), span);
                let speed = self.constant(1.0 / friction.speed);
                let sense = Expr::apply(Function::Tanh, &[&speed * &u]);
                let sense = self.bind(Section::Mechanism, format!("sense_{name}"), sense);
                &stiffened - &(&torque * &sense)
            }
        }
    }

    fn spring(&mut self, joint: usize) -> Spring {
        let hinge = &self.mechanism().joints[joint];
        let (name, span) = (&hinge.name, Some(hinge.span));
        let stiffness = self.scalar(&hinge.stiffness, &format!("stiffness_{name}"), span);
        let cubic = self.scalar(&hinge.cubic_stiffness, &format!("cubic_stiffness_{name}"), span);
        let rest = self.scalar(&hinge.rest, &format!("rest_{name}"), span);
        let mut bend = &self.q[joint] - &rest;
        if !cubic.is_zero() {
            bend = self.bind(Section::Mechanism, format!("bend_{name}"), bend);
        }
        Spring { stiffness, cubic, bend }
    }

    /// f: everything in F_r + F_r* that is not a coefficient of du/dt.
    fn forcing(&mut self, partial: &[PartialVelocity], mut wrench: Vec<Wrench>) -> Vec<Expr> {
        let mut forcing = vec![Expr::zero(); wrench.len()];
        for id in (0..wrench.len()).rev().map(NodeId) {
            let Wrench { force, moment } = wrench[id.index()].clone();
            let force = self.bind_vector(id, "force", force);
            let moment = self.bind_vector(id, "moment", moment);
            let PartialVelocity { omega, v } = &partial[id.index()];
            let joint = self.joint_of(id);
            forcing[joint] = &(&dot(omega, &moment) + &dot(v, &force)) + &self.joint_torque(joint);
            if let Some(parent) = self.topology.nodes[id.index()].parent {
                let carried = self.carry_wrench(id, &Wrench { force, moment });
                let sum = &mut wrench[parent.index()];
                sum.force = add(&sum.force, &carried.force);
                sum.moment = add(&sum.moment, &carried.moment);
            }
        }
        forcing
    }

    /// The same wrench about the parent's origin, in the parent's frame.
    pub fn carry_wrench(&mut self, node: NodeId, wrench: &Wrench) -> Wrench {
        let force = self.up(node, &wrench.force);
        let force = self.bind_vector(node, "force_above", force);
        let moment = self.up(node, &wrench.moment);
        let r = self.offset(node);
        let moment = self.bind_vector(node, "moment_above", add(&moment, &cross(&r, &force)));
        Wrench { force, moment }
    }

    /// M: the coefficients of du/dt in -F_r*.
    fn mass_matrix(
        &mut self,
        partial: &[PartialVelocity],
        mut composite: Vec<Inertia>,
    ) -> Vec<Expr> {
        let n = composite.len();
        let mut matrix = vec![Expr::zero(); n * n];
        for id in (0..n).rev().map(NodeId) {
            let column = self.joint_of(id);
            let body = self.bind_inertia(id, composite[id.index()].clone());
            let PartialVelocity { omega, v } = &partial[id.index()];
            let mut wrench = Wrench {
                force: add(&cross(omega, &body.moment), &scale(&body.mass, v)),
                moment: add(&apply(&body.inertia, omega), &cross(&body.moment, v)),
            };
            let mut at = id;
            loop {
                let PartialVelocity { omega, v } = &partial[at.index()];
                let row = self.joint_of(at);
                let entry = &dot(omega, &wrench.moment) + &dot(v, &wrench.force);
                let names = [row, column].map(|j| self.mechanism().joints[j].name.clone());
                let name = format!("mass_{}_{}", names[0], names[1]);
                let entry = self.bind(Section::Node(id), name, entry);
                matrix[row * n + column] = entry.clone();
                matrix[column * n + row] = entry;
                let Some(parent) = self.topology.nodes[at.index()].parent else { break };
                wrench = self.carry_wrench(at, &wrench);
                at = parent;
            }
            if let Some(parent) = self.topology.nodes[id.index()].parent {
                let carried = self.carry_inertia(id, &body);
                let sum = &mut composite[parent.index()];
                sum.mass = &sum.mass + &carried.mass;
                sum.moment = add(&sum.moment, &carried.moment);
                sum.inertia = add(&sum.inertia, &carried.inertia);
            }
        }
        matrix
    }

    fn bind_inertia(&mut self, node: NodeId, body: Inertia) -> Inertia {
        let axes = ["xx", "xy", "xz", "yy", "yz", "zz"];
        let mut axes = axes.into_iter();
        Inertia {
            mass: self.bind_scalar(node, "mass", body.mass),
            moment: self.bind_vector(node, "first_moment", body.moment),
            inertia: body.inertia.map(|component| {
                let axis = axes.next().unwrap_or_default();
                self.bind_scalar(node, &format!("inertia_{axis}"), component)
            }),
        }
    }

    /// The same composite about the parent's origin, in the parent's frame.
    fn carry_inertia(&mut self, node: NodeId, body: &Inertia) -> Inertia {
        let r = self.offset(node);
        let moment = self.up(node, &body.moment);
        let moment = self.bind_vector(node, "first_moment_above", moment);
        let turned = self.turn_tensor(node, &body.inertia);
        let half = self.constant(0.5);
        let parallel = scale(&(&half * &body.mass), &shift(&r, &r));
        Inertia {
            mass: body.mass.clone(),
            inertia: add(&turned, &add(&shift(&r, &moment), &parallel)),
            moment: add(&moment, &scale(&body.mass, &r)),
        }
    }

    /// Changes a tensor's components from the node's frame to the parent's.
    fn turn_tensor(&mut self, node: NodeId, [xx, xy, xz, yy, yz, zz]: &Tensor) -> Tensor {
        let [s, c] = self.sin_cos[self.joint_of(node)].clone();
        let cc = self.bind_scalar(node, "cos_squared", &c * &c);
        let cs = self.bind_scalar(node, "sin_cos", &c * &s);
        let difference = self.bind_scalar(node, "difference", yy - zz);
        let bend =
            self.bind_scalar(node, "bend", &(&cc * &difference) - &(&(&cs * yz) + &(&cs * yz)));
        // About x: the y-z block turns by q.
        let about_x: Tensor = [
            xx.clone(),
            self.bind_scalar(node, "turned_xy", &(&c * xy) - &(&s * xz)),
            &(&s * xy) + &(&c * xz),
            self.bind_scalar(node, "turned_yy", zz + &bend),
            self.bind_scalar(
                node,
                "turned_yz",
                &(&(&cs * &difference) + &(&(&cc * yz) + &(&cc * yz))) - yz,
            ),
            yy - &bend,
        ];
        // About z: the x-y block turns by the constant angle of the hinge lines.
        let [cos, sin] = self.turn(node);
        let [cc, cs, ss] = self.constants([cos * cos, cos * sin, sin * sin]);
        let [cos, sin] = self.constants([cos, sin]);
        let [xx, xy, xz, yy, yz, zz] = about_x;
        let xz = self.bind_scalar(node, "turned_xz", xz);
        let twist = &(&cs * &xy) + &(&cs * &xy);
        let twist = self.bind_scalar(node, "twist", twist);
        [
            &(&(&cc * &xx) + &(&ss * &yy)) - &twist,
            &(&cs * &(&xx - &yy)) + &(&(&cc - &ss) * &xy),
            &(&cos * &xz) - &(&sin * &yz),
            &(&(&ss * &xx) + &(&cc * &yy)) + &twist,
            &(&sin * &xz) + &(&cos * &yz),
            zz,
        ]
    }

    /// Sum over nodes of m v.v / 2 + v.(omega x h) + omega.I omega / 2.
    fn kinetic_energy(&mut self, inertia: &[Inertia]) -> Expr {
        let half = self.constant(0.5);
        let mut total = Expr::zero();
        for (index, body) in inertia.iter().enumerate() {
            let node = NodeId(index);
            let Motion { omega, v, .. } = self.motion(None, Some(node));
            let linear = &(&half * &body.mass) * &dot(&v, &v);
            let mixed = dot(&v, &cross(&omega, &body.moment));
            let angular = &half * &dot(&omega, &apply(&body.inertia, &omega));
            let energy = &(&linear + &mixed) + &angular;
            total = &total + &self.bind_scalar(node, "kinetic", energy);
        }
        total
    }

    /// Sum over nodes of -m g . p and over joints of k bend^2 / 2 + k3 bend^4 / 4.
    fn potential_energy(&mut self, inertia: &[Inertia]) -> Expr {
        let half = self.constant(0.5);
        let gravity = self.gravity(None);
        let mut total = Expr::zero();
        for (index, body) in inertia.iter().enumerate() {
            let node = NodeId(index);
            let placement = self.placement(None, Some(node));
            let moment = add(&scale(&body.mass, &placement.origin), &placement.turn(&body.moment));
            let energy = -&dot(&gravity, &moment);
            total = &total + &self.bind_scalar(node, "potential", energy);
        }
        for joint in 0..self.mechanism().joints.len() {
            let Spring { stiffness, cubic, bend } = self.spring(joint);
            let name = format!("spring_{}", self.mechanism().joints[joint].name);
            let quarter = if cubic.is_zero() { Expr::zero() } else { self.constant(0.25) };
            let energy = &(&(&half * &stiffness) * &(&bend * &bend))
                + &(&(&quarter * &cubic) * &bend.power(4));
            total = &total + &self.bind(Section::Mechanism, name, energy);
        }
        total
    }
}
