//! Q R of a square matrix by Householder reflections, in place: stable without exchanging rows.
//!
//! After G. H. Golub, C. F. Van Loan, "Matrix Computations", 5.2.1.

use super::{add_scaled, dot};
use crate::Scalar;

/// Overwrites the rows of `a` (n x n, row-major) by the factors of its transpose: the reflections'
/// vectors and, above them, R; the diagonal of R goes to `diagonal`. False where a is singular.
pub(crate) fn reflect<S: Scalar>(a: &mut [S], diagonal: &mut [S]) -> bool {
    let n = diagonal.len();
    let mut regular = true;
    for j in 0..n {
        let length = dot(&a[j * n + j..(j + 1) * n], &a[j * n + j..(j + 1) * n]).sqrt();
        // Written so that NaN is singular too.
        if !(length > S::ZERO) {
            regular = false;
        }
        let alpha = if a[j * n + j] > S::ZERO { -length } else { length };
        diagonal[j] = alpha;
        a[j * n + j] -= alpha;
        let (done, rest) = a.split_at_mut((j + 1) * n);
        let v = &done[j * n + j..];
        let scale = -S::ONE / (alpha * v[0]);
        for row in rest.chunks_exact_mut(n) {
            let factor = dot(&row[j..], v) * scale;
            add_scaled(&mut row[j..], -factor, v);
        }
    }
    regular
}

/// Solves a x = b with the result of [`reflect`]: a = L Q^T with L the lower triangle of R^T.
pub(crate) fn solve<S: Scalar>(a: &[S], diagonal: &[S], b: &mut [S]) {
    let n = diagonal.len();
    for i in 0..n {
        b[i] = (b[i] - dot(&a[i * n..i * n + i], &b[..i])) / diagonal[i];
    }
    for j in (0..n).rev() {
        let v = &a[j * n + j..(j + 1) * n];
        let factor = -dot(&b[j..], v) / (diagonal[j] * v[0]);
        add_scaled(&mut b[j..], -factor, v);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linear::test_matrix;
    use nalgebra::DVector;

    #[test]
    fn solves_as_nalgebra_does() {
        for n in 1..9 {
            let a = test_matrix(n, n, n as u64);
            let mut factors: Vec<f64> = a.transpose().iter().copied().collect();
            let mut diagonal = vec![0.0; n];
            assert!(reflect(&mut factors, &mut diagonal));
            let b: Vec<f64> = (0..n).map(|i| (i as f64).cos()).collect();
            let mut x = b.clone();
            solve(&factors, &diagonal, &mut x);
            let residual = &a * DVector::from_vec(x) - DVector::from_vec(b);
            assert!(residual.amax() < 1e-11, "n = {n}: {}", residual.amax());
        }
        let mut zero = [0.0, 0.0, 1.0, 1.0];
        assert!(!reflect(&mut zero, &mut [0.0; 2]));
    }
}
