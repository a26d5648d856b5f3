//! The choice of the spanning tree: the cheapest of several.
//!
//! Trees of small mechanisms are compared by the operations of an acceleration, for which it is derived once per tree.
//! For large ones that takes too long, and an estimate decides ([`choice`]).

use std::cmp::Ordering;

use super::CompileError;
use crate::kane;
use crate::laminate::{self, Geometry, Mechanism};
use crate::lowering;
use crate::source::{Diagnostics, SourceModel};
use crate::topology::choice::{self, Candidate};
use crate::topology::{Comparison, Topology, build_cut};

/// Most joints with which trees are counted that are estimated to cost as much as the plain one.
const FEW_JOINTS: usize = 12;

/// Most joints with which trees are counted that are estimated to cost less.
const MOST_JOINTS: usize = 24;

/// Most trees that are counted, the plain one included: counting one may take as long as deriving all
/// equations.
const MOST_COUNTED: usize = 3;

/// Share of the plain tree's estimate that another one must have to be chosen without counting: estimates of trees of
/// the same kind are wrong by some 7 per cent (decision 75).
const CLEARLY_LESS: f64 = 0.9;

/// Runs the stages laminate and topology with the tree that costs least: the topology, and the warnings of both.
pub(super) fn cheapest(model: &SourceModel) -> Result<(Topology, Diagnostics), CompileError> {
    let mut warnings = Diagnostics::default();
    let mechanism = laminate::build(model, &mut warnings)?;
    let candidates = choice::candidates(&mechanism)?;
    let Some((plain, others)) = candidates.split_first() else {
        unreachable!("the plain tree is always a candidate")
    };
    let (joints, trees) = (mechanism.joints.len(), candidates.len());
    let is_worth = |it: &&Candidate| match it.estimate.cmp(&plain.estimate) {
        Ordering::Less => joints <= MOST_JOINTS,
        Ordering::Equal => joints <= FEW_JOINTS,
        Ordering::Greater => false,
    };
    let counted: Vec<&Candidate> = others.iter().filter(is_worth).collect();
    let topology = if !counted.is_empty() {
        let counted = [plain].into_iter().chain(counted).take(MOST_COUNTED);
        by_operations(model, mechanism, counted, trees)?
    } else {
        let clearly = |it: &&Candidate| {
            joints > MOST_JOINTS && (it.estimate as f64) < CLEARLY_LESS * plain.estimate as f64
        };
        let chosen = others.first().filter(clearly).unwrap_or(plain);
        let comparison = (trees > 1).then_some(Comparison {
            trees,
            counted: 0,
            chosen: chosen.estimate,
            plain: plain.estimate,
        });
        Topology { comparison, ..build_cut(mechanism, chosen.cuts.clone())? }
    };
    warnings.extend(topology.warnings.0.iter().cloned());
    Ok((topology, warnings))
}

/// Returns the topology with the tree whose acceleration has the fewest operations: of equal ones the first, which is the
/// plain one.
fn by_operations<'c>(
    model: &SourceModel,
    mechanism: Mechanism,
    candidates: impl Iterator<Item = &'c Candidate>,
    trees: usize,
) -> Result<Topology, CompileError> {
    let mut operations = Vec::new();
    let mut best: Option<(usize, Topology)> = None;
    for candidate in candidates {
        let topology = build_cut(mechanism.clone(), candidate.cuts.clone())?;
        let geometry = Geometry::new(model, &topology.mechanism)?;
        let equations = kane::derive_acceleration(&topology, &geometry)?;
        let count = lowering::operations_of_acceleration(&equations);
        operations.push(count);
        if best.as_ref().is_none_or(|(least, _)| count < *least) {
            best = Some((count, topology));
        }
    }
    let Some((chosen, topology)) = best else { unreachable!("the plain tree is a candidate") };
    let (counted, plain) = (operations.len(), operations[0]);
    Ok(Topology { comparison: Some(Comparison { trees, counted, chosen, plain }), ..topology })
}
