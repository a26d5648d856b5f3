//! The first fold of a flat sheet.
//!
//! A sheet with several vertices can leave the flat state along many branches, and an infinitely
//! small push decides which of them it takes: no integrator can know. Here the forces decide. The
//! folded configuration nearest to where they accelerate the flat sheet is followed back along its
//! branch to where it is all but flat, and the motion starts there.

use lamc::arithmetic::largest;
use lamc_runtime::{Mechanism, State, acceleration, assemble};

use crate::execution::Jit;

/// A sheet whose joints are all this near to zero, rad, lies flat.
const FLAT: f64 = 1e-6;

/// How far the most bent joint is bent where a fold is looked for, rad.
const FOLDED: f64 = 0.3;

/// How far it is bent where the motion starts, rad, at most.
const START: f64 = 1e-3;

/// Share of [`START`] that is aimed at: closing the loops may bend joints a little more.
const AIM: f64 = 0.99;

/// Folds on the way from there to here: more than log2(FOLDED / START).
const MOST_FOLDS: usize = 20;

/// Directions in which the flat sheet is loose and the folded one is not. With only one of them, as
/// in a four-bar, the motion finds its way from the flat state itself.
const MANY: usize = 2;

/// How a flat sheet sets off.
pub enum Fold {
    /// Moved to the beginning of the fold that its forces choose: how far the most bent joint is
    /// bent, rad.
    Begun(f64),
    /// From the flat state: what the forces choose leaves it loose in more directions than usual,
    /// as where it bends along straight lines only.
    Loose,
}

impl Fold {
    /// The warning of it. `initial` is how the reader gives initial angles.
    pub fn warning(&self, initial: &str) -> String {
        match self {
            Self::Begun(bent) => format!(
                "a flat sheet can fold in many ways: it starts bent by {bent:.1e} rad in the direction of its \
                 forces; {initial} chooses another direction"
            ),
            Self::Loose => format!(
                "a flat sheet can fold in many ways, and its forces do not determine one: if the simulation \
                 fails, start from a folded guess ({initial})"
            ),
        }
    }
}

/// Moves a flat sheet at rest to the beginning of a fold. `None`: it is no such sheet, nothing moves
/// it, or no fold was found.
pub fn unfold(system: &Jit, state: &mut State<Vec<f64>, f64>) -> Option<Fold> {
    let d = system.dimensions();
    let at_rest = largest(&state.u) == 0.0 && largest(&state.q) <= FLAT;
    if d.drives > 0 || d.speeds > d.joints || d.loops < MANY || !at_rest {
        return None;
    }
    let usual = system.interface().rank.min(d.speeds);
    let workspace = &mut system.workspace();
    let mut rates = system.speeds();
    let mut rank = |q: &[f64], rates: &mut [f64]| {
        let found = acceleration(system, state.t, q, &state.u, workspace, rates);
        found.ok().map(|constraint| constraint.rank)
    };
    let flat = rank(&state.q, &mut rates)?;
    let fastest = largest(&rates);
    if flat + MANY > usual || fastest == 0.0 || !fastest.is_finite() {
        return None;
    }
    let mut fold: Vec<f64> = rates.iter().map(|rate| FOLDED * rate / fastest).collect();
    let free = vec![false; d.joints];
    let close = |fold: &mut [f64]| {
        assemble(system, state.t, fold, &free, &mut system.workspace())
            .ok()
            .map(|_| largest(&*fold))
    };
    let mut bent = close(&mut fold)?;
    if bent < START {
        return None;
    }
    if rank(&fold, &mut rates)? < usual {
        return Some(Fold::Loose);
    }
    for _ in 0..MOST_FOLDS {
        if bent <= START {
            break;
        }
        // By halves: each fold is the guess of the next.
        let share = (AIM * START / bent).max(0.5);
        fold.iter_mut().for_each(|q| *q *= share);
        bent = close(&mut fold)?;
    }
    // Neither lost on another branch nor back where it came from.
    if !(0.1 * START..=START).contains(&bent) {
        return None;
    }
    state.q.copy_from_slice(&fold);
    Some(Fold::Begun(bent))
}
