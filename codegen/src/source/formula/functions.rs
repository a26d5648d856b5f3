//! The functions of expressions: their names and domains.

use crate::source::expression::{Binary, Unary};

/// A function of expressions.
#[derive(Clone, Copy)]
pub(super) enum Function {
    One(Unary),
    Two(Binary),
}

/// Every function by its name.
pub(super) const FUNCTIONS: &[(&str, Function)] = &[
    ("sin", Function::One(Unary::Sin)),
    ("cos", Function::One(Unary::Cos)),
    ("tan", Function::One(Unary::Tan)),
    ("asin", Function::One(Unary::Asin)),
    ("acos", Function::One(Unary::Acos)),
    ("atan", Function::One(Unary::Atan)),
    ("atan2", Function::Two(Binary::Atan2)),
    ("exp", Function::One(Unary::Exp)),
    ("log", Function::One(Unary::Log)),
    ("sqrt", Function::One(Unary::Sqrt)),
    ("abs", Function::One(Unary::Abs)),
    ("sign", Function::One(Unary::Sign)),
    ("step", Function::One(Unary::Step)),
    ("tanh", Function::One(Unary::Tanh)),
    ("min", Function::Two(Binary::Min)),
    ("max", Function::Two(Binary::Max)),
];

/// Returns the domain of a function if it is not all numbers.
pub(super) fn domain(function: Function) -> Option<&'static str> {
    match function {
        Function::One(Unary::Log) => Some("a number greater than 0"),
        Function::One(Unary::Sqrt) => Some("a number that is not negative"),
        Function::One(Unary::Asin | Unary::Acos) => Some("a number from -1 to 1"),
        _ => None,
    }
}

/// Returns the function with this name.
pub(super) fn function(name: &str) -> Option<Function> {
    FUNCTIONS.iter().find(|(known, _)| *known == name).map(|(_, function)| *function)
}

/// Returns true for the names of functions.
pub(in crate::source) fn is_function(name: &str) -> bool {
    function(name).is_some()
}

/// Iterates over the names of all functions.
pub(in crate::source) fn functions() -> impl Iterator<Item = &'static str> {
    FUNCTIONS.iter().map(|(name, _)| *name)
}
