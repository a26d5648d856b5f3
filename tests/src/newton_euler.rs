//! Newton's and Euler's equations in maximal coordinates: six accelerations per moving body, five
//! equations per hinge. No tree, no cut, no generalised speeds: loops are hinges like any other.
//!
//! ```text
//! minimise  1/2 (a - a0)^T W (a - a0)   subject to   A a = b        (Gauss's principle)
//! a0 = W^-1 (applied forces)            W = diag(m 1, I_com)        per body
//! a = a0 + W^-1/2 (A W^-1/2)^+ (b - A a0)
//! ```
//!
//! Udwadia & Kalaba, A new perspective on constrained motion, Proc. R. Soc. Lond. A 439 (1992).

use crate::compare::{keep_largest, largest};
use lamc::laminate::Mechanism;
use nalgebra::{DMatrix, DVector, Matrix3, Rotation3, Unit, Vector3};

use crate::expression::Values;

/// Singular values of the scaled hinge equations below this fraction of the largest are zero: well
/// above rounding, and below anything but a configuration next to a singular one.
const RANK_TOLERANCE: f64 = 1e-9;

/// A body in motion, base frame.
#[derive(Clone, Copy, Debug)]
pub struct Motion {
    /// The point drawn at x lies at R x + p.
    pub rotation: Matrix3<f64>,
    /// p, m.
    pub position: Vector3<f64>,
    /// Angular velocity, rad/s.
    pub omega: Vector3<f64>,
    /// Velocity of the centre of mass, m/s.
    pub velocity: Vector3<f64>,
}

/// Results of the equations at one state.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Joint accelerations, rad/s^2.
    pub acceleration: Vec<f64>,
    /// J.
    pub kinetic_energy: f64,
    /// Gravity of the moving bodies and springs, J.
    pub potential_energy: f64,
    /// How badly the joint angles disagree about where a body is: m, or as a sine.
    pub open_by: f64,
    /// How badly the joint speeds disagree about how a body moves: m/s, or rad/s.
    pub speed_mismatch: f64,
}

/// Solves for the joint accelerations at a closed state.
pub fn solve(mechanism: &Mechanism, values: &Values) -> Solution {
    let system = System::new(mechanism, values);
    let (open_by, speed_mismatch) = system.mismatch();
    Solution {
        acceleration: system.accelerations(),
        kinetic_energy: system.kinetic_energy(),
        potential_energy: system.potential_energy(),
        open_by,
        speed_mismatch,
    }
}

/// The mass matrix of a mechanism without loops, row-major: the polarised kinetic energy.
pub fn tree_mass_matrix(mechanism: &Mechanism, values: &Values) -> Vec<Vec<f64>> {
    let n = mechanism.joints.len();
    let unit_speeds = |joint: usize| {
        let u = (0..n).map(|j| f64::from(u8::from(j == joint))).collect();
        Values { u, ..values.clone() }
    };
    let speeds: Vec<_> = (0..n).map(unit_speeds).collect();
    let systems: Vec<_> = speeds.iter().map(|values| System::new(mechanism, values)).collect();
    let entry = |r: &System<'_>, s: &System<'_>| -> f64 {
        let of = |&body: &usize| {
            let (x, y) = (&r.motions[body], &s.motions[body]);
            r.mass(body) * x.velocity.dot(&y.velocity) + x.omega.dot(&(r.inertia(body) * y.omega))
        };
        r.moving().iter().map(of).sum()
    };
    systems.iter().map(|r| systems.iter().map(|s| entry(r, s)).collect()).collect()
}

/// A mechanism at a state.
struct System<'a> {
    mechanism: &'a Mechanism,
    values: &'a Values,
    motions: Vec<Motion>,
}

/// A hinge at a state, base frame.
struct Hinge {
    bodies: [usize; 2],
    direction: Vector3<f64>,
    /// From each body's centre of mass to the hinge.
    arms: [Vector3<f64>; 2],
    /// Torque on the second body about the direction, N m.
    torque: f64,
}

