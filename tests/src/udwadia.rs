//! Constrained acceleration the dense way, for comparison with the runtime's:
//!
//! ```text
//! M = L L^T,  W = J L^-T
//! du/dt = M^-1 (f + J^T lambda),  lambda = (J M^-1 J^T)^+ (-gamma - J M^-1 f)
//!       = L^-T (y + W^+ (-gamma - W y)),  y = L^-1 f
//! ```
//!
//! F. E. Udwadia and R. E. Kalaba, "A new perspective on constrained motion", 1992. Which
//! eigenvalues of J M^-1 J^T = W W^T count is read off W^T W, which has the same; the
//! pseudo-inverse is then that of an orthogonal decomposition of what is kept.

use nalgebra::{Cholesky, DMatrix, DVector};

/// The equations of a mechanism at a state.
#[derive(Clone, Debug)]
pub struct Equations {
    /// M, N x N.
    pub mass: DMatrix<f64>,
    /// f, N.
    pub forcing: DVector<f64>,
    /// J, rows x N.
    pub jacobian: DMatrix<f64>,
    /// gamma, rows.
    pub gamma: DVector<f64>,
}

/// What they say.
#[derive(Clone, Debug)]
pub struct Constrained {
    /// du/dt, rad/s^2.
    pub acceleration: DVector<f64>,
    /// Eigenvalues of J M^-1 J^T that were kept.
    pub rank: usize,
    /// Its eigenvalues over the largest, in descending order; at most N of them.
    pub spectrum: Vec<f64>,
}

impl Constrained {
    /// The least eigenvalue kept, over the largest.
    pub fn least_kept(&self) -> f64 {
        self.spectrum[self.rank - 1]
    }

    /// The greatest eigenvalue dropped, over the largest.
    pub fn greatest_dropped(&self) -> f64 {
        self.spectrum.get(self.rank).map_or(0.0, |value| value.max(0.0))
    }
}

impl Equations {
    /// The constrained acceleration; eigenvalues of J M^-1 J^T below `cut` of the largest are
    /// dropped.
    pub fn solve(&self, cut: f64) -> Constrained {
        let n = self.forcing.len();
        let factor = Cholesky::new(self.mass.clone()).expect("a positive definite mass matrix");
        let lower = factor.l();
        let solved = |b: &DMatrix<f64>| lower.solve_lower_triangular(b).expect("a regular factor");
        let weighted = solved(&self.jacobian.transpose()).transpose();
        let free = solved(&DMatrix::from_column_slice(n, 1, self.forcing.as_slice()))
            .column(0)
            .into_owned();
        let rhs = -&self.gamma - &weighted * &free;

        let eigen = (weighted.transpose() * &weighted).symmetric_eigen();
        let mut order: Vec<usize> = (0..n).collect();
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        let spectrum: Vec<f64> =
            order.iter().map(|&i| eigen.eigenvalues[i] / eigen.eigenvalues[order[0]]).collect();
        let rank = spectrum.iter().filter(|&&value| value >= cut).count();
        let kept: Vec<_> = order[..rank].iter().map(|&i| eigen.eigenvectors.column(i)).collect();

        // Eigenvectors of W^T W are good to epsilon over the ratio of their eigenvalues; once to
        // the range of W and back, in the order of their size, makes it the root of that ratio.
        let range = (&weighted * DMatrix::from_columns(&kept)).qr().q();
        let rows = (weighted.transpose() * &range).qr();
        let inner = (range.transpose() * rhs).as_slice().to_vec();
        let inner = rows
            .r()
            .transpose()
            .solve_lower_triangular(&DVector::from_vec(inner))
            .expect("independent directions");
        let solution = free + rows.q() * inner;
        let acceleration =
            lower.transpose().solve_upper_triangular(&solution).expect("a regular factor");
        Constrained { acceleration, rank, spectrum }
    }

    /// What is left of J du/dt = -gamma, beside the largest term of its rows: more than rounding
    /// where the equations contradict each other or an eigenvalue was dropped that is not zero.
    pub fn contradiction(&self, found: &Constrained) -> f64 {
        let rates = found.acceleration.amax();
        let scale = self.jacobian.amax() * rates + self.gamma.amax();
        (&self.jacobian * &found.acceleration + &self.gamma).amax() / scale
    }
}
