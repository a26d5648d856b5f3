//! Numbers on a command line: without a unit, or with a unit whose dimension is known.

use std::f64::consts::TAU;

use serde::{Deserialize, Serialize};

use super::units::{ANGLE, Dimension, SI, Unit, parse_unit, split_quantity};

/// Relative tolerance for a full turn that is written with a few digits.
const ROUNDED: f64 = 1e-3;

/// The unit of angles that are written without a unit: a model's `units.angle`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct AngleUnit(pub(super) Unit);

impl Default for AngleUnit {
    fn default() -> Self {
        Self(SI)
    }
}

impl AngleUnit {
    /// Reads a number in this unit, or with its own unit of angle, in radians.
    pub fn read(self, text: &str) -> Option<f64> {
        read(text, Some(ANGLE.dimension), self.0)
    }

    /// Returns whether angles without a unit are radians.
    pub fn is_radian(self) -> bool {
        self.0 == SI
    }
}

/// Returns whether a text is a number without a unit.
pub fn has_no_unit(text: &str) -> bool {
    split_quantity(text.trim()).is_some_and(|(_, unit)| unit.is_empty())
}

/// Returns a remark on an angle (rad) of more than a full turn, which was perhaps meant in degrees.
pub fn beyond_a_turn(angle: f64) -> Option<String> {
    let turns = angle.abs() / TAU;
    (turns > 1.0 + ROUNDED)
        .then(|| format!("{angle} rad {} {turns:.1} turns", if turns < 2.0 { "is" } else { "are" }))
}

/// Reads a number with any unit, in SI; numbers without a unit are in SI.
pub fn read_quantity(text: &str) -> Option<f64> {
    read(text, None, SI)
}

/// Reads a number with a unit of angle, in radians; numbers without a unit are in radians.
pub fn read_angle(text: &str) -> Option<f64> {
    AngleUnit::default().read(text)
}

/// Reads a number with a unit of the same dimension as `unit`, in SI; numbers without a unit are in
/// SI.
///
/// # Errors
/// Returns a message that says what was expected.
pub fn read_in(text: &str, unit: &str) -> Result<f64, String> {
    let dimension = parse_unit(unit).ok().map(|unit| unit.dimension);
    read(text, dimension, SI)
        .ok_or_else(|| format!("expected a number, with or without a unit, as in `1 {unit}`"))
}

/// Reads a number that must have a dimension, if one is known, in SI; numbers without a unit are in
/// SI.
///
/// # Errors
/// Returns a message that says what is wrong and what was expected.
pub fn read_as(text: &str, dimension: Option<Dimension>) -> Result<f64, String> {
    if let Some(value) = read(text, dimension, SI) {
        return Ok(value);
    }
    let unit = split_quantity(text.trim()).and_then(|(_, unit)| parse_unit(unit).ok());
    match (unit, dimension) {
        (Some(unit), Some(dimension)) if unit.dimension != dimension => Err(format!(
            "expected {dimension}, found {}; write a number in SI without a unit, or one in {}",
            unit.dimension,
            dimension.examples()
        )),
        _ => Err("expected a number with a unit, or in SI without a unit".to_owned()),
    }
}

/// Reads a number in its own unit or, if it has none, in `default`.
fn read(text: &str, dimension: Option<Dimension>, default: Unit) -> Option<f64> {
    let (number, unit) = split_quantity(text.trim())?;
    if unit.is_empty() {
        return Some(default.to_si(number)).filter(|value| value.is_finite());
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
    fn angles_without_a_unit_are_in_the_unit_of_the_model() {
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
