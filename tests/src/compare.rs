//! Comparisons of numbers that keep NaN: a value that is not a number must fail a test.
//!
//! `f64::max(0.0, NAN)` is 0, so a maximum folded with it passes any bound if all its values are NaN.

use std::borrow::Borrow;

/// The largest of the values, at least `-inf`; NaN if one of them is NaN.
pub fn maximum(values: impl IntoIterator<Item = impl Borrow<f64>>) -> f64 {
    values.into_iter().fold(f64::NEG_INFINITY, |most, value| keep_largest(most, *value.borrow()))
}

/// The largest magnitude, 0 of no values; NaN if one of them is NaN.
pub fn largest(values: impl IntoIterator<Item = impl Borrow<f64>>) -> f64 {
    values.into_iter().fold(0.0, |most, value| keep_largest(most, value.borrow().abs()))
}

/// The larger of two numbers; NaN if one of them is NaN.
pub fn keep_largest(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The largest difference between two vectors; NaN if a component is NaN.
///
/// # Panics
/// When the lengths differ.
pub fn largest_difference(left: &[f64], right: &[f64]) -> f64 {
    assert_eq!(left.len(), right.len(), "vectors of different lengths");
    largest(left.iter().zip(right).map(|(x, y)| x - y))
}

/// The largest difference over the largest magnitude of the right side: 0 if both sides are equal, and
/// infinite if only the right side is zero.
///
/// # Panics
/// When the lengths differ.
pub fn relative_error(left: &[f64], right: &[f64]) -> f64 {
    let error = largest_difference(left, right);
    if error == 0.0 { 0.0 } else { error / largest(right) }
}
