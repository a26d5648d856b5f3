//! Gauss's principle: of all accelerations that meet linear equations, those nearest to the free ones.

use nalgebra::{DMatrix, DVector};

/// Singular values of the scaled hinge equations below this fraction of the largest are zero: well
/// above rounding, and below anything but a configuration next to a singular one.
const RANK_TOLERANCE: f64 = 1e-9;

/// Number of passes. Each pass gains sixteen digits less twice those of the condition number.
const PASSES: usize = 6;

/// The accelerations that meet the equations.
#[derive(Clone, Debug)]
pub struct Constrained {
    /// The accelerations.
    pub accelerations: DVector<f64>,
    /// Independent equations.
    pub rank: usize,
    /// Singular values over the largest, in descending order.
    pub spectrum: Vec<f64>,
}

/// The point nearest to `free`, in the norm of W, that satisfies `rows` a = `rhs`, where
/// W^-1 = `root` `root`^T.
pub fn constrain(
    rows: &DMatrix<f64>,
    rhs: &DVector<f64>,
    free: &DVector<f64>,
    root: &DMatrix<f64>,
) -> Constrained {
    if rows.nrows() == 0 {
        return Constrained { accelerations: free.clone(), rank: 0, spectrum: Vec::new() };
    }
    let mut scaled = rows * root;
    let mut weights = DVector::zeros(rows.nrows());
    for (i, mut row) in scaled.row_iter_mut().enumerate() {
        // A row between two fixed bodies is zero.
        let norm = row.norm();
        weights[i] = if norm > 0.0 { 1.0 / norm } else { 0.0 };
        row *= weights[i];
    }
    let svd = scaled.clone().svd(true, false);
    let most = svd.singular_values.max();
    let tolerance = RANK_TOLERANCE * most;
    let mut accelerations = free.clone();
    let Some(left) = &svd.u else { unreachable!("these vectors were asked for") };
    // Each pass takes away what rounding left of those before. Every step is a combination of the rows, however
    // exact the singular vectors are: sometimes they have six digits only.
    for _ in 0..PASSES {
        let violation = (rhs - rows * &accelerations).component_mul(&weights);
        let mut multipliers = left.tr_mul(&violation);
        for (multiplier, value) in multipliers.iter_mut().zip(&svd.singular_values) {
            *multiplier = if *value > tolerance { *multiplier / (value * value) } else { 0.0 };
        }
        accelerations += root * scaled.tr_mul(&(left * multipliers));
    }
    let mut spectrum: Vec<f64> = svd.singular_values.iter().map(|value| value / most).collect();
    spectrum.sort_by(|a, b| b.total_cmp(a));
    let rank = spectrum.iter().filter(|&&value| value > RANK_TOLERANCE).count();
    Constrained { accelerations, rank, spectrum }
}
