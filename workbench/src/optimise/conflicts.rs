//! Which goals stand against each other at the best design, what cannot be kept, and what stopped the search.
//!
//! Where a sum of squares is least, the gradients of its parts add up to zero, but for what the ends of the ranges and the
//! constraints hold back. Goals whose own gradient is not zero there would come nearer at the cost of others.

use lamc::arithmetic::largest;
use nalgebra::RowDVector;

use super::Outcome;
use super::evaluate::{Evaluation, Problem};
use super::goals::Norm;
use super::local::KEPT;

/// A goal that is missed by less than this is met; it has no unit.
const MET: f64 = 1e-6;
/// A goal pulls if its gradient is at least this share of the largest.
const PULLS: f64 = 1e-3;
/// Shares of a range within which a variable is at its end: solvers stay inside.
const AT_END: f64 = 1e-3;
/// How far designs are looked at along which goals come nearer, as shares of the ranges.
const AHEAD: [f64; 2] = [1e-3, 1e-2];
/// Goals come nearer if the sum of squares falls by this share on the way ahead.
const NEARER: f64 = 1e-5;

/// Remarks on the best design, a sentence each.
pub fn remarks(problem: &Problem<'_>, outcome: &Outcome) -> Vec<String> {
    let best = &outcome.found[outcome.best];
    let mut remarks = Vec::new();
    for &variable in &outcome.idle {
        let name = &problem.goals.variables[variable].name;
        remarks.push(format!(
            "no error of a goal and no constraint depends on `{name}`: it keeps its value"
        ));
    }
    let mut ends = Vec::new();
    let varied = problem.goals.variables.iter().zip(&best.x).enumerate();
    let varied = varied.filter(|(variable, _)| !outcome.idle.contains(variable));
    for (_, (variable, share)) in varied {
        for (is_there, end) in [(*share < AT_END, "lower"), (*share > 1.0 - AT_END, "upper")] {
            if is_there {
                ends.push(variable.name.as_str());
                remarks.push(format!("`{}` is at the {end} end of its range", variable.name));
            }
        }
    }
    let exceeded = |kept: &&super::Kept| kept.excess.value > KEPT;
    let constraints = &best.evaluation.constraints;
    let broken: Vec<String> =
        constraints.iter().filter(exceeded).map(|kept| format!("`{}`", kept.name)).collect();
    let binding: Vec<String> = constraints
        .iter()
        .filter(|kept| kept.excess.value.abs() <= KEPT)
        .map(|kept| format!("`{}`", kept.name))
        .collect();
    if !broken.is_empty() {
        let beside = match binding.is_empty() {
            true => String::new(),
            false => format!(", together with {}", binding.join(", ")),
        };
        remarks.push(format!("no design was found that keeps {}{beside}", broken.join(", ")));
    }
    let pulling = pulling(problem, &best.evaluation, &best.x);
    if pulling.len() > 1 {
        let names: Vec<String> = pulling.iter().map(|name| format!("`{name}`")).collect();
        remarks.push(format!(
            "the goals {} are against each other: what brings one nearer takes another away",
            names.join(", ")
        ));
    }
    if broken.is_empty() && !binding.is_empty() {
        remarks.push(format!("at its limit: {}", binding.join(", ")));
    }
    if broken.is_empty()
        && binding.is_empty()
        && let Some(reason) = barrier(problem, &best.evaluation, &best.x)
    {
        remarks.push(format!(
            "the goals would come nearer beyond this design, but the next designs cannot be evaluated: {reason}"
        ));
    }
    remarks
}

/// Why designs cannot be evaluated a short way along which the goals would come nearer.
fn barrier(problem: &Problem<'_>, evaluation: &Evaluation, x: &[f64]) -> Option<String> {
    let goals = &problem.goals;
    let objective = evaluation.objective(goals);
    if goals.norm != Norm::Squares || objective.sqrt() <= MET {
        return None;
    }
    let mut gradient: RowDVector<f64> = RowDVector::zeros(x.len());
    for residual in evaluation.residuals(goals) {
        gradient += 2.0 * residual.value * &residual.slope;
    }
    hold_at_ends(&mut gradient, x);
    let steepness = gradient.norm();
    let mut ahead = AHEAD.into_iter().filter(|way| way * steepness > NEARER * objective);
    ahead.find_map(|way| {
        let next =
            x.iter().zip(&gradient).map(|(x, by)| (x - way * by / steepness).clamp(0.0, 1.0));
        problem.evaluate(&next.collect::<Vec<_>>()).err()
    })
}

/// Takes away what leads out of the ranges.
fn hold_at_ends(gradient: &mut RowDVector<f64>, x: &[f64]) {
    for (entry, share) in gradient.iter_mut().zip(x) {
        let is_held = (*share < AT_END && *entry > 0.0) || (*share > 1.0 - AT_END && *entry < 0.0);
        *entry = if is_held { 0.0 } else { *entry };
    }
}

/// The goals that are not met and would come nearer with another design.
fn pulling(problem: &Problem<'_>, evaluation: &Evaluation, x: &[f64]) -> Vec<String> {
    let mut gradients: Vec<(&str, f64)> = Vec::new();
    for (reached, goal) in evaluation.goals.iter().zip(&problem.goals.goals) {
        let mut gradient: RowDVector<f64> = RowDVector::zeros(x.len());
        let mut square = 0.0;
        for part in reached.errors.iter().flatten() {
            square += part.value * part.value / reached.errors.len() as f64;
            gradient += goal.weight * part.value / reached.errors.len() as f64 * &part.slope;
        }
        hold_at_ends(&mut gradient, x);
        if square.sqrt() > MET {
            gradients.push((&goal.name, gradient.norm()));
        }
    }
    let largest = largest(gradients.iter().map(|(_, size)| *size));
    // With one goal, or near zero, there is nothing to stand against.
    let pulls = gradients.iter().filter(|(_, size)| *size > PULLS * largest && *size > MET * MET);
    pulls.map(|(name, _)| (*name).to_owned()).collect()
}
