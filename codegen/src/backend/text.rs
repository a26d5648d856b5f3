//! Lines and comments of every backend.

use serde::Serialize;

use crate::program::{Interface, JointInfo};

/// Columns of a line.
const WIDTH: usize = 100;

/// Cuts a line where it is too long: behind a comma or before the sign of a sum, or else at any
/// space.
pub fn wrap(line: &str, lines: &mut Vec<String>) {
    let text = line.trim_start();
    let indent = line.len() - text.len();
    let mut current = " ".repeat(indent);
    let mut is_first = true;
    for piece in pieces(text) {
        let fits = |length: usize| indent + 4 + length <= WIDTH;
        let words = if fits(piece.len()) { vec![piece] } else { piece.split(' ').collect() };
        for word in words {
            if !is_first && current.len() + 1 + word.len() > WIDTH {
                lines.push(std::mem::replace(&mut current, " ".repeat(indent + 4)));
            } else if !is_first {
                current.push(' ');
            }
            current.push_str(word);
            is_first = false;
        }
    }
    lines.push(current);
}

/// What is better not cut.
fn pieces(text: &str) -> Vec<&str> {
    let mut pieces = Vec::new();
    let (mut begin, mut end, mut before) = (0, 0, "");
    for word in text.split(' ') {
        let is_bound = matches!(before, "+" | "-" | "*" | "/") || matches!(word, "*" | "/" | "=");
        if end > 0 && !is_bound {
            pieces.push(&text[begin..end]);
            begin = end + 1;
        }
        end += word.len() + usize::from(end > 0);
        before = word;
    }
    pieces.push(&text[begin..end]);
    pieces
}

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
