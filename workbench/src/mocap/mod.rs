//! Joint angles from the quaternions of rigid bodies, as motion capture gives them.
//!
//! ```text
//! rows (CSV) -> relative quaternion of each joint -> axis -> signed, unwrapped angle -> rates
//! ```
//!
//! Convention: Hamilton's unit quaternions (w, x, y, z) that turn a body's components into the
//! world's; all bodies' frames are parallel while the sheet lies flat. q and -q are one rotation.
//!
//! The rotation of body i + 1 relative to body i is `q_i^-1 q_{i+1}`: its axis, in the frame of body
//! i, is the hinge line as drawn. (Sharifzadeh, Khodambashi, Aukes, DETC2018-86359, form
//! `q_{i+1} q_i^-1`, the same angle about the same line in the frame of the world, where the line
//! moves with body i and cannot be compared with the drawing.)

mod angles;
mod quaternions;

pub use angles::{JointMotion, angles};
pub use quaternions::{FlattenError, Quaternions, write};
