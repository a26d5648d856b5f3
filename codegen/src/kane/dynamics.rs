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
//! same way from composite bodies (mass m, first moment h, second moments S about the origin,
//! I = tr(S) - S): with the partial accelerations of joint s, f = partial_omega x h + m partial_v,
//! n = I partial_omega + h x partial_v, carried to every ancestor r (Walker & Orin 1982; one entry
//! costs the same whatever lies beyond it, so the whole grows as N^2).

use super::derivation::Derivation;
use super::inertia::Inertia;
use super::motion::Motion;
use super::section::{Phase, Section};
use super::vector::{Vector, add, apply, cross, dot, scale, sub, twice_symmetric, zero};
use crate::symbolic::{Expr, Function};
use crate::topology::NodeId;

/// Mean number of hinges from the ground to a node beyond which a tree is deep.
const DEEP: usize = 8;

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
    pub shares: Vec<Inertia>,
    /// By node: the part of the inertia that moves a hinge.
    pub moving: Vec<Inertia>,
    /// By node: gravity, applied forces and inertia at du/dt = 0.
    pub wrenches: Vec<Wrench>,
}

/// Force and moment about the frame's origin, in the frame.
#[derive(Clone)]
pub struct Wrench {
    pub force: Vector,
    pub moment: Vector,
}

impl Wrench {
    /// No force, no moment.
    pub fn none() -> Self {
        Self { force: zero(), moment: zero() }
    }

    /// The sum of two about the same point.
    pub fn plus(&self, other: &Self) -> Self {
        Self { force: add(&self.force, &other.force), moment: add(&self.moment, &other.moment) }
    }
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
    let (shares, moving) = (d.shares(), d.moving_parts());
    let phases = [Phase::ApparentGravity, Phase::BiasForce];
    let wrenches = d.wrenches(phases, &moving, |d, id| d.motion(None, Some(id)));
    let partial: Vec<_> = nodes.iter().map(|&node| d.partial_velocity(node)).collect();
    Dynamics {
        forcing: d.forcing(&partial, wrenches.clone()),
        mass: d.mass_matrix(&partial, moving.clone()),
        kinetic_energy: d.kinetic_energy(&shares),
        potential_energy: d.potential_energy(&shares),
        partial,
        shares,
        moving,
        wrenches,
    }
}

