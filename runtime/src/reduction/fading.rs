//! Next to singular states of a part of a sheet: rows of J that fade, each by itself.
//!
//! Where all plates about a vertex are nearly in one plane, the row of its loop across that plane fades. It does by itself, whatever
//! the rest of the sheet does, so that no decomposition of J is needed to see it. What becomes of the row is decided as by a
//! decomposition ([`passage`](crate::passage), [`rank`](crate::rank)), with its length in the place of a singular value:
//!
//! - it stays while its direction is known;
//! - else a motion that passes through the singular state has the row's change along the motion instead;
//! - where neither is known it is left out, and the joint that it determines is independent; unless the compiler has dropped rows,
//!   because they followed from all others.
//!
//! The elimination is that of all other states, with other entries in some rows. Where a pivot fades and its row does not, another joint
//! should determine it: the row is a condition on the independent speeds. Where no joint can, a decomposition decides.

use super::{Motion, Reduction, beyond_solution};
use crate::constants::{
    FADING_ASIDE, FADING_RATE, NOISE_OF_ACCELERATION, SPEED_ACROSS, SPEED_ALONG,
};
use crate::linear::{add_scaled, copy, dot, max_abs, set_scaled};
use crate::plumbing::Dimensions;
use crate::rank::{Fading, Gap};
use crate::trust::beside;
use crate::workspace::split;
use crate::{Arithmetic, Constraint, Error, Mechanism, Scalar};

/// Pivots that are weaker than this lose digits of the rows after them, unless their own rows fade with them.
pub(super) const SPOILING_PIVOT: f64 = 1e-3;

/// du/dt at a state next to a singular state, into `out`; nothing if only a decomposition can tell. Rows shorter than the share `zone`
/// of the longest whose directions are not known well enough are taken along the motion. Where loops `may_be_open` and are, nothing
/// is computed: the caller closes them.
#[inline(always)]
pub(crate) fn accelerate<Y: Mechanism>(
    system: &Y,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    zone: Y::Scalar,
    may_be_open: bool,
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Option<Constraint>, Error> {
    let Dimensions { reduction: sizes, speeds, loops, .. } = system.dimensions();
    match beyond_solution(system) {
        Some(reduction) if sizes.most_independent(speeds, loops) > sizes.independent => {
            by_rows(system, reduction, state, (zone, may_be_open), workspace, out)
        }
        _ => Ok(None),
    }
}

#[inline(never)]
fn by_rows<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    state: (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    (zone, may_be_open): (Y::Scalar, bool),
    workspace: &mut [Y::Scalar],
    out: &mut [Y::Scalar],
) -> Result<Option<Constraint>, Error> {
    let Dimensions { rank, reduction: sizes, .. } = system.dimensions();
    let (t, q, u) = state;
    let gap = beside(system, (q, u), workspace)?;
    let workspace = &mut &mut *workspace;
    let mut motion = Motion::of(system, reduction, workspace)?;
    let rates = split(workspace, sizes.closure)?;
    let openings = split(workspace, sizes.dependent())?;
    motion.write(reduction, state)?;
    let rows = FadingRows::of(system, reduction, gap, motion.terms.closure);
    if may_be_open && !gap.is_closed() {
        return Ok(Some(Constraint::passing(rank, false)));
    }
    let mut solve = |motion: &mut Motion<'_, _>, is_eliminated: bool| {
        if !is_eliminated || !motion.solve((system, t), true, out, &mut [])? {
            return Ok(None);
        }
        let constraint = Constraint::passing(motion.rank(system), gap.is_closed());
        Ok(Some((constraint, max_abs(out))))
    };
    let is_eliminated = motion.leave_out(&rows, |_, _, _, _| false)?;
    let found = solve(&mut motion, is_eliminated)?;
    let most = found.map_or(Y::Scalar::ZERO, |(_, most)| most);
    let found = found.map(|(constraint, _)| constraint);

    let path = Path { rows, u, zone, most };
    motion.write(reduction, state)?;
    let is_noisy =
        path.rows.all(motion.terms.closure).any(|(joint, row)| path.is_noisy(joint, row));
    if !is_noisy || !(dot(u, u) > Y::Scalar::ZERO) {
        return Ok(found);
    }
    difference(system, reduction, state, &mut motion, [&mut *rates, &mut *openings])?;
    motion.write(reduction, state)?;
    let is_eliminated = motion.leave_out(&path.rows, |index, joint, row, opening| {
        let rate = reduction.closure.entries_of_mut(joint.into(), rates);
        let is_passing = path.is_noisy(joint, row) && path.passes(joint, row, rate);
        if is_passing {
            row.iter_mut().zip(rate).for_each(|(entry, &mut rate)| *entry = rate);
            *opening = openings.get(index).copied().unwrap_or(Y::Scalar::ZERO);
        }
        is_passing
    })?;
    Ok(solve(&mut motion, is_eliminated)?.map(|(constraint, _)| constraint))
}

