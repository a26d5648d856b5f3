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

use crate::acceleration::{blame, not_finite, write};
use crate::closure_rows::weigh;
use crate::constants::{FADING_ASIDE, FADING_RATE, SPEED_ACROSS, SPEED_ALONG};
use crate::linear::{
    add_scaled, backward, combine, dot, exchange, factor, forward, orthogonalise, set_scaled,
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
    difference(system, (t, q, u), distance, beside, out, workspace)?;

    let mass = split(&mut workspace, n * n)?;
    let rows = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    write(system, t, q, u, EquationsMut { mass, forcing: out, jacobian: rows, gamma })?;
    for (beside, &gamma) in beside.chunks_exact_mut(width).zip(&*gamma) {
        beside[n + 1] = -gamma;
    }
    factor(mass, n).map_err(|joint| blame(&[q, u], mass, joint))?;
    let push = split(&mut workspace, n)?;
    forward(mass, out);

    let k = orthogonalise(rows, beside, c, n);
    rows[k * n..].fill(Y::Scalar::ZERO);
    let largest = rows.chunks_exact(n).fold(Y::Scalar::ZERO, |most, row| most.max(length(row)));
    let path = Path { u, speed, gap, zone, largest };
    let rhs = gamma;
    let Some(strong) = path.strong_first(rows, beside, rhs) else { return Ok(None) };
    let rank = path.replace_fading(rows, beside, rhs, strong);
    if path.leads_aside(&rows[strong * n..rank * n], &mut beside[strong * width..]) {
        return Ok(None);
    }

    let (rows, rhs) = (&mut rows[..rank * n], &mut rhs[..rank]);
    weigh(mass, rows, n);
    for (value, row) in rhs.iter_mut().zip(rows.chunks_exact(n)) {
        *value -= dot(row, out);
    }
    orthogonalise(rows, rhs, rank, n);
    combine(rows, rhs, push);
    add_scaled(out, Y::Scalar::ONE, push);
    backward(mass, out);
    match not_finite(&[out]) {
        Some(joint) => Err(Error::NotFinite { joint }),
        None => Ok(Some(Constraint::passing(rank, gap.is_closed()))),
    }
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
    fn strong_first(&self, rows: &mut [S], beside: &mut [S], rhs: &mut [S]) -> Option<usize> {
        let (n, width) = (self.u.len(), self.u.len() + 2);
        let mut strong = 0;
        for i in 0..rhs.len() {
            let row = &rows[i * n..(i + 1) * n];
            let value = length(row);
            if value > self.zone * self.largest {
                exchange(rows, n, i, strong);
                exchange(beside, width, i, strong);
                strong += 1;
            } else if value > self.gap.cut() * self.largest {
                let across = dot(row, self.u).abs();
                if across > S::from_f64(SPEED_ACROSS) * value * self.speed {
                    return None;
                }
            }
        }
        for i in 0..strong {
            let row = &mut rows[i * n..(i + 1) * n];
            let scale = S::ONE / length(row);
            row.iter_mut().for_each(|value| *value *= scale);
            rhs[i] = beside[i * width + n + 1] * scale;
        }
        Some(strong)
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
    ) -> usize {
        let (n, width, c) = (self.u.len(), self.u.len() + 2, rhs.len());
        let (kept, fading) = rows.split_at_mut(strong * n);
        for (i, row) in fading.chunks_exact_mut(n).enumerate() {
            let beside = &mut beside[(strong + i) * width..];
            row.swap_with_slice(&mut beside[..n]);
            let along = dot(row, self.u) / self.speed;
            let near = S::from_f64(SPEED_ALONG) * length(&beside[..n]) / self.largest;
            if along.abs() <= near * length(row) {
                add_scaled(row, -along / self.speed, self.u);
            }
            let mut wanted = -beside[n];
            for (kept, &value) in kept.chunks_exact(n).zip(&*rhs) {
                let share = dot(row, kept);
                add_scaled(row, -share, kept);
                wanted -= share * value;
            }
            rhs[strong + i] = wanted;
        }
        let least = S::from_f64(FADING_RATE) * self.largest;
        let count = match fading.is_empty() {
            true => 0,
            false => orthogonalise(fading, &mut rhs[strong..], c - strong, n),
        };
        let mut rank = strong;
        for i in strong..strong + count {
            let value = length(&rows[i * n..(i + 1) * n]);
            if value > least {
                exchange(rows, n, i, rank);
                let row = &mut rows[rank * n..(rank + 1) * n];
                row.iter_mut().for_each(|entry| *entry = *entry / value);
                rhs[rank] = rhs[i] / value;
                rank += 1;
            }
        }
        rank
    }

    /// Whether the motion passes beside the singular state: it turns a row instead of letting it fade, and
    /// the faded row does not lie among what the rows change by (orthonormal `changes`).
    fn leads_aside(&self, changes: &[S], faded: &mut [S]) -> bool {
        let n = self.u.len();
        faded.chunks_exact_mut(n + 2).any(|faded| {
            let faded = &mut faded[..n];
            let value = length(faded);
            if value <= self.gap.cut() * self.largest {
                return false;
            }
            for row in changes.chunks_exact(n) {
                let share = dot(faded, row);
                add_scaled(faded, -share, row);
            }
            let aside = S::from_f64(FADING_ASIDE).max(self.gap.uncertainty(value / self.largest));
            length(faded) > (aside + aside) * value
        })
    }
}

/// dJ/ds and a third of dgamma/ds by differences over a distance (rad) along the path from q at the speeds u, into rows
/// of n + 2 numbers. `forcing` is overwritten.
fn difference<Y: Mechanism>(
    system: &Y,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    distance: Y::Scalar,
    beside: &mut [Y::Scalar],
    forcing: &mut [Y::Scalar],
    mut workspace: &mut [Y::Scalar],
) -> Result<(), Error> {
    let n = u.len();
    let c = beside.len() / (n + 2);
    let mass = split(&mut workspace, n * n)?;
    let jacobian = split(&mut workspace, c * n)?;
    let gamma = split(&mut workspace, c)?;
    let half = Y::Scalar::from_f64(0.5) / distance;
    let sixth = half / Y::Scalar::from_f64(3.0);
    let time = distance / dot(u, u).sqrt();
    let (mut at, mut step) = (system.initial().q, system.speeds());
    beside.fill(Y::Scalar::ZERO);
    for sign in [-Y::Scalar::ONE, Y::Scalar::ONE] {
        at.as_mut().copy_from_slice(q);
        set_scaled(step.as_mut(), sign * time, u);
        system.advance(at.as_mut(), step.as_ref());
        let out = EquationsMut { mass, forcing, jacobian, gamma };
        write(system, t, at.as_ref(), u, out)?;
        let rows = jacobian.chunks_exact(n).zip(&*gamma);
        for (beside, (row, &gamma)) in beside.chunks_exact_mut(n + 2).zip(rows) {
            add_scaled(&mut beside[..n], sign * half, row);
            beside[n] += sign * sixth * gamma;
        }
    }
    Ok(())
}
