//! Projection of a state onto the closure, by the least change weighted with M.
//!
//! Coordinates by Gauss-Newton on all nine residuals r of each loop, q += -M^-1 J^T (J M^-1
//! J^T)^+ r, then speeds onto J u = 0 in the same metric, u += -M^-1 J^T (J M^-1 J^T)^+ J u: what
//! keeps an index-1 integration on the constraints. A driven joint is a tenth kind of residual,
//! its distance from where it should be times the mechanism's size. After E. Hairer, C. Lubich, G. Wanner,
//! "Geometric Numerical Integration", IV.4; E. Eich, "Convergence results for a coordinate
//! projection method", 1993.
//!
//! Where no direction of the closure is weak, loops are closed to 1e-12 of the mechanism's size; next to
//! a singular state, where a residual says little of the position, to rounding. How far off the
//! directions themselves are is known there ([`rank`](crate::rank)), and speeds are corrected by no less
//! than that: what is rounding must not turn them away from their branch.

use crate::acceleration::{blame, holds, not_finite};
use crate::closure_rows::weigh;
use crate::constants::{PROJECTION_STEPS, STEP_HALVINGS, UNDECIDED_FACTOR};
use crate::linear::{
    add_scaled, backward, combine, dot, factor, keep, max_abs, normalise, orthogonalise, reduce,
};
use crate::rank::{Gap, bearable, closed, closed_finely};
use crate::workspace::{check, split};
use crate::{Arithmetic, Dimensions, EquationsMut, Error, ProjectionMut, Scalar, System};

/// What a projection reached.
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct Projected<S> {
    /// Largest closure residual left, m.
    pub residual: S,
    /// Independent rows among all nine of every loop.
    pub rank: usize,
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

/// Moves q (rad) onto the closure and u (rad/s) onto its tangent, driven joints to where they
/// should be at t (s). Without loops and drives nothing happens.
///
/// # Errors
///
/// [`Error::NotClosed`] or [`Error::NotDriven`] if q is too far away; [`Error::MassMatrix`], [`Error::NotFinite`],
/// [`Error::Workspace`], [`Error::Length`].
#[inline]
pub fn project<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    project_within(system, t, q, u, closed(system), workspace)
}

/// As [`project`], to rounding everywhere.
pub(crate) fn project_finely<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    project_within(system, t, q, u, closed_finely(system), workspace)
}

/// As [`project`]; loops that are closed by elimination are closed to `enough` (m).
#[inline]
fn project_within<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    enough: Y::Scalar,
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    let dimensions = check(system, workspace, &[q.len(), u.len()])?;
    if dimensions.loops + dimensions.drives == 0 {
        return Ok(Projected { residual: Y::Scalar::ZERO, rank: 0 });
    }
    match directly(system, q, u, enough, workspace) {
        Some(projected) => projected,
        None => generally(system, t, q, u, workspace),
    }
}

/// Moves the state of a stage of an integrator next to a singular state as near to the closure as
/// directions that are certain lead: which branch it belongs to is not decided here.
pub(crate) fn project_stage<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<(), Error> {
    check(system, workspace, &[q.len(), u.len()])?;
    let (mut closure, previous) = Closure::new(system, t, q, u, workspace)?;
    let residual = closure.move_coordinates(system, q, false, previous)?;
    closure.move_speeds(system, u, Gap::of(system, residual));
    Ok(())
}

/// With a decision on the rank. Much code, seldom needed: not to be inlined.
#[inline(never)]
fn generally<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    workspace: &mut [Y::Scalar],
) -> Result<Projected<Y::Scalar>, Error> {
    let (mut closure, previous) = Closure::new(system, t, q, u, workspace)?;
    let residual = closure.move_coordinates(system, q, true, previous)?;
    if !(residual <= bearable(system)) {
        return Err(closure.open(system));
    }
    let rank = closure.move_speeds(system, u, Gap::of(system, residual));
    match not_finite(&[q, u]) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(Projected { residual, rank }),
    }
}