impl<'a> System<'a> {
    fn new(mechanism: &'a Mechanism, values: &'a Values) -> Self {
        Self { mechanism, values, motions: motions(mechanism, values) }
    }

    fn mass(&self, body: usize) -> f64 {
        let body = &self.mechanism.bodies[body];
        match body.mass_parameter {
            Some(id) => self.values.parameters[id.index()],
            None => body.mass_properties.mass,
        }
    }

    /// About the centre of mass, base axes.
    fn inertia(&self, body: usize) -> Matrix3<f64> {
        let properties = self.mechanism.bodies[body].mass_properties;
        let r = self.motions[body].rotation;
        r * properties.inertia * r.transpose() * (self.mass(body) / properties.mass)
    }

    fn com(&self, body: usize) -> Vector3<f64> {
        let motion = &self.motions[body];
        motion.rotation * self.mechanism.bodies[body].mass_properties.com + motion.position
    }

    fn gravity(&self) -> Vector3<f64> {
        Vector3::from_fn(|i, _| self.values.of(&self.mechanism.gravity[i]))
    }

    fn moving(&self) -> Vec<usize> {
        (0..self.mechanism.bodies.len()).filter(|&b| !self.mechanism.bodies[b].fixed).collect()
    }

    fn hinge(&self, index: usize) -> Hinge {
        let joint = &self.mechanism.joints[index];
        let bodies = joint.bodies.map(|id| id.index());
        let first = &self.motions[bodies[0]];
        let point = first.rotation * joint.point + first.position;
        let (q, u) = (self.values.q[index], self.values.u[index]);
        let of = |expression| self.values.of(expression);
        Hinge {
            bodies,
            direction: first.rotation * joint.direction,
            arms: bodies.map(|body| point - self.com(body)),
            torque: of(&joint.torque)
                - of(&joint.stiffness) * (q - of(&joint.rest))
                - of(&joint.damping) * u,
        }
    }

