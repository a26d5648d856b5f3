//! Numbers given on a command line: bare, or with a unit whose dimension is known.

use std::f64::consts::TAU;

use super::units::{ANGLE, Dimension, SI, Unit, parse_unit, split_quantity};

/// Angles beyond a turn by more than this share of it: a full turn written with a few digits is none.
const ROUNDED: f64 = 1e-3;

/// What bare angles are in: a model's `units.angle`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AngleUnit(pub(super) Unit);

impl Default for AngleUnit {
    fn default() -> Self {
        Self(SI)
    }
}

impl AngleUnit {
    /// The value in radians of a number in this unit, or with a unit of angle of its own.
    pub fn read(self, text: &str) -> Option<f64> {
        read(text, Some(ANGLE.dimension), self.0)
    }

    /// Whether bare angles are radians.
    pub fn is_radian(self) -> bool {
        self.0 == SI
    }
}

/// Whether a text is a number without a unit.
pub fn is_bare(text: &str) -> bool {
    split_quantity(text.trim()).is_some_and(|(_, unit)| unit.is_empty())
}

/// What there is to say of a bare angle, rad, of more than a turn: it may have been meant in degrees.
pub fn beyond_a_turn(angle: f64) -> Option<String> {
    let turns = angle.abs() / TAU;
    (turns > 1.0 + ROUNDED)
        .then(|| format!("{angle} rad {} {turns:.1} turns", if turns < 2.0 { "is" } else { "are" }))
}

/// The value in SI of a number with any unit; bare numbers are SI.
pub fn read_quantity(text: &str) -> Option<f64> {
    read(text, None, SI)
}

/// The value in radians of a number with a unit of angle; bare numbers are radians.
pub fn read_angle(text: &str) -> Option<f64> {
    AngleUnit::default().read(text)
}

/// The value in SI of a number with a unit of the dimension of `unit`; bare numbers are SI.
///
/// # Errors
/// What was expected.
pub fn read_in(text: &str, unit: &str) -> Result<f64, String> {
    let dimension = parse_unit(unit).ok().map(|unit| unit.dimension);
    read(text, dimension, SI)
        .ok_or_else(|| format!("expected a number, bare or with a unit as in `1 {unit}`"))
}

/// The value in SI of a number that is to have a dimension, where one is known; bare numbers are SI.
///
/// # Errors
/// What is wrong, and what would be right.
pub fn read_as(text: &str, dimension: Option<Dimension>) -> Result<f64, String> {
    if let Some(value) = read(text, dimension, SI) {
        return Ok(value);
    }
    let unit = split_quantity(text.trim()).and_then(|(_, unit)| parse_unit(unit).ok());
    match (unit, dimension) {
        (Some(unit), Some(dimension)) if unit.dimension != dimension => Err(format!(
            "expected {dimension}, found {}; write a bare number (SI), or one in {}",
            unit.dimension,
            dimension.examples()
        )),
        _ => Err("expected a number, bare (SI) or with a unit".to_owned()),
    }
}

/// A number in its own unit or, bare, in that of `bare`.
fn read(text: &str, dimension: Option<Dimension>, bare: Unit) -> Option<f64> {
    let (number, unit) = split_quantity(text.trim())?;
    if unit.is_empty() {
        return Some(bare.to_si(number)).filter(|value| value.is_finite());
    }
    let unit = parse_unit(unit).ok()?;
    let fits = dimension.is_none_or(|dimension| unit.dimension == dimension);
    Some(unit.to_si(number)).filter(|value| fits && value.is_finite())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::source::units::{STIFFNESS, find};

    #[test]
    fn bare_angles_are_in_the_unit_of_the_model() {
        let degrees = AngleUnit(find("deg").unwrap());
        assert_eq!(degrees.read("90"), Some(TAU / 4.0));
        assert_eq!(degrees.read(" 1.5 rad"), Some(1.5));
        assert_eq!(AngleUnit::default().read("90"), Some(90.0));
        assert_eq!((degrees.read("1 mm"), degrees.read("a")), (None, None));
    }

    #[test]
    fn dimensions_are_kept() {
        let stiffness = Some(STIFFNESS.dimension);
        assert_eq!(read_as("11.4 mN*m/rad", stiffness), Ok(0.0114));
        assert_eq!(read_as("2", stiffness), Ok(2.0));
        assert_eq!(read_as("3deg", None), Ok(3_f64.to_radians()));
        let refused = read_as("3deg", stiffness).unwrap_err();
        assert!(refused.contains("expected a rotational stiffness, found an angle"), "{refused}");
        assert!(refused.contains("`N*m/rad`"), "{refused}");
        assert!(read_as("stiff", stiffness).is_err());
    }

    #[test]
    fn more_than_a_turn() {
        assert_eq!(beyond_a_turn(TAU + 1e-3), None);
        assert_eq!(beyond_a_turn(-30.0).as_deref(), Some("-30 rad are 4.8 turns"));
        assert_eq!(beyond_a_turn(7.0).as_deref(), Some("7 rad is 1.1 turns"));
    }
}
