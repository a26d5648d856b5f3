//! Where the bodies are and how they move, from the angles and speeds of the joints.

use lamc::laminate::{FreeId, Mechanism};
use nalgebra::{Matrix3, Quaternion, Rotation3, Unit, UnitQuaternion, Vector3};

use super::expression::Values;

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

/// Where a free body is and how it moves, by its coordinates and speeds.
fn of_free(mechanism: &Mechanism, values: &Values, index: usize) -> Motion {
    let com = mechanism.bodies[mechanism.free[index].body.index()].mass_properties.com;
    let q = &values.q[mechanism.coordinate_of(FreeId(index)).index()..];
    let u = &values.u[mechanism.speed_of(FreeId(index)).index()..];
    let orientation = Quaternion::new(q[3], q[4], q[5], q[6]);
    let rotation = UnitQuaternion::new_normalize(orientation).to_rotation_matrix().into_inner();
    let vector = |x: &[f64]| Vector3::new(x[0], x[1], x[2]);
    Motion {
        rotation,
        position: com + vector(&q[..3]) - rotation * com,
        omega: rotation * vector(&u[3..]),
        velocity: vector(&u[..3]),
    }
}

/// Where every body is and how it moves: hinges are followed in any order until all are placed.
pub fn motions(mechanism: &Mechanism, values: &Values) -> Vec<Motion> {
    let ground = Motion {
        rotation: Matrix3::identity(),
        position: Vector3::zeros(),
        omega: Vector3::zeros(),
        velocity: Vector3::zeros(),
    };
    let mut placed: Vec<Option<Motion>> =
        mechanism.bodies.iter().map(|body| body.fixed.then_some(ground)).collect();
    for (index, free) in mechanism.free.iter().enumerate() {
        placed[free.body.index()] = Some(of_free(mechanism, values, index));
    }
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
        debug_assert!(
            placed.iter().flatten().count() > before,
            "all bodies hang on the ground or a free body"
        );
    }
    placed.into_iter().flatten().collect()
}

/// The rotation about a direction by an angle, rad.
pub fn turn(direction: &Vector3<f64>, angle: f64) -> Matrix3<f64> {
    Rotation3::from_axis_angle(&Unit::new_normalize(*direction), angle).into_inner()
}
