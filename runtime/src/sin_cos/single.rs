//! Sine and cosine in `f32` arithmetic alone.
//!
//! libm computes them by way of `f64`, for which a Cortex-M4F has no instructions: ten times slower
//! there. Here x is reduced by multiples of pi/2 to -pi/4 .. pi/4, where the Taylor polynomials are
//! exact to rounding. Small x by W. J. Cody and W. Waite, "Software Manual for the Elementary
//! Functions", 1980, 8: pi/2 in three parts, of which small multiples are exact; large x by
//! M. H. Payne and R. N. Hanek, "Radian reduction for trigonometric functions", 1983: those bits of
//! 2/pi that matter for the fraction, in whole numbers.

use core::f32::consts::FRAC_2_PI;

use super::Angle;
use crate::Arithmetic;

/// pi/2: parts of 17, 17 and 24 bits.
const HALF_PI: [f32; 3] = [1.570_785_5, 1.080_427_3e-5, 6.077_100_6e-11];

/// 1.5 2^23: adding it rounds a number to an integer, which is then in the last bits.
const ROUND: f32 = 12_582_912.0;

/// 2/pi = 0.a2f9836e..., the point after the first word.
const TWO_OVER_PI: [u32; 8] =
    [0, 0xa2f9_836e, 0x4e44_1529, 0xfc27_57d1, 0xf534_ddc0, 0xdb62_9599, 0x3c43_9041, 0xfe51_63ab];

impl Angle for f32 {
    // Multiples are of 7 bits, and exact.
    const NEAR: Self = 128.0;

    #[inline(always)]
    fn near(self) -> (Self, Self) {
        of_quadrant(near(self))
    }

    fn far(self) -> (Self, Self) {
        if self.is_finite() { of_quadrant(far(self)) } else { (Self::NAN, Self::NAN) }
    }
}

/// Sine and cosine of an angle by the nearest multiple of a quarter turn, modulo four, and the
/// remainder.
#[inline(always)]
fn of_quadrant((quadrant, x): (u32, f32)) -> (f32, f32) {
    let square = x * x;
    let sine = polynomial(square, [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0]);
    let sine = Arithmetic::mul_add(x * square, sine, x);
    let cosine = polynomial(square, [1.0 / 24.0, -1.0 / 720.0, 1.0 / 40_320.0, -1.0 / 3_628_800.0]);
    let cosine = 1.0 - Arithmetic::mul_add(-(square * square), cosine, 0.5 * square);
    let odd = (quadrant & 1).wrapping_neg();
    let swap = (sine.to_bits() ^ cosine.to_bits()) & odd;
    let sine = sine.to_bits() ^ swap ^ (quadrant & 2) << 30;
    let cosine = cosine.to_bits() ^ swap ^ (quadrant.wrapping_add(1) & 2) << 30;
    (f32::from_bits(sine), f32::from_bits(cosine))
}

/// Tangent.
#[cfg(not(feature = "std"))]
pub(crate) fn tan(x: f32) -> f32 {
    let (sine, cosine) = Arithmetic::sin_cos(x);
    sine / cosine
}

/// By Horner's rule.
#[inline(always)]
fn polynomial(x: f32, [a, b, c, d]: [f32; 4]) -> f32 {
    let horner = |high, low| Arithmetic::mul_add(x, high, low);
    horner(horner(horner(d, c), b), a)
}

/// The nearest multiple of a quarter turn, in the last two bits, and what x exceeds it by.
#[inline(always)]
fn near(x: f32) -> (u32, f32) {
    let shifted = Arithmetic::mul_add(x, FRAC_2_PI, ROUND);
    let quarters = shifted - ROUND;
    let rest = HALF_PI.into_iter().fold(x, |x, part| Arithmetic::mul_add(-quarters, part, x));
    (shifted.to_bits(), rest)
}

/// As [`near`], where |x| >= 1/2.
fn far(x: f32) -> (u32, f32) {
    let bits = x.to_bits();
    // |x| = mantissa 2^exponent; 2/pi from its bit of weight 2^(1 - exponent) on makes 2^1 and what
    // is below, that is, all that matters of the product: modulo four quarter turns.
    let mantissa = (bits & 0x007f_ffff) | 0x0080_0000;
    let first = (bits >> 23 & 0xff) as usize + 30 - 150;
    let word = |i: usize| {
        let pair = |i| u64::from(TWO_OVER_PI.get(i).copied().unwrap_or(0));
        let i = first / 32 + i;
        ((pair(i) << 32 | pair(i + 1)) << (first % 32) >> 32) as u32
    };
    let product = |i| u64::from(mantissa) * u64::from(word(i));
    // In units of 2^-62 quarter turns.
    let turns = (product(0) << 32).wrapping_add(product(1)).wrapping_add(product(2) >> 32);
    let quarters = (turns >> 62) + (turns >> 61 & 1);
    let rest = turns.wrapping_sub(quarters << 62) as i64;
    let rest = rest as f32 * (core::f32::consts::FRAC_PI_2 / (1_u64 << 62) as f32);
    let quarters = quarters as u32;
    if x < 0.0 { (quarters.wrapping_neg(), -rest) } else { (quarters, rest) }
}

#[cfg(test)]
mod tests {
    use super::super::sin_cos_all;
    use super::*;

    /// Compares with the standard library's `f64`, in units of the last place.
    fn check(values: impl Iterator<Item = f32>) {
        for x in values {
            let allowed = if x.abs() < <f32 as Angle>::NEAR { 1.7 } else { 2.5 };
            let exact = f64::from(x).sin_cos();
            let [got] = sin_cos_all([x]);
            for (got, exact) in [(got.0, exact.0), (got.1, exact.1)] {
                let place = (exact as f32).abs().max(f32::MIN_POSITIVE);
                let unit = f64::from(f32::from_bits(place.to_bits() + 1) - place);
                let error = (f64::from(got) - exact).abs() / unit;
                assert!(error <= allowed, "of {x:e}: {got:e} is not {exact:e}: {error} units");
            }
        }
    }

    #[test]
    fn numbers_of_all_sizes_are_right() {
        // Steps without a pattern in the last bits.
        let sizes = || (0..0x7f80_0000_u32).step_by(9_973).map(f32::from_bits);
        check(sizes());
        check(sizes().map(|x| -x));
        for x in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let [(sine, cosine)] = sin_cos_all([x]);
            assert!(sine.is_nan() && cosine.is_nan());
        }
    }

    #[test]
    fn multiples_of_a_quarter_turn_and_what_is_beside_them_are_right() {
        let beside = |x: f32| {
            let bits = x.to_bits();
            (0..5).map(move |i| f32::from_bits((bits + i).saturating_sub(2)))
        };
        let eighths = (0..200_000).map(|k| (f64::from(k) * core::f64::consts::FRAC_PI_4) as f32);
        check(eighths.flat_map(beside));
        check(beside(f32::NEAR));
    }
}
