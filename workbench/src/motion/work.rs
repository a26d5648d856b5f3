//! The work of the torques, motors and dampers of the hinges along a motion:
//!
//! ```text
//! W = integral of sum over j of (torque_j + motor_j - b_j u_j) u_j dt
//! ```
//!
//! from the formulas of the model, independent of the equations of motion. It equals the change of the energy T + V
//! if nothing else does work. Each step of the integrator is integrated by Simpson's rule.

use lamc_runtime::State;

use lamc::laminate::{Contact, Mechanism, Motor, Tension};
use lamc::source::Expression;

/// The error of Simpson's rule as a share of its difference from the trapezoidal rule: more than for any
/// power that the steps resolve.
const DOUBT: f64 = 0.1;

/// The work done so far.
#[derive(Clone, Debug)]
pub struct Work {
    /// Damping and torque of each joint.
    hinges: Vec<[Expression; 2]>,
    motors: Vec<Motor>,
    parameters: Vec<f64>,
    inputs: Vec<f64>,
    /// W, J.
    pub total: f64,
    /// Integral of the magnitude of the power, J.
    pub exchanged: f64,
    /// The largest error of `total`, J: a share of the difference between Simpson's and the trapezoidal rule.
    pub doubt: f64,
}

impl Work {
    /// Starts with no work done. Returns `None` if something else changes the energy: forces, air, driven joints,
    /// friction, tendons of given tension, springs with dampers other than those of joints, contacts that dissipate
    /// or end, springs or gravity that change with time or with what a controller drives.
    pub fn new(mechanism: &Mechanism, parameters: &[f64], inputs: &[f64]) -> Option<Self> {
        let joints = &mechanism.joints;
        let springs =
            joints.iter().flat_map(|joint| [&joint.stiffness, &joint.rest, &joint.cubic_stiffness]);
        let elements = &mechanism.elements;
        let lines: Option<Vec<_>> =
            elements.tendons.iter().map(|it| elastic(&it.tension)).collect();
        let lines = lines?.into_iter().flatten();
        let twists = elements.twists.iter();
        let is_damped = twists.clone().any(|twist| twist.damping != Expression::ZERO);
        let twists = twists.flat_map(|twist| [&twist.stiffness, &twist.rest]);
        let mut stored = springs.chain(lines).chain(twists).chain(&mechanism.gravity);
        let commands = mechanism.controllers.iter().flat_map(|controller| &controller.commands);
        let driven: Vec<_> = commands.map(|command| Expression::Input(command.input)).collect();
        let changes = |law: &Expression| {
            law.contains(&Expression::Time) || driven.iter().any(|input| law.contains(input))
        };
        let is_alone = mechanism.forces.is_empty()
            && !is_damped
            && mechanism.air.is_none()
            && joints.iter().all(|joint| joint.drive.is_none() && joint.friction.is_none())
            && mechanism
                .contacts
                .iter()
                .all(|contact| conserves(contact) && !changes(&contact.stiffness))
            && !stored.any(changes);
        is_alone.then(|| Self {
            hinges: joints.iter().map(|j| [j.damping.clone(), j.torque.clone()]).collect(),
            motors: elements.motors.clone(),
            parameters: parameters.to_vec(),
            inputs: inputs.to_vec(),
            total: 0.0,
            exchanged: 0.0,
            doubt: 0.0,
        })
    }

    /// Sets the inputs of further steps, SI.
    pub fn set_inputs(&mut self, inputs: &[f64]) {
        self.inputs.copy_from_slice(inputs);
    }

    /// Adds the work of a step, from the states at its beginning, middle and end.
    pub fn add(&mut self, states: [&State<Vec<f64>, f64>; 3]) {
        let step = states[2].t - states[0].t;
        let power = states.map(|state| self.power(state));
        let simpson = |p: [f64; 3]| step / 6.0 * (p[0] + 4.0 * p[1] + p[2]);
        self.total += simpson(power);
        self.doubt += DOUBT * (simpson(power) - step / 2.0 * (power[0] + power[2])).abs();
        self.exchanged += simpson(power.map(f64::abs));
    }

    /// W.
    fn power(&self, State { t, q, u }: &State<Vec<f64>, f64>) -> f64 {
        let leaf = |leaf: &Expression| match *leaf {
            Expression::Time => *t,
            Expression::Parameter(id) => self.parameters[id.index()],
            Expression::Input(id) => self.inputs[id.index()],
            Expression::Position(id) => q[id.index()],
            Expression::Rate(id) => u[id.index()],
            _ => f64::NAN,
        };
        let hinges = self.hinges.iter().zip(u).map(|([damping, torque], u)| {
            (torque.evaluate(&leaf) - damping.evaluate(&leaf) * u) * u
        });
        let motors = self.motors.iter().map(|motor| {
            let u = u[motor.joint.index()];
            let of = |law: &Expression| law.evaluate(&leaf);
            let limit = |law: &Option<Expression>| law.as_ref().map_or(f64::INFINITY, of);
            let within = |value: f64, limit: f64| value.min(limit).max(-limit);
            let constant = motor.gear * of(&motor.torque_constant);
            let voltage = within(of(&motor.voltage), limit(&motor.max_voltage));
            let current = (voltage - constant * u) / of(&motor.resistance);
            constant * within(current, limit(&motor.max_current)) * u
        });
        hinges.sum::<f64>() + motors.sum::<f64>()
    }
}

/// Returns the formulas that the energy of an elastic tendon depends on; `None` if the tendon does work that is not
/// followed here.
fn elastic(tension: &Tension) -> Option<[&Expression; 2]> {
    match tension {
        Tension::Elastic { stiffness, damping, rest_length, .. }
            if *damping == Expression::ZERO =>
        {
            Some([stiffness, rest_length])
        }
        _ => None,
    }
}

/// Returns whether a contact of constant stiffness only stores energy, and gives all of it back.
fn conserves(contact: &Contact) -> bool {
    let Contact { plane, dissipation, friction, .. } = contact;
    let is_none = |law: &Expression| law.constant() == Some(0.0);
    is_none(dissipation) && is_none(friction) && plane.outline.is_none()
}
