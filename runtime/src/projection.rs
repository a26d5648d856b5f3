//! Back onto the closed loops: q by Gauss-Newton on all nine residuals of every loop, then u onto
//! J u = 0. Both are the least change in the norm of the mass matrix.
//!
//! ```text
//! q <- q - M^-1 J^T (J M^-1 J^T)^+ r(q)   until r is rounding;   u <- u - M^-1 J^T (J M^-1 J^T)^+ J u
//! ```

use crate::acceleration::RANK_TOLERANCE;
use crate::linear::{add_scaled, cholesky, dot, solve_lower, solve_upper};
use crate::workspace::{Parts, split};
use crate::{EquationsMut, Error, Scalar, System};

/// Gauss-Newton steps: it converges quadratically, so more than a few mean that it cannot.
const ITERATIONS: usize = 8;

/// Residuals below this are closed, m: 1e-13 of the size, or what the precision allows.
pub(crate) fn closed<M: System>(system: &M) -> M::Scalar {
    let few_roundings = M::Scalar::from_f64(16.0) * M::Scalar::EPSILON;
    few_roundings.max(M::Scalar::from_f64(1e-13)) * system.size()
}

/// Largest magnitude.
pub(crate) fn largest<S: Scalar>(values: &[S]) -> S {
    values.iter().fold(S::ZERO, |most, x| most.max(x.abs()))
}

/// Projects q and u; returns the largest closure residual that is left, m.
///
/// # Errors
/// When the mass matrix is not positive definite or the state is not finite.
pub fn project<M: System>(
    system: &M,
    t: M::Scalar,
    q: &mut [M::Scalar],
    u: &mut [M::Scalar],
    workspace: &mut [M::Scalar],
) -> Result<M::Scalar, Error> {
    let d = system.dimensions();
    let n = d.coordinates;
    if q.len() != n || u.len() != n {
        return Err(Error::Workspace);
    }
    if d.loops == 0 {
        return Ok(M::Scalar::ZERO);
    }
    let most_rows = if d.rows > 9 * d.loops { d.rows } else { 9 * d.loops };
    let Parts { mass, jacobian, weighted, residual, rhs, forcing, y, mut inverse, .. } =
        split(workspace, d, most_rows)?;
    let equations = EquationsMut {
        mass,
        forcing,
        jacobian: &mut jacobian[..d.rows * n],
        gamma: &mut residual[..d.rows],
    };
    system.write_equations(t, q, u, equations);
    cholesky(mass, n).map_err(|joint| Error::MassMatrix { joint })?;
    let (jacobian, weighted) = (&mut jacobian[..9 * d.loops * n], &mut weighted[..9 * d.loops * n]);
    let (residual, rhs) = (&mut residual[..9 * d.loops], &mut rhs[..9 * d.loops]);
    let tolerance = M::Scalar::from_f64(RANK_TOLERANCE);
    let mut correct = |jacobian: &[M::Scalar], rhs: &[M::Scalar], x: &mut [M::Scalar]| {
        weighted.copy_from_slice(jacobian);
        weighted.chunks_exact_mut(n).for_each(|row| solve_lower(mass, n, row));
        inverse.solve(weighted, rhs, y, tolerance, M::Scalar::ZERO);
        solve_upper(mass, n, y);
        add_scaled(x, -M::Scalar::ONE, y);
    };
    system.write_closure(q, residual, jacobian);
    let mut open = largest(residual);
    for _ in 0..ITERATIONS {
        if open <= closed(system) {
            break;
        }
        forcing.copy_from_slice(q);
        correct(jacobian, residual, q);
        system.write_closure(q, residual, jacobian);
        let now = largest(residual);
        // A step that does not help (or is not a number) is taken back.
        let helped = now < open;
        if !helped {
            q.copy_from_slice(forcing);
            system.write_closure(q, residual, jacobian);
            break;
        }
        open = now;
    }
    for (rate, row) in rhs.iter_mut().zip(jacobian.chunks_exact(n)) {
        *rate = dot(row, u);
    }
    correct(jacobian, rhs, u);
    match u.iter().chain(q.iter()).position(|x| !x.is_finite()) {
        Some(index) => Err(Error::NotFinite { joint: index % n }),
        None => Ok(open),
    }
}
