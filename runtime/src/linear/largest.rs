//! The largest of many numbers.

use crate::Arithmetic;

/// As many maxima as the processor has at work at a time.
const SIDE_BY_SIDE: usize = 4;
/// From so many numbers on this is faster. Shorter code counts where there are fewer.
const MANY: usize = 32;

/// Largest magnitude; NaN if any entry is.
pub(crate) fn max_abs<S: Arithmetic>(values: &[S]) -> S {
    values.iter().fold(S::ZERO, |largest, value| largest.max(value.abs()))
}

/// Largest magnitude; NaN if any entry is. Of many values, some maxima side by side, since each has to wait for the one
/// before. C has the plain one, with the same result.
#[inline]
pub(crate) fn max_abs_of_many<S: Arithmetic>(values: &[S]) -> S {
    if values.len() < MANY {
        return max_abs(values);
    }
    let mut largest = [S::ZERO; SIDE_BY_SIDE];
    let chunks = values.chunks_exact(largest.len());
    let rest = chunks.remainder();
    for chunk in chunks {
        for (largest, value) in largest.iter_mut().zip(chunk) {
            *largest = largest.max(value.abs());
        }
    }
    max_abs(rest).max(max_abs(&largest))
}
