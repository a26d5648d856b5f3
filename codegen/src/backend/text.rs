//! Words in the comments of every backend.

use crate::program::Interface;

/// Text that may stand in a comment of Rust or C: no line break, which would end the one, and
/// nothing that would end the other or seem to begin another.
pub fn comment(text: &str) -> String {
    text.replace(char::is_control, "?").replace("*/", "* /").replace("/*", "/ *")
}

/// The options that cut loops, for the command in a module's header.
pub fn cuts(interface: &Interface) -> String {
    interface.cuts.iter().map(|joint| format!(" --cut {joint}")).collect()
}

/// A joint's limits for the table of joints.
pub fn limits([least, greatest]: [f64; 2]) -> String {
    if least == f64::NEG_INFINITY && greatest == f64::INFINITY {
        return String::new();
    }
    format!(", {:.4} .. {:.4} deg", least.to_degrees(), greatest.to_degrees())
}
