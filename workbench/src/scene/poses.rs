//! The poses of bodies at any time of a sampled motion.

use nalgebra::{Matrix3, Rotation3, UnitQuaternion, Vector3};

use crate::motion::{Motion, Pose, Sample};

/// The pose of a body.
#[derive(Clone, Copy, Debug)]
pub struct Placement {
    /// R.
    pub rotation: Matrix3<f64>,
    /// p, m.
    pub position: Vector3<f64>,
}

impl Placement {
    /// The pose of a body among those of all bodies; the flat pose if there are too few.
    pub fn of(poses: &[Pose], body: usize) -> Self {
        match poses.get(body) {
            Some(pose) => Self {
                rotation: Matrix3::from_fn(|row, column| pose.rotation[row][column]),
                position: pose.translation.into(),
            },
            None => Self { rotation: Matrix3::identity(), position: Vector3::zeros() },
        }
    }

    /// The position in the base frame, m, of a point of the body that is given in flat coordinates.
    pub fn apply(&self, x: &Vector3<f64>) -> Vector3<f64> {
        self.rotation * x + self.position
    }

    /// The rotation as a unit quaternion.
    pub fn quaternion(&self) -> UnitQuaternion<f64> {
        UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(self.rotation))
    }
}

/// What a picture shows of a motion at one time.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Moment {
    /// The poses of all bodies.
    pub poses: Vec<Pose>,
    /// The forces on contact points, N, in the base frame; none if they are not known.
    pub forces: Vec<[f64; 3]>,
}

impl From<&Sample> for Moment {
    fn from(sample: &Sample) -> Self {
        let forces = sample.contacts.iter().map(|[.., x, y, z]| [*x, *y, *z]);
        Self { poses: sample.poses.clone(), forces: forces.collect() }
    }
}

/// A motion at a time, s: between samples, bodies turn uniformly, their origins move
/// on straight lines, and forces change uniformly; before the first sample and after the last one, all rests.
pub fn moment_at(motion: &Motion, t: f64) -> Moment {
    let after = motion.samples.partition_point(|sample| sample.t < t);
    let (Some(before), Some(after)) = (
        motion.samples.get(after.saturating_sub(1)),
        motion.samples.get(after).or(motion.samples.last()),
    ) else {
        return Moment::default();
    };
    let whole = after.t - before.t;
    let share = if whole > 0.0 { ((t - before.t) / whole).clamp(0.0, 1.0) } else { 0.0 };
    let poses = (0..before.poses.len().min(after.poses.len())).map(|body| {
        let [a, b] = [before, after].map(|sample| Placement::of(&sample.poses, body));
        let (from, to) = (a.quaternion(), b.quaternion());
        let turned = from.try_slerp(&to, share, 1e-12).unwrap_or(to).to_rotation_matrix();
        Pose {
            rotation: turned.matrix().transpose().data.0,
            translation: a.position.lerp(&b.position, share).into(),
        }
    });
    let [from, to] = [before, after].map(|sample| Moment::from(sample).forces);
    let forces = from.into_iter().zip(to);
    let forces = forces.map(|(a, b)| Vector3::from(a).lerp(&Vector3::from(b), share).into());
    Moment { poses: poses.collect(), forces: forces.collect() }
}

#[cfg(test)]
mod tests {
    use lamc_runtime::Energy;

    use super::*;
    use crate::motion::Course;

    /// A body that turns about z at 3 rad/s while its origin moves along x at 2 m/s.
    fn pose(t: f64) -> Pose {
        let (s, c) = (3.0 * t).sin_cos();
        Pose {
            rotation: [[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]],
            translation: [2.0 * t, 0.0, 0.0],
        }
    }

    #[test]
    fn a_uniform_motion_is_found_at_any_time() {
        let sample = |t: f64| Sample {
            t,
            q: Vec::new(),
            u: Vec::new(),
            acceleration: Vec::new(),
            energy: Energy { kinetic: 0.0, potential: 0.0 },
            closure: 0.0,
            points: Vec::new(),
            contacts: vec![[0.0, 0.0, 0.0, t, 2.0, -t]],
            tensions: Vec::new(),
            inputs: Vec::new(),
            poses: vec![pose(t)],
        };
        let motion = Motion {
            name: String::new(),
            course: Course::Time,
            free: Vec::new(),
            joints: Vec::new(),
            bodies: vec!["body".to_owned()],
            points: Vec::new(),
            contacts: vec!["foot".to_owned()],
            tensions: Vec::new(),
            inputs: Vec::new(),
            size: 1.0,
            samples: [0.5, 0.6, 0.9].map(sample).to_vec(),
            complete: true,
        };
        for (t, expected) in
            [(0.0, 0.5), (0.5, 0.5), (0.53, 0.53), (0.6, 0.6), (0.87, 0.87), (2.0, 0.9)]
        {
            let Moment { poses, forces } = moment_at(&motion, t);
            let [found, wanted] = [poses[0], pose(expected)];
            let pairs = found.rotation.iter().flatten().zip(wanted.rotation.iter().flatten());
            let pairs = pairs.chain(found.translation.iter().zip(&wanted.translation));
            for (found, wanted) in pairs {
                assert!((found - wanted).abs() < 1e-12, "{found} is not {wanted} at {t}");
            }
            let [[x, y, z]] = *forces else { panic!("{forces:?}") };
            assert!((x - expected).abs() < 1e-12 && y == 2.0 && z == -x, "{forces:?} at {t}");
        }
        assert_eq!(moment_at(&Motion { samples: Vec::new(), ..motion }, 0.0), Moment::default());
    }
}
