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
    /// L.
    pub lower: DMatrix<f64>,
    /// y.
    pub free: DVector<f64>,
    /// W.
    pub weighted: DMatrix<f64>,
    /// b = -gamma - W y.
    pub rhs: DVector<f64>,
    /// Columns: an orthonormal basis of the range of what is kept of W.
    pub range: DMatrix<f64>,
    /// The least singular value of W that is kept.
    pub least_kept: f64,
    /// The size of what is dropped of W, which its largest singular value there does not exceed.
    pub dropped: f64,
}

impl Equations {
    /// The constrained acceleration; eigenvalues of J M^-1 J^T below `cut` of the largest are
    /// dropped.
    pub fn solve(&self, cut: f64) -> Constrained {
        let n = self.forcing.len();
        let lower = Cholesky::new(self.mass.clone()).expect("a positive definite matrix").l();
        let columns = lower.solve_lower_triangular(&self.jacobian.transpose());
        let weighted = columns.expect("a regular factor").transpose();
        let free = lower.solve_lower_triangular(&self.forcing).expect("a regular factor");
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
        let (basis, inner) = (weighted.transpose() * &range).qr().unpack();
        let inner = inner.transpose();
        let solution = inner.solve_lower_triangular(&(range.transpose() * &rhs));
        let solution = &free + &basis * solution.expect("independent directions");
        let acceleration =
            lower.transpose().solve_upper_triangular(&solution).expect("a regular factor");
        let least_kept = inner.singular_values().min();
        let dropped = (&weighted - &weighted * &basis * basis.transpose()).norm();
        Constrained {
            acceleration,
            rank,
            spectrum,
            lower,
            free,
            weighted,
            rhs,
            range,
            least_kept,
            dropped,
        }
    }
}

/// The constant of Wedin's bound |A^+ - B^+| <= c |A^+| |B^+| |A - B| for matrices of one rank
/// ("Perturbation theory for pseudo-inverses", 1973).
const WEDIN: f64 = 1.619;

impl Constrained {
    /// |L^T v|, the length of a vector of rates in the metric of mass.
    pub fn length(&self, rates: &DVector<f64>) -> f64 {
        (self.lower.transpose() * rates).norm()
    }

    /// How far, in the metric of mass, an acceleration by the rows T W may be from this one.
    ///
    /// With W = W_r + E, W_r of the rank kept and |E| what is dropped, and b = W_r x + r, r across
    /// the range of W_r,
    ///
    /// ```text
    /// (T W_r)^+ T b - W_r^+ b = (T W_r)^+ T r,   |(T W_r)^+| <= 1 / (tau s_r)
    /// ```
    ///
    /// where tau is the least singular value of T on the range and s_r the least of W_r; and what
    /// is kept of T W is within 2 |T E| of T W_r. The rows of T are orthonormal, so that |T| = 1.
    pub fn by_other_rows(&self, selection: &DMatrix<f64>, other: &Self) -> f64 {
        let tau = (selection * &self.range).singular_values().min();
        let across = (&self.rhs - &self.range * (self.range.transpose() * &self.rhs)).norm();
        let inverse = 1.0 / (tau * self.least_kept);
        let turned = WEDIN * inverse / other.least_kept * 2.0 * self.dropped;
        across * inverse + turned * self.rhs.norm()
    }

    /// How far, in the metric of mass at this state, the acceleration at another one nearby may
    /// be, when what is kept of W has the same rank: to first order
    ///
    /// ```text
    /// |d(W_r^+)| <= 3 |dW| / (s_r (s_r - s_d))
    /// ```
    ///
    /// with s_r the least singular value kept and s_d the greatest dropped: one share each for
    /// what happens within the spaces kept and for the turns of the two spaces, left and right.
    pub fn by_distance(&self, other: &Self) -> f64 {
        let inverse = 1.0 / self.least_kept;
        let gap = self.least_kept - self.dropped;
        let weights = (&other.weighted - &self.weighted).norm();
        let metric = other.lower.solve_lower_triangular(&self.lower).expect("a regular factor");
        let metric = (metric - DMatrix::identity(self.free.len(), self.free.len())).norm();
        3.0 * weights * inverse / gap * self.rhs.norm()
            + (&other.rhs - &self.rhs).norm() * inverse
            + (&other.free - &self.free).norm()
            + metric * other.length(&other.acceleration)
    }
}
