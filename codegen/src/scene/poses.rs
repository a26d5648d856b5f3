//! Where bodies are at any time of a sampled motion.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::motion::{Motion, Pose};

/// A pose, ready to be applied.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// R.
    pub rotation: Matrix3<f64>,
    /// p, m.
    pub position: Vector3<f64>,
}

impl Placement {
    /// That of a body among the poses of all; flat where there are too few.
    pub fn of(poses: &[Pose], body: usize) -> Self {
        match poses.get(body) {
            Some(pose) => Self {
                rotation: Matrix3::from_fn(|row, column| pose.rotation[row][column]),
                position: pose.translation.into(),
            },
            None => Self { rotation: Matrix3::identity(), position: Vector3::zeros() },
        }
    }

    /// Where a point of the body, given in flat coordinates, is in the base frame, m.
    pub fn apply(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * x + self.position
    }

    /// The rotation as a unit quaternion.
    pub fn quaternion(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(self.rotation))
    }
}

/// Poses of all bodies at a time, s: between samples, bodies turn uniformly and their origins move
/// straight; before the first and after the last, they rest.
pub fn poses_at(motion: &Motion, t: f64) -> Vec<Pose> {
    let after = motion.samples.partition_point(|sample| sample.t < t);
    let (Some(before), Some(after)) = (
        motion.samples.get(after.saturating_sub(1)),
        motion.samples.get(after).or(motion.samples.last()),
    ) else {
        return Vec::new();
    };
    let whole = after.t - before.t;
    let share = if whole > 0.0 { ((t - before.t) / whole).clamp(0.0, 1.0) } else { 0.0 };
    (0..before.poses.len().min(after.poses.len()))
        .map(|body| {
            let [a, b] = [before, after].map(|sample| Placement::of(&sample.poses, body));
            let (from, to) = (a.quaternion(), b.quaternion());
            let turned = from.try_slerp(&to, share, 1e-12).unwrap_or(to).to_rotation_matrix();
            Pose {
                rotation: turned.matrix().transpose().data.0,
                translation: a.position.lerp(&b.position, share).into(),
            }
        })
        .collect()
}
