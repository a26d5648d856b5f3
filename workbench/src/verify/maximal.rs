//! Newton's and Euler's equations in maximal coordinates: six accelerations per moving body, five
//! equations per hinge and one more where an angle is prescribed. The rotor of a motor has an acceleration of its
//! own, and the equation that it is that of the joint. There is no tree, no cut and no generalised speed: loops are
//! hinges like any other.
//!
//! ```text
//! minimise  1/2 (a - a0)^T W (a - a0)   subject to   A a = b        (Gauss's principle)
//! a0 = W^-1 (applied forces)            W = diag(m 1, I_com)        per body
//! a = a0 + W^-1/2 (A W^-1/2)^+ (b - A a0)
//! ```
//!
//! F. E. Udwadia and R. E. Kalaba, "A new perspective on constrained motion", Proc. R. Soc. Lond. A 439
//! (1992).

use lamc::arithmetic::{larger, largest};
use lamc::laminate::Mechanism;
use nalgebra::{DMatrix, DVector, Matrix3, Vector3};

use super::elements::Place;
use super::expression::Values;
use super::gauss::{Constrained, constrain};
use super::placement::{Motion, motions};

mod sums;

/// Results of the equations at one state.
#[derive(Clone, Debug)]
pub struct Solution {
    /// Joint accelerations, rad/s^2.
    pub acceleration: Vec<f64>,
    /// The largest of them, and of those that there would be if no joint were driven: motors hold against the
    /// rest.
    pub magnitude: f64,
    /// J.
    pub kinetic_energy: f64,
    /// Gravity of the moving bodies and springs, J.
    pub potential_energy: f64,
    /// How badly the joint angles disagree about where a body is: a share of the model's size, or a sine.
    pub open_by: f64,
    /// How badly the joint speeds disagree about how a body moves: a share of the largest speed, of turning or
    /// by the model's size.
    pub speed_mismatch: f64,
    /// Independent equations of the hinges.
    pub rank: usize,
    /// Further equations, which are always independent: those of the rotors of motors.
    pub rotors: usize,
    /// The singular values of the scaled equations over the largest, in descending order.
    pub spectrum: Vec<f64>,
}

impl Solution {
    /// The degrees of freedom that the hinges leave to `bodies` moving bodies.
    pub fn mobility(&self, bodies: usize) -> usize {
        6 * bodies - self.rank
    }

    /// The largest difference of joint accelerations from these, over the magnitude.
    pub fn relative_error(&self, found: &[f64]) -> f64 {
        let difference = largest(found.iter().zip(&self.acceleration).map(|(a, b)| a - b));
        if difference == 0.0 { 0.0 } else { difference / self.magnitude }
    }

    /// The condition number: the largest singular value over the smallest that counts.
    pub fn condition(&self) -> f64 {
        (self.rank + self.rotors).checked_sub(1).map_or(1.0, |last| 1.0 / self.spectrum[last])
    }
}

/// The inertia of this body is not positive definite, which this formulation needs.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the inertia of body {0} is not positive definite")]
pub struct Massless(pub usize);

/// Solves for the joint accelerations at a closed state.
///
/// # Errors
/// A body without inertia.
pub fn solve(mechanism: &Mechanism, values: &Values) -> Result<Solution, Massless> {
    let system = System::new(mechanism, values);
    let (open_by, speed_mismatch) = system.mismatch();
    let rotors = system.place().rotors().len();
    let Accelerations { joints, magnitude, rank, spectrum } = system.accelerations()?;
    Ok(Solution {
        acceleration: joints,
        magnitude,
        kinetic_energy: system.kinetic_energy(),
        potential_energy: system.potential_energy(),
        open_by,
        speed_mismatch,
        rank: rank - rotors,
        rotors,
        spectrum,
    })
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
        r.moving().iter().map(of).sum::<f64>() + 2.0 * r.place().rotor_energy(s.values)
    };
    systems.iter().map(|r| systems.iter().map(|s| entry(r, s)).collect()).collect()
}

/// Joint accelerations, their magnitude, the rank of the hinges' equations and their singular values.
struct Accelerations {
    joints: Vec<f64>,
    magnitude: f64,
    rank: usize,
    spectrum: Vec<f64>,
}

/// A mechanism at a state.
pub(super) struct System<'a> {
    pub mechanism: &'a Mechanism,
    pub values: &'a Values,
    pub motions: Vec<Motion>,
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

