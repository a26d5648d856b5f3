//! Quantities: a number and a unit, checked for dimension and converted to SI and radians.
//!
//! A unit is a product of powers (`mN*m/rad`, `kg m^2`). Powers of ten move the decimal exponent of
//! the number before it is read, so `0.127 mm` is the double nearest to 0.000127, not the product
//! of two rounded ones. Angle is a separate dimension, so `N*m/deg` and `N*m` are different. (`uom`
//! checks dimensions in types; a unit in a text is known only when the file is read.)

use std::f64::consts::PI;
use std::fmt;
use std::ops::Range;

use serde::{Deserialize, Serialize};

/// Dimension of a quantity: exponents of kilogram, metre, second, radian and ampere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Dimension {
    mass: i32,
    length: i32,
    time: i32,
    angle: i32,
    current: i32,
}

const fn dimension(mass: i32, length: i32, time: i32, angle: i32) -> Dimension {
    Dimension { mass, length, time, angle, current: 0 }
}

const fn electric(mass: i32, length: i32, time: i32, current: i32) -> Dimension {
    Dimension { current, ..dimension(mass, length, time, 0) }
}

impl Dimension {
    /// Returns whether it is the dimension of angles.
    pub fn is_angle(self) -> bool {
        self == ANGLE.dimension
    }

    /// Returns the SI unit of this dimension as text that can be read again: `N*m/rad`; empty for a
    /// plain number.
    pub fn si_unit(self) -> String {
        if self == NUMBER.dimension {
            return String::new();
        }
        if let Some(quantity) = QUANTITIES.iter().find(|quantity| quantity.dimension == self) {
            return quantity.examples.split('`').nth(1).unwrap_or_default().to_owned();
        }
        let mut factors = Vec::new();
        for (mut power, base) in self.powers() {
            while power != 0 {
                let part = power.clamp(-HIGHEST_POWER, HIGHEST_POWER);
                factors.push(format!("{base}^{part}"));
                power -= part;
            }
        }
        factors.join("*")
    }

    fn powers(self) -> [(i32, &'static str); 5] {
        let Self { mass, length, time, angle, current } = self;
        [(mass, "kg"), (length, "m"), (time, "s"), (angle, "rad"), (current, "A")]
    }

    /// Returns examples of units of this dimension.
    pub(super) fn examples(self) -> String {
        match QUANTITIES.iter().find(|quantity| quantity.dimension == self) {
            Some(quantity) => quantity.examples.to_owned(),
            None => format!("`{}`", self.si_unit()),
        }
    }

    fn plus(self, other: Self, power: i32) -> Self {
        Self {
            mass: self.mass + power * other.mass,
            length: self.length + power * other.length,
            time: self.time + power * other.time,
            angle: self.angle + power * other.angle,
            current: self.current + power * other.current,
        }
    }
}

impl fmt::Display for Dimension {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(quantity) = QUANTITIES.iter().find(|quantity| quantity.dimension == *self) {
            return f.write_str(quantity.name);
        }
        let powers: Vec<_> = self
            .powers()
            .into_iter()
            .filter(|(power, _)| *power != 0)
            .map(|(power, base)| if power == 1 { base.into() } else { format!("{base}^{power}") })
            .collect();
        write!(f, "in {}", powers.join("*"))
    }
}

/// Quantity of a key of the model.
#[derive(Debug, PartialEq, Eq)]
pub struct Quantity {
    /// Name with its article.
    pub name: &'static str,
    /// Its dimension.
    pub dimension: Dimension,
    /// Examples of units.
    pub examples: &'static str,
}

macro_rules! quantities {
    ($($id:ident = $name:literal, $of:ident $powers:tt, $examples:literal;)*) => {
        $(
            #[doc = $name]
            pub const $id: Quantity =
                Quantity { name: $name, dimension: $of $powers, examples: $examples };
        )*
        /// All quantities of the model.
        pub const QUANTITIES: &[Quantity] = &[$($id),*];
    };
}

