//! Constrained acceleration the dense way, for comparison with the runtime's. Which constraints count
//! is decided on J, without masses, and by how well the loops are closed:
//!
//! ```text
//! J = U S V^T + E                  singular values s > 2 sqrt(g) max s are kept, E is dropped
//! V^T a = V^T p,  p = -V S^-1 U^T gamma
//! M = L L^T,  y = L^-1 f
//! L^T a = y + P (L^T p - y)        P projects onto the columns of L^-1 V
//! ```
//!
//! Of all a that meet the constraints kept, this is the one nearest to M^-1 f in the metric of mass:
//! F. E. Udwadia and R. E. Kalaba, "A new perspective on constrained motion", 1992. Masses never
//! multiply what is weak, so that a weak direction of J costs epsilon over its singular value, no
//! more.

use nalgebra::{Cholesky, DMatrix, DVector};

/// Singular values of J up to this share of the largest are dropped, for loops that are open by
/// `openness` of the mechanism's size: beyond it the direction of a constraint is not known. Closed
/// ones are open by four units in the last place.
pub fn cut(openness: f64) -> f64 {
    2.0 * openness.max(4.0 * f64::EPSILON).sqrt()
}

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

/// The solution of the equations.
#[derive(Clone, Debug)]
pub struct Constrained {
    /// The equations.
    pub equations: Equations,
    /// du/dt, rad/s^2.
    pub acceleration: DVector<f64>,
    /// Singular values of J that were kept.
    pub rank: usize,
    /// Its singular values over the largest, in descending order.
    pub spectrum: Vec<f64>,
    /// L.
    pub lower: DMatrix<f64>,
    /// y.
    pub free: DVector<f64>,
    /// U, rows x rank.
    pub range: DMatrix<f64>,
    /// The singular values that are kept, m.
    pub kept: DVector<f64>,
    /// V, N x rank.
    pub directions: DMatrix<f64>,
    /// S^T, rank x rank: triangular.
    pub triangle: DMatrix<f64>,
    /// An orthonormal basis of the columns of L^-1 V.
    pub weighted: DMatrix<f64>,
    /// p.
    pub particular: DVector<f64>,
    /// |E|, which the largest singular value that is dropped does not exceed, m.
    pub dropped: f64,
}

impl Equations {
    /// The constrained acceleration; singular values of J up to `cut` of the largest are dropped.
    ///
    /// # Panics
    ///
    /// If M is not positive definite, or the singular values of J are not those of its factors.
    pub fn solve(self, cut: f64) -> Constrained {
        let lower = Cholesky::new(self.mass.clone()).expect("a positive definite matrix").l();
        let free = lower.solve_lower_triangular(&self.forcing).expect("a regular factor");

        let Factors { values, left } = Factors::of(&self.jacobian);
        let largest = values.max();
        let spectrum: Vec<f64> = values.iter().map(|value| value / largest).collect();
        let rank = spectrum.iter().filter(|&&value| value > cut).count();

        // Once to the rows of J and back, in the order of their size, so that weak directions keep their digits.
        let directions = self.jacobian.tr_mul(&left.columns(0, rank)).qr().q();
        let range = (&self.jacobian * directions).qr().q();
        let (directions, triangle) = self.jacobian.tr_mul(&range).qr().unpack();
        let kept = triangle.singular_values();
        let dropped = (&self.jacobian - &range * (&directions * &triangle).transpose()).norm();
        let neglected = values.rows(rank, values.len() - rank).norm();
        let error = (dropped - neglected).abs() / largest;
        assert!(error < 1e-13, "singular values dropped off by {error:e}");

        let wanted = triangle.tr_solve_upper_triangular(&range.tr_mul(&self.gamma));
        let particular = -&directions * wanted.expect("independent directions");
        let weighted =
            lower.solve_lower_triangular(&directions).expect("a regular factor").qr().q();
        let wanted = lower.tr_mul(&particular) - &free;
        let solution = &free + &weighted * weighted.tr_mul(&wanted);
        let acceleration = lower.tr_solve_lower_triangular(&solution).expect("a regular factor");
        Constrained {
            equations: self,
            acceleration,
            rank,
            spectrum,
            lower,
            free,
            range,
            kept,
            directions,
            triangle,
            weighted,
            particular,
            dropped,
        }
    }
}

/// Singular values in descending order, and the left singular vectors.
struct Factors {
    values: DVector<f64>,
    left: DMatrix<f64>,
}

impl Factors {
    /// From the eigenvectors (u, v) of the symmetric matrix of J and J^T beside the diagonal, whose
    /// eigenvalues are s and -s: all to epsilon of the largest. nalgebra's own decomposition errs by up
    /// to 1e-7 where singular values are nearly zero.
    fn of(jacobian: &DMatrix<f64>) -> Self {
        let (m, n) = jacobian.shape();
        let mut both = DMatrix::zeros(m + n, m + n);
        both.view_mut((0, m), (m, n)).copy_from(jacobian);
        both.view_mut((m, 0), (n, m)).copy_from(&jacobian.transpose());
        let eigen = both.symmetric_eigen();
        let mut order: Vec<usize> = (0..m + n).collect();
        order.sort_by(|&i, &j| eigen.eigenvalues[j].total_cmp(&eigen.eigenvalues[i]));
        order.truncate(m.min(n));
        let values = order.iter().map(|&i| eigen.eigenvalues[i].max(0.0));
        let values = DVector::from_iterator(order.len(), values);
        let left: Vec<_> =
            order.iter().map(|&i| eigen.eigenvectors.column(i).rows(0, m).into_owned()).collect();
        Self { values, left: DMatrix::from_columns(&left) }
    }
}