/// Gravity and inertia, with the second moments S of the node and its motion's E:
///
/// ```text
/// f = m (g - a) - E h        n_i = (h x (g - a))_i - sum_jk eps_ijk (E S)_kj
/// ```
fn inertial_wrench(inertia: &Inertia, motion: &Motion, fall: &Vector) -> Wrench {
    let Inertia { mass, moment: h, second: [sxx, sxy, sxz, syy, syz, szz] } = inertia;
    let [[_, xy, xz], [yx, _, yz], [zx, zy, _]] = &motion.gradient;
    // Of the diagonal of E only differences count.
    let [x, y, z] = &motion.squares;
    let twist = [
        &(&(&(zx * sxy) - &(yx * sxz)) + &(&(zy * syy) - &(yz * szz))) + &(&(z - y) * syz),
        &(&(&(xz * szz) - &(zx * sxx)) + &(&(xy * syz) - &(zy * sxy))) + &(&(x - z) * sxz),
        &(&(&(yx * sxx) - &(xy * syy)) + &(&(yz * sxz) - &(xz * syz))) + &(&(y - x) * sxy),
    ];
    Wrench {
        force: sub(&scale(mass, fall), &motion.relative_acceleration(h)),
        moment: sub(&cross(h, fall), &twist),
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
            omega: motion.omega.map(|x| self.by_speed(Phase::PartialVelocity, &x, joint)),
            v: motion.v.map(|x| self.by_speed(Phase::PartialVelocity, &x, joint)),
        }
    }

    /// Per node, by its motion: gravity, forces at points, air and inertia, the summands of F_r and
    /// F_r* without their partial velocities. Node by node, so that little has to be remembered.
    pub fn wrenches(
        &mut self,
        [falling, phase]: [Phase; 2],
        inertia: &[Inertia],
        motion_of: impl Fn(&mut Self, NodeId) -> Motion,
    ) -> Vec<Wrench> {
        let gravity = self.gravity();
        let mut falls: Vec<Vector> = Vec::with_capacity(inertia.len());
        let mut wrenches = Vec::with_capacity(inertia.len());
        for (index, inertia) in inertia.iter().enumerate() {
            let id = NodeId(index);
            let motion = motion_of(self, id);
            let fall = match self.parent(id) {
                None => self.free_fall(id, falling, &gravity, &Motion::rest()),
                Some(parent) => {
                    let carrier = motion_of(self, parent);
                    self.free_fall(id, falling, &falls[parent.index()], &carrier)
                }
            };
            let wrench = inertial_wrench(inertia, &motion, &fall).plus(&self.applied(id, &motion));
            wrenches.push(self.bind_wrench(id, phase, "own", wrench));
            falls.push(fall);
        }
        wrenches
    }

    /// Forces at points and the air.
    fn applied(&mut self, node: NodeId, motion: &Motion) -> Wrench {
        if self.topology.nodes[node.index()].ghost.is_some() {
            return Wrench::none();
        }
        let mut sum = self.drag(node, motion);
        let mechanism = self.mechanism();
        let body = self.topology.nodes[node.index()].body;
        for applied in &mechanism.forces {
            let point = &mechanism.points[applied.point.index()];
            if point.body == body {
                let name = format!("force_{}", applied.name);
                let components = applied.force.clone();
                let at_base = components.map(|component| self.scalar(&component, &name, None));
                let axes = self.placement(None, Some(node)).axes;
                let here = axes.map(|axis| dot(&axis, &at_base));
                let here = self.bind_vector(node, Phase::AppliedForce, &name, here);
                let arm = self.arm(Some(node), &point.at);
                sum.moment = add(&sum.moment, &cross(&arm, &here));
                sum.force = add(&sum.force, &here);
            }
        }
        sum
    }

    /// What the air does to the plates of a node: density drag |v| v / 2 per area against the speed
    /// v along the normal.
    fn drag(&mut self, node: NodeId, motion: &Motion) -> Wrench {
        let mut sum = Wrench::none();
        let mechanism = self.mechanism();
        let body = &mechanism.bodies[self.topology.nodes[node.index()].body.index()];
        let Some(air) = mechanism.air.as_ref().filter(|_| !body.surface.is_empty()) else {
            return sum;
        };
        let density = self.scalar(&air.density, "air_density", None);
        let drag = self.scalar(&air.drag, "air_drag", None);
        let pressure =
            self.bind(Section::mechanism(Phase::AirDrag), "air_pressure".into(), &density * &drag);
        let normal = self.frame(Some(node)).direction(&nalgebra::Vector3::z());
        let normal = self.constants(normal);
        for (index, point) in body.surface.iter().enumerate() {
            let arm = self.arm(Some(node), &point.at);
            let speed = dot(&normal, &motion.velocity_at(&arm));
            let speed = self.bind_scalar(node, Phase::AirDrag, &format!("wind_{index}"), speed);
            let size = Expr::apply(Function::Abs, std::slice::from_ref(&speed));
            let size = self.bind_scalar(node, Phase::AirDrag, &format!("wind_size_{index}"), size);
            let half_area = self.constant(0.5 * point.area);
            let push = -&(&(&half_area * &pressure) * &(&size * &speed));
            let push = self.bind_scalar(node, Phase::AirDrag, &format!("drag_{index}"), push);
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
                let sense = self.bind(
                    Section::mechanism(Phase::JointTorque),
                    format!("sense_{name}"),
                    sense,
                );
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
            bend = self.bind(Section::mechanism(Phase::JointTorque), format!("bend_{name}"), bend);
        }
        Spring { stiffness, cubic, bend }
    }

    /// f: everything in F_r + F_r* that is not a coefficient of du/dt.
    fn forcing(&mut self, partial: &[PartialVelocity], mut wrench: Vec<Wrench>) -> Vec<Expr> {
        let mut forcing = vec![Expr::zero(); wrench.len()];
        for id in (0..wrench.len()).rev().map(NodeId) {
            let Wrench { force, moment } = wrench[id.index()].clone();
            let force = self.bind_vector(id, Phase::GeneralizedForce, "force", force);
            let moment = self.bind_vector(id, Phase::GeneralizedForce, "moment", moment);
            let PartialVelocity { omega, v } = &partial[id.index()];
            let joint = self.joint_of(id);
            forcing[joint] = &(&dot(omega, &moment) + &dot(v, &force)) + &self.joint_torque(joint);
            if let Some(parent) = self.topology.nodes[id.index()].parent {
                let carried =
                    self.carry_wrench(id, Phase::GeneralizedForce, &Wrench { force, moment });
                wrench[parent.index()] = wrench[parent.index()].plus(&carried);
            }
        }
        forcing
    }

    /// The same wrench about the parent's origin, in the parent's frame.
    pub fn carry_wrench(&mut self, node: NodeId, phase: Phase, wrench: &Wrench) -> Wrench {
        let force = self.up(node, phase, &wrench.force);
        let force = self.bind_vector(node, phase, "force_above", force);
        let moment = self.up(node, phase, &wrench.moment);
        let r = self.offset(node);
        let moment =
            self.bind_vector(node, phase, "moment_above", add(&moment, &cross(&r, &force)));
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
        // A wrench carried from node to node meets each hinge where it lies; carried to the ground it
        // meets all of them with a third of the operations, at the cost of the way there.
        let deep = self.topology.depths().iter().sum::<usize>() > DEEP * n;
        for id in (0..n).rev().map(NodeId) {
            let column = self.joint_of(id);
            let body = self.bind_inertia(id, composite[id.index()].clone());
            let PartialVelocity { omega, v } = &partial[id.index()];
            let mut wrench = Wrench {
                force: add(&cross(omega, &body.moment), &scale(&body.mass, v)),
                moment: add(&apply(&body.tensor(), omega), &cross(&body.moment, v)),
            };
            let at_ground = deep.then(|| self.wrench_at_ground(id, &wrench));
            let mut at = id;
            loop {
                let row = self.joint_of(at);
                let entry = match at_ground.as_ref().filter(|_| at != id) {
                    Some(wrench) => {
                        let [axis, arm] = self.hinge_at_ground(at);
                        &dot(&axis, &wrench.moment) + &dot(&arm, &wrench.force)
                    }
                    None => {
                        let PartialVelocity { omega, v } = &partial[at.index()];
                        &dot(omega, &wrench.moment) + &dot(v, &wrench.force)
                    }
                };
                let names = [row, column].map(|j| self.mechanism().joints[j].name.clone());
                let name = format!("mass_{}_{}", names[0], names[1]);
                let entry = self.bind(Section::body(id, Phase::MassMatrix), name, entry);
                matrix[row * n + column] = entry.clone();
                matrix[column * n + row] = entry;
                let Some(parent) = self.topology.nodes[at.index()].parent else { break };
                if !deep {
                    wrench = self.carry_wrench(at, Phase::MassMatrix, &wrench);
                }
                at = parent;
            }
            if let Some(parent) = self.topology.nodes[id.index()].parent {
                let carried = self.carry_inertia(id, &body);
                let sum = &mut composite[parent.index()];
                sum.mass = &sum.mass + &carried.mass;
                sum.moment = add(&sum.moment, &carried.moment);
                sum.second = add(&sum.second, &carried.second);
            }
        }
        matrix
    }

    /// A wrench on a node about the ground's origin, in the base frame.
    fn wrench_at_ground(&mut self, id: NodeId, wrench: &Wrench) -> Wrench {
        let placement = self.placement(None, Some(id));
        let force = self.bind_vector(
            id,
            Phase::MassMatrix,
            "force_at_ground",
            placement.turn(&wrench.force),
        );
        let moment = add(&placement.turn(&wrench.moment), &cross(&placement.origin, &force));
        Wrench {
            moment: self.bind_vector(id, Phase::MassMatrix, "moment_at_ground", moment),
            force,
        }
    }

    /// A hinge's partial angular velocity and the partial velocity at the ground's origin, base
    /// frame.
    fn hinge_at_ground(&mut self, id: NodeId) -> [Vector; 2] {
        let placement = self.placement(None, Some(id));
        let [axis, ..] = placement.axes;
        let arm = cross(&placement.origin, &axis);
        let arm = self.bind_vector(id, Phase::MassMatrix, "hinge_arm", arm);
        [axis, arm]
    }

    fn bind_inertia(&mut self, node: NodeId, body: Inertia) -> Inertia {
        Inertia {
            mass: self.bind_scalar(node, Phase::CompositeInertia, "mass", body.mass),
            moment: self.bind_vector(node, Phase::CompositeInertia, "first_moment", body.moment),
            second: self.bind_tensor(node, Phase::CompositeInertia, "second_moment", body.second),
        }
    }

    /// The same composite about the parent's origin, in the parent's frame.
    fn carry_inertia(&mut self, node: NodeId, body: &Inertia) -> Inertia {
        let r = self.offset(node);
        let moment = self.up(node, Phase::CompositeInertia, &body.moment);
        let moment = self.bind_vector(node, Phase::CompositeInertia, "first_moment_above", moment);
        let turned = self.turn_tensor(node, Phase::CompositeInertia, &body.second);
        // int (x + r)(x + r)^T dm.
        let half = self.constant(0.5);
        let middle = add(&moment, &scale(&(&half * &body.mass), &r));
        Inertia {
            mass: body.mass.clone(),
            moment: add(&moment, &scale(&body.mass, &r)),
            second: add(&turned, &twice_symmetric(&r, &middle)),
        }
    }

    /// Sum over nodes of m v.v / 2 + v.(omega x h) + omega.I omega / 2.
    fn kinetic_energy(&mut self, shares: &[Inertia]) -> Expr {
        let half = self.constant(0.5);
        let mut total = Expr::zero();
        for (index, body) in shares.iter().enumerate() {
            let node = NodeId(index);
            let Motion { omega, v, .. } = self.motion(None, Some(node));
            let linear = &(&half * &body.mass) * &dot(&v, &v);
            let mixed = dot(&v, &cross(&omega, &body.moment));
            let angular = &half * &dot(&omega, &apply(&body.tensor(), &omega));
            let energy = &(&linear + &mixed) + &angular;
            total = &total + &self.bind_scalar(node, Phase::KineticEnergy, "kinetic", energy);
        }
        total
    }

    /// Sum over nodes of -m g . p and over joints of k bend^2 / 2 + k3 bend^4 / 4.
    fn potential_energy(&mut self, shares: &[Inertia]) -> Expr {
        let half = self.constant(0.5);
        let gravity = self.gravity();
        let mut total = Expr::zero();
        for (index, body) in shares.iter().enumerate() {
            let node = NodeId(index);
            let placement = self.placement(None, Some(node));
            let moment = add(&scale(&body.mass, &placement.origin), &placement.turn(&body.moment));
            let energy = -&dot(&gravity, &moment);
            total = &total + &self.bind_scalar(node, Phase::PotentialEnergy, "potential", energy);
        }
        for joint in 0..self.mechanism().joints.len() {
            let Spring { stiffness, cubic, bend } = self.spring(joint);
            let name = format!("spring_{}", self.mechanism().joints[joint].name);
            let quarter = if cubic.is_zero() { Expr::zero() } else { self.constant(0.25) };
            let energy = &(&(&half * &stiffness) * &(&bend * &bend))
                + &(&(&quarter * &cubic) * &bend.power(4));
            total = &total + &self.bind(Section::mechanism(Phase::PotentialEnergy), name, energy);
        }
        total
    }
}
