//! Which directions of the closure count: the decision on the rank.
//!
//! The rows of J are made orthogonal as they are, without masses: what is independent is a matter of
//! geometry. The lengths of the orthogonal rows are the singular values s, here as shares of the
//! largest. Next to a singular state, such as the flat one, some of them fade in proportion to the
//! distance from it (rad): such a constraint is weak, but real.
//!
//! The angles are known only as well as the loops are closed. With g the largest closure residual over
//! the mechanism's size, a direction is known to within g / s rad, and Newton's method finds its way
//! along it while
//!
//! ```text
//! g / s^2 < 1/4
//! ```
//!
//! (L. V. Kantorovich, "Functional analysis and applied mathematics", 1948, for closures that curve
//! by their size per rad^2). Beyond that, two branches of the mechanism's motion can no longer be
//! distinguished, and the direction is dropped as if it were zero. A closed state has a residual of
//! four units in the last place: in `f64` directions are kept to within some 1e-7 rad of a singular
//! state, in `f32` to within some 1e-3 rad. Redundant rows, which differ from zero by g / s of the
//! weakest direction, are always dropped.

use crate::constants::{
    ACCEPTABLE, CLOSED, CLOSED_EPSILONS, KANTOROVICH_BOUND, LARGEST_GAP, PASSING_FACTOR,
    REDUNDANT_FACTOR, WEAK_SHARE,
};
use crate::linear::{Kept, max_abs};
use crate::plumbing::Dimensions;
use crate::workspace::split;
use crate::{Arithmetic, Error, Mechanism, Scalar};

/// Thresholds for faded directions, relative to the largest singular value.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fading<S> {
    /// The state is some 0.1 rad or less from a singular one: loops are closed to rounding.
    pub weak: S,
    /// Of derivatives, which rounding reaches divided by the fourth power, four digits are left.
    pub rough: S,
    /// In a motion the direction is better seen from where it comes and where it goes than at the state:
    /// the acceleration there depends on rounding divided by the third power, here on the distance from
    /// the singular state.
    pub passing: S,
    /// So it is for a state by itself, whose own rows show its direction to a thousandth or better above.
    pub lost: S,
    /// Distance of the samples before and after the state, rad.
    pub beside: S,
}

impl<S: Scalar> Fading<S> {
    /// For loops closed to rounding.
    pub fn of_rounding() -> Self {
        let gap = S::from_f64(CLOSED_EPSILONS) * S::EPSILON;
        let (weak, quarter) = (S::from_f64(WEAK_SHARE), gap.sqrt().sqrt());
        let passing = S::from_f64(PASSING_FACTOR) * quarter.min(weak);
        Self {
            weak,
            rough: weak.min(S::from_f64(ROUGH_FACTOR) * quarter),
            passing,
            lost: passing.min(quarter * quarter.sqrt()),
            beside: weak.min(quarter),
        }
    }
}

/// Derivatives are rough below this multiple of the fourth root of rounding: they lose a power of it more
/// than accelerations.
const ROUGH_FACTOR: f64 = 10.0;

/// The residual, m, at which loops are closed to rounding.
pub(crate) fn closed_to_rounding<Y: Mechanism>(system: &Y) -> Y::Scalar {
    Y::Scalar::from_f64(CLOSED_EPSILONS) * Y::Scalar::EPSILON * system.size()
}

/// The residual, m, at which a loop counts as closed where no direction is weak: 1e-12 of the
/// mechanism's size; 16 epsilon, about 2e-6 of it, in `f32`.
pub(crate) fn closed<Y: Mechanism>(system: &Y) -> Y::Scalar {
    CLOSED.of::<Y::Scalar>() * system.size()
}

/// Returns the largest residual, m, with which rounding or a singular state may stop a projection:
/// 1e-9 of the size; a thousand epsilon, about 1e-4 of it, in `f32`.
pub(crate) fn acceptable_residual<Y: Mechanism>(system: &Y) -> Y::Scalar {
    ACCEPTABLE.of::<Y::Scalar>() * system.size()
}

/// By how much loops are open, as a share of the mechanism's size, never less than what rounding leaves
/// of closed ones.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Gap<S>(S);

impl<S: Scalar> Gap<S> {
    /// From the largest residual, m.
    pub fn of<Y: Mechanism<Scalar = S>>(system: &Y, residual: S) -> Self {
        Self(residual.max(closed_to_rounding(system)) / system.size())
    }

    /// Of loops closed to rounding.
    #[cfg(test)]
    pub fn closed() -> Self {
        Self(S::from_f64(CLOSED_EPSILONS) * S::EPSILON)
    }

    /// Of loops that are so much open that singular values up to `cut` are dropped.
    #[cfg(test)]
    pub fn with_cut(cut: S) -> Self {
        Self(cut * cut * S::from_f64(KANTOROVICH_BOUND))
    }

    /// At q; the workspace holds 9 L (N + 1) numbers. A state that is not closed at all has no rank of its
    /// own: it gets that of one that is open by 1e-9 of the size (16 epsilon in `f32`).
    pub fn at<Y: Mechanism<Scalar = S>>(
        system: &Y,
        q: &[S],
        mut workspace: &mut [S],
    ) -> Result<Self, Error> {
        let Dimensions { speeds: n, loops, .. } = system.dimensions();
        let residual = split(&mut workspace, 9 * loops)?;
        let jacobian = split(&mut workspace, 9 * loops * n)?;
        system.write_closure(q, residual, jacobian)?;
        Ok(Self::of_state(system, max_abs(residual)))
    }

    /// As [`at`](Self::at), from the largest residual, m.
    pub fn of_state<Y: Mechanism<Scalar = S>>(system: &Y, residual: S) -> Self {
        Self::of(system, residual.min(LARGEST_GAP.of::<S>() * system.size()))
    }

    /// As a share of the mechanism's size.
    pub fn share(self) -> S {
        self.0
    }

    /// Singular values up to this share of the largest are dropped.
    pub fn cut(self) -> S {
        (self.0 / S::from_f64(KANTOROVICH_BOUND)).sqrt()
    }

    /// Whether a direction that is kept or dropped has faded to less than this share of the strongest.
    pub fn is_below(self, share: S, kept: &Kept<S>) -> bool {
        kept.least < share || kept.dropped > S::from_f64(REDUNDANT_FACTOR) * self.0 / kept.least
    }

    /// Returns the largest error of a direction with this singular value, rad.
    pub fn uncertainty(self, singular_value: S) -> S {
        self.0 / (singular_value * singular_value)
    }

    /// Whether Newton's method finds its way along a direction with this singular value.
    pub fn shows(self, singular_value: S) -> bool {
        self.uncertainty(singular_value) < S::from_f64(KANTOROVICH_BOUND)
    }

    /// Whether the loops are closed to rounding.
    pub fn is_closed(self) -> bool {
        self.0 <= S::from_f64(CLOSED_EPSILONS) * S::EPSILON
    }
}