/// Rounding of the two kinematics and of two ways to solve, in units in the last place of the largest
/// entries.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

impl Constrained {
    /// |L^T v|, the length of a vector of rates in the metric of mass.
    pub fn length(&self, rates: &DVector<f64>) -> f64 {
        self.lower.tr_mul(rates).norm()
    }

    /// The least singular value of J that is kept, m.
    pub fn least(&self) -> f64 {
        self.kept.min()
    }

    /// The share of gamma that no acceleration meets, m/s^2.
    fn contradiction(&self) -> DVector<f64> {
        let gamma = &self.equations.gamma;
        gamma - &self.range * self.range.tr_mul(gamma)
    }

    /// How far, in the metric of mass, the acceleration moves when what is kept of J, A, becomes
    /// A + F of the same rank, with |F| and the least singular value of A + F given: with the three
    /// terms of
    ///
    /// ```text
    /// (A + F)^+ - A^+ = -(A + F)^+ F A^+  +  ((A + F)^T (A + F))^+ F^T (1 - A A^+)
    ///                   - (1 - (A + F)^+ (A + F)) F^T (A A^T)^+
    /// ```
    ///
    /// (P.-A. Wedin, "Perturbation theory for pseudo-inverses", 1973) for p, and the turn of the
    /// columns of V by |F| over the least singular value for the projection P.
    fn by_change(&self, change: f64, least: f64) -> f64 {
        let values = self.lower.singular_values();
        let (heaviest, lightest) = (values.max(), values.min());
        let particular = self.particular.norm();
        let shift = particular * (1.0 / least + 1.0 / self.least())
            + self.contradiction().norm() / (least * least);
        let wanted = self.lower.tr_mul(&self.particular) - &self.free;
        change * (heaviest * shift + heaviest / lightest / least * wanted.norm())
    }

    /// How far rounding moves the acceleration, in the metric of mass, at these speeds.
    pub fn by_rounding(&self, u: &[f64]) -> f64 {
        let rounding = ROUNDING * self.kept.max();
        let speed: f64 = u.iter().map(|u| u * u).sum();
        self.by_change(rounding, self.least()) + self.lower.norm() * rounding * speed / self.least()
    }

    /// How far, in the metric of mass, an acceleration by the rows T J may be from this one.
    ///
    /// With J = A + E, A = U S V^T what is kept, and gamma = -A p + r, r across the range of A, the
    /// rows T A ask for an acceleration that differs by
    ///
    /// ```text
    /// (T A)^+ T gamma - A^+ gamma = V S^-1 (T U)^+ T r
    /// ```
    ///
    /// and what is kept of T J is within 2 |T E| of T A. The rows of T are orthonormal, so that
    /// |T| = 1.
    pub fn by_other_rows(&self, selection: &DMatrix<f64>, other: &Self) -> f64 {
        let (basis, triangle) = (selection * &self.range).qr().unpack();
        let seen = basis.tr_mul(&(selection * self.contradiction()));
        let shares = triangle.solve_upper_triangular(&seen).expect("rows that see all of J");
        let shares = self.triangle.tr_solve_upper_triangular(&shares);
        let shift = &self.directions * shares.expect("independent directions");
        let shift = self.weighted.tr_mul(&self.lower.tr_mul(&shift)).norm();
        shift + self.by_change(2.0 * self.dropped, other.least().min(self.least()))
    }

    /// How far, in the metric of mass at this state, the acceleration at another one nearby may be,
    /// when what is kept of J has the same rank. What is kept changes, to first order, by
    ///
    /// ```text
    /// |dA| <= sqrt(2) |dJ| s_r / (s_r - s_d)
    /// ```
    ///
    /// with s_r the least singular value kept and s_d the greatest dropped.
    pub fn by_distance(&self, other: &Self) -> f64 {
        let n = self.free.len();
        let least = self.least().min(other.least());
        let dropped = self.dropped.max(other.dropped);
        let change = (&other.equations.jacobian - &self.equations.jacobian).norm();
        let change = 2.0_f64.sqrt() * change * least / (least - dropped);
        let gamma = (&other.equations.gamma - &self.equations.gamma).norm();
        let metric = other.lower.solve_lower_triangular(&self.lower).expect("a regular factor");
        let metric = (metric - DMatrix::identity(n, n)).norm();
        let wanted = self.lower.tr_mul(&self.particular) - &self.free;
        self.by_change(change, least)
            + self.lower.norm() * gamma / least
            + (&other.free - &self.free).norm()
            + metric
                * (wanted.norm()
                    + other.length(&other.particular)
                    + other.length(&other.acceleration))
    }
}
