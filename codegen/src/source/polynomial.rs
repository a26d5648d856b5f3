//! Polynomials of a hinge's length l, width w and body area a, SI.

use serde::{Deserialize, Serialize};

use crate::arithmetic::powi;

/// A term: coefficient l^i w^j a^k.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Term {
    /// The coefficient.
    pub coefficient: f64,
    /// Exponents of l, w, a.
    pub powers: [u8; 3],
}

/// A sum of terms.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Polynomial(pub Vec<Term>);

impl Term {
    /// Returns l^i w^j a^k at (l, w, a) in m, m, m^2.
    pub fn monomial(&self, at: [f64; 3]) -> f64 {
        self.powers.iter().zip(at).map(|(&power, x)| powi(x, power.into())).product()
    }
}

impl Polynomial {
    /// Creates a polynomial from coefficients with the exponents of l, w and a.
    pub fn new(terms: &[(f64, [u8; 3])]) -> Self {
        let term = |&(coefficient, powers): &(f64, [u8; 3])| Term { coefficient, powers };
        Self(terms.iter().map(term).collect())
    }

    /// Returns its value at (l, w, a) in m, m, m^2.
    pub fn value(&self, at: [f64; 3]) -> f64 {
        self.0.iter().map(|term| term.coefficient * term.monomial(at)).sum()
    }

    /// Splits the polynomial into the terms with a and those without.
    pub fn split_area(&self) -> (Self, Self) {
        let (with, without) = self.0.iter().partition(|term: &&Term| term.powers[2] > 0);
        (Self(with), Self(without))
    }
}
