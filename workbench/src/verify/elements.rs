//! Springs, tendons and motors in maximal coordinates.
//!
//! Tendons are broken lines between points, with the exact distances. The angle of a torsion spring comes from the
//! unit quaternion (w, v) of the relative rotation, whose twist about the axis d has the components w and v.d:
//!
//! ```text
//! angle = 2 atan2(v.d, w)     d(angle)/dt = (w (w d + v x d) + (v.d) v) . omega / (w^2 + (v.d)^2)
//! ```

use std::f64::consts::{PI, TAU};

use lamc::laminate::{Mechanism, Motor, Tendon, Tension, Twist};
use nalgebra::{Rotation3, UnitQuaternion, Vector3};

use super::expression::Values;
use super::placement::Motion;

/// Where a mechanism is.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    /// The mechanism.
    pub mechanism: &'a Mechanism,
    /// The variables of its formulas.
    pub values: &'a Values,
    /// Its bodies.
    pub motions: &'a [Motion],
}

/// A tendon at a state.
pub struct Line {
    /// Length, m.
    pub length: f64,
    /// Rate of change of the length, m/s.
    pub rate: f64,
    /// For each point its body, where it is, and the derivative of the length by its position.
    pub ends: Vec<(usize, Vector3<f64>, Vector3<f64>)>,
}

/// The angle of a torsion spring at a state.
pub struct Angle {
    /// From -pi to pi, rad.
    pub angle: f64,
    /// Its rate of change, rad/s.
    pub rate: f64,
    /// Its derivative by a turn of the second body, in the base frame.
    pub gradient: Vector3<f64>,
}

impl Place<'_> {
    /// The line of a tendon.
    pub fn line(&self, tendon: &Tendon) -> Line {
        let points = tendon.through.iter().map(|id| {
            let point = &self.mechanism.points[id.index()];
            let body = point.body.index();
            let motion = &self.motions[body];
            let com = self.mechanism.bodies[body].mass_properties.com;
            let velocity = motion.omega.cross(&(motion.rotation * (point.at - com)));
            // All fixed bodies rest, wherever their centre of mass is.
            let velocity = velocity + motion.velocity;
            (body, motion.rotation * point.at + motion.position, velocity)
        });
        let points: Vec<_> = points.collect();
        let mut line = Line { length: 0.0, rate: 0.0, ends: Vec::new() };
        line.ends.extend(points.iter().map(|&(body, at, _)| (body, at, Vector3::zeros())));
        for (number, pair) in points.windows(2).enumerate() {
            let span = pair[1].1 - pair[0].1;
            let unit = span.try_normalize(0.0).unwrap_or_default();
            line.length += span.norm();
            line.rate += unit.dot(&(pair[1].2 - pair[0].2));
            line.ends[number].2 -= unit;
            line.ends[number + 1].2 += unit;
        }
        line
    }

    /// The tension of a tendon, N, and its potential energy, J.
    pub fn tension(&self, tendon: &Tendon, line: &Line) -> [f64; 2] {
        match &tendon.tension {
            Tension::Given(law) => [self.values.of(law).max(0.0), 0.0],
            Tension::Elastic { stiffness, damping, rest_length, tension_only } => {
                let [k, b, rest] = [stiffness, damping, rest_length].map(|law| self.values.of(law));
                let stretch = line.length - rest;
                let force = k * stretch + b * line.rate;
                let energy = k * stretch * stretch / 2.0;
                match tension_only {
                    true if stretch < 0.0 => [0.0; 2],
                    true => [force.max(0.0), energy],
                    false => [force, energy],
                }
            }
        }
    }

    /// The angle of a torsion spring.
    pub fn angle(&self, twist: &Twist) -> Angle {
        let [first, second] = twist.bodies.map(|body| &self.motions[body.index()]);
        let relative = first.rotation.transpose() * second.rotation;
        let turn =
            UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(relative));
        let (w, v, d) = (turn.w, turn.imag(), twist.direction);
        let along = v.dot(&d);
        let angle = 2.0 * along.atan2(w);
        let angle = if angle > PI { angle - TAU } else { angle };
        let angle = if angle < -PI { angle + TAU } else { angle };
        let gradient = (d * w + v.cross(&d)) * w + v * along;
        let gradient = first.rotation * gradient / (w * w + along * along);
        Angle { angle, rate: gradient.dot(&(second.omega - first.omega)), gradient }
    }

    /// The torque of a torsion spring, N m, and its potential energy, J.
    pub fn twist(&self, twist: &Twist, at: &Angle) -> [f64; 2] {
        let [k, b, rest] =
            [&twist.stiffness, &twist.damping, &twist.rest].map(|law| self.values.of(law));
        let bend = at.angle - rest;
        [-k * bend - b * at.rate, k * bend * bend / 2.0]
    }

    /// The torque of a motor on its joint, N m.
    pub fn motor(&self, motor: &Motor) -> f64 {
        let of = |law| self.values.of(law);
        let limited = |value: f64, limit: Option<f64>| match limit {
            Some(limit) => value.clamp(-limit, limit),
            None => value,
        };
        let constant = motor.gear * of(&motor.torque_constant);
        let voltage = limited(of(&motor.voltage), motor.max_voltage.as_ref().map(of));
        let current =
            (voltage - constant * self.values.u[motor.joint.index()]) / of(&motor.resistance);
        constant * limited(current, motor.max_current.as_ref().map(of))
    }

    /// Forces at points: the body, the point and the force.
    pub(super) fn forces(&self) -> Vec<(usize, Vector3<f64>, Vector3<f64>)> {
        let mut forces = Vec::new();
        for tendon in &self.mechanism.elements.tendons {
            let line = self.line(tendon);
            let [tension, _] = self.tension(tendon, &line);
            forces.extend(line.ends.iter().map(|(body, at, by)| (*body, *at, -by * tension)));
        }
        forces
    }

    /// Moments of torsion springs, by body.
    pub(super) fn moments(&self) -> Vec<(usize, Vector3<f64>)> {
        let mut moments = Vec::new();
        for twist in &self.mechanism.elements.twists {
            let at = self.angle(twist);
            let moment = at.gradient * self.twist(twist, &at)[0];
            moments.extend([(twist.bodies[0].index(), -moment), (twist.bodies[1].index(), moment)]);
        }
        moments
    }

    /// The potential energy of springs and tendons, J.
    pub(super) fn energy(&self) -> f64 {
        let elements = &self.mechanism.elements;
        let tendons = elements.tendons.iter().map(|it| self.tension(it, &self.line(it))[1]);
        let twists = elements.twists.iter().map(|it| self.twist(it, &self.angle(it))[1]);
        tendons.chain(twists).sum()
    }

    /// The joints with motors whose rotor has inertia, with this inertia about the joint, kg m^2.
    pub(super) fn rotors(&self) -> Vec<(usize, f64)> {
        let motors = self.mechanism.elements.motors.iter();
        let rotors = motors.map(|motor| (motor.joint.index(), motor.reflected_inertia()));
        rotors.filter(|(_, inertia)| *inertia > 0.0).collect()
    }

    /// The kinetic energy of the rotors at the speeds of two states, for the polar form, J.
    pub(super) fn rotor_energy(&self, other: &Values) -> f64 {
        let of = |(joint, inertia): (usize, f64)| inertia * self.values.u[joint] * other.u[joint];
        self.rotors().into_iter().map(of).sum::<f64>() / 2.0
    }
}
