//! Numbers that remember how they follow from the parameters.
//!
//! The code that computes with numbers of the drawing is generic: with `f64` it computes values, with [`Number`]
//! formulas too. What a formula is everywhere, such as zero, cannot be seen in one value of it: a number is
//! known at several points of the space of the parameters.

use std::iter::Sum;
use std::ops::{Add, AddAssign, Div, DivAssign, Mul, MulAssign, Neg, Sub, SubAssign};
use std::sync::Arc;

use nalgebra::{ClosedAddAssign, ClosedDivAssign, ClosedMulAssign, ClosedSubAssign, Scalar};
use num_traits::{One, Zero};

use crate::source::Expression;

/// Number of points in the space of the parameters at which numbers are known. The first is that of the defaults.
pub const POINTS: usize = 3;

/// Numbers that the drawing's quantities are computed with.
pub trait Real:
    Scalar
    + Zero
    + One
    + ClosedAddAssign
    + ClosedSubAssign
    + ClosedMulAssign
    + ClosedDivAssign
    + Neg<Output = Self>
    + Sum
    + From<f64>
{
    /// Returns the square root.
    fn root(&self) -> Self;

    /// Returns the value at the defaults of the parameters.
    fn value(&self) -> f64;
}

impl Real for f64 {
    fn root(&self) -> Self {
        self.sqrt()
    }

    fn value(&self) -> f64 {
        *self
    }
}

/// A number, with its formula if it depends on parameters.
#[derive(Clone, Debug)]
pub struct Number {
    at: [f64; POINTS],
    formula: Option<Arc<Formula>>,
}

/// How a number follows from others.
#[derive(Debug)]
#[allow(missing_docs, reason = "each is the operation of its name")]
pub enum Formula {
    /// A formula of the file.
    Given(Expression),
    Sum(Number, Number),
    Difference(Number, Number),
    Product(Number, Number),
    Quotient(Number, Number),
    Root(Number),
}

impl Number {
    /// Creates the number of a formula of the file, whose values at the points are `at`.
    pub fn given(formula: &Expression, at: [f64; POINTS]) -> Self {
        Self { at, formula: Some(Arc::new(Formula::Given(formula.clone()))) }
    }

    /// Returns its formula, if it depends on parameters.
    pub fn formula(&self) -> Option<&Arc<Formula>> {
        self.formula.as_ref()
    }

    /// Returns its largest magnitude at the points.
    pub fn magnitude(&self) -> f64 {
        self.at.iter().fold(0.0, |largest, x| x.abs().max(largest))
    }

    /// Returns zero if its magnitude is at most `least` at all points, otherwise itself.
    pub fn rounded(self, least: f64) -> Self {
        if self.magnitude() <= least { Self::zero() } else { self }
    }

    fn is(&self, value: f64) -> bool {
        self.formula.is_none() && self.at[0] == value
    }

    fn combine(
        self,
        other: Self,
        apply: impl Fn(f64, f64) -> f64,
        formula: fn(Self, Self) -> Formula,
    ) -> Self {
        let at = std::array::from_fn(|point| apply(self.at[point], other.at[point]));
        let depends = self.formula.is_some() || other.formula.is_some();
        Self { at, formula: depends.then(|| Arc::new(formula(self, other))) }
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Self { at: [value; POINTS], formula: None }
    }
}

/// Numbers are equal if their values are, and if they follow from the same formula.
impl PartialEq for Number {
    fn eq(&self, other: &Self) -> bool {
        let same = match (&self.formula, &other.formula) {
            (None, None) => true,
            (Some(own), Some(other)) => Arc::ptr_eq(own, other),
            _ => false,
        };
        same && self.at == other.at
    }
}

impl Real for Number {
    fn root(&self) -> Self {
        let formula = self.formula.is_some().then(|| Arc::new(Formula::Root(self.clone())));
        Self { at: self.at.map(f64::sqrt), formula }
    }

    fn value(&self) -> f64 {
        self.at[0]
    }
}

impl Add for Number {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match () {
            () if self.is(0.0) && other.formula.is_some() => other,
            () if other.is(0.0) && self.formula.is_some() => self,
            () => self.combine(other, |x, y| x + y, Formula::Sum),
        }
    }
}

impl Sub for Number {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        match () {
            () if other.is(0.0) && self.formula.is_some() => self,
            () => self.combine(other, |x, y| x - y, Formula::Difference),
        }
    }
}

impl Mul for Number {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        match () {
            () if self.is(1.0) || (other.is(0.0) && self.formula.is_some()) => other,
            () if other.is(1.0) || (self.is(0.0) && other.formula.is_some()) => self,
            () => self.combine(other, |x, y| x * y, Formula::Product),
        }
    }
}

impl Div for Number {
    type Output = Self;

    fn div(self, other: Self) -> Self {
        match () {
            () if other.is(1.0) || (self.is(0.0) && other.formula.is_some()) => self,
            () => self.combine(other, |x, y| x / y, Formula::Quotient),
        }
    }
}

impl Neg for Number {
    type Output = Self;

    fn neg(self) -> Self {
        match self.formula {
            None => Self { at: self.at.map(f64::neg), formula: None },
            Some(_) => Self::from(-1.0) * self,
        }
    }
}

impl AddAssign for Number {
    fn add_assign(&mut self, other: Self) {
        *self = self.clone() + other;
    }
}

impl SubAssign for Number {
    fn sub_assign(&mut self, other: Self) {
        *self = self.clone() - other;
    }
}

impl MulAssign for Number {
    fn mul_assign(&mut self, other: Self) {
        *self = self.clone() * other;
    }
}

impl DivAssign for Number {
    fn div_assign(&mut self, other: Self) {
        *self = self.clone() / other;
    }
}

impl Sum for Number {
    fn sum<I: Iterator<Item = Self>>(numbers: I) -> Self {
        numbers.fold(Self::zero(), |sum, number| sum + number)
    }
}

impl Zero for Number {
    fn zero() -> Self {
        Self::from(0.0)
    }

    fn is_zero(&self) -> bool {
        self.is(0.0)
    }
}

impl One for Number {
    fn one() -> Self {
        Self::from(1.0)
    }
}