/// By the system's own elimination, where that holds and closes the loops; otherwise q and u stay as
/// they are.
#[inline]
fn directly<Y: System>(
    system: &Y,
    q: &mut [Y::Scalar],
    u: &mut [Y::Scalar],
    enough: Y::Scalar,
    mut workspace: &mut [Y::Scalar],
) -> Option<Result<Projected<Y::Scalar>, Error>> {
    let Dimensions { coordinates: n, rows, loops, drives, .. } = system.dimensions();
    if drives != 0 {
        return None;
    }
    let residual = split(&mut workspace, 9 * loops).ok()?;
    let positions = split(&mut workspace, n).ok()?;
    let speeds = split(&mut workspace, n).ok()?;
    let given = split(&mut workspace, n).ok()?;
    given.copy_from_slice(q);
    let mut before = None;
    for _ in 0..PROJECTION_STEPS {
        let out = ProjectionMut { residual, positions, speeds };
        let margin = system.write_projection(q, u, out);
        if !holds(&margin) {
            break;
        }
        // Written so that NaN is not closed.
        if residual.iter().all(|x| x.abs() <= enough) {
            let moved = subtract(u, speeds);
            return Some(moved.map(|()| Projected { residual: max_abs(residual), rank: rows }));
        }
        // Written so that NaN is no progress.
        let size = max_abs(residual);
        if !before.is_none_or(|before| size + size < before) {
            break;
        }
        before = Some(size);
        add_scaled(q, -Y::Scalar::ONE, positions);
    }
    q.copy_from_slice(given);
    None
}

/// `x -= y`, one number after the other: y comes fresh from single stores, which a wide load would
/// have to wait for.
#[inline]
fn subtract<S: Scalar>(x: &mut [S], y: &[S]) -> Result<(), Error> {
    for (joint, (x, &y)) in x.iter_mut().zip(y).enumerate() {
        *x -= y;
        if !x.is_finite() {
            return Err(Error::NotFinite { joint });
        }
    }
    Ok(())
}

/// Adds to du/dt what restores the constraints, -M^-1 J^T (J M^-1 J^T)^+ (2 g J u + g^2 r), all
/// nine rows per loop, with the gain g (1/s).
pub(crate) fn restore<Y: System>(
    system: &Y,
    t: Y::Scalar,
    q: &[Y::Scalar],
    u: &[Y::Scalar],
    gain: Y::Scalar,
    workspace: &mut [Y::Scalar],
    acceleration: &mut [Y::Scalar],
) -> Result<(), Error> {
    let dimensions = check(system, workspace, &[q.len(), u.len(), acceleration.len()])?;
    if dimensions.loops + dimensions.drives == 0 {
        return Ok(());
    }
    let (mut closure, _) = Closure::new(system, t, q, u, workspace)?;
    let residual = closure.evaluate(system, q)?;
    closure.add_rates(system, u, gain + gain, gain * gain);
    closure.solve(Gap::of(system, residual), Y::Scalar::ZERO);
    add_scaled(acceleration, Y::Scalar::ONE, closure.step);
    Ok(())
}

/// The linearised closure and the metric.
struct Closure<'a, S> {
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
    step: &'a mut [S],
}

impl<'a, S: Scalar> Closure<'a, S> {
    /// With the metric at a state; and a vector more.
    fn new<Y: System<Scalar = S>>(
        system: &Y,
        t: S,
        q: &[S],
        u: &[S],
        mut workspace: &'a mut [S],
    ) -> Result<(Self, &'a mut [S]), Error> {
        let dimensions = system.dimensions();
        let (n, c) = (dimensions.coordinates, dimensions.rows);
        let r = 9 * dimensions.loops + dimensions.drives;
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
        let closure = Self {
            t,
            loops: dimensions.loops,
            mass,
            residual: split(&mut workspace, r)?,
            jacobian: split(&mut workspace, r * n)?,
            step: split(&mut workspace, n)?,
        };
        Ok((closure, split(&mut workspace, n)?))
    }

    /// The residual r becomes a J u + b r, where for a driven joint J u is less its due speed.
    fn add_rates<Y: System<Scalar = S>>(&mut self, system: &Y, u: &[S], a: S, b: S) {
        let n = u.len();
        for (value, row) in self.residual.iter_mut().zip(self.jacobian.chunks_exact(n.max(1))) {
            *value = a * dot(row, u) + b * *value;
        }
        let mut driven = self.residual[9 * self.loops..].iter_mut();
        system.drives(self.t, |drive| {
            if let Some(value) = driven.next() {
                *value -= a * system.size() * drive.speed;
            }
        });
    }

