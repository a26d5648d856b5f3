//! Facts: the named numbers of the model.
//!
//! The algebra computes only with the numbers. The generated code has a table of their names, which
//! tells a reader where each number comes from.

use std::borrow::Cow;

use serde::{Deserialize, Serialize};

use super::binder::Binder;
use super::section::Subject;
use crate::symbolic::Expr;
use crate::topology::NodeId;

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

/// Axes of a vector, and of the entries of a symmetric tensor.
pub const AXES: [&str; 3] = ["x", "y", "z"];
pub const SYMMETRIC: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];

impl Binder<'_> {
    /// Returns a number of a node, exactly, and records its name: `mass_south`.
    pub fn fact(&mut self, node: NodeId, quantity: Quantity, value: f64) -> Expr {
        let [expression] = self.facts_of(node, quantity, [""], [value]);
        expression
    }

    /// Returns the components of a quantity of a node and records their names: `offset_south_x`.
    pub fn facts_of<const K: usize>(
        &mut self,
        node: NodeId,
        quantity: Quantity,
        axes: [&str; K],
        values: [f64; K],
    ) -> [Expr; K] {
        let owner = self.node_name(node).to_owned();
        self.facts_about(Subject::Body(node), &owner, quantity, axes, values)
    }

    /// Returns the components of a quantity of a subject with the name `owner`, and records their
    /// names.
    pub fn facts_about<const K: usize>(
        &mut self,
        subject: Subject,
        owner: &str,
        quantity: Quantity,
        axes: [&str; K],
        values: [f64; K],
    ) -> [Expr; K] {
        let mut axes = axes.into_iter();
        values.map(|value| {
            let parts = [&*quantity.name, owner, axes.next().unwrap_or_default()];
            let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            let name = parts.join("_");
            self.name(Fact { name, quantity: Some(quantity.clone()), subject, value });
            self.constant(value)
        })
    }
}
