//! The number type a compiled mechanism is evaluated in: `f64` or `f32`.

use core::fmt::Debug;
use core::ops::{Add, AddAssign, Div, Mul, MulAssign, Neg, Sub, SubAssign};

/// A real number.
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + PartialOrd
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
    /// As an `f64`.
    fn to_f64(self) -> f64;
    /// Square root.
    fn sqrt(self) -> Self;
    /// Sine and cosine.
    fn sin_cos(self) -> (Self, Self);
    /// Tangent.
    fn tan(self) -> Self;
    /// e to the power.
    fn exp(self) -> Self;
    /// Hyperbolic tangent.
    fn tanh(self) -> Self;
    /// To the power of `exponent`.
    fn pow(self, exponent: Self) -> Self;
    /// Magnitude.
    fn abs(self) -> Self;
    /// The smaller; NaN if either is.
    fn min(self, other: Self) -> Self;
    /// The larger; NaN if either is.
    fn max(self, other: Self) -> Self;
    /// Neither infinite nor NaN.
    fn is_finite(self) -> bool;
}

macro_rules! scalar {
    ($float:ident, $sqrt:ident, $sincos:ident, $tan:ident, $exp:ident, $tanh:ident, $pow:ident) => {
        impl Scalar for $float {
            const ZERO: Self = 0.0;
            const ONE: Self = 1.0;
            const EPSILON: Self = $float::EPSILON;

            #[inline]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[inline]
            fn to_f64(self) -> f64 {
                self.into()
            }
            #[inline]
            fn sqrt(self) -> Self {
                #[cfg(feature = "std")]
                return $float::sqrt(self);
                #[cfg(not(feature = "std"))]
                return libm::$sqrt(self);
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                #[cfg(feature = "std")]
                return $float::sin_cos(self);
                #[cfg(not(feature = "std"))]
                return libm::$sincos(self);
            }
            #[inline]
            fn tan(self) -> Self {
                #[cfg(feature = "std")]
                return $float::tan(self);
                #[cfg(not(feature = "std"))]
                return libm::$tan(self);
            }
            #[inline]
            fn exp(self) -> Self {
                #[cfg(feature = "std")]
                return $float::exp(self);
                #[cfg(not(feature = "std"))]
                return libm::$exp(self);
            }
            #[inline]
            fn tanh(self) -> Self {
                #[cfg(feature = "std")]
                return $float::tanh(self);
                #[cfg(not(feature = "std"))]
                return libm::$tanh(self);
            }
            #[inline]
            fn pow(self, exponent: Self) -> Self {
                #[cfg(feature = "std")]
                return $float::powf(self, exponent);
                #[cfg(not(feature = "std"))]
                return libm::$pow(self, exponent);
            }
            #[inline]
            fn abs(self) -> Self {
                $float::abs(self)
            }
            #[inline]
            fn min(self, other: Self) -> Self {
                if self < other || self.is_nan() { self } else { other }
            }
            #[inline]
            fn max(self, other: Self) -> Self {
                if self > other || self.is_nan() { self } else { other }
            }
            #[inline]
            fn is_finite(self) -> bool {
                $float::is_finite(self)
            }
        }
    };
}

scalar!(f64, sqrt, sincos, tan, exp, tanh, pow);
scalar!(f32, sqrtf, sincosf, tanf, expf, tanhf, powf);
