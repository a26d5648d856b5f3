//! Makes every identifier of the generated code.

use std::collections::HashMap;

use crate::program::Signature;
use crate::source::is_keyword;

/// Types of a generated Rust module besides the mechanism's type: its parameters, its inputs, and its
/// number type.
pub const RUST_TYPES: [&str; 3] = ["Params", "Inputs", "S"];

/// Returns a type name in camel case (`four_bar` -> `FourBar`) that differs from all [`RUST_TYPES`].
pub fn type_name(name: &str) -> String {
    let mut camel = String::new();
    for word in name.split('_').filter(|word| !word.is_empty()) {
        let mut letters = word.chars();
        camel.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        camel.push_str(letters.as_str());
    }
    // `_1a` is an identifier, but `1a` is not.
    if !camel.starts_with(|c: char| c.is_ascii_alphabetic()) {
        camel.insert_str(0, "Model");
    } else if RUST_TYPES.contains(&camel.as_str()) {
        camel.push_str("Model");
    }
    camel
}

/// Returns the names that local variables of a function must not have: its arguments, its outputs, and
/// the `helpers` that function bodies in the target language call.
pub fn reserved(
    signature: &Signature,
    helpers: impl IntoIterator<Item = &'static str>,
) -> Vec<&'static str> {
    let inputs = signature.inputs.iter().map(|input| input.name());
    let outputs = signature.outputs.iter().map(|output| output.name);
    inputs.chain(outputs).chain(helpers).collect()
}

/// Makes identifiers in snake case and never returns the same one twice.
#[derive(Debug, Default)]
pub struct Names {
    /// Every name that was returned or is reserved, with the last number that was appended to it.
    taken: HashMap<String, usize>,
}

impl Names {
    /// Creates a generator of identifiers that never returns one of `reserved`.
    pub fn reserving(reserved: &[&str]) -> Self {
        Self { taken: reserved.iter().map(|&name| (name.to_owned(), 1)).collect() }
    }

    /// Returns an identifier for `name` in lower case. A number is appended if the identifier was
    /// returned before, is reserved, or is a keyword.
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
