//! Facts: the numbers of the model under their names.
//!
//! The algebra computes with the numbers alone. The generated code has a table of their names, from which a
//! reader sees where each number comes from.

use super::binder::Binder;
use super::section::Subject;
use crate::symbolic::Expr;
use crate::topology::NodeId;

/// A number of the model.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    /// `offset_south_x`.
    pub name: String,
    /// What it is; a number of a formula, or of an intermediate, has the name of that.
    pub quantity: Option<Quantity>,
    /// What it belongs to.
    pub subject: Subject,
    /// In SI units.
    pub value: f64,
}

/// What facts of a kind are called and what they are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Quantity {
    /// The beginning of their names.
    pub name: &'static str,
    /// With the unit.
    pub meaning: &'static str,
}

/// Axes of a vector, and of the entries of a symmetric tensor.
pub const AXES: [&str; 3] = ["x", "y", "z"];
pub const SYMMETRIC: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];

impl Binder<'_> {
    /// A number of a node, exactly: `mass_south`.
    pub fn fact(&mut self, node: NodeId, quantity: Quantity, value: f64) -> Expr {
        let [expression] = self.facts_of(node, quantity, [""], [value]);
        expression
    }

    /// Numbers of a node, componentwise: `offset_south_x`.
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

    /// Numbers of a subject that is called `owner`, componentwise.
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
            let parts = [quantity.name, owner, axes.next().unwrap_or_default()];
            let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            let name = parts.join("_");
            self.name(Fact { name, quantity: Some(quantity), subject, value });
            self.constant(value)
        })
    }
}