/// The rows of J at a state.
pub(super) struct FadingRows<'a, S> {
    reduction: Reduction<'a, S>,
    gap: Gap<S>,
    /// The length of the longest row.
    largest: S,
    /// Whether rows of J that the compiler dropped follow from all of these only.
    are_followed: bool,
}

impl<'a, S: Scalar> FadingRows<'a, S> {
    pub fn of<Y: Mechanism>(
        system: &Y,
        reduction: Reduction<'a, S>,
        gap: Gap<S>,
        closure: &[S],
    ) -> Self {
        let Dimensions { rows, reduction: sizes, .. } = system.dimensions();
        let are_followed = rows > sizes.dependent();
        let rows = Self { reduction, gap, largest: S::ONE, are_followed };
        let largest = rows.all(closure).fold(S::ZERO, |most, (_, row)| most.max(length(row)));
        Self { largest, ..rows }
    }

    /// The joints that are determined by rows, and the rows' entries.
    fn all<'c>(&self, closure: &'c [S]) -> impl Iterator<Item = (u16, &'c [S])> {
        let rows = self.reduction.closure;
        self.reduction.dependent().map(move |joint| (joint, rows.entries_of(joint.into(), closure)))
    }

    /// The joints that are determined by rows, in the order of the elimination.
    pub fn joints(&self) -> impl Iterator<Item = u16> + use<'a, S> {
        self.reduction.dependent()
    }

    /// The entries of the row that determines a joint.
    pub fn entries_mut<'c>(&self, joint: u16, closure: &'c mut [S]) -> &'c mut [S] {
        self.reduction.closure.entries_of_mut(joint.into(), closure)
    }

    /// Whether a row may be left out.
    pub fn may_be_fewer(&self) -> bool {
        !self.are_followed
    }

    /// Whether the direction of a row is known.
    pub fn is_known(&self, row: &[S]) -> bool {
        self.share(row) > self.gap.cut()
    }

    /// The length of a row as a share of the longest.
    pub fn share(&self, row: &[S]) -> S {
        length(row) / self.largest
    }
}

/// A motion along which rows fade.
struct Path<'a, S> {
    rows: FadingRows<'a, S>,
    u: &'a [S],
    /// Rows shorter than this share of the longest may be taken along the motion.
    zone: S,
    /// The largest acceleration with all rows as they are.
    most: S,
}

