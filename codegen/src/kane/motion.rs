//! Velocities along the tree, and accelerations at du/dt = 0 or at given du/dt.
//!
//! Components are in the node's own frame. With r the constant offset of the node's origin in its
//! parent's frame, e_x the hinge axis and R the rotation to the parent's frame:
//!
//! ```text
//! w     = R^T w_parent + u e_x              v = R^T (v_parent + w_parent x r)
//! alpha = R^T alpha_parent + w x u e_x      a = R^T (a_parent + E_parent r)
//! E r   = alpha x r + w x (w x r)
//! ```
//!
//! (Kane & Levinson, Dynamics, sections 2.4-2.8; alpha and a are the velocity-product accelerations,
//! which are the terms without du/dt. At given du/dt, du/dt e_x is added to alpha.)

use super::binder::Binder;
use super::free::Free;
use super::link::{Freedom, Hinge, Link};
use super::vector::{Vector, add, cross, dot, sub, zero};
use crate::program::Phase;
use crate::symbolic::Expr;

/// Motion of a node's frame relative to an ancestor, in the node's own components.
#[derive(Clone)]
pub struct Motion {
    /// w: angular velocity, rad/s.
    pub omega: Vector,
    /// v: velocity of the origin, m/s.
    pub velocity: Vector,
    /// alpha: angular acceleration at du/dt = 0 or at given du/dt, rad/s^2.
    pub alpha: Vector,
    /// a: acceleration of the origin, at the same du/dt as `alpha`, m/s^2.
    pub acceleration: Vector,
    /// E, by rows: the gradient of the acceleration with respect to the position, 1/s^2.
    pub gradient: [Vector; 3],
    /// Squares of the components of w, rad^2/s^2.
    pub squares: Vector,
}

/// Phases and names of the intermediates of an acceleration: its angular part, its linear part and its
/// gradient.
struct AccelerationNames {
    phases: [Phase; 3],
    names: [&'static str; 3],
}

const VELOCITY_PRODUCT: AccelerationNames = AccelerationNames {
    phases: [Phase::AngularVelocityProduct, Phase::VelocityProduct, Phase::AccelerationGradient],
    names: ["velocity_product_alpha", "velocity_product", "gradient"],
};

const GIVEN: AccelerationNames = AccelerationNames {
    phases: [Phase::GivenAcceleration; 3],
    names: ["alpha", "acceleration", "acceleration_gradient"],
};

impl Motion {
    /// Returns the motion of the ancestor relative to itself.
    pub fn rest() -> Self {
        let gradient = std::array::from_fn(|_| zero());
        Self {
            omega: zero(),
            velocity: zero(),
            alpha: zero(),
            acceleration: zero(),
            gradient,
            squares: zero(),
        }
    }

    /// Derives the motion of a node at du/dt = 0 from the motion of its parent.
    pub fn new(binder: &mut Binder, link: &Link, parent: &Self) -> Self {
        let (node, u) = match &link.freedom {
            Freedom::Hinge(hinge) => (link.node, &hinge.speed),
            Freedom::Free(free) => return Self::of_free(binder, link, free),
        };
        let omega = link.down(binder, Phase::AngularVelocity, "parent_omega", &parent.omega);
        let [x, y, z] = binder.vector(node, Phase::AngularVelocity, "parent_omega", omega);
        let turning = [Expr::zero(), &z * u, -&(&y * u)];
        let omega = binder.vector(node, Phase::AngularVelocity, "omega", [&x + u, y, z]);
        let velocity = parent.velocity_at(&link.offset);
        let velocity = link.down(binder, Phase::Velocity, "velocity", &velocity);
        let velocity = binder.vector(node, Phase::Velocity, "velocity", velocity);
        let moving = Self { omega, velocity, ..Self::rest() };
        moving.accelerated(binder, link, parent, &turning, &VELOCITY_PRODUCT)
    }

    /// Derives the motion of a free body at du/dt = 0.
    fn of_free(binder: &mut Binder, link: &Link, free: &Free) -> Self {
        let omega = free.omega.clone();
        let velocity = free.velocity_of_origin(&free.velocity, &omega);
        let velocity = binder.vector(link.node, Phase::Velocity, "velocity", velocity);
        let moving = Self { omega, velocity, ..Self::rest() };
        moving.accelerated_freely(binder, link, free, zero(), &zero(), &VELOCITY_PRODUCT)
    }

