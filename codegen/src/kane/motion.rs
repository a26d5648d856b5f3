//! Kinematics along the tree: velocities, accelerations at du/dt = 0, placements.
//!
//! Components are in the node's own frame. With r the constant offset of the node's origin in its
//! parent's frame, x the hinge direction and `down` the change of frame from parent to node:
//!
//! ```text
//! omega = down(omega_P) + u x             v = down(v_P + omega_P x r)
//! alpha = down(alpha_P) + omega x (u x)   a = down(a_P + E_P r)
//! E r   = alpha x r + omega x (omega x r)
//! ```
//!
//! (Kane & Levinson, Dynamics, sections 2.4-2.8; alpha and a are the terms without du/dt.)

use super::derivation::Derivation;
use super::frame::Frame;
use super::section::Phase;
use super::vector::{Vector, add, cross, dot, sub, zero};
use crate::source::BodyId;
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// Motion of a node's frame relative to an ancestor, in the node's own components.
#[derive(Clone, Debug)]
pub struct Motion {
    /// Angular velocity, rad/s.
    pub omega: Vector,
    /// Velocity of the origin, m/s.
    pub v: Vector,
    /// Angular acceleration at du/dt = 0, rad/s^2.
    pub alpha: Vector,
    /// Acceleration of the origin at du/dt = 0, m/s^2.
    pub a: Vector,
    /// E, rows: how the acceleration grows with the distance from the origin, 1/s^2.
    pub gradient: [Vector; 3],
    /// Squares of omega's components, rad^2/s^2.
    pub squares: Vector,
}

impl Motion {
    /// Of the ancestor relative to itself.
    pub fn rest() -> Self {
        let gradient = std::array::from_fn(|_| zero());
        Self { omega: zero(), v: zero(), alpha: zero(), a: zero(), gradient, squares: zero() }
    }

    /// Velocity of the point at `arm` in the node's frame.
    pub fn velocity_at(&self, arm: &Vector) -> Vector {
        add(&self.v, &cross(&self.omega, arm))
    }

    /// Acceleration at du/dt = 0 of the point at `arm` in the node's frame.
    pub fn acceleration_at(&self, arm: &Vector) -> Vector {
        add(&self.a, &self.relative_acceleration(arm))
    }

    /// E r.
    pub fn relative_acceleration(&self, r: &Vector) -> Vector {
        [0, 1, 2].map(|row| dot(&self.gradient[row], r))
    }
}

/// Where a node's frame is relative to an ancestor's, in the ancestor's components.
#[derive(Clone, Debug)]
pub struct Placement {
    /// The x, y and z axes.
    pub axes: [Vector; 3],
    /// The origin, m.
    pub origin: Vector,
}

impl Placement {
    /// Components in the ancestor's frame of a vector given in the node's.
    pub fn turn(&self, v: &Vector) -> Vector {
        std::array::from_fn(|i| {
            let along = |k: usize| &self.axes[k][i] * &v[k];
            &(&along(0) + &along(1)) + &along(2)
        })
    }

    /// Position in the ancestor's frame of a point given in the node's.
    pub fn place(&self, point: &Vector) -> Vector {
        add(&self.origin, &self.turn(point))
    }
}

