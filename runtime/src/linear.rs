//! Small dense linear algebra over slices: Cholesky, triangular solves, one-sided Jacobi SVD.
//!
//! Matrices are row-major. Nothing here allocates, recurses or panics on lengths that agree.

use crate::Scalar;

/// a . b.
pub fn dot<S: Scalar>(a: &[S], b: &[S]) -> S {
    a.iter().zip(b).fold(S::ZERO, |sum, (&x, &y)| sum + x * y)
}

/// a += k b.
pub fn add_scaled<S: Scalar>(a: &mut [S], k: S, b: &[S]) {
    for (x, &y) in a.iter_mut().zip(b) {
        *x += k * y;
    }
}

/// Factors a symmetric positive definite n x n matrix in place: the lower triangle becomes L of
/// L L^T. `Err` names the row whose pivot is not positive.
pub fn cholesky<S: Scalar>(a: &mut [S], n: usize) -> Result<(), usize> {
    for i in 0..n {
        let (above, rest) = a.split_at_mut(i * n);
        let row = &mut rest[..n];
        for j in 0..i {
            let earlier = &above[j * n..j * n + n];
            row[j] = (row[j] - dot(&row[..j], &earlier[..j])) / earlier[j];
        }
        let pivot = row[i] - dot(&row[..i], &row[..i]);
        // Also false for NaN.
        if !(pivot > S::ZERO && pivot.is_finite()) {
            return Err(i);
        }
        row[i] = pivot.sqrt();
    }
    Ok(())
}

/// x <- L^-1 x.
pub fn solve_lower<S: Scalar>(l: &[S], n: usize, x: &mut [S]) {
    for i in 0..n {
        let row = &l[i * n..i * n + n];
        x[i] = (x[i] - dot(&row[..i], &x[..i])) / row[i];
    }
}

/// x <- L^-T x.
pub fn solve_upper<S: Scalar>(l: &[S], n: usize, x: &mut [S]) {
    for i in (0..n).rev() {
        x[i] = x[i] / l[i * n + i];
        let (before, from) = x.split_at_mut(i);
        add_scaled(before, -from[0], &l[i * n..i * n + i]);
    }
}

/// Sweeps after which one-sided Jacobi stops whatever happened; it converges in five to eight.
const SWEEPS: usize = 30;

/// Makes the rows of `a` (k x length) orthogonal by rotations, applying the same rotations to the
/// rows of `v` (k x k): on return a = V a_0 with V orthogonal, and the row norms are the singular
/// values (one-sided Jacobi: Hestenes 1958; small values keep their relative accuracy, Demmel &
/// Veselic 1992).
pub fn orthogonalise_rows<S: Scalar>(a: &mut [S], length: usize, v: &mut [S], k: usize) {
    v.fill(S::ZERO);
    for i in 0..k {
        v[i * k + i] = S::ONE;
    }
    // Rows this small are rounding: turning them further never ends.
    let nothing = S::EPSILON * S::EPSILON * largest_square(a, k, length);
    let threshold = S::EPSILON + S::EPSILON;
    for _ in 0..SWEEPS {
        let mut rotated = false;
        for i in 1..k {
            for j in 0..i {
                let (x, y) = two_rows(a, length, j, i);
                let (xx, yy, xy) = (dot(x, x), dot(y, y), dot(x, y));
                if xy.abs() <= threshold * (xx * yy).sqrt() || xx <= nothing || yy <= nothing {
                    continue;
                }
                rotated = true;
                let zeta = (yy - xx) / (xy + xy);
                let root = zeta.abs() + (S::ONE + zeta * zeta).sqrt();
                let tangent = if zeta < S::ZERO { -S::ONE / root } else { S::ONE / root };
                let cos = S::ONE / (S::ONE + tangent * tangent).sqrt();
                let sin = cos * tangent;
                rotate(x, y, cos, sin);
                let (x, y) = two_rows(v, k, j, i);
                rotate(x, y, cos, sin);
            }
        }
        if !rotated {
            return;
        }
    }
}

fn two_rows<S>(a: &mut [S], length: usize, first: usize, second: usize) -> (&mut [S], &mut [S]) {
    let (head, tail) = a.split_at_mut(second * length);
    (&mut head[first * length..(first + 1) * length], &mut tail[..length])
}

fn rotate<S: Scalar>(x: &mut [S], y: &mut [S], cos: S, sin: S) {
    for (a, b) in x.iter_mut().zip(y) {
        (*a, *b) = (cos * *a - sin * *b, sin * *a + cos * *b);
    }
}

/// Storage for [`PseudoInverse::solve`]: `v` min(rows, n)^2 numbers, `transposed` rows x n.
pub struct PseudoInverse<'a, S> {
    /// Accumulated rotations.
    pub v: &'a mut [S],
    /// The transposed matrix, where it has more rows than columns.
    pub transposed: &'a mut [S],
}

impl<S: Scalar> PseudoInverse<'_, S> {
    /// y = B^+ r: the least-squares solution of least norm, with singular values dropped whose
    /// square is at most `tolerance` times the largest square. Returns the rank.
    ///
    /// With `damping` > 0 it is the Levenberg-Marquardt step y = B^T (B B^T + mu 1)^-1 r, where mu
    /// is `damping` times the largest squared singular value. B (rows x n) is overwritten.
    pub fn solve(&mut self, b: &mut [S], r: &[S], y: &mut [S], tolerance: S, damping: S) -> usize {
        let (rows, n) = (r.len(), y.len());
        y.fill(S::ZERO);
        if rows == 0 || n == 0 {
            return 0;
        }
        // The rows of W = V A are orthogonal, A being B or its transpose, whichever has fewer rows.
        let wide = rows <= n;
        let (w, k, length) = if wide {
            (&mut b[..rows * n], rows, n)
        } else {
            for i in 0..rows {
                for j in 0..n {
                    self.transposed[j * rows + i] = b[i * n + j];
                }
            }
            (&mut self.transposed[..rows * n], n, rows)
        };
        let v = &mut self.v[..k * k];
        orthogonalise_rows(w, length, v, k);
        let largest = largest_square(w, k, length);
        let mut rank = 0;
        for (w, v) in w.chunks_exact(length).zip(v.chunks_exact(k)) {
            let square = dot(w, w);
            if square > tolerance * largest {
                rank += 1;
                let (from, to) = if wide { (v, w) } else { (w, v) };
                add_scaled(y, dot(from, r) / (square + damping * largest), to);
            }
        }
        rank
    }
}

fn largest_square<S: Scalar>(a: &[S], rows: usize, length: usize) -> S {
    let square = |i: usize| dot(&a[i * length..(i + 1) * length], &a[i * length..(i + 1) * length]);
    (0..rows).map(square).fold(S::ZERO, |most, x| if x > most { x } else { most })
}
