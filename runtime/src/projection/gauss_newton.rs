//! Steps of Gauss-Newton onto the closure, with a decision on the rank.
//!
//! ```text
//! q += -M^-1 J^T (J M^-1 J^T)^+ r        u += -M^-1 J^T (J M^-1 J^T)^+ J u
//! ```

use super::worst_loop;
use crate::acceleration::{blame, not_finite};
use crate::constants::{PROJECTION_STEPS, STEP_HALVINGS, UNDECIDED_FACTOR};
use crate::decomposition::Decomposition;
use crate::linear::{
    add_scaled, backward, combine, copy, dot, factor, max_abs, normalise, rows_of_mut, set_scaled,
};
use crate::plumbing::EquationsMut;
use crate::rank::{Gap, closed_to_rounding};
use crate::workspace::split;
use crate::{Error, Mechanism, Scalar};

/// The closure, linearised at q, with the mass matrix as the metric.
pub(super) struct GaussNewton<'a, S> {
    /// s.
    t: S,
    /// L.
    loops: usize,
    /// Factor of M.
    mass: &'a [S],
    /// r, 9 L + D; also the right-hand side.
    residual: &'a mut [S],
    /// J, (9 L + D) x N; then its orthogonal rows.
    jacobian: &'a mut [S],
    /// N.
    pub(super) step: &'a mut [S],
}

impl<'a, S: Scalar> GaussNewton<'a, S> {
    /// With the metric at a state; and a place for coordinates.
    pub(super) fn new<Y: Mechanism<Scalar = S>>(
        system: &Y,
        t: S,
        q: &[S],
        u: &[S],
        mut workspace: &'a mut [S],
    ) -> Result<(Self, &'a mut [S]), Error> {
        let dimensions = system.dimensions();
        let (n, c) = (dimensions.speeds, dimensions.rows);
        let r = 9 * dimensions.loops + dimensions.drives;
        let mass = split(&mut workspace, n * n)?;
        {
            // Only M is of interest: the closure takes the place of the rest.
            let mut rest = &mut *workspace;
            let forcing = split(&mut rest, n)?;
            let jacobian = split(&mut rest, c * n)?;
            let gamma = split(&mut rest, c)?;
            system.write_equations(t, q, u, EquationsMut { mass, forcing, jacobian, gamma })?;
        }
        factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
        let closure = Self {
            t,
            loops: dimensions.loops,
            mass,
            residual: split(&mut workspace, r)?,
            jacobian: split(&mut workspace, r * n)?,
            step: split(&mut workspace, n)?,
        };
        Ok((closure, split(&mut workspace, dimensions.coordinates)?))
    }

    /// The residual r becomes a J u + b r, where for a driven joint the prescribed speed is taken from J u.
    pub(super) fn add_rates<Y: Mechanism<Scalar = S>>(&mut self, system: &Y, u: &[S], a: S, b: S) {
        let n = u.len();
        for (value, row) in self.residual.iter_mut().zip(self.jacobian.chunks_exact(n.max(1))) {
            *value = a * dot(row, u) + b * *value;
        }
        let mut driven = self.residual.iter_mut().skip(9 * self.loops);
        system.drives(self.t, |drive| {
            if let Some(value) = driven.next() {
                *value -= a * system.size() * drive.speed;
            }
        });
    }

