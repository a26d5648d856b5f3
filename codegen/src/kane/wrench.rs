//! Wrenches: pairs of a force and a moment.

use super::vector::{Vector, add, cross, scale, sub, zero};
use crate::symbolic::Expr;

/// Force (N) and moment (N m) about the origin of a body's frame, in that frame.
#[derive(Clone)]
pub struct Wrench {
    pub force: Vector,
    pub moment: Vector,
}

impl Wrench {
    /// Returns the wrench without force and moment.
    pub fn zero() -> Self {
        Self { force: zero(), moment: zero() }
    }

    /// Returns the wrench of a force at the point `arm`.
    pub fn at(arm: &Vector, force: Vector) -> Self {
        Self { moment: cross(arm, &force), force }
    }

    /// Returns the sum of two wrenches about the same point.
    pub fn plus(&self, other: &Self) -> Self {
        Self { force: add(&self.force, &other.force), moment: add(&self.moment, &other.moment) }
    }

    /// Returns the difference of two wrenches about the same point.
    pub fn minus(&self, other: &Self) -> Self {
        Self { force: sub(&self.force, &other.force), moment: sub(&self.moment, &other.moment) }
    }

    /// Returns the wrench times a factor.
    pub fn times(&self, factor: &Expr) -> Self {
        Self { force: scale(factor, &self.force), moment: scale(factor, &self.moment) }
    }

    /// Returns the opposite wrench.
    pub fn opposite(&self) -> Self {
        let negated = |v: &Vector| v.clone().map(|x| -&x);
        Self { force: negated(&self.force), moment: negated(&self.moment) }
    }
}

/// Adds a wrench to a sum that may be empty.
pub fn accumulate(sum: &mut Option<Wrench>, wrench: Wrench) {
    *sum = Some(match sum.take() {
        Some(other) => other.plus(&wrench),
        None => wrench,
    });
}
