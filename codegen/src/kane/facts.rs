//! The model's numbers enter the equations, and their names the table of [`Fact`]s.

use super::binder::Binder;
use crate::laminate::{Formula, Number, Real};
use crate::program::{Fact, Phase, Quantity, Section, Subject};
use crate::symbolic::{Expr, Function};
use crate::topology::NodeId;

/// Axes of a vector, and of the entries of a symmetric tensor.
pub const AXES: [&str; 3] = ["x", "y", "z"];
pub const SYMMETRIC: [&str; 6] = ["xx", "xy", "xz", "yy", "yz", "zz"];

/// Name of an intermediate of a number of the drawing.
const PART: &str = "drawn";

impl Binder<'_> {
    /// Returns a number of a node, exactly, and records its name: `mass_south`.
    pub fn fact(&mut self, node: NodeId, quantity: Quantity, value: impl Into<Number>) -> Expr {
        let [expression] = self.facts_of(node, quantity, [""], [value]);
        expression
    }

    /// Returns the components of a quantity of a node and records their names: `offset_south_x`.
    pub fn facts_of<const K: usize>(
        &mut self,
        node: NodeId,
        quantity: Quantity,
        axes: [&str; K],
        values: [impl Into<Number>; K],
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
        values: [impl Into<Number>; K],
    ) -> [Expr; K] {
        let mut axes = axes.into_iter();
        values.map(|value| {
            let parts = [&*quantity.name, owner, axes.next().unwrap_or_default()];
            let parts: Vec<&str> = parts.into_iter().filter(|part| !part.is_empty()).collect();
            let (name, number) = (parts.join("_"), value.into());
            if number.formula().is_some() {
                return self.number(&number, &name);
            }
            let value = number.value();
            self.name(Fact { name, quantity: Some(quantity.clone()), subject, value });
            self.constant(value)
        })
    }

    /// Returns a number of the drawing, and binds it to this name if it depends on parameters.
    pub fn number(&mut self, number: &Number, name: &str) -> Expr {
        let Some(formula) = number.formula() else { return self.constant(number.value()) };
        if let Some(known) = self.drawn(formula) {
            return known;
        }
        let value = match &**formula {
            Formula::Given(formula) => self.formula(formula, name, None),
            Formula::Sum(x, y) => &self.number(x, PART) + &self.number(y, PART),
            Formula::Difference(x, y) => &self.number(x, PART) - &self.number(y, PART),
            Formula::Product(x, y) => &self.number(x, PART) * &self.number(y, PART),
            Formula::Quotient(x, y) => &self.number(x, PART) * &self.number(y, PART).power(-1),
            Formula::Root(x) => Expr::apply(Function::Sqrt, &[self.number(x, PART)]),
        };
        let bound = self.bind(Section::mechanism(Phase::Drawing), name.to_owned(), value);
        self.note_drawn(formula, &bound);
        bound
    }
}
