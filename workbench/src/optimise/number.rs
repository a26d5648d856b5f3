//! A number of a design with its derivatives by the variables.

use nalgebra::RowDVector;

/// A number, SI or without a unit, with its derivatives by the variables.
#[derive(Clone, Debug, PartialEq)]
pub struct Number {
    /// The number.
    pub value: f64,
    /// Its derivatives.
    pub slope: RowDVector<f64>,
}

impl Number {
    /// A number that does not depend on the variables.
    pub fn constant(value: f64, variables: usize) -> Self {
        Self { value, slope: RowDVector::zeros(variables) }
    }

    /// The number plus a factor times another one.
    pub fn plus(&self, factor: f64, other: &Self) -> Self {
        Self {
            value: self.value + factor * other.value,
            slope: &self.slope + factor * &other.slope,
        }
    }

    /// The number less another one, times a factor.
    pub fn scaled(&self, less: f64, factor: f64) -> Self {
        Self { value: factor * (self.value - less), slope: factor * &self.slope }
    }
}

/// The length of a vector of numbers; where it is zero, its derivatives are zero too.
pub fn length(parts: &[Number]) -> Number {
    if let [only] = parts {
        return only.clone();
    }
    let value = parts.iter().map(|part| part.value * part.value).sum::<f64>().sqrt();
    let variables = parts.first().map_or(0, |part| part.slope.len());
    let mut length = Number::constant(value, variables);
    if value > 0.0 {
        parts.iter().for_each(|part| length.slope += part.value / value * &part.slope);
    }
    length
}
