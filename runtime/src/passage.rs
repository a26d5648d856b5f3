//! Passing through a singular state: constraints that fade on the way.
//!
//! A row w of the closure that fades along a motion has a direction to the last: w / |w| tends to
//! dw/dt / |dw/dt|. Where w itself is too short to show it, the difference of the row a little ahead on
//! the motion and a little behind does, and a motion keeps its branch. With w du/dt + gamma = 0 all along
//! the motion, and J and gamma of the closure c, the same limit (de l'Hospital's) gives the right-hand
//! side:
//!
//! ```text
//! d/dt (w du/dt + gamma) = 3 dw/dt du/dt + c'''(u, u, u) + w d2u/dt2,    w -> 0
//! dw/dt du/dt = -1/3 c'''(u, u, u) = -1/3 dgamma/dt at constant u
//! ```

use core::mem;

use crate::acceleration::{blame, not_finite, write};
use crate::constants::{FADING_ASIDE, FADING_RATE, SPEED_ACROSS, SPEED_ALONG};
use crate::decomposition::Decomposition;
use crate::linear::{
    add_scaled, backward, combine, copy, dot, exchange, factor, forward, orthogonalise, rows_of,
    rows_of_mut, set_scaled,
};
use crate::plumbing::{Dimensions, EquationsMut};
use crate::rank::{Fading, Gap};
use crate::workspace::split;
use crate::{Arithmetic, Constraint, Error, Mechanism, Scalar};

/// Writes du/dt at a state next to a singular state through which the motion passes into `out`.
/// Directions that have faded to less than the fraction `zone` of the strongest are replaced by
/// their derivatives along the motion. `None` at rest and where the speeds do not lie along a
/// branch.
pub(crate) fn pass<Y: Mechanism>(
    system: &Y,
    dimensions: Dimensions,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    (gap, zone): (Gap<Y::Scalar>, Y::Scalar),
    mut workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Option<Constraint>, Error> {
    let (n, c) = (dimensions.speeds, dimensions.rows + dimensions.drives);
    let speed = dot(u, u).sqrt();
    if !(speed > Y::Scalar::ZERO) {
        return Ok(None);
    }
    // dJ/ds and a third of dgamma/ds along the path (rad), then -gamma: n + 2 columns.
    let width = n + 2;
    let beside = split(&mut workspace, c * width)?;
    let distance = Fading::<Y::Scalar>::of_rounding().beside;
    difference(system, dimensions, (t, q, u), distance, beside, out, workspace)?;

    let mass = split(&mut workspace, n * n)?;
    let rows = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    write(system, t, q, u, EquationsMut { mass, forcing: out, jacobian: rows, gamma })?;
    for (beside, &gamma) in beside.chunks_exact_mut(width.max(1)).zip(&*gamma) {
        let (_, [_, wanted]) = parts(beside)?;
        *wanted = -gamma;
    }
    factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
    let push = split(&mut workspace, n)?;
    forward(mass, out);

    let k = orthogonalise(rows, beside, c, n)?;
    rows_of_mut(rows, n, k..c)?.fill(Y::Scalar::ZERO);
    let all = rows.chunks_exact(n.max(1));
    let largest = all.fold(Y::Scalar::ZERO, |most, row| most.max(length(row)));
    let path = Path { u, speed, gap, zone, largest };
    let rhs = gamma;
    let Some(strong) = path.strong_first(rows, beside, rhs)? else { return Ok(None) };
    let rank = path.replace_fading(rows, beside, rhs, strong)?;
    let changes = rows_of(rows, n, strong..rank)?;
    if path.leads_aside(changes, rows_of_mut(beside, width, strong..c)?)? {
        return Ok(None);
    }

    let (rows, rhs) = (rows_of_mut(rows, n, 0..rank)?, rows_of_mut(rhs, 1, 0..rank)?);
    let decomposition = Decomposition::of(system);
    decomposition.weigh(mass, rows, n);
    for (value, row) in rhs.iter_mut().zip(rows.chunks_exact(n.max(1))) {
        *value -= dot(row, out);
    }
    decomposition.orthogonalise(rows, rhs, [rank, n])?;
    combine(rows, rhs, push);
    add_scaled(out, Y::Scalar::ONE, push);
    backward(mass, out);
    match not_finite(&[out]) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(Some(Constraint::passing(rank, gap.is_closed()))),
    }
}

/// The parts of a row of n + 2 numbers: the first n, and the last two.
fn parts<S>(beside: &mut [S]) -> Result<(&mut [S], &mut [S; 2]), Error> {
    let given = beside.len();
    beside.split_last_chunk_mut().ok_or(Error::Length { expected: 2, given })
}

fn length<S: Arithmetic>(row: &[S]) -> S {
    dot(row, row).sqrt()
}

/// A motion along which rows fade. `rows` have n entries, those `beside` them n + 2.
struct Path<'a, S> {
    u: &'a [S],
    /// |u|.
    speed: S,
    gap: Gap<S>,
    /// Rows shorter than this share of the longest have faded.
    zone: S,
    /// The length of the longest row.
    largest: S,
}

