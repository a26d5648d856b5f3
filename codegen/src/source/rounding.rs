//! Tolerance of a drawing from the number of decimals of its coordinates.
//!
//! A coordinate written with d decimals has a rounding error of up to half a unit of the last
//! decimal. Because of it, hinge lines that should be parallel or concurrent are so only
//! approximately. The tolerance of the drawing is the distance by which their points may be moved
//! to make this exact.
//!
//! Only drawn coordinates count: outlines, holes, hinge lines and their heights. Centres of mass,
//! point masses and output points are measured or computed, often with more digits.

use crate::arithmetic::hypot;

use super::model::{Body, Joint, Shape};
use super::units::Unit;

/// Upper bound of the default, relative to the drawing's size.
pub(super) const LARGEST_SHARE: f64 = 1e-4;
/// Default for drawings whose coordinates are whole numbers, relative to the drawing's size.
const WHOLE: f64 = 1e-9;
/// Coordinates below this bound, relative to the drawing's size, are zeros with the rounding error
/// of a program.
const NOISE: f64 = 1e-12;
/// Decimal digits that a double always holds; further digits are rounding errors.
const RELIABLE_DIGITS: usize = 15;
/// A number with at most this many digits apart from such rounding errors is taken without them.
const MAX_WRITTEN_DIGITS: usize = 12;

/// The decimals of every drawn coordinate.
#[derive(Default)]
pub(super) struct Decimals(Vec<Written>);

/// A coordinate with decimals.
struct Written {
    /// Absolute value, m.
    magnitude: f64,
    /// One unit of its last decimal, m.
    unit: f64,
}

impl Decimals {
    /// Records a coordinate with its text and unit.
    pub fn note(&mut self, number: &str, unit: Unit) {
        let decimals = decimals(number);
        if decimals > 0 {
            let magnitude = unit.to_si(number).abs();
            self.0.push(Written { magnitude, unit: unit.to_si(&format!("1e-{decimals}")) });
        }
    }

    /// Returns the default tolerance of a drawing, m: half a unit of the last decimal.
    pub fn tolerance(&self, bodies: &[Body], joints: &[Joint]) -> f64 {
        let size = size(bodies, joints);
        let significant = self.0.iter().filter(|written| written.magnitude >= NOISE * size);
        let finest = significant.map(|written| written.unit).fold(f64::INFINITY, f64::min);
        if finest.is_finite() { (0.5 * finest).min(LARGEST_SHARE * size) } else { WHOLE * size }
    }
}

/// Returns the diagonal of the bounding box of all outlines and hinge lines, m.
pub(super) fn size(bodies: &[Body], joints: &[Joint]) -> f64 {
    let outlines = bodies.iter().flat_map(|body| match &body.shape {
        Shape::Plates(layers) => layers.as_slice(),
        Shape::None | Shape::Rigid { .. } => &[],
    });
    let corners = outlines.flatten().flat_map(|plate| &plate.outline.value);
    let ends = joints.iter().flat_map(|joint| &joint.axis.value);
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for point in corners.chain(ends) {
        for axis in 0..2 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }
    let diagonal = hypot(high[0] - low[0], high[1] - low[1]);
    if diagonal.is_finite() { diagonal } else { 0.0 }
}

/// Returns the number of decimals, 0 for a whole number. Programs write whole numbers as `30.0`,
/// and 0.3 as `0.30000000000000004`; these decimals say nothing about the precision of the
/// coordinate.
fn decimals(number: &str) -> i64 {
    let (mantissa, exponent) = parts(number);
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    if digits.trim_start_matches('0').len() > RELIABLE_DIGITS
        && let Ok(value) = number.parse::<f64>()
    {
        let reliable = format!("{value:.*e}", RELIABLE_DIGITS - 1);
        let (mantissa, exponent) = parts(&reliable);
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let fraction = fraction.trim_end_matches('0');
        if whole.len() + fraction.len() <= MAX_WRITTEN_DIGITS {
            return (fraction.len() as i64 - exponent).max(0);
        }
    }
    let fraction = mantissa.split_once('.').map_or("", |(_, fraction)| fraction);
    let fraction = if fraction == "0" { "" } else { fraction };
    (fraction.len() as i64 - exponent).max(0)
}

/// Splits the text of a number into mantissa and exponent.
fn parts(number: &str) -> (&str, i64) {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    // Exponents beyond those of a double are reported elsewhere.
    (mantissa, exponent.parse::<i64>().unwrap_or(0).clamp(-400, 400))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn decimals_are_those_written_but_for_a_programs_rounding() {
        for (number, expected) in [
            ("30", 0),
            ("-30.0", 0),
            ("30.", 0),
            ("31.8189", 4),
            ("+31.8000", 4),
            (".5", 1),
            ("-0.05", 2),
            ("1.5e-3", 4),
            ("2e-6", 6),
            ("1.25e1", 1),
            ("1.5e3", 0),
            ("0.30000000000000004", 1),
            ("31.819000000000003", 3),
            ("99.99999999999999", 0),
            ("0.030000000000000002", 2),
            ("-0.4974452554744527", 16),
            ("-0.029306516282004123", 18),
            ("12.345678901234", 12),
            ("6.123233995736766e-17", 32),
            ("1e-999999999999999999999", 0),
        ] {
            assert_eq!(decimals(number), expected, "{number}");
        }
    }
}
