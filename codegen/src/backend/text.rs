//! Words in the comments of every backend.

use serde::Serialize;

use crate::program::{Interface, JointInfo};

/// Text that may stand in a comment of Rust or C: no line break, which would end the one, and
/// nothing that would end the other or seem to begin another.
pub fn comment(text: &str) -> String {
    text.replace(char::is_control, "?").replace("*/", "* /").replace("/*", "/ *")
}

/// The options that cut loops, for the command in a module's header.
pub fn cuts(interface: &Interface) -> String {
    interface.cuts.iter().map(|joint| format!(" --cut {joint}")).collect()
}

/// A row of the table of joints.
#[derive(Serialize)]
pub struct Joint {
    index: usize,
    name: String,
    first: String,
    second: String,
    limits: String,
}

/// The table of joints, in the order of q.
pub fn joints(interface: &Interface) -> Vec<Joint> {
    let joint = |(index, joint): (usize, &JointInfo)| Joint {
        index,
        name: joint.name.clone(),
        first: joint.bodies[0].clone(),
        second: joint.bodies[1].clone(),
        limits: limits(joint.limits),
    };
    interface.joints.iter().enumerate().map(joint).collect()
}

fn limits([least, greatest]: [f64; 2]) -> String {
    if least == f64::NEG_INFINITY && greatest == f64::INFINITY {
        return String::new();
    }
    format!(", {:.4} .. {:.4} deg", least.to_degrees(), greatest.to_degrees())
}