impl Hinge {
    /// Each body, its arm, and the sign of its acceleration in the equations.
    fn ends(&self) -> [(usize, Vector3<f64>, f64); 2] {
        [(self.bodies[0], self.arms[0], -1.0), (self.bodies[1], self.arms[1], 1.0)]
    }
}

impl<'a> System<'a> {
    fn new(mechanism: &'a Mechanism, values: &'a Values) -> Self {
        Self { mechanism, values, motions: motions(mechanism, values) }
    }

    fn place(&self) -> Place<'_> {
        Place { mechanism: self.mechanism, values: self.values, motions: &self.motions }
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

    pub fn com(&self, body: usize) -> Vector3<f64> {
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
        let of = |formula| self.values.of(formula);
        let bend = q - of(&joint.rest);
        let friction = joint.friction.as_ref();
        let friction = friction.map_or(0.0, |law| of(&law.torque) * (u / law.speed).tanh());
        let motor = self.mechanism.motor(lamc::source::JointId(index));
        Hinge {
            bodies,
            direction: first.rotation * joint.direction,
            arms: bodies.map(|body| point - self.com(body)),
            torque: of(&joint.torque)
                - of(&joint.stiffness) * bend
                - of(&joint.cubic_stiffness) * bend.powi(3)
                - of(&joint.damping) * u
                - friction
                + motor.map_or(0.0, |motor| self.place().motor(motor)),
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
        let mut push = |body: usize, at: Vector3<f64>, force: Vector3<f64>| {
            wrenches[body].0 += force;
            wrenches[body].1 += (at - self.com(body)).cross(&force);
        };
        for force in &self.mechanism.forces {
            let point = &self.mechanism.points[force.point.index()];
            let motion = &self.motions[point.body.index()];
            let at = motion.rotation * point.at + motion.position;
            let force = Vector3::from_fn(|i, _| self.values.of(&force.force[i]));
            push(point.body.index(), at, force);
        }
        for body in self.moving() {
            self.drag(body).into_iter().for_each(|(at, force)| push(body, at, force));
        }
        for touched in self.contacts() {
            push(touched.body, touched.at, touched.force);
            touched.plane.into_iter().for_each(|plane| push(plane, touched.at, -touched.force));
        }
        self.place().forces().into_iter().for_each(|(body, at, force)| push(body, at, force));
        for (body, moment) in self.place().moments() {
            wrenches[body].1 += moment;
        }
        for index in 0..self.mechanism.joints.len() {
            let hinge = self.hinge(index);
            wrenches[hinge.bodies[0]].1 -= hinge.direction * hinge.torque;
            wrenches[hinge.bodies[1]].1 += hinge.direction * hinge.torque;
        }
        wrenches
    }

    /// What the air does to the plates of a body: at which points, N. The force per area against the speed v
    /// along the normal is density drag |v| v / 2.
    fn drag(&self, body: usize) -> Vec<(Vector3<f64>, Vector3<f64>)> {
        let Some(air) = &self.mechanism.air else { return Vec::new() };
        let pressure = self.values.of(&air.density) * self.values.of(&air.drag) / 2.0;
        let motion = &self.motions[body];
        let normal = motion.rotation * Vector3::z();
        let force = |point: &lamc::laminate::SurfacePoint| {
            let at = motion.rotation * point.at + motion.position;
            let velocity = motion.velocity + motion.omega.cross(&(at - self.com(body)));
            let speed = velocity.dot(&normal);
            (at, -normal * (pressure * point.area * speed.abs() * speed))
        };
        self.mechanism.bodies[body].surface.iter().map(force).collect()
    }

    /// The joint accelerations by Gauss's principle over the accelerations of all moving bodies.
    fn accelerations(&self) -> Result<Accelerations, Massless> {
        let moving = self.moving();
        let column = |body: usize| moving.iter().position(|&b| b == body).map(|i| 6 * i);
        let hinges: Vec<_> = (0..self.mechanism.joints.len()).map(|j| self.hinge(j)).collect();
        let (free, root) = self.free_bodies(&moving)?;
        let (rows, rhs) = self.hinge_equations(&hinges, free.len(), &column);
        let about_hinges = |accelerations: &DVector<f64>| -> Vec<f64> {
            let alpha = |body: usize| {
                let rows = |c: usize| accelerations.fixed_rows::<3>(c + 3).into_owned();
                column(body).map_or(Vector3::zeros(), rows)
            };
            let relative = |hinge: &Hinge| alpha(hinge.bodies[1]) - alpha(hinge.bodies[0]);
            hinges.iter().map(|hinge| hinge.direction.dot(&relative(hinge))).collect()
        };
        let Constrained { accelerations, rank, spectrum } = constrain(&rows, &rhs, &free, &root);
        let joints = about_hinges(&accelerations);
        let mut magnitude = largest(&joints);
        let undriven = 5 * hinges.len() + self.place().rotors().len();
        if undriven < rows.nrows() {
            let (rows, rhs) =
                (rows.rows(0, undriven).into_owned(), rhs.rows(0, undriven).into_owned());
            let free = about_hinges(&constrain(&rows, &rhs, &free, &root).accelerations);
            magnitude = larger(magnitude, largest(&free));
        }
        Ok(Accelerations { joints, magnitude, rank, spectrum })
    }

    /// The accelerations without hinges, and W^-1/2 (S^-T of the Cholesky factor S of W): six rows per body, then
    /// one per rotor.
    fn free_bodies(&self, moving: &[usize]) -> Result<(DVector<f64>, DMatrix<f64>), Massless> {
        let wrenches = self.wrenches();
        let rotors = self.place().rotors();
        let size = 6 * moving.len() + rotors.len();
        let mut free = DVector::zeros(size);
        let mut root = DMatrix::zeros(size, size);
        for (at, (_, inertia)) in (6 * moving.len()..).zip(rotors) {
            root[(at, at)] = 1.0 / inertia.sqrt();
        }
        for (i, &body) in moving.iter().enumerate() {
            let (force, moment) = wrenches[body];
            let inertia = self.inertia(body).cholesky().ok_or(Massless(body))?;
            let inverse = inertia.l().try_inverse().ok_or(Massless(body))?;
            free.fixed_rows_mut::<3>(6 * i).copy_from(&(force / self.mass(body)));
            free.fixed_rows_mut::<3>(6 * i + 3).copy_from(&inertia.solve(&moment));
            let light = Matrix3::identity() / self.mass(body).sqrt();
            root.fixed_view_mut::<3, 3>(6 * i, 6 * i).copy_from(&light);
            root.fixed_view_mut::<3, 3>(6 * i + 3, 6 * i + 3).copy_from(&inverse.transpose());
        }
        Ok((free, root))
    }

    /// A and b: five rows for each hinge, then one for each rotor, then one for each driven joint.
    fn hinge_equations(
        &self,
        hinges: &[Hinge],
        columns: usize,
        column: &dyn Fn(usize) -> Option<usize>,
    ) -> (DMatrix<f64>, DVector<f64>) {
        let joints = &self.mechanism.joints;
        let driven: Vec<_> = joints
            .iter()
            .enumerate()
            .filter_map(|(j, joint)| Some((j, joint.drive.as_ref()?)))
            .collect();
        let rotors = self.place().rotors();
        let mut rows = DMatrix::zeros(5 * hinges.len() + rotors.len() + driven.len(), columns);
        let mut rhs = DVector::zeros(rows.nrows());
        for (j, hinge) in hinges.iter().enumerate() {
            let across = perpendicular(&hinge.direction);
            for (body, arm, sign) in hinge.ends() {
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
            let u = self.values.u[j];
            let carried = self.motions[hinge.bodies[0]].omega.cross(&hinge.direction) * u;
            for (k, direction) in across.iter().enumerate() {
                rhs[5 * j + 3 + k] = direction.dot(&carried);
            }
        }
        let of_rotors = columns - rotors.len()..;
        let rotors = rotors.iter().zip(of_rotors).map(|((j, _), own)| (*j, Some(own), 0.0));
        let driven = driven.into_iter().map(|(j, drive)| (j, None, self.values.jet(drive)[2]));
        for (row, (j, rotor, rate)) in (5 * hinges.len()..).zip(rotors.chain(driven)) {
            for (body, _, sign) in hinges[j].ends() {
                if let Some(c) = column(body) {
                    let turn = hinges[j].direction.transpose() * sign;
                    rows.fixed_view_mut::<1, 3>(row, c + 3).copy_from(&turn);
                }
            }
            rotor.into_iter().for_each(|own| rows[(row, own)] = -1.0);
            rhs[row] = rate;
        }
        (rows, rhs)
    }
}

/// Two unit vectors at right angles to a unit vector and to each other.
fn perpendicular(direction: &Vector3<f64>) -> [Vector3<f64>; 2] {
    let first = direction.cross(&Vector3::ith(direction.iamin(), 1.0)).normalize();
    [first, direction.cross(&first)]
}
