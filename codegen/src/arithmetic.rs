//! Elementary functions that give the same bits on every machine.
//!
//! The standard library takes them from the platform's C library, whose last digits differ from one
//! system to the next; what the compiler computes with them ends up as constants in its output.
//! So every stage, the interpreter and the machine code of the workbench call these. Sine and cosine
//! are the runtime's own, the others come from the crate `libm`, which the runtime uses in firmware.
//! `clippy.toml` rejects the methods of `f64` that these replace.
//!
//! The maxima here keep NaN, which `f64::max` loses: a residual that is no number must not count as zero.

use std::borrow::Borrow;

pub use lamc_runtime::sin_cos_unfused as sin_cos;
pub use libm::{acos, asin, atan, atan2, exp, exp2, hypot, log as ln, log2, log10, pow, tan, tanh};

/// The sine of an angle, rad.
pub fn sin(angle: f64) -> f64 {
    sin_cos(angle).0
}

/// The cosine of an angle, rad.
pub fn cos(angle: f64) -> f64 {
    sin_cos(angle).1
}

/// `base` to a whole power, by repeated squaring.
pub fn powi(base: f64, exponent: i32) -> f64 {
    let (mut square, mut left, mut product) = (base, exponent.unsigned_abs(), 1.0);
    while left > 0 {
        if left % 2 == 1 {
            product *= square;
        }
        square *= square;
        left /= 2;
    }
    if exponent < 0 { 1.0 / product } else { product }
}

/// Units in the last place within which two numbers are the same but for their rounding.
const SAME: f64 = 4.0 * f64::EPSILON;

/// Whether two numbers are the same but for their rounding.
pub fn is_same(x: f64, y: f64) -> bool {
    (x - y).abs() <= SAME * x.abs().max(y.abs())
}

/// The larger of two numbers; NaN if one of them is NaN.
pub fn larger(a: f64, b: f64) -> f64 {
    if a.is_nan() || a > b { a } else { b }
}

/// The largest magnitude, 0 of no numbers; NaN if one of them is NaN.
pub fn largest(numbers: impl IntoIterator<Item = impl Borrow<f64>>) -> f64 {
    numbers.into_iter().fold(0.0, |most, number| larger(most, number.borrow().abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn maxima_keep_nan() {
        for numbers in [[f64::NAN, 1.0], [1.0, f64::NAN]] {
            assert!(largest(numbers).is_nan() && larger(numbers[0], numbers[1]).is_nan());
        }
        assert_eq!((largest([1.0, -3.0, 2.0]), largest([0.0; 0])), (3.0, 0.0));
        assert_eq!((larger(1.0, -3.0), larger(-3.0, 1.0)), (1.0, 1.0));
    }

    #[test]
    fn whole_powers_are_exact_where_the_result_is() {
        for (base, exponent, power) in
            [(2.0, 10, 1024.0), (-3.0, 3, -27.0), (0.5, -2, 4.0), (7.0, 0, 1.0), (0.0, 0, 1.0)]
        {
            assert_eq!(powi(base, exponent), power, "{base}^{exponent}");
        }
    }

    /// Bits that no library of a platform may change. They were computed once with these functions;
    /// each is within one unit of the last place of the exact value.
    #[test]
    fn results_have_the_same_bits_everywhere() {
        let table: [(&str, f64, f64); 14] = [
            ("sin", sin(0.7), 0.644217687237691),
            ("cos", cos(2.5), -0.8011436155469337),
            ("tan", tan(1.1), 1.9647596572486523),
            ("asin", asin(0.3), 0.3046926540153975),
            ("acos", acos(0.3), 1.2661036727794992),
            ("atan", atan(3.0), 1.2490457723982544),
            ("exp", exp(1.7), 5.473947391727199),
            ("ln", ln(5.3), 1.667706820558076),
            ("tanh", tanh(0.4), 0.3799489622552249),
            ("pow", pow(1.3, 4.7), 3.431893133890802),
            ("atan2", atan2(-1.2, 0.7), -1.042721878368537),
            ("hypot", hypot(0.3, 0.7), 0.7615773105863908),
            ("log2", log2(0.3), -1.7369655941662063),
            ("exp2", exp2(0.3), 1.2311444133449163),
        ];
        for (name, got, expected) in table {
            assert_eq!(got.to_bits(), expected.to_bits(), "{name} is {got:?}, not {expected:?}");
        }
    }
}
