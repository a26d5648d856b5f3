//! The model's numbers enter the equations, and their names the table of [`Fact`]s.

use super::binder::Binder;
use crate::program::{Fact, Quantity, Subject};
use crate::symbolic::Expr;
use crate::topology::NodeId;

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
