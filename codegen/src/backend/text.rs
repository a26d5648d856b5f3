//! Lines and comments that all backends write.

use serde::Serialize;

use crate::program::{Interface, JointInfo};

/// Maximum number of columns in a line.
const WIDTH: usize = 100;

/// Breaks a line that is too long, if possible after a comma or before the sign of a term, otherwise at
/// any space.
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

/// Splits a text into pieces within which a line break is undesirable.
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

/// Returns text that is safe in a comment of Rust or C: without line breaks, which would end a line
/// comment, and without anything that would end or begin a block comment.
pub fn comment(text: &str) -> String {
    text.replace(char::is_control, "?").replace("*/", "* /").replace("/*", "/ *")
}

/// Returns the options that select the cut joints, for the command line in a module's header.
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

/// Returns the table of joints, in the order of q.
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
