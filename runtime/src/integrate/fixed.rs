//! Common parts of integrators with fixed steps: a step whose values are not finite is repeated in
//! shorter pieces, and a run ends exactly at its end.

use crate::constants::STEP_PIECES;
use crate::scalar::whole;
use crate::{Arithmetic, Error, Mechanism, Scalar, StateOf};

/// Whether time can go on by a step (s): positive and finite.
pub(crate) fn is_forward<S: Scalar>(dt: S) -> bool {
    dt > S::ZERO && dt.is_finite()
}

/// Advances `state` by `dt` (s), in as many equal pieces as it takes to keep every value finite, at most
/// [`STEP_PIECES`]. `attempt` advances by one piece; where it fails its state does not matter.
pub(super) fn step<Y: Mechanism>(
    state: &mut StateOf<Y>,
    dt: Y::Scalar,
    mut attempt: impl FnMut(&mut StateOf<Y>, Y::Scalar) -> Result<(), Error>,
) -> Result<(), Error> {
    if !is_forward(dt) || !state.t.is_finite() {
        return Err(Error::Time);
    }
    let start = state.clone();
    let mut pieces = 1_u64;
    loop {
        let piece = dt / whole::<Y::Scalar>(pieces);
        let outcome = (0..pieces).try_for_each(|_| attempt(state, piece));
        if outcome.is_ok() {
            state.t = start.t + dt;
            return Ok(());
        }
        state.clone_from(&start);
        // Shorter steps mend no other error, and would take time that a control loop does not have.
        if pieces >= STEP_PIECES as u64 || !matches!(outcome, Err(Error::NotFinite { .. })) {
            return outcome;
        }
        pieces *= 2;
    }
}

/// Advances to `t_end` (s) in equal steps of at most `dt` (s).
pub(super) fn run<Y: Mechanism>(
    state: &mut StateOf<Y>,
    t_end: Y::Scalar,
    dt: Y::Scalar,
    mut step: impl FnMut(&mut StateOf<Y>, Y::Scalar) -> Result<(), Error>,
    mut observe: impl FnMut(&StateOf<Y>),
) -> Result<(), Error> {
    let start = state.t;
    let duration = t_end - start;
    if !is_forward(dt) || !duration.is_finite() {
        return Err(Error::Time);
    }
    // A quotient that is a whole number but for rounding is that number.
    let quotient = (duration / dt).to_f64() * (1.0 - 4.0 * Y::Scalar::EPSILON.to_f64());
    let steps = if quotient > 0.0 { quotient as u64 + 1 } else { 0 };
    let length = duration / whole::<Y::Scalar>(steps);
    for i in 1..=steps {
        step(state, length)?;
        // From the count, not by adding up: a thousand steps of f32 lose digits.
        state.t = if i == steps { t_end } else { start + whole::<Y::Scalar>(i) * length };
        observe(state);
    }
    Ok(())
}
