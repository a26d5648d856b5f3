//! Every identifier of generated code is made here.

use std::collections::HashMap;

use crate::program::Signature;
use crate::source::is_keyword;

/// Types of a generated Rust module besides the mechanism's: of its parameters, of its inputs, and
/// of its numbers.
pub const RUST_TYPES: [&str; 3] = ["Params", "Inputs", "S"];

/// `four_bar` -> `FourBar`, which is none of [`RUST_TYPES`].
pub fn type_name(name: &str) -> String {
    let mut camel = String::new();
    for word in name.split('_').filter(|word| !word.is_empty()) {
        let mut letters = word.chars();
        camel.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        camel.push_str(letters.as_str());
    }
    // `_1a` is an identifier, `1a` is none.
    if !camel.starts_with(|c: char| c.is_ascii_alphabetic()) {
        camel.insert_str(0, "Model");
    } else if RUST_TYPES.contains(&camel.as_str()) {
        camel.push_str("Model");
    }
    camel
}

/// What the locals of a function must not be called: its arguments, its outputs, and the `helpers`
/// that bodies in its language call.
pub fn reserved(
    signature: &Signature,
    helpers: impl IntoIterator<Item = &'static str>,
) -> Vec<&'static str> {
    let inputs = signature.inputs.iter().map(|input| input.name());
    let outputs = signature.outputs.iter().map(|output| output.name);
    inputs.chain(outputs).chain(helpers).collect()
}

/// Gives out identifiers in snake case, each once.
#[derive(Debug, Default)]
pub struct Names {
    /// What was given out or is reserved, and the number it was last given out with.
    taken: HashMap<String, usize>,
}

impl Names {
    /// No identifier is given out twice, nor any of `reserved`.
    pub fn reserving(reserved: &[&str]) -> Self {
        Self { taken: reserved.iter().map(|&name| (name.to_owned(), 1)).collect() }
    }

    /// An identifier for `name`: in lower case, numbered when it was given out before or is a
    /// keyword.
    pub fn give(&mut self, name: &str) -> String {
        let lower = name.to_ascii_lowercase();
        let mut candidate = lower.clone();
        let mut count = self.taken.get(&lower).copied().unwrap_or(1);
        while is_keyword(&candidate) || self.taken.contains_key(&candidate) {
            count += 1;
            candidate = format!("{lower}_{count}");
        }
        self.taken.insert(candidate.clone(), 1);
        self.taken.insert(lower, count);
        candidate
    }
}

#[cfg(test)]
mod tests {
    use super::{Names, type_name};

    #[test]
    fn names_are_given_once_and_types_are_camels() {
        let mut names = Names::reserving(&["q"]);
        let given = ["q", "Left", "left", "left_2"].map(|name| names.give(name));
        assert_eq!(given, ["q_2", "left", "left_2", "left_2_2"]);
        assert_eq!(["Type", "Double"].map(|name| names.give(name)), ["type_2", "double_2"]);
        assert_eq!(type_name("m4th_design"), "M4thDesign");
        assert_eq!(["_1a", "__"].map(type_name), ["Model1a", "Model"]);
        let clashing = ["params", "in_puts", "s"].map(type_name);
        assert_eq!(clashing, ["ParamsModel", "InPuts", "SModel"]);
    }
}
