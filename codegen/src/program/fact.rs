//! Facts: the named numbers of the model.
//!
//! The algebra computes only with the numbers. The generated code has a table of their names, which
//! tells a reader where each number comes from.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::section::Subject;

/// A number of the model.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Fact {
    /// Name, for example `offset_south_x`.
    pub name: String,
    /// Quantity that the number measures. Numbers in formulas and intermediates have none: they are
    /// named after the formula or the intermediate.
    pub quantity: Option<Quantity>,
    /// The body, the loop or the mechanism that it belongs to.
    pub subject: Subject,
    /// Value, in SI units.
    pub value: f64,
}

/// A kind of facts, with the prefix of their names and their meaning.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Quantity {
    /// Prefix of the facts' names.
    pub name: Cow<'static, str>,
    /// Meaning, with the unit.
    pub meaning: Cow<'static, str>,
}

impl Quantity {
    /// Returns a kind of facts with this prefix and this meaning.
    pub const fn new(name: &'static str, meaning: &'static str) -> Self {
        Self { name: Cow::Borrowed(name), meaning: Cow::Borrowed(meaning) }
    }
}
