//! What ties the speeds of a design together: rows J with J u = 0, of which some may depend on others.

use lamc::arithmetic::largest;
use nalgebra::{DMatrix, DVector};

/// Eigenvalues of J^T J below this share of the largest are rounding errors: singular values below 1e-6 of the largest.
const SINGULAR: f64 = 1e-12;

/// The rows, and J^T J = V S^2 V^T.
///
/// That squares J, so that what is solved is corrected once by its residual.
#[derive(Clone, Debug)]
pub struct Ties {
    rows: DMatrix<f64>,
    /// V without the directions in which J is zero.
    across: DMatrix<f64>,
    /// S^2.
    squares: DVector<f64>,
    /// A basis N of the directions with J N = 0, one column each.
    pub free: DMatrix<f64>,
}

impl Ties {
    /// Of the rows J.
    pub fn new(rows: DMatrix<f64>) -> Self {
        let eigen = (rows.transpose() * &rows).symmetric_eigen();
        let largest = largest(&eigen.eigenvalues);
        let is_free = |index: &usize| eigen.eigenvalues[*index] <= SINGULAR * largest;
        let (free, across): (Vec<usize>, Vec<usize>) = (0..rows.ncols()).partition(is_free);
        let mut ties = Self {
            across: eigen.eigenvectors.select_columns(&across),
            squares: DVector::from_iterator(
                across.len(),
                across.iter().map(|index| eigen.eigenvalues[*index]),
            ),
            free: eigen.eigenvectors.select_columns(&free),
            rows,
        };
        ties.free -= ties.along(&(&ties.rows * &ties.free));
        ties
    }

    /// The d of J d = `load` with the smallest length, J^+ times the load.
    pub fn along(&self, load: &DMatrix<f64>) -> DMatrix<f64> {
        let once = |load: &DMatrix<f64>| self.squared(&self.rows.tr_mul(load));
        let found = once(load);
        let missing = load - &self.rows * &found;
        found + once(&missing)
    }

    /// The l of J^T l = `load` with the smallest length.
    pub fn multipliers(&self, load: &DMatrix<f64>) -> DMatrix<f64> {
        let once = |load: &DMatrix<f64>| &self.rows * self.squared(load);
        let found = once(load);
        let missing = load - self.rows.tr_mul(&found);
        found + once(&missing)
    }

    /// (J^T J)^+ times the load.
    fn squared(&self, load: &DMatrix<f64>) -> DMatrix<f64> {
        let mut shares = self.across.tr_mul(load);
        shares.column_iter_mut().for_each(|mut column| column.component_div_assign(&self.squares));
        &self.across * shares
    }
}