    /// Force and moment about the centre of mass of each body, without the hinges' reactions.
    fn wrenches(&self) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let gravity = self.gravity();
        let mut wrenches: Vec<_> = (0..self.mechanism.bodies.len())
            .map(|body| {
                let omega = self.motions[body].omega;
                let gyroscopic = -omega.cross(&(self.inertia(body) * omega));
                (gravity * self.mass(body), gyroscopic)
            })
            .collect();
        for force in &self.mechanism.forces {
            let point = &self.mechanism.points[force.point.index()];
            let body = point.body.index();
            let motion = &self.motions[body];
            let at = motion.rotation * point.at + motion.position;
            let force = Vector3::from_fn(|i, _| self.values.of(&force.force[i]));
            wrenches[body].0 += force;
            wrenches[body].1 += (at - self.com(body)).cross(&force);
        }
        for index in 0..self.mechanism.joints.len() {
            let hinge = self.hinge(index);
            wrenches[hinge.bodies[0]].1 -= hinge.direction * hinge.torque;
            wrenches[hinge.bodies[1]].1 += hinge.direction * hinge.torque;
        }
        wrenches
    }

    /// Gauss's principle over the accelerations of all moving bodies.
    fn accelerations(&self) -> Vec<f64> {
        let moving = self.moving();
        let column = |body: usize| moving.iter().position(|&b| b == body).map(|i| 6 * i);
        let hinges: Vec<_> = (0..self.mechanism.joints.len()).map(|j| self.hinge(j)).collect();
        let wrenches = self.wrenches();

        // W^-1/2 per body (a square root by Cholesky: W = S S^T) and the free accelerations.
        let mut free = DVector::zeros(6 * moving.len());
        let mut root = DMatrix::zeros(6 * moving.len(), 6 * moving.len());
        for (i, &body) in moving.iter().enumerate() {
            let (force, moment) = wrenches[body];
            let inertia = self.inertia(body).cholesky().expect("inertia is positive definite");
            free.fixed_rows_mut::<3>(6 * i).copy_from(&(force / self.mass(body)));
            free.fixed_rows_mut::<3>(6 * i + 3).copy_from(&inertia.solve(&moment));
            let light = Matrix3::identity() / self.mass(body).sqrt();
            root.fixed_view_mut::<3, 3>(6 * i, 6 * i).copy_from(&light);
            let inverse = inertia.l().try_inverse().expect("a regular triangle");
            root.fixed_view_mut::<3, 3>(6 * i + 3, 6 * i + 3).copy_from(&inverse.transpose());
        }

        let mut rows = DMatrix::zeros(5 * hinges.len(), 6 * moving.len());
        let mut rhs = DVector::zeros(5 * hinges.len());
        for (j, hinge) in hinges.iter().enumerate() {
            let u = self.values.u[j];
            let across = perpendicular(&hinge.direction);
            for (body, arm, sign) in
                [(hinge.bodies[0], hinge.arms[0], -1.0), (hinge.bodies[1], hinge.arms[1], 1.0)]
            {
                let omega = self.motions[body].omega;
                // Same acceleration of the hinge point: a + alpha x r + omega x (omega x r).
                let centripetal = omega.cross(&omega.cross(&arm));
                let mut bias = rhs.fixed_rows_mut::<3>(5 * j);
                bias -= sign * centripetal;
                if let Some(c) = column(body) {
                    let identity = Matrix3::identity() * sign;
                    rows.fixed_view_mut::<3, 3>(5 * j, c).copy_from(&identity);
                    let turn = -arm.cross_matrix() * sign;
                    rows.fixed_view_mut::<3, 3>(5 * j, c + 3).copy_from(&turn);
                    for (k, direction) in across.iter().enumerate() {
                        let turn = direction.transpose() * sign;
                        rows.fixed_view_mut::<1, 3>(5 * j + 3 + k, c + 3).copy_from(&turn);
                    }
                }
            }
            // alpha_1 - alpha_0 = u' e + u omega_0 x e, so across e only the last term is left.
            let carried = self.motions[hinge.bodies[0]].omega.cross(&hinge.direction) * u;
            for (k, direction) in across.iter().enumerate() {
                rhs[5 * j + 3 + k] = direction.dot(&carried);
            }
        }
        let accelerations = constrain(&rows, &rhs, &free, &root);
        let alpha = |body: usize| {
            column(body).map_or(Vector3::zeros(), |c| accelerations.fixed_rows::<3>(c + 3).into())
        };
        let relative = |hinge: &Hinge| alpha(hinge.bodies[1]) - alpha(hinge.bodies[0]);
        hinges.iter().map(|hinge| hinge.direction.dot(&relative(hinge))).collect()
    }

    fn kinetic_energy(&self) -> f64 {
        let of = |&body: &usize| {
            let Motion { omega, velocity, .. } = self.motions[body];
            0.5 * self.mass(body) * velocity.norm_squared()
                + 0.5 * omega.dot(&(self.inertia(body) * omega))
        };
        self.moving().iter().map(of).sum()
    }

    fn potential_energy(&self) -> f64 {
        let gravity = self.gravity();
        let weight = |&body: &usize| -self.mass(body) * gravity.dot(&self.com(body));
        let spring = |(joint, q): (&lamc::laminate::Joint, &f64)| {
            let stretch = q - self.values.of(&joint.rest);
            0.5 * self.values.of(&joint.stiffness) * stretch * stretch
        };
        self.moving().iter().map(weight).sum::<f64>()
            + self.mechanism.joints.iter().zip(&self.values.q).map(spring).sum::<f64>()
    }

    /// Largest disagreement over any hinge: of positions, of speeds.
    fn mismatch(&self) -> (f64, f64) {
        let mut open = (0.0_f64, 0.0_f64);
        for (j, joint) in self.mechanism.joints.iter().enumerate() {
            let [a, b] = joint.bodies.map(|id| id.index());
            let (first, second) = (&self.motions[a], &self.motions[b]);
            let turned = first.rotation * turn(&joint.direction, self.values.q[j]);
            open.0 = keep_largest(open.0, largest(&(second.rotation - turned)));
            let gap = second.rotation * joint.point + second.position
                - first.rotation * joint.point
                - first.position;
            open.0 = keep_largest(open.0, largest(&gap));
            let hinge = self.hinge(j);
            let spin = second.omega - first.omega - hinge.direction * self.values.u[j];
            let slip = second.velocity + second.omega.cross(&hinge.arms[1])
                - first.velocity
                - first.omega.cross(&hinge.arms[0]);
            open.1 = keep_largest(open.1, largest(spin.iter().chain(&slip)));
        }
        open
    }
}

