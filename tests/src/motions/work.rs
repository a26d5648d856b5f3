//! What changes the energy of a mechanism, written from the laws of its model:
//!
//! ```text
//! d(T + V)/dt = sum over joints of (torque - b u - friction tanh(u / speed)) u + motor u
//!             + sum over forces, surfaces and contacts of F . v
//!             - sum over tendons of (T - k (l - l0)) dl/dt, torsion springs alike
//!             + dV/dt at constant q            gravity, springs, rest angles and lengths that change with time
//!             + d(k d^2 / 2)/dt                contacts
//! ```

use lamc::laminate::{Joint, Mechanism, Tension};
use lamc::source::Expression;
use lamc_runtime::{Mechanism as _, acceleration_and_forces};
use lamc_workbench::verify::{Motion, Place, Values, motions};
use nalgebra::Vector3;

use super::subject::{Point, Subject};
use super::touch::of_contacts;

/// The power of everything that changes T + V, W.
pub fn power(subject: &Subject, at: &Point) -> f64 {
    let mechanism = &subject.compiled.topology.mechanism;
    let values = subject.values(at);
    let motions = motions(mechanism, &values);
    let joints = mechanism.joints.iter().enumerate();
    let joints: f64 = joints.map(|(index, joint)| of_joint(joint, index, &values)).sum();
    joints
        + of_motors(subject, at)
        + of_forces(mechanism, &motions, &values)
        + of_air(mechanism, &motions, &values)
        + of_contacts(mechanism, &motions, &values)
        + of_gravity(mechanism, &motions, &values)
        + of_elements(&Place { mechanism, values: &values, motions: &motions })
}

/// Motors, tendons of given tension, dampers, and springs that change with time.
fn of_elements(place: &Place) -> f64 {
    let Place { mechanism, values, .. } = place;
    let elements = &mechanism.elements;
    let changed = |[k, rest]: [&Expression; 2], stretch: f64| {
        let [k, rest] = [k, rest].map(|law| values.jet(law));
        k[1] * stretch * stretch / 2.0 - k[0] * stretch * rest[1]
    };
    let motors = elements.motors.iter();
    let motors = motors.map(|motor| place.motor(motor) * values.u[motor.joint.index()]);
    let tendons = elements.tendons.iter().map(|tendon| {
        let line = place.line(tendon);
        let [tension, _] = place.tension(tendon, &line);
        match &tendon.tension {
            Tension::Given(_) => -tension * line.rate,
            Tension::Elastic { stiffness, rest_length, tension_only, .. } => {
                let stretch = line.length - values.of(rest_length);
                let stretch = if *tension_only { stretch.max(0.0) } else { stretch };
                let lost = (tension - values.of(stiffness) * stretch) * line.rate;
                changed([stiffness, rest_length], stretch) - lost
            }
        }
    });
    let twists = elements.twists.iter().map(|twist| {
        let at = place.angle(twist);
        let lost = values.of(&twist.damping) * at.rate * at.rate;
        changed([&twist.stiffness, &twist.rest], at.angle - values.of(&twist.rest)) - lost
    });
    motors.sum::<f64>() + tendons.sum::<f64>() + twists.sum::<f64>()
}

/// Torque, damper and friction, and a spring that changes with time.
fn of_joint(joint: &Joint, index: usize, values: &Values) -> f64 {
    let (q, u) = (values.q[index], values.u[index]);
    let friction = joint.friction.as_ref();
    let friction = friction.map_or(0.0, |law| values.of(&law.torque) * (u / law.speed).tanh());
    let torque = values.of(&joint.torque) - values.of(&joint.damping) * u - friction;
    let [linear, cubic, rest] =
        [&joint.stiffness, &joint.cubic_stiffness, &joint.rest].map(|law| values.jet(law));
    let bend = q - rest[0];
    let stored = linear[1] * bend.powi(2) / 2.0 + cubic[1] * bend.powi(4) / 4.0;
    let relaxed = (linear[0] * bend + cubic[0] * bend.powi(3)) * rest[1];
    torque * u + stored - relaxed
}