    /// Residual and Jacobian at q; the largest residual.
    pub(super) fn evaluate<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        q: &[S],
    ) -> Result<S, Error> {
        let n = self.step.len();
        let (mut driven, mut rows) = (&mut *self.residual, &mut *self.jacobian);
        let residual = split(&mut driven, 9 * self.loops)?;
        let jacobian = split(&mut rows, 9 * self.loops * n)?;
        system.write_closure(q, residual, jacobian)?;
        rows.fill(S::ZERO);
        let mut slots = driven.iter_mut().zip(rows.chunks_exact_mut(n.max(1)));
        system.drives(self.t, |drive| {
            if let Some((residual, row)) = slots.next() {
                *residual = system.size() * (q[drive.joint] - drive.position);
                row[drive.joint] = system.size();
            }
        });
        let size = max_abs(self.residual);
        if size.is_finite() {
            return Ok(size);
        }
        match not_finite(&[q]) {
            Some(joint) => Err(Error::NotFinite { joint }),
            None => Err(self.open(system)),
        }
    }

    /// Which constraint is not met.
    pub(super) fn open<Y: Mechanism<Scalar = S>>(&self, system: &Y) -> Error {
        let (loop_index, largest) = worst_loop(self.residual, self.loops);
        let mut error = Error::NotClosed { loop_index, residual: largest.to_f32(), joint: None };
        let mut values = self.residual.iter().skip(9 * self.loops);
        system.drives(self.t, |drive| {
            if let Some(&value) = values.next()
                && !(value.abs() <= largest)
            {
                error = Error::NotDriven { joint: drive.joint };
            }
        });
        error
    }

    /// The step of least weighted length that takes the residual away, and the rank. Residual and
    /// Jacobian are lost. Of a vector of this `length`, what lies across the closure is taken away
    /// only where it is more than the directions themselves are uncertain by.
    pub(super) fn solve(
        &mut self,
        decomposition: Decomposition,
        gap: Gap<S>,
        length: S,
    ) -> Result<usize, Error> {
        let (n, m) = (self.step.len(), self.residual.len());
        let kept = decomposition.independent_of_loops(self.jacobian, self.residual, [m, n], gap)?;
        let k = kept.rank;
        let (jacobian, residual) =
            (rows_of_mut(self.jacobian, n, 0..k)?, rows_of_mut(self.residual, 1, 0..k)?);
        let singular = |row: &[S]| dot(row, row).sqrt();
        let all = jacobian.chunks_exact(n.max(1));
        let largest = all.clone().fold(S::ZERO, |most, row| most.max(singular(row)));
        for (value, row) in residual.iter_mut().zip(all) {
            let uncertain = singular(row) * length * gap.uncertainty(singular(row) / largest);
            // Written so that NaN is kept and seen.
            *value = if value.abs() <= uncertain { S::ZERO } else { -*value };
        }
        normalise(jacobian, residual, n);
        decomposition.weigh(self.mass, jacobian, n);
        decomposition.orthogonalise(jacobian, residual, [k, n])?;
        combine(jacobian, residual, self.step);
        backward(self.mass, self.step);
        Ok(k)
    }

    /// Leaves residual and Jacobian at the final q; returns the largest residual.
    ///
    /// If the reliable directions do not close the loops next to a singular state, q goes to the
    /// nearest branch if `decided` is set: between branches Newton's step is shortened until it
    /// reduces the residual.
    pub(super) fn move_coordinates<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        q: &mut [S],
        decided: bool,
        previous: &mut [S],
    ) -> Result<S, Error> {
        let enough = closed_to_rounding(system);
        let (far, half) = (S::from_f64(UNDECIDED_FACTOR) * enough, S::from_f64(0.5));
        let mut trial = system.speeds();
        let mut nearest = false;
        let mut size = self.evaluate(system, q)?;
        for _ in 0..PROJECTION_STEPS {
            if size <= enough {
                break;
            }
            copy(previous, q)?;
            let gap = Gap::of(system, if nearest { S::ZERO } else { size });
            self.solve(Decomposition::of(system), gap, S::ZERO)?;
            let (tries, progress) = if nearest { (STEP_HALVINGS, size) } else { (1, size * half) };
            let mut share = S::ONE;
            let mut found = None;
            for _ in 0..tries {
                copy(q, previous)?;
                set_scaled(trial.as_mut(), share, self.step);
                system.advance(q, trial.as_ref());
                let next = self.evaluate(system, q).ok().filter(|next| *next < progress);
                if next.is_some() {
                    found = next;
                    break;
                }
                share *= half;
            }
            if let Some(next) = found {
                size = next;
                continue;
            }
            copy(q, previous)?;
            size = self.evaluate(system, q)?;
            if nearest || !decided || size <= far {
                break;
            }
            nearest = true;
        }
        Ok(size)
    }

    /// Makes J u = 0 (for a driven joint: its speed), with the Jacobian of the last
    /// [`evaluate`](Self::evaluate).
    pub(super) fn move_speeds<Y: Mechanism<Scalar = S>>(
        &mut self,
        system: &Y,
        u: &mut [S],
        gap: Gap<S>,
    ) -> Result<usize, Error> {
        self.add_rates(system, u, S::ONE, S::ZERO);
        let rank = self.solve(Decomposition::of(system), gap, dot(u, u).sqrt())?;
        add_scaled(u, S::ONE, self.step);
        Ok(rank)
    }
}