impl<S: Scalar> Path<'_, S> {
    /// Moves the rows that have not faded to the front, normalised and with their right-hand side.
    /// Returns `None` if the speeds do not determine a branch.
    fn strong_first(
        &self,
        rows: &mut [S],
        beside: &mut [S],
        rhs: &mut [S],
    ) -> Result<Option<usize>, Error> {
        let (n, width) = (self.u.len(), self.u.len() + 2);
        let mut strong = 0;
        for i in 0..rhs.len() {
            let row = rows_of(rows, n, i..i + 1)?;
            let value = length(row);
            if value > self.zone * self.largest {
                exchange(rows, n, i, strong)?;
                exchange(beside, width, i, strong)?;
                strong += 1;
            } else if value > self.gap.cut() * self.largest {
                let across = dot(row, self.u).abs();
                if across > S::from_f64(SPEED_ACROSS) * value * self.speed {
                    return Ok(None);
                }
            }
        }
        let beside = beside.chunks_exact_mut(width.max(1));
        let rows = rows.chunks_exact_mut(n.max(1)).zip(rhs).zip(beside).take(strong);
        for ((row, rhs), beside) in rows {
            let (_, [_, wanted]) = parts(beside)?;
            let scale = S::ONE / length(row);
            row.iter_mut().for_each(|value| *value *= scale);
            *rhs = *wanted * scale;
        }
        Ok(Some(strong))
    }

    /// Replaces faded rows by their derivatives, orthogonal to the strong rows; `beside` receives
    /// the old values. Returns the number of remaining rows.
    ///
    /// Where the speeds lie along a branch, what of a row is along them belongs to the distance from the
    /// singular state; where they do not yet, the whole row turns them towards one.
    fn replace_fading(
        &self,
        rows: &mut [S],
        beside: &mut [S],
        rhs: &mut [S],
        strong: usize,
    ) -> Result<usize, Error> {
        let (n, c) = (self.u.len(), rhs.len());
        let (mut fading, mut fading_rhs) = (&mut *rows, &mut *rhs);
        let kept = split(&mut fading, strong * n)?;
        let kept_rhs = split(&mut fading_rhs, strong)?;
        let beside = rows_of_mut(beside, n + 2, strong..c)?.chunks_exact_mut((n + 2).max(1));
        let replaced = fading.chunks_exact_mut(n.max(1)).zip(beside).zip(&mut *fading_rhs);
        for ((row, beside), rhs) in replaced {
            let (old, [change, _]) = parts(beside)?;
            row.iter_mut().zip(&mut *old).for_each(|(row, old)| mem::swap(row, old));
            let along = dot(row, self.u) / self.speed;
            let near = S::from_f64(SPEED_ALONG) * length(old) / self.largest;
            if along.abs() <= near * length(row) {
                add_scaled(row, -along / self.speed, self.u);
            }
            let mut wanted = -*change;
            for (kept, &value) in kept.chunks_exact(n.max(1)).zip(&*kept_rhs) {
                let share = dot(row, kept);
                add_scaled(row, -share, kept);
                wanted -= share * value;
            }
            *rhs = wanted;
        }
        let count = orthogonalise(fading, fading_rhs, c - strong, n)?;
        let least = S::from_f64(FADING_RATE) * self.largest;
        let mut rank = strong;
        for i in strong..strong + count {
            let value = length(rows_of(rows, n, i..i + 1)?);
            if value > least {
                exchange(rows, n, i, rank)?;
                exchange(rhs, 1, i, rank)?;
                let row = rows_of_mut(rows, n, rank..rank + 1)?.iter_mut();
                row.chain(rows_of_mut(rhs, 1, rank..rank + 1)?)
                    .for_each(|entry| *entry = *entry / value);
                rank += 1;
            }
        }
        Ok(rank)
    }

    /// Whether the motion passes beside the singular state: it turns a row instead of letting it fade, and
    /// the faded row does not lie among what the rows change by (orthonormal `changes`).
    fn leads_aside(&self, changes: &[S], faded: &mut [S]) -> Result<bool, Error> {
        let n = self.u.len();
        for faded in faded.chunks_exact_mut((n + 2).max(1)) {
            let (faded, _) = parts(faded)?;
            let value = length(faded);
            if value <= self.gap.cut() * self.largest {
                continue;
            }
            for row in changes.chunks_exact(n.max(1)) {
                let share = dot(faded, row);
                add_scaled(faded, -share, row);
            }
            let aside = S::from_f64(FADING_ASIDE).max(self.gap.uncertainty(value / self.largest));
            if length(faded) > (aside + aside) * value {
                return Ok(true);
            }
        }
        Ok(false)
    }
}

/// dJ/ds and a third of dgamma/ds by differences over a distance (rad) along the path from q at the speeds u, into rows
/// of n + 2 numbers. `forcing` is overwritten.
fn difference<Y: Mechanism>(
    system: &Y,
    dimensions: Dimensions,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    distance: Y::Scalar,
    beside: &mut [Y::Scalar],
    forcing: &mut [Y::Scalar],
    mut workspace: &mut [Y::Scalar],
) -> Result<(), Error> {
    let (n, c) = (dimensions.speeds, dimensions.rows + dimensions.drives);
    let mass = split(&mut workspace, n * n)?;
    let jacobian = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    let half = Y::Scalar::from_f64(0.5) / distance;
    let sixth = half / Y::Scalar::from_f64(3.0);
    let time = distance / dot(u, u).sqrt();
    let (mut at, mut step) = (system.initial().q, system.speeds());
    beside.fill(Y::Scalar::ZERO);
    for sign in [-Y::Scalar::ONE, Y::Scalar::ONE] {
        copy(at.as_mut(), q)?;
        set_scaled(step.as_mut(), sign * time, u);
        system.advance(at.as_mut(), step.as_ref());
        let out = EquationsMut { mass, forcing, jacobian, gamma };
        write(system, t, at.as_ref(), u, out)?;
        let rows = jacobian.chunks_exact(n.max(1)).zip(&*gamma);
        for (beside, (row, &gamma)) in beside.chunks_exact_mut((n + 2).max(1)).zip(rows) {
            let (difference, [change, _]) = parts(beside)?;
            add_scaled(difference, sign * half, row);
            *change += sign * sixth * gamma;
        }
    }
    Ok(())
}
