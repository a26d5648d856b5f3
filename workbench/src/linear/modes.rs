//! The modes of a linear system, from its eigenvalues.

use std::f64::consts::TAU;

use nalgebra::{Complex, DMatrix, DVector};

use super::{Linear, Mode};

/// Eigenvalues of A with their shapes, slowest first; of a conjugate pair the upper one.
pub(super) fn modes(linear: &Linear) -> Vec<Mode> {
    let size = linear.a.len();
    if size == 0 {
        return Vec::new();
    }
    let a = DMatrix::from_fn(size, size, |i, k| linear.a[i][k]);
    let mut values: Vec<Complex<f64>> =
        balanced_eigenvalues(&a).into_iter().filter(|value| value.im >= 0.0).collect();
    values.sort_by(|x, y| x.norm().total_cmp(&y.norm()));
    values
        .into_iter()
        .map(|value| {
            let norm = value.norm();
            Mode {
                eigenvalue: [value.re, value.im],
                frequency: norm / TAU,
                damping_ratio: if norm > 0.0 { -value.re / norm } else { 0.0 },
                shape: shape(&a, value, linear),
            }
        })
        .collect()
}

/// Eigenvalues of a matrix scaled so that z and dz/dt weigh alike.
fn balanced_eigenvalues(a: &DMatrix<f64>) -> Vec<Complex<f64>> {
    let d = a.nrows() / 2;
    let stiffness = a.view((d, 0), (d, d)).norm().sqrt();
    let rate = if stiffness > 0.0 { stiffness } else { 1.0 };
    // z in units of dz/dt / rate.
    let scaled = DMatrix::from_fn(2 * d, 2 * d, |i, k| match (i < d, k < d) {
        (true, false) => a[(i, k)] * rate,
        (false, true) => a[(i, k)] / rate,
        _ => a[(i, k)],
    });
    scaled.complex_eigenvalues().iter().copied().collect()
}

/// The part of the speeds in a mode, by inverse iteration.
fn shape(a: &DMatrix<f64>, value: Complex<f64>, linear: &Linear) -> Vec<[f64; 2]> {
    let size = a.nrows();
    let scale = a.norm().max(f64::MIN_POSITIVE);
    let shift = value + Complex::new(scale, scale) * 1e-12;
    let matrix = DMatrix::from_fn(size, size, |i, k| {
        let diagonal = if i == k { shift } else { Complex::ZERO };
        Complex::new(a[(i, k)], 0.0) - diagonal
    });
    let factors = matrix.lu();
    let mut vector = DVector::from_fn(size, |i, _| Complex::new(1.0 + i as f64, 0.5));
    for _ in 0..4 {
        if let Some(next) = factors.solve(&vector) {
            let norm = next.norm();
            if norm.is_finite() && norm > 0.0 {
                vector = next / Complex::new(norm, 0.0);
            }
        }
    }
    let parts: Vec<Complex<f64>> = linear
        .basis
        .iter()
        .map(|row| row.iter().zip(vector.iter()).map(|(&t, &z)| z * t).sum())
        .collect();
    let largest = parts.iter().copied().max_by(|x, y| x.norm().total_cmp(&y.norm()));
    match largest.filter(|largest| largest.norm() > 0.0) {
        Some(largest) => parts.iter().map(|x| x / largest).map(|x| [x.re, x.im]).collect(),
        None => parts.iter().map(|_| [0.0, 0.0]).collect(),
    }
}
