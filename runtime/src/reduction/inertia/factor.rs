//! The factor of H where one block holds a row of it: column by column, each as a whole, so that few steps wait for others.

use crate::Scalar;
use crate::reduction::blocks::{Block, sum_of};

/// Writes Cholesky's factor of H = A + A^T, for d < W rows of A, on and below the diagonal of `out` (d x d), with 1 / `l_kk` there. Returns
/// whether H is safely positive definite.
///
/// The next column waits for C_k and 1 / h_k of those before it only,
///
/// ```text
/// C_k = H_k - sum_(j < k) C_j c_kj / h_j,    h_k = c_kk,    L_k = C_k / sqrt(h_k)
/// ```
pub(super) fn factor_sum<S: Scalar, const W: usize>(
    mut rows: impl Iterator<Item = Block<S, W>>,
    out: &mut [S],
    d: usize,
) -> bool {
    let none = [S::ZERO; W];
    let mut columns: [Block<S, W>; W] = core::array::from_fn(|_| rows.next().unwrap_or(none));
    let (mut pivots, mut reciprocals) = (none, none);
    for k in 0..d.min(W) {
        // Numbers of columns that are done are never read.
        let given: Block<S, W> = core::array::from_fn(|i| columns[k][i] + columns[i][k]);
        let before = columns.iter().zip(&reciprocals).take(k);
        columns[k] = before.fold(given, |column, (other, &reciprocal)| {
            sum_of(-(other[k] * reciprocal), other, &column)
        });
        let pivot = columns[k][k];
        // Written so that NaN and infinity fail too.
        if !(pivot > S::EPSILON * given[k]) || !pivot.is_finite() {
            return false;
        }
        (pivots[k], reciprocals[k]) = (pivot, S::ONE / pivot);
    }
    let scales = pivots.map(|pivot| S::ONE / pivot.sqrt());
    for (i, row) in out.chunks_exact_mut(d.max(1)).enumerate().take(W) {
        for (k, place) in row.iter_mut().enumerate().take(i + 1) {
            *place = if k == i { scales[k] } else { scales[k] * columns[k][i] };
        }
    }
    true
}
