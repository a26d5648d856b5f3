//! Sine and cosine in `f64`.
//!
//! x is reduced by multiples of pi/2 to -pi/4 .. pi/4 as by W. J. Cody and W. Waite, "Software
//! Manual for the Elementary Functions", 1980, 8: pi/2 in parts, of which multiples below 2^20 are
//! exact. The remainder is a sum of two numbers; their differences are exact by T. J. Dekker, "A
//! floating-point technique for extending the available precision", 1971, however close x is to a
//! multiple of pi/2: each minuend is a multiple of the subtrahend's last place.
//!
//! The polynomials have the least largest error over |x| <= pi/4 (E. Ya. Remez, 1934; computed in 60
//! digits, then rounded):
//!
//! ```text
//! sin x = x - x z S(z),            z = x^2,  relative error of sin x below 2^-58.0
//! cos x = 1 - z/2 + z^2 C(z),                error of cos x below 2^-64.2
//! ```

use core::f64::consts::FRAC_2_PI;

use super::Angle;
use crate::Arithmetic;

/// pi/2: three parts of 33 bits and the 53 that follow.
const HALF_PI: [f64; 4] = [
    1.570_796_326_734_125_6,
    6.077_100_506_303_966e-11,
    2.022_266_248_711_166_5e-21,
    8.478_427_660_368_9e-32,
];

/// 1.5 2^52: adding it rounds a number to an integer, which is then in the last bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// S.
const SINE: [f64; 6] = [
    0.166_666_666_666_666_32,
    -0.008_333_333_333_322_425,
    0.000_198_412_698_298_168_53,
    -2.755_731_369_518_211_3e-6,
    2.505_075_864_566_061_4e-8,
    -1.589_682_747_276_371e-10,
];

/// C.
const COSINE: [f64; 6] = [
    0.041_666_666_666_666_6,
    -0.001_388_888_888_887_413_8,
    2.480_158_728_949_186e-5,
    -2.755_731_435_525_119_6e-7,
    2.087_572_368_567_132e-9,
    -1.135_966_992_921_824_4e-11,
];

impl Angle for f64 {
    const NEAR: Self = 1_048_576.0;

    #[inline(always)]
    fn near(self) -> (Self, Self) {
        near(self, Arithmetic::mul_add)
    }

    fn far(self) -> (Self, Self) {
        libm::sincos(self)
    }
}

/// Sine and cosine of an angle (rad), with every product rounded: the same bits on every machine.
///
/// [`Arithmetic::sin_cos`] gives the same where products are not fused. Constants that a compiler
/// writes into a module, and a reference that compiled code is compared with, need one result
/// wherever they are computed.
pub fn sin_cos_unfused(angle: f64) -> (f64, f64) {
    if angle.abs() < f64::NEAR { near(angle, |a, b, c| a * b + c) } else { angle.far() }
}

/// Sine and cosine of an angle below [`Angle::NEAR`]; `mul_add` gives `a * b + c`.
#[inline(always)]
fn near(angle: f64, mul_add: impl Fn(f64, f64, f64) -> f64 + Copy) -> (f64, f64) {
    // The last bits of the number of quarter turns give the quadrant of the angle.
    let shifted = mul_add(angle, FRAC_2_PI, ROUND);
    let quadrant = shifted.to_bits();
    let quarters = shifted - ROUND;

    let [a, b, c, d] = HALF_PI;
    let nearly = mul_add(-quarters, a, angle);
    let (b, c) = (quarters * b, quarters * c);
    let rest = nearly - b;
    let lost = b - (nearly - rest);
    let x = rest - c;
    let low = mul_add(-quarters, d, ((rest - x) - c) - lost);

    // The small part of the remainder x + low is included to first order.
    let z = x * x;
    let zz = z * z;
    let below = mul_add(0.5 * z, low, -low);
    let sine = x - mul_add(x * z, polynomial(z, zz, SINE, mul_add), below);
    let half = 0.5 * z;
    let top = 1.0 - half;
    let below = mul_add(-x, low, (1.0 - top) - half);
    let cosine = top + mul_add(zz, polynomial(z, zz, COSINE, mul_add), below);

    let odd = (quadrant & 1).wrapping_neg();
    let swap = (sine.to_bits() ^ cosine.to_bits()) & odd;
    let sine = sine.to_bits() ^ swap ^ (quadrant & 2) << 62;
    let cosine = cosine.to_bits() ^ swap ^ (quadrant.wrapping_add(1) & 2) << 62;
    (f64::from_bits(sine), f64::from_bits(cosine))
}

/// By pairs (G. Estrin, 1960), whose operations do not wait for each other.
#[inline(always)]
fn polynomial(
    z: f64,
    zz: f64,
    [a, b, c, d, e, f]: [f64; 6],
    mul_add: impl Fn(f64, f64, f64) -> f64,
) -> f64 {
    let pair = |low, high| mul_add(z, high, low);
    let upper = mul_add(zz, pair(c, d), pair(a, b));
    mul_add(zz * zz, pair(e, f), upper)
}

