//! The angle of each hinge from the rotations of its two bodies.
//!
//! With r = q_i^-1 q_{i+1} = (w, v), the axis is the principal direction of the sum of v v^T over
//! the record, on the side of the drawn one, and the angle 2 atan2(v . axis, w), continued by whole
//! turns. The sign of r, and thus that of the axis of a single sample, does not matter.

use std::f64::consts::TAU;

use nalgebra::{Matrix3, UnitQuaternion, Vector3};

use super::quaternions::Quaternions;
use crate::identify::fourier::Fourier;
use lamc::laminate::Mechanism;

/// The measured axis is used if the hinge turns by more than this, rad, root mean square ...
const LEAST_TURN: f64 = 0.02;
/// ... and about it this many times as far as about any other.
const LEAST_RATIO: f64 = 10.0;

/// The measured motion of a hinge.
#[derive(Clone, Debug, PartialEq)]
pub struct JointMotion {
    /// The joint.
    pub name: String,
    /// The angle at each sample, rad, with the sign of the model; NaN in a gap.
    pub angle: Vec<f64>,
    /// The rate at each sample, rad/s, from a Fourier series through the angles; NaN outside the record
    /// of the joint, or if there are too few samples.
    pub rate: Vec<f64>,
    /// The measured axis in the first body's frame; `None` if the hinge hardly turns, in which case the
    /// drawn axis is used.
    pub axis: Option<Vector3<f64>>,
    /// The angle between the measured and the drawn axis, rad.
    pub misalignment: f64,
    /// The rotation about other axes divided by that about this one, root mean square.
    pub wobble: f64,
}

/// The motion of every joint of a model, in order; `None` if one of its bodies was not recorded.
pub fn angles(mechanism: &Mechanism, measured: &Quaternions) -> Vec<Option<JointMotion>> {
    let motion = |joint: &lamc::laminate::Joint| {
        let [first, second] = joint.bodies.map(|body| &measured.bodies[body.index()]);
        if first.is_empty() || second.is_empty() {
            return None;
        }
        let relative: Vec<Option<UnitQuaternion<f64>>> = first
            .iter()
            .zip(second)
            .map(|(first, second)| Some(first.as_ref()?.inverse() * second.as_ref()?))
            .collect();
        if relative.iter().all(Option::is_none) {
            return None;
        }
        let found = axis(relative.iter().flatten(), &joint.direction);
        let along = found.axis.unwrap_or(joint.direction);
        let angle = unwrapped(&relative, &along);
        let rate = rates(&measured.t, &angle);
        Some(JointMotion { name: joint.name.clone(), angle, rate, ..found })
    };
    mechanism.joints.iter().map(motion).collect()
}

/// The common axis of rotations, with the direction of the drawn one.
fn axis<'r>(
    relative: impl Iterator<Item = &'r UnitQuaternion<f64>>,
    drawn: &Vector3<f64>,
) -> JointMotion {
    let (mut scatter, mut count) = (Matrix3::zeros(), 0.0_f64);
    for rotation in relative {
        // For a half turn, this is the axis.
        let v = rotation.imag();
        scatter += v * v.transpose();
        count += 1.0;
    }
    let eigen = (scatter / count.max(1.0)).symmetric_eigen();
    let principal = eigen.eigenvalues.imax();
    let along = eigen.eigenvalues[principal].max(0.0);
    let across = (eigen.eigenvalues.sum() - eigen.eigenvalues[principal]).max(0.0);
    let direction: Vector3<f64> = eigen.eigenvectors.column(principal).into();
    let direction = if direction.dot(drawn) < 0.0 { -direction } else { direction };
    let turns = 2.0 * along.sqrt() > LEAST_TURN && along.sqrt() > LEAST_RATIO * across.sqrt();
    JointMotion {
        name: String::new(),
        angle: Vec::new(),
        rate: Vec::new(),
        axis: turns.then_some(direction),
        misalignment: if turns {
            direction.cross(drawn).norm().atan2(direction.dot(drawn))
        } else {
            0.0
        },
        wobble: if along > 0.0 { (across / along).sqrt() } else { 0.0 },
    }
}

/// Angles about an axis, each within half a turn of the one before; the first within half a turn of
/// flat.
fn unwrapped(relative: &[Option<UnitQuaternion<f64>>], axis: &Vector3<f64>) -> Vec<f64> {
    let mut last = 0.0;
    let angle = |rotation: &Option<UnitQuaternion<f64>>| {
        let Some(rotation) = rotation else { return f64::NAN };
        let angle = 2.0 * rotation.imag().dot(axis).atan2(rotation.w);
        last = angle + TAU * ((last - angle) / TAU).round();
        last
    };
    relative.iter().map(angle).collect()
}

/// The rates at all times between the first and the last angle.
fn rates(t: &[f64], angle: &[f64]) -> Vec<f64> {
    let seen = || t.iter().zip(angle).filter(|(_, angle)| !angle.is_nan());
    let (times, angles): (Vec<f64>, Vec<f64>) = seen().unzip();
    let series = Fourier::fit(&times, &angles);
    let rate = |t: &f64| match (&series, times.first(), times.last()) {
        (Some(series), Some(first), Some(last)) if (*first..=*last).contains(t) => {
            series.derivative(1, *t)
        }
        _ => f64::NAN,
    };
    t.iter().map(rate).collect()
}
