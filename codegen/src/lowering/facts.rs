//! The numbers of the model by name, for the table of constants of the generated code.

use crate::arithmetic::powi;
use crate::kane::{Binding, Equations, Leaf};
use crate::program::Fact;
use crate::symbolic::Tree;

/// The named numbers of the derivation, and the intermediates that are numbers.
pub fn facts(equations: &Equations) -> Vec<Fact> {
    let mut known: Vec<Option<f64>> = Vec::with_capacity(equations.bindings.len());
    let mut facts = equations.facts.clone();
    for Binding { name, section, tree } in &equations.bindings {
        let value = number(tree, &known);
        known.push(value);
        facts.extend(value.map(|value| Fact {
            name: name.clone(),
            quantity: None,
            subject: section.subject,
            value,
        }));
    }
    facts
}

/// The number that an expression is, by those of the intermediates.
fn number(tree: &Tree<Leaf>, known: &[Option<f64>]) -> Option<f64> {
    match tree {
        Tree::Rational(numerator, denominator) => Some(*numerator as f64 / *denominator as f64),
        Tree::Number(value) => Some(*value),
        Tree::Leaf(Leaf::Bound(id)) => known[id.index()],
        Tree::Leaf(_) | Tree::Apply(..) => None,
        Tree::Sum(terms) => terms.iter().map(|term| number(term, known)).sum(),
        Tree::Product(factors) => factors.iter().map(|factor| number(factor, known)).product(),
        Tree::Power(base, exponent) => {
            let exponent = i32::try_from(*exponent).ok()?;
            number(base, known).map(|base| powi(base, exponent))
        }
    }
}
