//! Projection of a state onto the closure, by the least change weighted with M.
//!
//! Coordinates by Gauss-Newton on all nine residuals r of each loop, q += -M^-1 J^T (J M^-1
//! J^T)^+ r, then speeds onto J u = 0 in the same metric, u += -M^-1 J^T (J M^-1 J^T)^+ J u: what
//! keeps an index-1 integration on the constraints. After E. Hairer, C. Lubich, G. Wanner,
//! "Geometric Numerical Integration", IV.4; E. Eich, "Convergence results for a coordinate
//! projection method", 1993.

use crate::acceleration::{blame, not_finite, plain, weigh};
use crate::linear::{
    Spectrum, add_scaled, backward, combine, dot, factor, max_abs, orthogonalise, tolerance,
};
use crate::workspace::{check, split};
use crate::{EquationsMut, Error, Scalar, System};

/// Steps of Gauss-Newton; it converges quadratically from where an integrator leaves it.
const ITERATIONS: usize = 12;

/// What a projection reached.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Projected<S> {
    /// Largest closure residual left, m.
    pub residual: S,
    /// Independent rows among all nine of every loop.
    pub rank: usize,
}

/// Residual at which a loop counts as closed: 1e-12 of the mechanism's size; 16 epsilon, about
/// 2e-6 of it, in `f32`.
pub(crate) fn closed<Y: System>(system: &Y) -> Y::Scalar {
    tolerance::<Y::Scalar>(1e-12, 16.0) * system.size()
}

/// The residual that is left when rounding or a singular state stops the iteration may be this
/// large: 1e-9 of the size; a thousand epsilon, about 1e-4 of it, in `f32`.
fn bearable<Y: System>(system: &Y) -> Y::Scalar {
    tolerance::<Y::Scalar>(1e-9, 1000.0) * system.size()
}

/// The loop with the largest residual, and that residual.
pub(crate) fn worst_loop<S: Scalar>(residual: &[S]) -> (usize, S) {
    let mut worst = (0, S::ZERO);
    for (index, part) in residual.chunks_exact(9).enumerate() {
        let size = max_abs(part);
        if worst.1.is_finite() && !(size <= worst.1) {
            worst = (index, size);
        }
    }
    worst
}

/// Moves q (rad) onto the closure and u (rad/s) onto its tangent. Without loops nothing happens.
///
/// # Errors
///
/// [`Error::NotClosed`] if q is too far away; [`Error::MassMatrix`], [`Error::NotFinite`],
/// [`Error::Workspace`], [`Error::Length`].
pub fn project<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    mut workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    let dimensions = check(system, workspace, &[q.len(), u.len()])?;
    if dimensions.loops == 0 {
        return Ok(Projected { residual: Y::Scalar::ZERO, rank: 0 });
    }
    let (n, c, r) = (dimensions.coordinates, dimensions.rows, 9 * dimensions.loops);
    let mass = split(&mut workspace, n * n)?;
    {
        // Only M is of interest: the closure takes the place of the rest.
        let mut rest = &mut *workspace;
        let forcing = split(&mut rest, n)?;
        let jacobian = split(&mut rest, c * n)?;
        let gamma = split(&mut rest, c)?;
        system.write_equations(t, q, u, EquationsMut { mass, forcing, jacobian, gamma });
    }
    factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
    let mut closure = Closure {
        mass,
        residual: split(&mut workspace, r)?,
        jacobian: split(&mut workspace, r * n)?,
        step: split(&mut workspace, n)?,
    };
    let residual = closure.move_coordinates(system, q, split(&mut workspace, n)?)?;
    if !(residual <= bearable(system)) {
        let (loop_index, residual) = worst_loop(closure.residual);
        return Err(Error::NotClosed { loop_index, residual: residual.to_f64(), joint: None });
    }
    let rank = closure.move_speeds(u);
    match not_finite(&[q, u]) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(Projected { residual, rank }),
    }
}

/// The linearised closure and the metric.
struct Closure<'a, S> {
    /// Factor of M.
    mass: &'a [S],
    /// r, 9 L; also the right-hand side.
    residual: &'a mut [S],
    /// J, 9 L x N; then its orthogonal rows.
    jacobian: &'a mut [S],
    /// N.
    step: &'a mut [S],
}

impl<S: Scalar> Closure<'_, S> {
    /// Residual and Jacobian at q; the largest residual.
    fn evaluate<Y: System<Scalar = S>>(&mut self, system: &Y, q: &[S]) -> Result<S, Error> {
        system.write_closure(q, self.residual, self.jacobian);
        let size = max_abs(self.residual);
        if size.is_finite() {
            return Ok(size);
        }
        let (loop_index, residual) = worst_loop(self.residual);
        match not_finite(&[q]) {
            Some(joint) => Err(Error::NotFinite { joint }),
            None => Err(Error::NotClosed { loop_index, residual: residual.to_f64(), joint: None }),
        }
    }

    /// The step of least weighted length that takes the residual (negated here) away, and the
    /// rank.
    fn solve(&mut self, spectrum: Spectrum<S>) -> usize {
        let n = self.step.len();
        for value in self.residual.iter_mut() {
            *value = -*value;
        }
        weigh(self.mass, self.jacobian, n);
        let k = orthogonalise(self.jacobian, self.residual, n);
        let rank = combine(self.jacobian, &self.residual[..k], spectrum, 1, self.step);
        backward(self.mass, self.step);
        rank
    }

    /// Leaves residual and Jacobian at the final q; returns the largest residual.
    fn move_coordinates<Y: System<Scalar = S>>(
        &mut self,
        system: &Y,
        q: &mut [S],
        previous: &mut [S],
    ) -> Result<S, Error> {
        let mut spectrum = plain();
        let mut finer = true;
        let mut size = self.evaluate(system, q)?;
        for _ in 0..ITERATIONS {
            if size <= closed(system) {
                break;
            }
            previous.copy_from_slice(q);
            self.solve(spectrum);
            add_scaled(q, S::ONE, self.step);
            let next = self.evaluate(system, q);
            if matches!(next, Ok(next) if next + next < size) {
                size = next?;
                continue;
            }
            // Stalled: near a singular state the direction that is missing lies below the cut of
            // the acceleration. Position needs it: only what is rounding is dropped.
            if !matches!(next, Ok(next) if next <= size) {
                q.copy_from_slice(previous);
            }
            size = self.evaluate(system, q)?;
            if !finer {
                break;
            }
            finer = false;
            spectrum.cut = tolerance(1e-15, 8.0);
        }
        Ok(size)
    }

    /// Makes J u = 0, with the Jacobian that [`evaluate`](Self::evaluate) left. The cut is that of
    /// the acceleration: a finer one would stop, at each passage of a singular state, speeds that
    /// the acceleration left free, and take their energy away.
    fn move_speeds(&mut self, u: &mut [S]) -> usize {
        let n = u.len();
        for (value, row) in self.residual.iter_mut().zip(self.jacobian.chunks_exact(n.max(1))) {
            *value = dot(row, u);
        }
        let rank = self.solve(plain());
        add_scaled(u, S::ONE, self.step);
        rank
    }
}
