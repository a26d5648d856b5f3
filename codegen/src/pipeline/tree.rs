//! The choice of the spanning tree: the cheapest of several.
//!
//! Small mechanisms are derived with several trees, and their accelerations compared by operations. For large ones that takes too
//! long, and an estimate decides ([`choice`](crate::topology::choice)).

use super::{CompileError, Derived};
use crate::program::{FunctionKind, Program};
use crate::topology::Comparison;
use crate::topology::choice::Candidate;

/// Most joints with which trees are derived that are estimated to cost as much as the plain one.
const FEW_JOINTS: usize = 12;

/// Most joints with which trees are derived that are estimated to cost less.
const MOST_JOINTS: usize = 24;

/// Most trees that are derived, the plain one included.
const MOST_DERIVED: usize = 3;

/// Share of the plain tree's estimate that another one must have to be chosen by it: estimates of trees of
/// the same kind are wrong by some 7 per cent (decision 89).
const CLEARLY_LESS: f64 = 0.9;

/// Derives with the tree that costs least, of equal ones the first.
pub(super) fn cheapest(
    (plain, others): (&Candidate, &[Candidate]),
    joints: usize,
    mut derive: impl FnMut(&Candidate) -> Result<Derived, CompileError>,
) -> Result<Derived, CompileError> {
    if joints > MOST_JOINTS {
        return by_estimate(plain, others, derive);
    }
    let mut best = derive(plain)?;
    let of_plain = operations(&best.program);
    let (mut least, mut derived) = (of_plain, 1);
    let is_worth_it = |other: &&Candidate| {
        other.estimate < plain.estimate || joints <= FEW_JOINTS && other.estimate == plain.estimate
    };
    for other in others.iter().filter(is_worth_it).take(MOST_DERIVED - 1) {
        // The plain tree has no errors, so that this one is only less suitable.
        let Ok(found) = derive(other) else { continue };
        derived += 1;
        let count = operations(&found.program);
        if count < least {
            (best, least) = (found, count);
        }
    }
    let costs = if derived > 1 { [least, of_plain] } else { [plain.estimate; 2] };
    best.topology.comparison = comparison(1 + others.len(), derived, costs);
    Ok(best)
}

fn comparison(trees: usize, derived: usize, [chosen, plain]: [usize; 2]) -> Option<Comparison> {
    (trees > 1).then_some(Comparison { trees, derived, chosen, plain })
}

/// Derives with the plain tree, unless another one is estimated to cost clearly less.
fn by_estimate(
    plain: &Candidate,
    others: &[Candidate],
    mut derive: impl FnMut(&Candidate) -> Result<Derived, CompileError>,
) -> Result<Derived, CompileError> {
    let clearly =
        |other: &&Candidate| (other.estimate as f64) < CLEARLY_LESS * plain.estimate as f64;
    let chosen = others.first().filter(clearly).unwrap_or(plain);
    let mut found = derive(chosen)?;
    let costs = [chosen.estimate, plain.estimate];
    found.topology.comparison = comparison(1 + others.len(), 1, costs);
    Ok(found)
}

/// Returns how many operations an acceleration takes; those of its parts where the runtime solves them.
fn operations(program: &Program) -> usize {
    use FunctionKind::{Acceleration, Equations, Reduction};
    let kinds = [Acceleration, Reduction, Equations];
    let costs = kinds.map(|kind| program.function_of(kind).cost().total());
    costs.into_iter().find(|&cost| cost > 0).unwrap_or(0)
}