quantities! {
    LENGTH = "a length", dimension(0, 1, 0, 0), "`m`, `mm`, `um` or `in`";
    ANGLE = "an angle", dimension(0, 0, 0, 1), "`rad` or `deg`";
    ANGULAR_SPEED = "an angular speed", dimension(0, 0, -1, 1), "`rad/s` or `deg/s`";
    MASS = "a mass", dimension(1, 0, 0, 0), "`kg`, `g` or `mg`";
    INERTIA = "a moment of inertia", dimension(1, 2, 0, 0), "`kg*m^2` or `g*mm^2`";
    DENSITY = "a density", dimension(1, -3, 0, 0), "`kg/m^3` or `g/cm^3`";
    PRESSURE = "a pressure or stress", dimension(1, -1, -2, 0), "`Pa`, `MPa` or `GPa`";
    STIFFNESS = "a rotational stiffness", dimension(1, 2, -2, -1), "`N*m/rad` or `mN*m/deg`";
    CUBIC_STIFFNESS = "a cubic rotational stiffness", dimension(1, 2, -2, -3), "`N*m/rad^3`";
    LINE_STIFFNESS = "a rotational stiffness per length", dimension(1, 1, -2, -1), "`N/rad` or `mN*m/rad/mm`";
    LINE_DAMPING = "a rotational damping per length", dimension(1, 1, -1, -1), "`N*s/rad`";
    DAMPING = "a rotational damping", dimension(1, 2, -1, -1), "`N*m*s/rad`";
    TORQUE = "a torque", dimension(1, 2, -2, 0), "`N*m` or `mN*m`";
    FORCE = "a force", dimension(1, 1, -2, 0), "`N` or `mN`";
    ACCELERATION = "an acceleration", dimension(0, 1, -2, 0), "`m/s^2`";
    TIME = "a time", dimension(0, 0, 1, 0), "`s` or `ms`";
    FREQUENCY = "a frequency", dimension(0, 0, -1, 0), "`Hz`";
    SPEED = "a speed", dimension(0, 1, -1, 0), "`m/s`";
    AREA = "an area", dimension(0, 2, 0, 0), "`m^2` or `cm^2`";
    LINEAR_STIFFNESS = "a stiffness", dimension(1, 0, -2, 0), "`N/m` or `N/mm`";
    LINEAR_DAMPING = "a damping", dimension(1, 0, -1, 0), "`N*s/m`";
    SLOWNESS = "an inverse speed", dimension(0, -1, 1, 0), "`s/m`";
    VOLTAGE = "a voltage", electric(1, 2, -3, -1), "`V` or `mV`";
    CURRENT = "a current", electric(0, 0, 0, 1), "`A` or `mA`";
    RESISTANCE = "a resistance", electric(1, 2, -3, -2), "`ohm`";
    TORQUE_CONSTANT = "a torque constant", electric(1, 2, -2, -1), "`N*m/A` or `mN*m/A`";
    NUMBER = "a number", dimension(0, 0, 0, 0), "no unit";
    SHARE = "a share", dimension(0, 0, 0, 0), "`%`";
}

/// A unit as a factor to SI: `mantissa * 10^exponent`.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Unit {
    mantissa: f64,
    exponent: i32,
    pub dimension: Dimension,
}

/// SI itself.
pub(super) const SI: Unit = unit(1.0, 0, dimension(0, 0, 0, 0));
/// The millimetre.
pub(super) const MILLIMETRE: Unit = unit(1.0, -3, LENGTH.dimension);

const fn unit(mantissa: f64, exponent: i32, dimension: Dimension) -> Unit {
    Unit { mantissa, exponent, dimension }
}

