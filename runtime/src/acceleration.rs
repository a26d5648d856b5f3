//! The constrained acceleration, finite wherever the mass matrix is positive definite.
//!
//! ```text
//! du/dt = M^-1 (f + J^T lambda),   lambda = (J M^-1 J^T)^+ (-gamma - J M^-1 f)
//! ```
//!
//! With M = L L^T, B = J L^-T and z = L^-1 f this is du/dt = L^-T (z + B^+ (-gamma - B z)): the
//! pseudo-inverse of B is that of the constraints weighted by the mass matrix. Where B has full row
//! rank and is well conditioned a Cholesky factor of B B^T serves; else its singular values decide.

use crate::linear::{add_scaled, cholesky, dot, solve_lower, solve_upper};
use crate::workspace::{Parts, split};
use crate::{EquationsMut, Error, Scalar, System};

/// Singular values of J M^-1 J^T below this fraction of the largest count as zero.
pub const RANK_TOLERANCE: f64 = 1e-7;

/// The accelerations du/dt (rad/s^2) at a state, into `out`. Returns the rank of the closure rows.
///
/// # Errors
/// When the mass matrix is not positive definite, or a result is not finite.
pub fn acceleration<M: System>(
    system: &M,
    t: M::Scalar,
    q: &[M::Scalar],
    u: &[M::Scalar],
    workspace: &mut [M::Scalar],
    out: &mut [M::Scalar],
) -> Result<usize, Error> {
    let d = system.dimensions();
    let n = d.coordinates;
    let Parts { mass, jacobian, weighted, residual, rhs, forcing, y, trial, wanted, mut inverse } =
        split(workspace, d, d.rows)?;
    if q.len() != n || u.len() != n || out.len() != n {
        return Err(Error::Workspace);
    }
    let gamma = residual;
    let equations = EquationsMut { mass, forcing, jacobian, gamma };
    system.write_equations(t, q, u, equations);
    cholesky(mass, n).map_err(|joint| Error::MassMatrix { joint })?;
    solve_lower(mass, n, forcing);
    let mut rank = 0;
    if d.rows > 0 {
        for (row, (rhs, gamma)) in jacobian.chunks_exact_mut(n).zip(rhs.iter_mut().zip(gamma)) {
            solve_lower(mass, n, row);
            *rhs = -*gamma - dot(row, forcing);
        }
        rank = if full_rank_solve(jacobian, rhs, y, inverse.transposed, trial, wanted) {
            d.rows
        } else {
            weighted.copy_from_slice(jacobian);
            let tolerance = M::Scalar::from_f64(RANK_TOLERANCE);
            inverse.solve(weighted, rhs, y, tolerance, M::Scalar::ZERO)
        };
        add_scaled(forcing, M::Scalar::ONE, y);
    }
    solve_upper(mass, n, forcing);
    if let Some(joint) = forcing.iter().position(|x| !x.is_finite()) {
        return Err(Error::NotFinite { joint });
    }
    out.copy_from_slice(forcing);
    Ok(rank)
}

/// y = B^T (B B^T)^-1 r by Cholesky, where B has certainly full row rank and a condition that
/// leaves two thirds of the digits; else `false`, and y is not touched.
fn full_rank_solve<S: Scalar>(
    b: &[S],
    r: &[S],
    y: &mut [S],
    gram: &mut [S],
    lambda: &mut [S],
    column: &mut [S],
) -> bool {
    let (rows, n) = (r.len(), y.len());
    if rows > n {
        return false;
    }
    let (gram, lambda) = (&mut gram[..rows * rows], &mut lambda[..rows]);
    let mut trace = S::ZERO;
    for i in 0..rows {
        for j in 0..=i {
            gram[i * rows + j] = dot(&b[i * n..(i + 1) * n], &b[j * n..(j + 1) * n]);
        }
        trace += gram[i * rows + i];
    }
    if cholesky(gram, rows).is_err() {
        return false;
    }
    // The trace bounds the largest eigenvalue, |L^-1|_F^2 the inverse of the least.
    let mut inverse_square = S::ZERO;
    for i in 0..rows {
        let column = &mut column[..rows];
        column.fill(S::ZERO);
        column[i] = S::ONE;
        solve_lower(gram, rows, column);
        inverse_square += dot(column, column);
    }
    let limit = S::from_f64(1e-2) / S::EPSILON.sqrt();
    let well_conditioned = trace * inverse_square < limit;
    if !well_conditioned {
        return false;
    }
    lambda.copy_from_slice(r);
    solve_lower(gram, rows, lambda);
    solve_upper(gram, rows, lambda);
    y.fill(S::ZERO);
    for (row, &lambda) in b.chunks_exact(n).zip(lambda.iter()) {
        add_scaled(y, lambda, row);
    }
    true
}
