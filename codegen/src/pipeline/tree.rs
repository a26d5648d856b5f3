//! The choice of the spanning tree: small mechanisms are derived with several trees ([`choice`](crate::topology::choice)), and the one
//! whose acceleration takes the fewest operations is taken. Large ones have the breadth-first tree.

use super::{CompileError, Derived};
use crate::laminate;
use crate::program::{FunctionKind, Program};
use crate::source::{Diagnostics, SourceModel};
use crate::topology::{Comparison, Topology, choice};

/// Up to so many joints, trees are derived as well that are estimated to cost as much as the breadth-first one.
const FEW_JOINTS: usize = 12;

/// Up to so many joints, trees are derived that are estimated to cost less.
const MOST_JOINTS: usize = 24;

/// Most trees that are derived, the breadth-first one included.
const MOST_DERIVED: usize = 3;

/// Derives with the tree that costs least, of equal ones the first: `derive` cuts loops where its model says.
pub(super) fn cheapest(
    model: &SourceModel,
    mut derive: impl FnMut(&SourceModel) -> Result<Derived, CompileError>,
) -> Result<Derived, CompileError> {
    let mut best = derive(model)?;
    let joints = model.joints.len();
    if joints > MOST_JOINTS || best.topology.loops.is_empty() {
        return Ok(best);
    }
    let mechanism = laminate::build(model, &mut Diagnostics::default())?;
    let (plain, others) = choice::candidates(&mechanism)?;
    let of_plain = operations(&best.program);
    let (mut least, mut derived) = (of_plain, 1);
    let others = others.into_iter().filter(|other| match joints {
        ..=FEW_JOINTS => other.estimate <= plain.estimate,
        _ => other.estimate < plain.estimate,
    });
    for other in others.take(MOST_DERIVED - 1) {
        let found = match derive(&SourceModel { cuts: other.cuts, ..model.clone() }) {
            Ok(found) => found,
            // The model has no errors with the breadth-first tree, so that this tree is only less suitable.
            Err(CompileError::Model(_)) => continue,
            Err(error) => return Err(error),
        };
        let count = operations(&found.program);
        if count.0 != least.0 || !is_alike(&found.topology, &best.topology) {
            continue;
        }
        derived += 1;
        if count < least {
            (best, least) = (found, count);
        }
    }
    let comparison = Comparison { derived, chosen: least.1, plain: of_plain.1 };
    best.topology.comparison = (derived > 1).then_some(comparison);
    Ok(best)
}

/// Which function an acceleration is made of, and its operations: its own; where the runtime solves for it, its parts; or the equations.
fn operations(program: &Program) -> (FunctionKind, usize) {
    use FunctionKind::{Acceleration, Equations, Reduction};
    let counts = [Acceleration, Reduction, Equations]
        .map(|kind| (kind, program.function_of(kind).cost().total()));
    let found = counts.into_iter().find(|(_, count)| *count > 0);
    found.unwrap_or((Equations, 0))
}

/// Whether two trees tell the same of the mechanism.
fn is_alike(one: &Topology, other: &Topology) -> bool {
    let found = |it: &Topology| (it.rank, it.mobility, it.warnings.0.len());
    found(one) == found(other)
}