#[rustfmt::skip]
const UNITS: &[(&str, Unit)] = &[
    ("m", unit(1.0, 0, LENGTH.dimension)),
    ("cm", unit(1.0, -2, LENGTH.dimension)),
    ("mm", MILLIMETRE),
    ("um", unit(1.0, -6, LENGTH.dimension)),
    ("µm", unit(1.0, -6, LENGTH.dimension)),
    ("μm", unit(1.0, -6, LENGTH.dimension)),
    ("nm", unit(1.0, -9, LENGTH.dimension)),
    ("in", unit(254.0, -4, LENGTH.dimension)),
    ("mil", unit(254.0, -7, LENGTH.dimension)),
    ("rad", unit(1.0, 0, ANGLE.dimension)),
    ("mrad", unit(1.0, -3, ANGLE.dimension)),
    ("deg", unit(PI / 180.0, 0, ANGLE.dimension)),
    ("°", unit(PI / 180.0, 0, ANGLE.dimension)),
    ("rev", unit(2.0 * PI, 0, ANGLE.dimension)),
    ("kg", unit(1.0, 0, MASS.dimension)),
    ("g", unit(1.0, -3, MASS.dimension)),
    ("mg", unit(1.0, -6, MASS.dimension)),
    ("s", unit(1.0, 0, TIME.dimension)),
    ("ms", unit(1.0, -3, TIME.dimension)),
    ("us", unit(1.0, -6, TIME.dimension)),
    ("min", unit(6.0, 1, TIME.dimension)),
    ("Hz", unit(1.0, 0, FREQUENCY.dimension)),
    ("kHz", unit(1.0, 3, FREQUENCY.dimension)),
    ("N", unit(1.0, 0, FORCE.dimension)),
    ("mN", unit(1.0, -3, FORCE.dimension)),
    ("uN", unit(1.0, -6, FORCE.dimension)),
    ("kN", unit(1.0, 3, FORCE.dimension)),
    ("Nm", unit(1.0, 0, TORQUE.dimension)),
    ("mNm", unit(1.0, -3, TORQUE.dimension)),
    ("Pa", unit(1.0, 0, PRESSURE.dimension)),
    ("kPa", unit(1.0, 3, PRESSURE.dimension)),
    ("MPa", unit(1.0, 6, PRESSURE.dimension)),
    ("GPa", unit(1.0, 9, PRESSURE.dimension)),
    ("J", unit(1.0, 0, TORQUE.dimension)),
    ("mJ", unit(1.0, -3, TORQUE.dimension)),
    ("W", unit(1.0, 0, dimension(1, 2, -3, 0))),
    ("V", unit(1.0, 0, VOLTAGE.dimension)),
    ("mV", unit(1.0, -3, VOLTAGE.dimension)),
    ("A", unit(1.0, 0, CURRENT.dimension)),
    ("mA", unit(1.0, -3, CURRENT.dimension)),
    ("ohm", unit(1.0, 0, RESISTANCE.dimension)),
    ("%", unit(1.0, -2, NUMBER.dimension)),
];

/// Returns the names of all units.
pub fn all_units() -> Vec<&'static str> {
    UNITS.iter().map(|(name, _)| *name).collect()
}

/// Returns the names of the units that have this dimension by themselves.
pub fn units_of(dimension: Dimension) -> Vec<&'static str> {
    let fits = UNITS.iter().filter(|(_, unit)| unit.dimension == dimension);
    fits.map(|(name, _)| *name).collect()
}

/// Returns the unit with this name.
pub(super) fn find(name: &str) -> Option<Unit> {
    UNITS.iter().find(|(known, _)| *known == name).map(|(_, unit)| *unit)
}

/// Largest number of factors in a unit.
const HIGHEST_POWER: i32 = 9;

/// Why a unit cannot be read; ranges are bytes of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum UnitError {
    /// There is no unit with this name.
    Unknown(Range<usize>),
    /// The text is not a product of powers of units.
    Malformed(Range<usize>),
}

impl Unit {
    /// Converts the text `number` from this unit to SI. The result is infinite if it is too large
    /// for a double.
    pub fn to_si(self, number: &str) -> f64 {
        let (digits, exponent) = number.split_once(['e', 'E']).unwrap_or((number, "0"));
        let exponent = exponent.parse::<i64>().unwrap_or(match exponent.starts_with('-') {
            true => i64::MIN / 2,
            false => i64::MAX / 2,
        });
        // The factor is applied before the decimal shift, because 254 is exact and 1e-4 is not.
        // Digits with an exponent are always a number; one that overflows is reported as not
        // finite.
        let digits = match self.mantissa {
            1.0 => digits.to_owned(),
            mantissa => (digits.parse::<f64>().unwrap_or(f64::NAN) * mantissa).to_string(),
        };
        let shifted = format!("{digits}e{}", exponent + i64::from(self.exponent));
        shifted.parse().unwrap_or(f64::NAN)
    }