#[cfg(test)]
mod tests {
    use core::f64::consts::FRAC_PI_4;

    use astro_float::{BigFloat, Consts, RoundingMode};

    use super::super::sin_cos_all;
    use super::*;

    /// Doubles below 2^20 that come closest to a multiple of pi/2: the first, and the last of
    /// the others, by continued fractions of pi/2 times powers of two.
    const CLOSEST: [f64; 4] =
        [45.553_093_477_052, 91.106_186_954_104, 364.424_747_816_416, 321_307.959_474_222_9];

    const BITS: usize = 192;

    /// Whether [`Arithmetic::mul_add`] rounds once here.
    const FUSES: bool =
        cfg!(all(feature = "std", any(target_feature = "fma", target_arch = "aarch64")));

    /// Distance from the exact result, in units of its last place.
    fn error(got: f64, exact: &BigFloat) -> f64 {
        let difference = BigFloat::from_f64(got, BITS).sub(exact, BITS, RoundingMode::ToEven);
        let (Some(&[.., top]), Some(power)) = (difference.mantissa_digits(), difference.exponent())
        else {
            panic!("{got} is not a number");
        };
        let place = exact.exponent().expect("a number").max(-1021) - 53;
        top as f64 * 2.0_f64.powi(-64) * 2.0_f64.powi(power - place)
    }

    /// The largest error among these, alone and among others.
    fn largest(values: impl Iterator<Item = f64>) -> f64 {
        let mut constants = Consts::new().expect("memory");
        let mut largest: f64 = 0.0;
        for x in values {
            let exact = BigFloat::from_f64(x, BITS);
            let sine = exact.sin(BITS, RoundingMode::ToEven, &mut constants);
            let cosine = exact.cos(BITS, RoundingMode::ToEven, &mut constants);
            let [got] = sin_cos_all([x]);
            largest = largest.max(error(got.0, &sine)).max(error(got.1, &cosine));
            let among = sin_cos_all([x, 0.5, 1.0, x, 2.0, 3.0, x, 4.0, -x, x, 5.0, 6.0, x, 1.5, x]);
            for k in [0, 3, 6, 9, 12, 14] {
                assert_eq!(among[k], got, "of {x:e} at {k}");
            }
            let unfused = sin_cos_unfused(x);
            largest = largest.max(error(unfused.0, &sine)).max(error(unfused.1, &cosine));
            if !FUSES {
                assert_eq!(unfused, got, "of {x:e}");
            }
            assert_eq!(among[8], (-got.0, got.1), "of {:e}", -x);
        }
        largest
    }

    #[test]
    fn near_angles_are_right_to_less_than_a_unit() {
        // All sizes, steps without a pattern in the last bits.
        let (least, step) = (1e-9_f64.to_bits(), 45_485_867_112_345);
        let sizes = (least..f64::NEAR.to_bits()).step_by(step).map(f64::from_bits);
        let found = largest(sizes);
        assert!(found < 0.8, "{found} units");
        let sizes = (0..least).step_by(step * 301).map(f64::from_bits);
        assert!(largest(sizes) < 0.51);
        // Evenly over the angles that mechanisms have.
        let found = largest((0..4_000).map(|k| f64::from(k) * 3.501_234_567e-3));
        assert!(found < 0.8, "{found} units");
    }

    #[test]
    fn multiples_of_an_eighth_turn_and_what_is_beside_them_are_right() {
        let multiples = (1..1_335_000).step_by(1_731).map(|k| f64::from(k) * FRAC_PI_4);
        let beside = |x: f64| [x.next_down(), x, x.next_up()];
        let found = largest(multiples.flat_map(beside));
        assert!(found < 0.8, "{found} units");
        let found = largest(CLOSEST.into_iter());
        assert!(found < 0.51, "{found} units");
    }

    #[test]
    fn far_angles_are_those_of_libm() {
        for x in [f64::NEAR, 1e7, -3.3e22, f64::MAX] {
            assert_eq!(sin_cos_all([0.5, x, 0.5])[1], libm::sincos(x));
            assert_eq!(sin_cos_unfused(x), libm::sincos(x));
            assert_eq!(sin_cos_all([0.5, x, 0.5])[2], sin_cos_all([0.5])[0]);
        }
        for x in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let [(sine, cosine)] = sin_cos_all([x]);
            assert!(sine.is_nan() && cosine.is_nan());
        }
    }

    #[test]
    fn zero_keeps_its_sign() {
        for zero in [0.0_f64, -0.0] {
            let [(sine, cosine)] = sin_cos_all([zero]);
            assert_eq!((sine.to_bits(), cosine), (zero.to_bits(), 1.0));
        }
    }
}
