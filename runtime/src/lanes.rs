//! Several numbers side by side (`wide`'s vectors) as [`Arithmetic`]: each lane has the bits that the
//! scalar type would have.

use wide::bytemuck::{cast_slice, cast_slice_mut};
use wide::{f32x8, f64x4};

use crate::sin_cos::write_sin_cos;
use crate::{Arithmetic, Lanes};

/// Implements [`Arithmetic`] by the vector's own operations where these are exact or correctly
/// rounded, else lane by lane.
macro_rules! lanes {
    ($vector:ident, $scalar:ident, $count:literal) => {
        impl Arithmetic for $vector {
            const ZERO: Self = Self::splat(0.0);
            const ONE: Self = Self::splat(1.0);
            const EPSILON: Self = Self::splat($scalar::EPSILON);
            #[inline]
            fn from_f64(value: f64) -> Self {
                Self::splat(value as $scalar)
            }
            #[inline]
            fn mul_add(self, a: Self, b: Self) -> Self {
                $vector::mul_add(self, a, b)
            }
            #[inline]
            fn sqrt(self) -> Self {
                $vector::sqrt(self)
            }
            #[inline]
            fn abs(self) -> Self {
                $vector::abs(self)
            }
            #[inline]
            fn sin_cos(self) -> (Self, Self) {
                let [both] = Self::sin_cos_all([self]);
                both
            }
            #[inline]
            fn sin_cos_all<const K: usize>(angles: [Self; K]) -> [(Self, Self); K] {
                let [mut sines, mut cosines] = [[Self::ZERO; K]; 2];
                let (sin, cos) = (cast_slice_mut(&mut sines), cast_slice_mut(&mut cosines));
                write_sin_cos::<$scalar>(cast_slice(&angles), sin, cos);
                core::array::from_fn(|k| (sines[k], cosines[k]))
            }
            #[inline]
            fn min(self, other: Self) -> Self {
                // The sum is not a number if either is not.
                let rest = self.simd_gt(other).select(other, self + other);
                self.simd_le(other).select(self, rest)
            }
            #[inline]
            fn max(self, other: Self) -> Self {
                let rest = self.simd_lt(other).select(other, self + other);
                self.simd_ge(other).select(self, rest)
            }
            lanes!(@each $scalar, tan(), exp(), tanh(), ln(), step(), pow(exponent), atan2(other));
        }

        impl Lanes for $vector {
            type Number = $scalar;
            const COUNT: usize = $count;
            #[inline]
            fn lanes(&self) -> &[$scalar] {
                self.as_array()
            }
            #[inline]
            fn lanes_mut(&mut self) -> &mut [$scalar] {
                self.as_mut_array()
            }
            #[inline]
            fn less(self, other: Self) -> u32 {
                self.simd_lt(other).to_bitmask()
            }
        }
    };
    (@each $scalar:ident, $($name:ident($($other:ident)?)),*) => {
        $(#[inline]
        fn $name(self $(, $other: Self)?) -> Self {
            let x = self.to_array();
            $(let $other = $other.to_array();)?
            Self::new(core::array::from_fn(|k| Arithmetic::$name(x[k] $(, $other[k])?)))
        })*
    };
}

lanes!(f64x4, f64, 4);
lanes!(f32x8, f32, 8);

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Scalar;

    /// Everything that is computed with, of three numbers.
    fn results<S: Arithmetic>(x: S, y: S, z: S) -> Vec<S> {
        let [mut sum, mut difference, mut product] = [x; 3];
        sum += y;
        difference -= y;
        product *= y;
        let [a, b] = S::sin_cos_all([y, z]);
        let binary = [x + y, x - y, x * y, x / y, x.pow(y), x.atan2(y), x.min(y), x.max(y)];
        let unary = [-x, x.sqrt(), x.tan(), x.exp(), x.tanh(), x.ln(), x.step(), x.abs()];
        let others = [sum, difference, product, x.mul_add(y, z), a.0, a.1, b.0, b.1, S::EPSILON];
        let (sine, cosine) = x.sin_cos();
        [&binary[..], &unary, &others, &[sine, cosine, S::ZERO, S::ONE, S::from_f64(0.1)]].concat()
    }

    /// Each lane against the scalar type, bit for bit; a NaN is a NaN.
    fn check<V: Arithmetic, S: Scalar, const L: usize>(
        numbers: &[f64],
        new: impl Fn([S; L]) -> V,
        lanes: impl Fn(V) -> [S; L],
    ) {
        let at = |k: usize| S::from_f64(numbers[k % numbers.len()]);
        for k in 0..numbers.len() {
            for step in 1..numbers.len() {
                let operands = |offset| core::array::from_fn(|lane| at(k + offset + step * lane));
                let (x, y, z) = (operands(0), operands(step), operands(2));
                let got = results(new(x), new(y), new(z));
                for lane in 0..L {
                    let expected = results(x[lane], y[lane], z[lane]);
                    for (index, (got, expected)) in got.iter().zip(expected).enumerate() {
                        let got = lanes(*got)[lane];
                        let same = got.to_f64().to_bits() == expected.to_f64().to_bits()
                            || got.to_f64().is_nan() && expected.to_f64().is_nan();
                        assert!(same, "result {index} of {x:?}, {y:?}, {z:?}: {got:?} in {lane}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_lane_has_the_bits_of_the_scalar() {
        let numbers = [
            0.0,
            -0.0,
            1.0,
            -1.0,
            0.5,
            -2.75,
            core::f64::consts::PI,
            1e-9,
            -1e-300,
            123.456,
            2e5,
            3e7,
            -1e30,
            1e300,
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
        ];
        check::<f64x4, f64, 4>(&numbers, f64x4::new, f64x4::to_array);
        check::<f32x8, f32, 8>(&numbers, f32x8::new, f32x8::to_array);
    }
}