    /// Derives the same motion of a node from the motion of its parent at given du/dt. `rates` are the given
    /// du/dt of all speeds.
    pub fn at_given(
        &self,
        binder: &mut Binder,
        link: &Link,
        parent: &Self,
        rates: &[Expr],
    ) -> Self {
        match &link.freedom {
            Freedom::Hinge(Hinge { joint, speed, .. }) => {
                let [_, y, z] = &self.omega;
                let turning = [rates[joint.index()].clone(), z * speed, -&(y * speed)];
                self.accelerated(binder, link, parent, &turning, &GIVEN)
            }
            Freedom::Free(free) => {
                let rate = |k: usize| rates[free.first + k].clone();
                let alpha = [rate(3), rate(4), rate(5)];
                let linear = free.down(&[rate(0), rate(1), rate(2)]);
                self.accelerated_freely(binder, link, free, alpha, &linear, &GIVEN)
            }
        }
    }

    /// Derives the accelerations of a free body from those of its rotation and, in its frame, of its centre of
    /// mass.
    fn accelerated_freely(
        &self,
        binder: &mut Binder,
        link: &Link,
        free: &Free,
        alpha: Vector,
        of_centre: &Vector,
        AccelerationNames { phases, names }: &AccelerationNames,
    ) -> Self {
        let (gradient, squares) = gradient(binder, link, &self.omega, &alpha);
        let gradient = binder.matrix(link.node, phases[2], names[2], gradient);
        let (omega, velocity) = (self.omega.clone(), self.velocity.clone());
        let mut moving = Self { omega, velocity, alpha, gradient, squares, ..Self::rest() };
        let acceleration = sub(of_centre, &moving.relative_acceleration(&free.centre));
        moving.acceleration = binder.vector(link.node, phases[1], names[1], acceleration);
        moving
    }

    /// Derives the accelerations from those of the parent. `turning` is the angular acceleration across
    /// the hinge.
    fn accelerated(
        &self,
        binder: &mut Binder,
        link: &Link,
        parent: &Self,
        turning: &Vector,
        AccelerationNames { phases, names }: &AccelerationNames,
    ) -> Self {
        let node = link.node;
        let alpha = link.down(binder, phases[0], names[0], &parent.alpha);
        let alpha = binder.vector(node, phases[0], names[0], add(&alpha, turning));
        let acceleration = parent.acceleration_at(&link.offset);
        let acceleration = link.down(binder, phases[1], names[1], &acceleration);
        let acceleration = binder.vector(node, phases[1], names[1], acceleration);
        let (gradient, squares) = gradient(binder, link, &self.omega, &alpha);
        let gradient = binder.matrix(node, phases[2], names[2], gradient);
        let (omega, velocity) = (self.omega.clone(), self.velocity.clone());
        Self { omega, velocity, alpha, acceleration, gradient, squares }
    }

    /// Returns the velocity of the point at `arm` in the node's frame.
    pub fn velocity_at(&self, arm: &Vector) -> Vector {
        add(&self.velocity, &cross(&self.omega, arm))
    }

    /// Returns the acceleration of the point at `arm` in the node's frame.
    pub fn acceleration_at(&self, arm: &Vector) -> Vector {
        add(&self.acceleration, &self.relative_acceleration(arm))
    }

    /// Returns E r.
    pub fn relative_acceleration(&self, r: &Vector) -> Vector {
        [0, 1, 2].map(|row| dot(&self.gradient[row], r))
    }
}

/// Derives E = [alpha]x + w w^T - (w . w) 1, and returns it with the squares in it.
fn gradient(
    binder: &mut Binder,
    link: &Link,
    [x, y, z]: &Vector,
    alpha: &Vector,
) -> ([Vector; 3], Vector) {
    let products = [x * x, y * y, z * z, x * y, x * z, y * z];
    let axes = ["xx", "yy", "zz", "xy", "xz", "yz"];
    let phase = Phase::AccelerationGradient;
    let [xx, yy, zz, xy, xz, yz] = binder.components(link.node, phase, "omega", axes, products);
    let [ax, ay, az] = alpha;
    let rows = [
        [-&(&yy + &zz), &xy - az, &xz + ay],
        [&xy + az, -&(&xx + &zz), &yz - ax],
        [&xz - ay, &yz + ax, -&(&xx + &yy)],
    ];
    (rows, [xx, yy, zz])
}