/// The motors of driven joints, by the torques that lamc reports.
fn of_motors(subject: &Subject, Point { t, q, u }: &Point) -> f64 {
    let system = &subject.system;
    let d = system.dimensions();
    let (mut rates, mut lambda) = (vec![0.0; u.len()], vec![0.0; d.rows + d.drives]);
    let workspace = &mut system.workspace();
    let found = acceleration_and_forces(system, *t, q, u, workspace, &mut rates, &mut lambda);
    if found.is_err() {
        return f64::NAN;
    }
    let mut torques = lambda[d.rows..].iter();
    let mut power = 0.0;
    system.drives(*t, |drive| {
        power += torques.next().unwrap_or(&f64::NAN) * u[drive.joint];
    });
    power
}

fn of_forces(mechanism: &Mechanism, motions: &[Motion], values: &Values) -> f64 {
    let power = |force: &lamc::laminate::Force| {
        let point = &mechanism.points[force.point.index()];
        let body = point.body.index();
        let velocity = velocity(mechanism, motions, body, &point.at);
        Vector3::from_fn(|i, _| values.of(&force.force[i])).dot(&velocity)
    };
    mechanism.forces.iter().map(power).sum()
}

/// The velocity of a point that is drawn on a body, m/s.
pub fn velocity(
    mechanism: &Mechanism,
    motions: &[Motion],
    body: usize,
    at: &Vector3<f64>,
) -> Vector3<f64> {
    let motion = &motions[body];
    let arm = motion.rotation * (at - mechanism.bodies[body].mass_properties.com);
    motion.velocity + motion.omega.cross(&arm)
}

/// Density drag |v| v / 2 for each area, against its speed along its normal.
fn of_air(mechanism: &Mechanism, motions: &[Motion], values: &Values) -> f64 {
    let Some(air) = &mechanism.air else { return 0.0 };
    let pressure = values.of(&air.density) * values.of(&air.drag) / 2.0;
    let moving = (0..motions.len()).filter(|&body| !mechanism.bodies[body].fixed);
    let of = |body: usize| -> f64 {
        let normal = motions[body].rotation * Vector3::z();
        let surface = mechanism.bodies[body].surface.iter();
        surface
            .map(|part| {
                let speed = velocity(mechanism, motions, body, &part.at).dot(&normal);
                -pressure * part.area * speed.abs().powi(3)
            })
            .sum()
    };
    moving.map(of).sum()
}

/// Gravity that changes with time.
fn of_gravity(mechanism: &Mechanism, motions: &[Motion], values: &Values) -> f64 {
    let change = Vector3::from_fn(|i, _| values.jet(&mechanism.gravity[i])[1]);
    let bodies = mechanism.bodies.iter().enumerate().filter(|(_, body)| !body.fixed);
    let of = |(index, body): (usize, &lamc::laminate::Body)| {
        let motion = &motions[index];
        let com = motion.rotation * body.mass_properties.com + motion.position;
        -mass(body, values) * change.dot(&com)
    };
    bodies.map(of).sum()
}

/// The mass of a body, kg.
pub fn mass(body: &lamc::laminate::Body, values: &Values) -> f64 {
    let id = body.mass_parameter;
    id.map_or(body.mass_properties.mass, |id| values.parameters[id.index()])
}

/// The angular momentum about a line through a point, kg m^2/s: the sum over the moving bodies, and the sum of
/// the magnitudes of all its terms.
pub fn angular_momentum(
    subject: &Subject,
    at: &Point,
    [point, direction]: [Vector3<f64>; 2],
) -> [f64; 2] {
    let mechanism = &subject.compiled.topology.mechanism;
    let values = subject.values(at);
    let motions = motions(mechanism, &values);
    let mut sums = [0.0; 2];
    for (body, motion) in mechanism.bodies.iter().zip(&motions).filter(|(body, _)| !body.fixed) {
        let properties = &body.mass_properties;
        let mass = mass(body, &values);
        let com = motion.rotation * properties.com + motion.position;
        let inertia = properties.inertia * (mass / properties.mass);
        let spin = motion.rotation * inertia * motion.rotation.transpose() * motion.omega;
        let terms = [(com - point).cross(&(mass * motion.velocity)), spin];
        for term in terms.map(|term| term.dot(&direction)) {
            sums = [sums[0] + term, sums[1] + term.abs()];
        }
    }
    sums
}
