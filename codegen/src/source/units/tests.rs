//! Quantities and units as texts.

use super::*;

fn si(text: &str) -> (f64, Dimension) {
    let (number, unit) = split_quantity(text).unwrap();
    let unit = if unit.is_empty() { SI } else { parse_unit(unit).unwrap() };
    (unit.to_si(number), unit.dimension)
}

#[test]
fn quantities_are_the_nearest_doubles() {
    for (text, value, of) in [
        ("0.127 mm", 0.000127, LENGTH),
        ("127um", 127e-6, LENGTH),
        ("127 µm", 127e-6, LENGTH),
        ("5 mil", 127e-6, LENGTH),
        ("1 in", 0.0254, LENGTH),
        ("180 deg", PI, ANGLE),
        ("-90°", -PI / 2.0, ANGLE),
        ("11.4 mN*m/rad", 0.0114, STIFFNESS),
        ("11.4 mNm/rad", 0.0114, STIFFNESS),
        ("4383.27 MPa", 4383.27e6, PRESSURE),
        ("42.84 N/mm^2", 42.84e6, PRESSURE),
        ("0.5 g", 0.0005, MASS),
        ("2 g*mm^2", 2e-9, INERTIA),
        ("2 g mm²", 2e-9, INERTIA),
        ("2e3 mg·mm^2", 2e-9, INERTIA),
        ("1.38 g/cm^3", 1380.0, DENSITY),
        ("9.81 m s^-2", 9.81, ACCELERATION),
        ("3.5e-6 N*m*s/rad", 3.5e-6, DAMPING),
        ("1e400 mm", f64::INFINITY, LENGTH),
        ("30%", 0.3, SHARE),
        ("80 %", 0.8, NUMBER),
    ] {
        let (got, dimension) = si(text);
        assert_eq!(dimension, of.dimension, "{text}");
        assert_eq!(got, value, "{text}");
    }
    // Factors that are no power of ten cost a rounding each.
    for (text, value, of) in
        [("1 mN*m/deg", 0.18 / PI, STIFFNESS), ("60 rev/min", 2.0 * PI, ANGULAR_SPEED)]
    {
        let (got, dimension) = si(text);
        assert_eq!(dimension, of.dimension, "{text}");
        assert!((got / value - 1.0).abs() < 4e-16, "{text}");
    }
}

#[test]
fn units_of_si_read_back() {
    for text in ["20 mm", "1 N*m/deg", "2 W", "3 kg^-2*s", "1 m^9*mm^9/s^9/ms^9", "4 Hz"] {
        let (_, dimension) = si(text);
        let again = parse_unit(&dimension.si_unit()).unwrap();
        assert_eq!(
            (again.dimension, again.mantissa, again.exponent),
            (dimension, 1.0, 0),
            "{text}"
        );
    }
}

#[test]
fn what_is_a_quantity_and_what_an_expression() {
    for text in ["1", "-1.5e-3", "2 m", "2m", ".5 mm", "5. N*m", "1e", "2 q"] {
        assert!(split_quantity(text).is_some(), "{text}");
    }
    for text in ["k", "2*k", "2 + 3", "2*pi", "sin(t)", "", "-", ".", "2 sin(t)", "1/2", "2 m-k"] {
        assert!(split_quantity(text).is_none(), "{text}");
    }
}

#[test]
fn bad_units() {
    assert_eq!(parse_unit("mN*furlong"), Err(UnitError::Unknown(3..10)));
    assert_eq!(parse_unit("mm^"), Err(UnitError::Malformed(2..3)));
    assert_eq!(parse_unit("mm*"), Err(UnitError::Malformed(3..3)));
    assert_eq!(parse_unit("m^99"), Err(UnitError::Malformed(1..4)));
    assert_eq!(parse_unit("m//s"), Err(UnitError::Malformed(2..4)));
    assert_eq!(parse_unit(&"m*".repeat(60)), Err(UnitError::Malformed(0..120)));
}