    /// Residual and Jacobian at q; the largest residual.
    fn evaluate<Y: System<Scalar = S>>(&mut self, system: &Y, q: &[S]) -> Result<S, Error> {
        let n = self.step.len();
        let (residual, driven) = self.residual.split_at_mut(9 * self.loops);
        let (jacobian, rows) = self.jacobian.split_at_mut(9 * self.loops * n);
        system.write_closure(q, residual, jacobian);
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
    fn open<Y: System<Scalar = S>>(&self, system: &Y) -> Error {
        let (residual, driven) = self.residual.split_at(9 * self.loops);
        let (loop_index, largest) = worst_loop(residual);
        let mut error = Error::NotClosed { loop_index, residual: largest.to_f64(), joint: None };
        let mut values = driven.iter();
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
    fn solve(&mut self, gap: Gap<S>, length: S) -> usize {
        let (n, rows) = (self.step.len(), self.residual.len());
        // Nine rows per loop are redundant: only what reduction leaves of them is looked at.
        let k = reduce(self.jacobian, self.residual, rows, n);
        let (jacobian, residual) = (&mut self.jacobian[..k * n], &mut self.residual[..k]);
        let k = orthogonalise(jacobian, residual, k, n);
        let k = keep(jacobian, residual, k, n, gap.cut()).rank;
        let (jacobian, residual) = (&mut jacobian[..k * n], &mut residual[..k]);
        let singular = |row: &[S]| dot(row, row).sqrt();
        let largest = jacobian.chunks_exact(n).fold(S::ZERO, |most, row| most.max(singular(row)));
        for (value, row) in residual.iter_mut().zip(jacobian.chunks_exact(n)) {
            let uncertain = singular(row) * length * gap.uncertainty(singular(row) / largest);
            // Written so that NaN is kept and seen.
            *value = if value.abs() <= uncertain { S::ZERO } else { -*value };
        }
        normalise(jacobian, residual, n);
        weigh(self.mass, jacobian, n);
        orthogonalise(jacobian, residual, k, n);
        combine(jacobian, residual, self.step);
        backward(self.mass, self.step);
        k
    }

    /// Leaves residual and Jacobian at the final q; returns the largest residual.
    ///
    /// Where the directions that are certain do not close the loops, next to a singular state, q goes
    /// to whichever branch is nearest if this is to be `decided`: between branches Newton's step is
    /// shortened until it closes the loops a little.
    fn move_coordinates<Y: System<Scalar = S>>(
        &mut self,
        system: &Y,
        q: &mut [S],
        decided: bool,
        previous: &mut [S],
    ) -> Result<S, Error> {
        let enough = closed_finely(system);
        let (far, half) = (S::from_f64(UNDECIDED_FACTOR) * enough, S::from_f64(0.5));
        let mut nearest = false;
        let mut size = self.evaluate(system, q)?;
        for _ in 0..PROJECTION_STEPS {
            if size <= enough {
                break;
            }
            previous.copy_from_slice(q);
            self.solve(Gap::of(system, if nearest { S::ZERO } else { size }), S::ZERO);
            let (tries, progress) = if nearest { (STEP_HALVINGS, size) } else { (1, size * half) };
            let mut share = S::ONE;
            let mut found = None;
            for _ in 0..tries {
                q.copy_from_slice(previous);
                add_scaled(q, share, self.step);
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
            q.copy_from_slice(previous);
            size = self.evaluate(system, q)?;
            if nearest || !decided || size <= far {
                break;
            }
            nearest = true;
        }
        Ok(size)
    }

    /// Makes J u = 0 (for a driven joint: its speed), with the Jacobian that [`evaluate`](Self::evaluate) left.
    fn move_speeds<Y: System<Scalar = S>>(
        &mut self,
        system: &Y,
        u: &mut [S],
        gap: Gap<S>,
    ) -> usize {
        self.add_rates(system, u, S::ONE, S::ZERO);
        let rank = self.solve(gap, dot(u, u).sqrt());
        add_scaled(u, S::ONE, self.step);
        rank
    }
}
