//! Prints the runtime's constants as macros.

use lamc_runtime::constants::{Constant, Value};
use serde::Serialize;

use super::Real;
use super::body::constant as number;
use crate::backend::text::wrap;

/// A macro and the comment that stands above it.
#[derive(Debug, Serialize)]
pub struct Definition {
    comment: Vec<String>,
    name: &'static str,
    value: String,
}

/// Returns the macro that defines the constant in the number type `real`.
pub fn define(constant: &Constant, real: Real) -> Definition {
    let value = match constant.value {
        Value::Number(value) => number(real, value),
        Value::Tolerance(tolerance) => {
            let [least, epsilons] =
                [tolerance.constant, tolerance.epsilons].map(|value| number(real, value));
            format!("tolerance({least}, {epsilons})")
        }
        Value::Bits(bits) => format!("{bits:#x}ULL"),
        Value::Count(count) => count.to_string(),
    };
    let meaning = constant.doc.split("\n\n").next().unwrap_or_default();
    let words: Vec<_> = meaning.split_whitespace().collect();
    let mut comment = Vec::new();
    wrap(&format!("/* {} */", words.join(" ")), &mut comment);
    Definition { comment, name: constant.name, value }
}
