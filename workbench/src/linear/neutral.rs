//! Neutral directions: displacements that no force opposes, the null space of the stiffness K. A free body that
//! nothing holds has six, a joint without a spring one, and what stands on the ground those along it.
//!
//! The null space is spanned by the right singular vectors of K whose singular values are rounding. Any basis of it
//! would do; the Gauss-Jordan method makes the one in which each direction has a speed that the others do not have.

use nalgebra::DMatrix;

use super::{Linear, STIFFNESS_ROUNDING};

/// What is smaller than this share of the largest component of a direction is rounding.
const ROUNDING: f64 = 1e-12;

impl Linear {
    /// The neutral directions, by speed, their largest component 1.
    pub fn neutral_directions(&self) -> Vec<Vec<f64>> {
        let stiffness = self.stiffness();
        let (speeds, freedoms) = (self.basis.len(), stiffness.nrows());
        if freedoms == 0 {
            return Vec::new();
        }
        let parts = stiffness.svd(false, true);
        let rounding = STIFFNESS_ROUNDING * f64::EPSILON * parts.singular_values.max();
        let found = parts.singular_values.iter().enumerate();
        let neutral: Vec<usize> =
            found.filter(|(_, value)| **value <= rounding).map(|(k, _)| k).collect();
        let Some(right) = parts.v_t else { return Vec::new() };
        let mut directions = DMatrix::from_fn(speeds, neutral.len(), |speed, k| {
            let row = right.row(neutral[k]);
            self.basis[speed].iter().zip(row.iter()).map(|(t, z)| t * z).sum()
        });
        separate(&mut directions);
        let column = |k: usize| {
            let column = directions.column(k);
            let largest = column[column.icamax()];
            let clean =
                |x: &f64| if x.abs() < ROUNDING * largest.abs() { 0.0 } else { x / largest };
            column.iter().map(clean).collect()
        };
        (0..neutral.len()).map(column).collect()
    }
}

/// Combines independent columns so that each has a row of its own, in the order of these rows.
fn separate(columns: &mut DMatrix<f64>) {
    let mut pivots = Vec::new();
    for k in 0..columns.ncols() {
        let (row, other) = columns.columns_range(k..).icamax_full();
        columns.swap_columns(k, k + other);
        let pivot = columns[(row, k)];
        columns.column_mut(k).scale_mut(1.0 / pivot);
        for j in (0..columns.ncols()).filter(|j| *j != k) {
            let share = columns[(row, j)];
            let own = columns.column(k).clone_owned();
            columns.column_mut(j).axpy(-share, &own, 1.0);
            columns[(row, j)] = 0.0;
        }
        pivots.push(row);
    }
    let mut order: Vec<usize> = (0..pivots.len()).collect();
    order.sort_by_key(|k| pivots[*k]);
    *columns = columns.select_columns(&order);
}
