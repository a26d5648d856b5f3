//! The coordinates and speeds of a free body, and their names in files.

use crate::arithmetic::{cos, sin};

pub use lamc_runtime::free_body::{COORDINATES, SPEEDS};

/// Names of the coordinates of a free body, after its own name and a dot: the displacement of its centre of
/// mass from where it is drawn, m, and its orientation, a unit quaternion.
pub const COORDINATE_NAMES: [&str; COORDINATES] = ["x", "y", "z", "qw", "qx", "qy", "qz"];

/// Names of the speeds of a free body: the velocity of its centre of mass in the base frame, m/s, and its
/// angular velocity in its own frame, rad/s.
pub const SPEED_NAMES: [&str; SPEEDS] = ["vx", "vy", "vz", "wx", "wy", "wz"];

/// Units of the coordinates of a free body.
pub const COORDINATE_UNITS: [&str; COORDINATES] = ["m", "m", "m", "1", "1", "1", "1"];

/// Units of the speeds of a free body.
pub const SPEED_UNITS: [&str; SPEEDS] = ["m/s", "m/s", "m/s", "rad/s", "rad/s", "rad/s"];

/// Returns the unit quaternion w x y z of a rotation vector, rad.
pub fn quaternion(turn: [f64; 3]) -> [f64; 4] {
    let [x, y, z] = turn;
    let angle = (x * x + y * y + z * z).sqrt();
    if angle == 0.0 {
        return [1.0, 0.0, 0.0, 0.0];
    }
    let share = sin(0.5 * angle) / angle;
    [cos(0.5 * angle), share * x, share * y, share * z]
}

/// Returns a quaternion with its length made one; nothing for the quaternion zero.
pub fn unit(quaternion: [f64; 4]) -> Option<[f64; 4]> {
    // The largest component first, so that no square underflows or overflows.
    let largest =
        quaternion.iter().fold(0.0, |most: f64, x| if x.abs() > most { x.abs() } else { most });
    let scaled = quaternion.map(|x| x / largest);
    let norm = scaled.iter().map(|x| x * x).sum::<f64>().sqrt();
    (largest > 0.0).then(|| scaled.map(|x| x / norm))
}
