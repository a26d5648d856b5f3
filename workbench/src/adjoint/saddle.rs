//! Kane's equations with loops as one linear system, and its solution where rows depend on each other.
//!
//! ```text
//! M x - J^T y = a,   J x = b:    M = L L^T,  W = J L^-T = U S V^T,  z = L^-1 a
//! x = L^-T (z + V (S^-1 U^T b - V^T z)),   y = U S^-1 (S^-1 U^T b - V^T z)
//! ```
//!
//! The matrix is symmetric but for a sign, so that adjoints solve the same system: with M m - J^T n = x' and J m = 0,
//! x'^T dx = m^T (da - dM x + dJ^T y) - n^T (db - dJ x).

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};

/// Singular values below this share of the largest say nothing: the state is singular.
const SINGULAR: f64 = 1e-6;

/// The system, factored.
pub struct Saddle {
    mass: Cholesky<f64, Dyn>,
    left: DMatrix<f64>,
    /// S.
    values: DVector<f64>,
    right: DMatrix<f64>,
}

impl Saddle {
    /// From M, NU x NU, and from J, of which so many rows are independent. `None` where M is not positive or fewer rows are.
    pub fn new(mass: &[f64], jacobian: &[f64], speeds: usize, rank: usize) -> Option<Self> {
        let mass = DMatrix::from_row_slice(speeds, speeds, mass).cholesky()?;
        let rows = jacobian.len() / speeds.max(1);
        // The columns of W^T are L^-1 times those of J^T.
        let mut weighted = DMatrix::from_column_slice(speeds, rows, jacobian);
        mass.l_dirty().solve_lower_triangular_mut(&mut weighted);
        let svd = weighted.transpose().svd(true, true);
        let (left, right) = (svd.u?, svd.v_t?);
        let mut order: Vec<usize> = (0..svd.singular_values.len()).collect();
        order.sort_by(|a, b| svd.singular_values[*b].total_cmp(&svd.singular_values[*a]));
        order.truncate(rank);
        let values =
            DVector::from_iterator(order.len(), order.iter().map(|k| svd.singular_values[*k]));
        let is_regular =
            order.len() == rank && (rank == 0 || values[rank - 1] > SINGULAR * values[0]);
        is_regular.then(|| Self {
            mass,
            left: left.select_columns(&order),
            right: right.select_rows(&order),
            values,
        })
    }

    /// x and y for a and b.
    pub fn solve(&self, a: &[f64], b: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let lower = self.mass.l_dirty();
        let mut x = DVector::from_column_slice(a);
        lower.solve_lower_triangular_mut(&mut x);
        let mut along = self.left.tr_mul(&DVector::from_column_slice(b));
        along.component_div_assign(&self.values);
        along -= &self.right * &x;
        x += self.right.tr_mul(&along);
        lower.tr_solve_lower_triangular_mut(&mut x);
        let y = &self.left * along.component_div(&self.values);
        (x.as_slice().to_vec(), y.as_slice().to_vec())
    }
}
