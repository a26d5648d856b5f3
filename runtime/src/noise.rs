//! Numbers that look random and are always the same.

use crate::Scalar;
use crate::constants::{
    NOISE_DROPPED, NOISE_FACTOR_1, NOISE_FACTOR_2, NOISE_HALF, NOISE_INCREMENT, NOISE_SHIFT_1,
    NOISE_SHIFT_2, NOISE_STRIDE,
};
use crate::scalar::whole;

/// A number between -1 and 1, always the same for the same arguments.
pub(crate) fn noise<S: Scalar>(row: usize, joint: usize) -> S {
    let mut bits = (row as u64 * NOISE_STRIDE + joint as u64 + 1).wrapping_mul(NOISE_INCREMENT);
    bits = (bits ^ (bits >> NOISE_SHIFT_1)).wrapping_mul(NOISE_FACTOR_1);
    bits = (bits ^ (bits >> NOISE_SHIFT_2)).wrapping_mul(NOISE_FACTOR_2);
    whole::<S>(bits >> NOISE_DROPPED) / whole(NOISE_HALF) - S::ONE
}