    fn times(self, other: Self, power: i32) -> Self {
        Self {
            mantissa: self.mantissa * crate::arithmetic::powi(other.mantissa, power),
            exponent: self.exponent + power * other.exponent,
            dimension: self.dimension.plus(other.dimension, power),
        }
    }
}

/// Splits `text` after the number it starts with; `None` if it does not start with a number.
pub(super) fn split_number(text: &str) -> Option<(&str, &str)> {
    let bytes = text.as_bytes();
    let digits = |from: usize| bytes[from..].iter().take_while(|b| b.is_ascii_digit()).count();
    let sign = usize::from(matches!(bytes.first(), Some(b'+' | b'-')));
    let whole = digits(sign);
    let mut end = sign + whole;
    let mut fraction = 0;
    if bytes.get(end) == Some(&b'.') {
        fraction = digits(end + 1);
        end += 1 + fraction;
    }
    if whole + fraction == 0 {
        return None;
    }
    if matches!(bytes.get(end), Some(b'e' | b'E')) {
        let sign = usize::from(matches!(bytes.get(end + 1), Some(b'+' | b'-')));
        let exponent = digits((end + 1 + sign).min(bytes.len()));
        if exponent > 0 {
            end += 1 + sign + exponent;
        }
    }
    Some(text.split_at(end))
}

/// Splits text that is one number and at most one unit; `None` for other text (an expression).
pub(super) fn split_quantity(text: &str) -> Option<(&str, &str)> {
    let (number, rest) = split_number(text)?;
    let unit = rest.trim_start();
    let starts = unit.starts_with(is_of_name);
    // A minus sign can be part of a power (`s^-1`); anywhere else it makes the text an expression.
    let of_units = |c: char| c.is_alphanumeric() || " */^·°%²³".contains(c);
    let is_unit = starts && unit.replace("^-", "^").chars().all(of_units);
    (unit.is_empty() || is_unit).then_some((number, unit))
}

/// Returns whether the names of units have this character.
fn is_of_name(c: char) -> bool {
    c.is_alphabetic() || "°%".contains(c)
}

/// Reads a unit: names with powers, between `*`, `·`, blanks and `/`. A `/` divides by the next
/// name only.
pub(super) fn parse_unit(text: &str) -> Result<Unit, UnitError> {
    let mut total = SI;
    let mut at = 0;
    let mut sign = 1;
    loop {
        let rest = &text[at..];
        let length = rest.find(|c: char| !is_of_name(c)).unwrap_or(rest.len());
        let name = &rest[..length];
        if name.is_empty() {
            return Err(UnitError::Malformed(at..text.len().max(at)));
        }
        let unit = find(name).ok_or(UnitError::Unknown(at..at + length))?;
        at += length;
        let (power, used) = parse_power(&text[at..]).ok_or(UnitError::Malformed(at..text.len()))?;
        if power == 0 || power.abs() > HIGHEST_POWER {
            return Err(UnitError::Malformed(at..at + used));
        }
        at += used;
        total = total.times(unit, sign * power);
        let rest = text[at..].trim_start();
        if rest.is_empty() {
            return Ok(total);
        }
        sign = if rest.starts_with('/') { -1 } else { 1 };
        let rest = rest.strip_prefix(['*', '/', '·']).unwrap_or(rest).trim_start();
        // The limit keeps the exponents small.
        if text.len() > 100 {
            return Err(UnitError::Malformed(0..text.len()));
        }
        at = text.len() - rest.len();
    }
}

/// Returns the power at the start of `text` (1 if there is none) and its length in bytes.
fn parse_power(text: &str) -> Option<(i32, usize)> {
    if let Some(power) = text.strip_prefix('^') {
        let digits = power.strip_prefix('-').unwrap_or(power);
        let length = digits.bytes().take_while(u8::is_ascii_digit).count();
        let used = power.len() - digits.len() + length;
        return power[..used].parse().ok().map(|value| (value, used + 1));
    }
    match text.chars().next() {
        Some('²') => Some((2, '²'.len_utf8())),
        Some('³') => Some((3, '³'.len_utf8())),
        _ => Some((1, 0)),
    }
}

#[cfg(test)]
mod tests;