impl Derivation<'_> {
    /// The node's parent.
    pub fn parent(&self, node: NodeId) -> Option<NodeId> {
        self.topology.nodes[node.index()].parent
    }

    /// The flat frame of a node; the base frame for the ground.
    pub fn frame(&self, node: Option<NodeId>) -> Frame {
        node.map_or_else(Frame::base, |node| self.frames[node.index()].clone())
    }

    /// Cosine and sine of the constant turn from the parent's x axis to the node's.
    pub fn turn(&self, node: NodeId) -> [f64; 2] {
        let parent = self.frame(self.parent(node));
        let [cos, sin, _] = parent.direction(&self.frames[node.index()].axes.column(0).into());
        [cos, sin]
    }

    /// Offset of the node's origin from its parent's, parent's components, m.
    pub fn offset(&mut self, node: NodeId) -> Vector {
        let size = self.mechanism().size;
        let parent = self.frame(self.parent(node));
        self.constants(parent.coordinates(&self.frames[node.index()].origin, size))
    }

    /// Coordinates in the node's frame (`None`: base) of a point drawn at `flat`.
    pub fn arm(&mut self, node: Option<NodeId>, flat: &nalgebra::Vector3<f64>) -> Vector {
        let coordinates = self.frame(node).coordinates(flat, self.mechanism().size);
        self.constants(coordinates)
    }

    fn sin_cos_of(&self, node: NodeId) -> [Expr; 2] {
        self.sin_cos[self.topology.nodes[node.index()].joint.index()].clone()
    }

    /// Changes components from the parent's frame to the node's.
    pub fn down(&mut self, node: NodeId, phase: Phase, [x, y, z]: &Vector) -> Vector {
        let [cos, sin] = self.turn(node);
        let [cos, sin] = self.constants([cos, sin]);
        let [s, c] = self.sin_cos_of(node);
        let across = self.bind_scalar(node, phase, "across", &(&cos * y) - &(&sin * x));
        [&(&cos * x) + &(&sin * y), &(&c * &across) + &(&s * z), &(&c * z) - &(&s * &across)]
    }

    /// Changes components from the node's frame to the parent's.
    pub fn up(&mut self, node: NodeId, phase: Phase, [x, y, z]: &Vector) -> Vector {
        let [cos, sin] = self.turn(node);
        let [cos, sin] = self.constants([cos, sin]);
        let [s, c] = self.sin_cos_of(node);
        let across = self.bind_scalar(node, phase, "across", &(&c * y) - &(&s * z));
        [&(&cos * x) - &(&sin * &across), &(&sin * x) + &(&cos * &across), &(&s * y) + &(&c * z)]
    }

    /// Motion of `node` relative to `ancestor` (`None`: the ground).
    pub fn motion(&mut self, ancestor: Option<NodeId>, node: Option<NodeId>) -> Motion {
        let Some(id) = node.filter(|_| node != ancestor) else { return Motion::rest() };
        if let Some(known) = self.motions.get(&(ancestor, id)) {
            return known.clone();
        }
        let parent = self.motion(ancestor, self.parent(id));
        let r = self.offset(id);
        let u = self.u[self.topology.nodes[id.index()].joint.index()].clone();
        let carried = self.down(id, Phase::AngularVelocity, &parent.omega);
        let [x, y, z] = self.bind_vector(id, Phase::AngularVelocity, "carried", carried);
        let bend = [Expr::zero(), &z * &u, -&(&y * &u)];
        let omega = self.bind_vector(id, Phase::AngularVelocity, "omega", [&x + &u, y, z]);
        let v = self.down(id, Phase::Velocity, &parent.velocity_at(&r));
        let v = self.bind_vector(id, Phase::Velocity, "v", v);
        let alpha = self.down(id, Phase::AngularVelocityProduct, &parent.alpha);
        let alpha =
            self.bind_vector(id, Phase::AngularVelocityProduct, "alpha", add(&alpha, &bend));
        let a = self.down(id, Phase::VelocityProduct, &parent.acceleration_at(&r));
        let a = self.bind_vector(id, Phase::VelocityProduct, "a", a);
        let (gradient, squares) =
            self.gradient(id, Phase::AccelerationGradient, "gradient", &omega, &alpha);
        let motion = Motion { omega, v, alpha, a, gradient, squares };
        self.motions.insert((ancestor, id), motion.clone());
        motion
    }

    /// E = [alpha]x + omega omega^T - omega^2 1, and the squares in it.
    pub fn gradient(
        &mut self,
        node: NodeId,
        phase: Phase,
        name: &str,
        [x, y, z]: &Vector,
        alpha: &Vector,
    ) -> ([Vector; 3], Vector) {
        let mut product = |name: &str, a: &Expr, b: &Expr| {
            self.bind_scalar(node, Phase::AccelerationGradient, &format!("omega_{name}"), a * b)
        };
        let (xx, yy, zz) = (product("xx", x, x), product("yy", y, y), product("zz", z, z));
        let (xy, xz, yz) = (product("xy", x, y), product("xz", x, z), product("yz", y, z));
        let [ax, ay, az] = alpha;
        let rows = [
            [-&(&yy + &zz), &xy - az, &xz + ay],
            [&xy + az, -&(&xx + &zz), &yz - ax],
            [&xz - ay, &yz + ax, -&(&xx + &yy)],
        ];
        let mut axes = ["x", "y", "z"].into_iter();
        let gradient = rows.map(|row| {
            let axis = axes.next().unwrap_or_default();
            self.bind_vector(node, phase, &format!("{name}_{axis}"), row)
        });
        (gradient, [xx, yy, zz])
    }

    /// g - a at a node's origin, its own components, m/s^2, by what that is for its parent (the
    /// base) and the parent's motion relative to the ground.
    pub fn free_fall(
        &mut self,
        id: NodeId,
        phase: Phase,
        above: &Vector,
        motion: &Motion,
    ) -> Vector {
        let r = self.offset(id);
        let above = sub(above, &motion.relative_acceleration(&r));
        let above = self.bind_vector(id, phase, "fall_above", above);
        let here = self.down(id, phase, &above);
        self.bind_vector(id, phase, "free_fall", here)
    }

    /// Gravity in the base frame, m/s^2.
    pub fn gravity(&mut self) -> Vector {
        let gravity = self.mechanism().gravity.clone();
        std::array::from_fn(|i| self.scalar(&gravity[i], "gravity", None))
    }

    /// Placement of `node` relative to `ancestor` (`None`: the ground).
    pub fn placement(&mut self, ancestor: Option<NodeId>, node: Option<NodeId>) -> Placement {
        let Some(id) = node.filter(|_| node != ancestor) else {
            let axes =
                std::array::from_fn(|i| std::array::from_fn(|j| Expr::integer(i64::from(i == j))));
            return Placement { axes, origin: zero() };
        };
        if let Some(known) = self.placements.get(&(ancestor, id)) {
            return known.clone();
        }
        let parent = self.placement(ancestor, self.parent(id));
        let offset = self.offset(id);
        let [cos, sin] = self.turn(id);
        let turned = [[cos, sin, 0.0], [-sin, cos, 0.0]].map(|v| parent.turn(&self.constants(v)));
        let [x, across] = turned;
        let across = self.bind_vector(id, Phase::Placement, "across", across);
        let [s, c] = self.sin_cos_of(id);
        let z = &parent.axes[2];
        let y: Vector = std::array::from_fn(|i| &(&c * &across[i]) + &(&s * &z[i]));
        let z: Vector = std::array::from_fn(|i| &(&c * &z[i]) - &(&s * &across[i]));
        let axes = [("axis_x", x), ("axis_y", y), ("axis_z", z)]
            .map(|(name, axis)| self.bind_vector(id, Phase::Placement, name, axis));
        let origin = self.bind_vector(id, Phase::Placement, "origin", parent.place(&offset));
        let placement = Placement { axes, origin };
        self.placements.insert((ancestor, id), placement.clone());
        placement
    }

    /// The original node of a body; `None` for the ground.
    pub fn original(&self, body: BodyId) -> Option<NodeId> {
        let is_original = |n: &crate::topology::Node| n.body == body && n.ghost.is_none();
        self.topology.nodes.iter().position(is_original).map(NodeId)
    }

    /// Per body: R row-major, then p, so that the point drawn at x lies at R x + p.
    pub fn poses(&mut self) -> Vec<Expr> {
        let mut poses = Vec::new();
        for body in 0..self.mechanism().bodies.len() {
            let node = self.original(BodyId(body));
            let placement = self.placement(None, node);
            let frame = self.frame(node);
            let columns: [Vector; 3] = std::array::from_fn(|k| {
                let flat = frame.axes.row(k).transpose();
                placement.turn(&self.constants(flat.into()))
            });
            let drawn_at_zero = self.arm(node, &nalgebra::Vector3::zeros());
            let p = placement.place(&drawn_at_zero);
            for row in 0..3 {
                poses.extend(columns.iter().map(|column| column[row].clone()));
            }
            poses.extend(p);
        }
        poses
    }

    /// Positions of the output points in the base frame, m.
    pub fn points(&mut self) -> Vec<Expr> {
        let mechanism = self.mechanism();
        let mut positions = Vec::new();
        for point in &mechanism.points {
            let node = self.original(point.body);
            let arm = self.arm(node, &point.at);
            positions.extend(self.placement(None, node).place(&arm));
        }
        positions
    }
}