impl<S: Scalar> Path<'_, S> {
    /// The speeds of the joints that have entries in the row that determines a joint.
    fn speeds(&self, joint: u16) -> impl Iterator<Item = S> {
        let Reduction { closure, branches, .. } = self.rows.reduction;
        closure.columns_of(joint.into()).iter().map(|&column| {
            let branch = branches.get(usize::from(column));
            let speed = branch.and_then(|branch| self.u.get(usize::from(branch.joint)));
            speed.copied().unwrap_or(S::ZERO)
        })
    }

    /// Whether rounding of the state makes much of the acceleration by this row.
    fn is_noisy(&self, joint: u16, row: &[S]) -> bool {
        let share = self.rows.share(row);
        let square = self.speeds(joint).fold(S::ZERO, |sum, u| u.mul_add(u, sum));
        let rounding = self.rows.gap.uncertainty(share) * square;
        let shows = rounding <= S::from_f64(NOISE_OF_ACCELERATION) * share * self.most;
        share <= self.zone && !shows
    }

    /// Whether the motion passes through the singular state in which the row vanishes, so that its `rate` takes its place; see
    /// [`passage`](crate::passage). What of the rate is along the speeds is taken out.
    fn passes(&self, joint: u16, row: &[S], rate: &mut [S]) -> bool {
        let Self { rows, u, .. } = self;
        let (share, speed) = (rows.share(row), dot(u, u).sqrt());
        let is_known = rows.is_known(row);
        let along = |row: &[S]| {
            row.iter().zip(self.speeds(joint)).fold(S::ZERO, |sum, (&x, u)| x.mul_add(u, sum))
        };
        let of_row = length(row);
        if is_known && along(row).abs() > S::from_f64(SPEED_ACROSS) * of_row * speed {
            return false;
        }
        let excess = along(rate);
        if excess.abs() <= S::from_f64(SPEED_ALONG) * share * length(rate) * speed {
            let square = self.speeds(joint).fold(S::ZERO, |sum, u| u.mul_add(u, sum));
            if square > S::ZERO {
                let factor = excess / square;
                rate.iter_mut().zip(self.speeds(joint)).for_each(|(rate, u)| *rate -= factor * u);
            }
        }
        let of_rate = length(rate);
        if !(of_rate > S::from_f64(FADING_RATE) * rows.largest) {
            return false;
        }
        let factor = dot(row, rate) / (of_rate * of_rate);
        let aside = row.iter().zip(&*rate).fold(S::ZERO, |sum, (&row, &rate)| {
            let aside = row - factor * rate;
            aside.mul_add(aside, sum)
        });
        let allowed = S::from_f64(FADING_ASIDE).max(rows.gap.uncertainty(share));
        !is_known || aside.sqrt() <= (allowed + allowed) * of_row
    }
}

fn length<S: Arithmetic>(row: &[S]) -> S {
    dot(row, row).sqrt()
}

/// The rows' changes along the path from q at the speeds u (1/rad), and a third of those of what they times du/dt have to be, by differences
/// over a distance. What the motion has of the state is lost.
fn difference<Y: Mechanism>(
    system: &Y,
    reduction: Reduction<'_, Y::Scalar>,
    (t, q, u): (Y::Scalar, &[Y::Scalar], &[Y::Scalar]),
    motion: &mut Motion<'_, Y::Scalar>,
    [rates, openings]: [&mut [Y::Scalar]; 2],
) -> Result<(), Error> {
    let distance = Fading::<Y::Scalar>::of_rounding().beside;
    let half = Y::Scalar::from_f64(0.5) / distance;
    let sixth = half / Y::Scalar::from_f64(3.0);
    let time = distance / dot(u, u).sqrt();
    let (mut at, mut step) = (system.initial().q, system.speeds());
    rates.fill(Y::Scalar::ZERO);
    openings.fill(Y::Scalar::ZERO);
    for sign in [-Y::Scalar::ONE, Y::Scalar::ONE] {
        copy(at.as_mut(), q)?;
        set_scaled(step.as_mut(), sign * time, u);
        system.advance(at.as_mut(), step.as_ref());
        motion.write(reduction, (t, at.as_ref(), u))?;
        add_scaled(rates, sign * half, motion.terms.closure);
        add_scaled(openings, sign * sixth, motion.opening);
    }
    Ok(())
}