/// Where every body is and how it moves: hinges are followed in any order until all are placed.
fn motions(mechanism: &Mechanism, values: &Values) -> Vec<Motion> {
    let ground = Motion {
        rotation: Matrix3::identity(),
        position: Vector3::zeros(),
        omega: Vector3::zeros(),
        velocity: Vector3::zeros(),
    };
    let mut placed: Vec<Option<Motion>> =
        mechanism.bodies.iter().map(|body| body.fixed.then_some(ground)).collect();
    while placed.iter().any(Option::is_none) {
        let before = placed.iter().flatten().count();
        for (j, joint) in mechanism.joints.iter().enumerate() {
            let [a, b] = joint.bodies.map(|id| id.index());
            let (known, new, sign) = match (&placed[a], &placed[b]) {
                (Some(known), None) => (*known, b, 1.0),
                (None, Some(known)) => (*known, a, -1.0),
                _ => continue,
            };
            let from = if new == b { a } else { b };
            let rotation = known.rotation * turn(&joint.direction, sign * values.q[j]);
            let hinge = known.rotation * joint.point + known.position;
            // The hinge line is the same line in both bodies.
            let omega = known.omega + known.rotation * joint.direction * (sign * values.u[j]);
            let com = |body: usize| mechanism.bodies[body].mass_properties.com;
            let known_com = known.rotation * com(from) + known.position;
            let position = hinge - rotation * joint.point;
            let new_com = rotation * com(new) + position;
            let at_hinge = known.velocity + known.omega.cross(&(hinge - known_com));
            let velocity = at_hinge + omega.cross(&(new_com - hinge));
            placed[new] = Some(Motion { rotation, position, omega, velocity });
        }
        assert!(placed.iter().flatten().count() > before, "a body is out of reach of the ground");
    }
    placed.into_iter().flatten().collect()
}

/// The point nearest to `free`, in the norm of W, that satisfies `rows` a = `rhs`, where
/// W^-1 = `root` `root`^T.
fn constrain(
    rows: &DMatrix<f64>,
    rhs: &DVector<f64>,
    free: &DVector<f64>,
    root: &DMatrix<f64>,
) -> DVector<f64> {
    let mut scaled = rows * root;
    let mut weights = DVector::zeros(rows.nrows());
    for (i, mut row) in scaled.row_iter_mut().enumerate() {
        weights[i] = 1.0 / row.norm();
        row *= weights[i];
    }
    let svd = scaled.svd(true, true);
    let tolerance = RANK_TOLERANCE * svd.singular_values.max();
    let mut solution = free.clone();
    // The second pass takes away what rounding left of the first.
    for _ in 0..2 {
        let violation = (rhs - rows * &solution).component_mul(&weights);
        solution += root * svd.solve(&violation, tolerance).expect("both factors were asked for");
    }
    solution
}

fn turn(direction: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    Rotation3::from_axis_angle(&Unit::new_normalize(*direction), angle).into_inner()
}

/// Two unit vectors at right angles to a unit vector and to each other.
fn perpendicular(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let first = direction.cross(&Vector3::ith(direction.iamin(), 1.0)).normalize();
    [first, direction.cross(&first)]
}
