//! How finely the coordinates of a drawing are written.
//!
//! A coordinate written with d decimals is off by up to half a unit of the last of them. Hinge
//! lines that are meant to be parallel or to meet in one point are so within that only; how far
//! they may be moved to make it exact is the drawing's tolerance.
//!
//! What counts are the coordinates that are drawn: outlines, holes, hinge lines and their heights.
//! Centres of mass, point masses and output points are measured or computed, often with more digits.

use crate::arithmetic::hypot;

use super::model::{Body, Joint, Shape};
use super::units::Unit;

/// The default is at most this share of the drawing's size.
const LARGEST_SHARE: f64 = 1e-4;
/// The default for drawings of whole numbers, over the drawing's size.
const WHOLE: f64 = 1e-9;
/// Coordinates below this share of the size are zeros that a program computed.
const NOISE: f64 = 1e-12;
/// Digits a double holds for certain; what a program prints beyond them is its rounding.
const CERTAIN_DIGITS: usize = 15;
/// A number that has no more digits than this, but for such rounding, was meant without it.
const MEANT_DIGITS: usize = 12;

/// The decimals of every drawn coordinate.
#[derive(Default)]
pub(super) struct Decimals(Vec<Written>);

/// A coordinate with decimals.
struct Written {
    /// Its magnitude, m.
    magnitude: f64,
    /// One unit of its last decimal, m.
    unit: f64,
}

impl Decimals {
    /// Notes a coordinate by its text and the unit it is in.
    pub fn note(&mut self, number: &str, unit: Unit) {
        let decimals = decimals(number);
        if decimals > 0 {
            let magnitude = unit.to_si(number).abs();
            self.0.push(Written { magnitude, unit: unit.to_si(&format!("1e-{decimals}")) });
        }
    }

    /// The tolerance of a drawing that gives none, m: half a unit of the last decimal used.
    pub fn tolerance(&self, bodies: &[Body], joints: &[Joint]) -> f64 {
        let size = size(bodies, joints);
        let meant = self.0.iter().filter(|written| written.magnitude >= NOISE * size);
        let finest = meant.map(|written| written.unit).fold(f64::INFINITY, f64::min);
        if finest.is_finite() { (0.5 * finest).min(LARGEST_SHARE * size) } else { WHOLE * size }
    }
}

/// Diagonal of the box around all outlines and hinge lines as drawn, m.
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

/// How many decimals a number has, 0 when it is whole. Programs write whole numbers as `30.0`, and
/// 0.3 as `0.30000000000000004`: neither says how finely the coordinate is known.
fn decimals(number: &str) -> i64 {
    let (mantissa, exponent) = parts(number);
    let digits: String = mantissa.chars().filter(char::is_ascii_digit).collect();
    if digits.trim_start_matches('0').len() > CERTAIN_DIGITS
        && let Ok(value) = number.parse::<f64>()
    {
        let certain = format!("{value:.*e}", CERTAIN_DIGITS - 1);
        let (mantissa, exponent) = parts(&certain);
        let (whole, fraction) = mantissa.split_once('.').unwrap_or((mantissa, ""));
        let fraction = fraction.trim_end_matches('0');
        if whole.len() + fraction.len() <= MEANT_DIGITS {
            return (fraction.len() as i64 - exponent).max(0);
        }
    }
    let fraction = mantissa.split_once('.').map_or("", |(_, fraction)| fraction);
    let fraction = if fraction == "0" { "" } else { fraction };
    (fraction.len() as i64 - exponent).max(0)
}

/// Mantissa and exponent of a number as written.
fn parts(number: &str) -> (&str, i64) {
    let (mantissa, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
    // Exponents beyond those of a double are refused elsewhere.
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
