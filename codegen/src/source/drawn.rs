//! Numbers of the drawing, which may follow from parameters.

use serde::{Deserialize, Serialize};

use super::diagnostic::{Span, Spanned};
use super::expression::Expression;

/// Numbers of the drawing, SI. Those with a formula have their values at the defaults of the parameters.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Drawn<T> {
    /// The values.
    pub value: T,
    /// Their position in the source text.
    pub span: Span,
    /// The formulas of parameters, by the place of their number in the value.
    pub formulas: Vec<(usize, Expression)>,
}

/// A value that consists of numbers, each at a place: those of the first row come first.
pub trait Places {
    /// Returns the number at a place.
    ///
    /// # Panics
    /// Panics if there is no such place.
    fn place(&mut self, place: usize) -> &mut f64;

    /// Returns the number at a place.
    ///
    /// # Panics
    /// As [`place`](Self::place).
    fn number(&self, place: usize) -> f64;
}

impl Places for f64 {
    fn place(&mut self, _: usize) -> &mut f64 {
        self
    }

    fn number(&self, _: usize) -> f64 {
        *self
    }
}

impl<const K: usize> Places for [f64; K] {
    fn place(&mut self, place: usize) -> &mut f64 {
        &mut self[place]
    }

    fn number(&self, place: usize) -> f64 {
        self[place]
    }
}

impl<const K: usize, const N: usize> Places for [[f64; K]; N] {
    fn place(&mut self, place: usize) -> &mut f64 {
        &mut self[place / K][place % K]
    }

    fn number(&self, place: usize) -> f64 {
        self[place / K][place % K]
    }
}

impl<const K: usize> Places for Vec<[f64; K]> {
    fn place(&mut self, place: usize) -> &mut f64 {
        &mut self[place / K][place % K]
    }

    fn number(&self, place: usize) -> f64 {
        self[place / K][place % K]
    }
}

impl<T> From<Spanned<T>> for Drawn<T> {
    fn from(Spanned { value, span }: Spanned<T>) -> Self {
        Self { value, span, formulas: Vec::new() }
    }
}

impl<T> Drawn<T> {
    /// Returns whether no number depends on a parameter.
    pub fn is_fixed(&self) -> bool {
        self.formulas.is_empty()
    }

    /// Returns the formula of the number at a place, if it depends on parameters.
    pub fn formula(&self, place: usize) -> Option<&Expression> {
        self.formulas.iter().find(|(at, _)| *at == place).map(|(_, formula)| formula)
    }
}

impl<T: Places> Drawn<T> {
    /// Evaluates the formulas at other values of the parameters.
    pub(super) fn evaluate(&mut self, parameters: &[f64]) {
        for (place, formula) in &self.formulas {
            *self.value.place(*place) = formula.at(parameters).unwrap_or(f64::NAN);
        }
    }
}
