//! The number type a compiled mechanism is evaluated in: `f64` or `f32`.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

use crate::sin_cos::sin_cos_all;

/// Number type of straight-line code: a real number, or several in lanes.
///
/// There is nothing to compare by and thus to branch on, so that lanes of a vector qualify.
pub trait Arithmetic:
    Copy
    + Debug
    + Default
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + 'static
{
    /// 0.
    const ZERO: Self;
    /// 1.
    const ONE: Self;
    /// Distance from 1 to the next larger number.
    const EPSILON: Self;
    /// The nearest representable number.
    fn from_f64(value: f64) -> Self;
    /// `self * a + b`: for `f64` and `f32` rounded once where the compilation target has an
    /// instruction for that and the feature `std` is on, else twice; never a function of a library.
    #[inline]
    fn mul_add(self, a: Self, b: Self) -> Self {
        self * a + b
    }
    /// Square root.
    fn sqrt(self) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Sine and cosine of each angle.
    #[inline]
    fn sin_cos_all<const K: usize>(angles: [Self; K]) -> [(Self, Self); K] {
        core::array::from_fn(|k| angles[k].sin_cos())
    }
    /// Tangent.
    fn tan(self) -> Self;
    /// e to the power.
    fn exp(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// To the power of `exponent`.
    fn pow(self, exponent: Self) -> Self;
    /// The angle of the point (`x`, `self`) from -pi to pi.
    fn atan2(self, x: Self) -> Self;
    /// Natural logarithm.
    fn ln(self) -> Self;
    /// 1 where not negative, else 0; NaN stays.
    fn step(self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The smaller; NaN if either is.
    fn min(self, other: Self) -> Self;
    /// The larger; NaN if either is.
    fn max(self, other: Self) -> Self;
}

/// A real number, which algorithms decide by.
pub trait Scalar: Arithmetic + PartialEq + PartialOrd {
    /// As an `f64`.
    fn to_f64(self) -> f64;
    /// The nearest `f32`.
    fn to_f32(self) -> f32;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

/// Implements both by these functions, or by the standard library with the feature `std`. Only
/// [`mul_add`](Arithmetic::mul_add) differs between targets.
macro_rules! scalar {
    ($type:ident, $sqrt:path, $tan:path, $exp:path, $tanh:path, $pow:path,
     $ln:path, $atan2:path) => {
        impl Scalar for $type {
            #[inline]
            fn to_f64(self) -> f64 {
                self.into()
            }
            #[inline]
            fn to_f32(self) -> f32 {
                self as f32
            }
            #[inline]
            fn is_finite(self) -> bool {
                $type::is_finite(self)
            }
        }

        impl Arithmetic for $type {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $type::EPSILON;
            #[inline]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[cfg(all(feature = "std", any(target_feature = "fma", target_arch = "aarch64")))]
            #[inline]
            fn mul_add(self, a: Self, b: Self) -> Self {
                $type::mul_add(self, a, b)
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                let [both] = sin_cos_all([self]);
                both
            }
            #[inline]
            fn sin_cos_all<const K: usize>(angles: [Self; K]) -> [(Self, Self); K] {
                sin_cos_all(angles)
            }
            scalar!(@function sqrt, $sqrt);
            scalar!(@function tan, $tan);
            scalar!(@function exp, $exp);
            scalar!(@function tanh, $tanh);
            scalar!(@function ln, $ln);
            #[inline]
            fn step(self) -> Self {
                if self < 0.0 {
                    0.0
                } else if self >= 0.0 {
                    1.0
                } else {
                    self
                }
            }
            #[inline]
            fn pow(self, exponent: Self) -> Self {
                #[cfg(feature = "std")]
                return $type::powf(self, exponent);
                #[cfg(not(feature = "std"))]
                return $pow(self, exponent);
            }
            #[inline]
            fn atan2(self, x: Self) -> Self {
                #[cfg(feature = "std")]
                return $type::atan2(self, x);
                #[cfg(not(feature = "std"))]
                return $atan2(self, x);
            }
            #[inline]
            fn abs(self) -> Self {
                $type::abs(self)
            }
            #[inline]
            #[allow(clippy::eq_op, reason = "false of what is not a number")]
            fn min(self, other: Self) -> Self {
                // Without branches. What is not a number is neither less nor equal itself. The first line keeps `self` if
                // either is none, so that only `other` is left to check, and a chain waits for the first line alone.
                let smaller = if other < self { other } else { self };
                if other == other { smaller } else { other }
            }
            #[inline]
            #[allow(clippy::eq_op, reason = "false of what is not a number")]
            fn max(self, other: Self) -> Self {
                let larger = if other > self { other } else { self };
                if other == other { larger } else { other }
            }
        }
    };
    (@function $name:ident, $path:path) => {
        #[inline]
        fn $name(self) -> Self {
            #[cfg(feature = "std")]
            return Self::$name(self);
            #[cfg(not(feature = "std"))]
            return $path(self);
        }
    };
}

/// A whole number; without `f64`, for which many a microcontroller has no instructions.
pub(crate) fn whole<S: Scalar>(value: u64) -> S {
    (0..u64::BITS - value.leading_zeros()).rev().fold(S::ZERO, |above, bit| {
        let twice = above + above;
        if value >> bit & 1 == 1 { twice + S::ONE } else { twice }
    })
}

/// Without the fraction.
pub(crate) fn truncated<S: Scalar>(value: S) -> S {
    // Next to a number this large there are only whole ones; such a one itself has no fraction.
    let large = S::ONE / S::EPSILON;
    let size = value.abs();
    if !(size < large) {
        return value;
    }
    let nearest = (size + large) - large;
    let below = if nearest > size { nearest - S::ONE } else { nearest };
    if value < S::ZERO { -below } else { below }
}

scalar!(f64, libm::sqrt, libm::tan, libm::exp, libm::tanh, libm::pow, libm::log, libm::atan2);
// Functions that libm computes in f64 are implemented here.
scalar!(
    f32,
    libm::sqrtf,
    crate::sin_cos::tan,
    libm::expf,
    libm::tanhf,
    libm::powf,
    libm::logf,
    libm::atan2f
);

#[cfg(test)]
mod tests {
    use super::*;

    fn check<S: Scalar>(tolerance: f64) {
        let of = S::from_f64;
        let table = [
            (of(2.0).sqrt(), core::f64::consts::SQRT_2),
            (of(0.5).sin_cos().0, 0.479_425_538_604_203),
            (of(0.5).sin_cos().1, 0.877_582_561_890_372_8),
            (of(0.5).tan(), 0.546_302_489_843_790_5),
            (of(1.0).exp(), core::f64::consts::E),
            (of(0.5).tanh(), 0.462_117_157_260_009_76),
            (of(2.0).pow(of(0.5)), core::f64::consts::SQRT_2),
            (of(2.0).ln(), core::f64::consts::LN_2),
            (of(2.0).atan2(of(-1.0)), 2.034_443_935_795_702_7),
            (of(-2.0).atan2(of(0.0)), -core::f64::consts::FRAC_PI_2),
            (of(-0.5).step() + of(0.0).step() + of(3.0).step(), 2.0),
            (of(-2.0).abs(), 2.0),
            (Arithmetic::min(of(1.0), of(2.0)), 1.0),
            (Arithmetic::max(of(1.0), of(2.0)), 2.0),
        ];
        for (got, expected) in table {
            assert!((got.to_f64() - expected).abs() <= tolerance, "{got:?} is not {expected}");
        }
        let nan = of(f64::NAN);
        for value in [
            Arithmetic::min(nan, S::ONE),
            Arithmetic::min(S::ONE, nan),
            Arithmetic::max(nan, S::ONE),
            Arithmetic::max(S::ONE, nan),
            nan.step(),
            nan.atan2(S::ONE),
            S::ONE.atan2(nan),
            (-S::ONE).ln(),
        ] {
            assert!(value.to_f64().is_nan(), "NaN got lost");
        }
        assert!(!nan.is_finite() && !of(f64::INFINITY).is_finite() && S::ONE.is_finite());
    }

    #[test]
    fn whole_numbers_are_as_the_language_converts_and_cuts_them() {
        for value in [0, 1, 2, 3, 1000, (1 << 24) - 1, 1 << 24, (1 << 53) - 1, 1 << 63] {
            assert_eq!(whole::<f64>(value), value as f64);
            assert_eq!(whole::<f32>(value & 0xff_ffff), (value & 0xff_ffff) as f32);
        }
        let sizes = [0.0_f64, 0.4, 0.5, 0.9, 1.0, 1.5, 2.5, 12_345.678, 8_388_606.5, 1e9, 1e300];
        for value in sizes.into_iter().flat_map(|size| [size, -size]) {
            assert_eq!(truncated(value), value.trunc());
            assert_eq!(truncated(value as f32), (value as f32).trunc());
        }
        assert!(truncated(f64::NAN).is_nan());
    }

    #[test]
    fn functions_match_known_values() {
        check::<f64>(1e-15);
        check::<f32>(3e-7);
    }
}
