//! Parameters from goals: `lamc optimise`.
//!
//! ```text
//! goals + model -> Problem -> starts (a Latin hypercube) -> local searches, on all cores -> Outcome
//! ```
//!
//! A search depends on its start only, and the starts on the seed only: the outcome is the same for every number of
//! threads.

mod balance;
mod clearance;
mod conflicts;
mod design;
mod drawn;
mod drive;
mod evaluate;
pub mod goals;
mod local;
mod motion;
mod number;
mod path;
mod robots;
mod settle;
mod stroke;
mod tangent;
#[cfg(test)]
mod tests;
mod ties;
mod vibration;
mod yields;

use std::collections::BTreeMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

pub use conflicts::remarks;
pub use evaluate::{Evaluation, Kept, Problem, Reached};
pub use goals::Goals;
pub use local::{Found, KEPT};
pub use number::Number;
pub use yields::{Influence, Judged, Yield};

use crate::sweep;
use crate::sweep::plan::{Distribution, Plan, Quantity, Sampler, Target, Task, Varied};
use goals::Norm;
use local::search;

/// Latin hypercubes that are drawn at most until there are enough designs that close.
const ROUNDS: u64 = 50;
/// A number whose slope over a range is less than this does not depend on the variable; it has no unit.
const IDLE: f64 = 1e-12;
/// A search reached the best design if its error is larger by at most this share,
const SHARE: f64 = 1e-3;
/// and by this, without a unit: a millionth of the size of the mechanism.
const BESIDE: f64 = 1e-6;

/// A design with which a search begins, in shares of the ranges, and what it is.
type Start = (Vec<f64>, Evaluation);

/// What an optimisation found.
#[derive(Clone, Debug)]
pub struct Outcome {
    /// The design of the model, if it closes.
    pub before: Option<Evaluation>,
    /// Designs that were drawn to find the starts.
    pub drawn: usize,
    /// What each search found, in the order of the starts.
    pub found: Vec<Found>,
    /// Which of them is the best.
    pub best: usize,
    /// How many of them reached it.
    pub reached: usize,
    /// The variables on which no goal and no constraint depends: the best design has the values of the model.
    pub idle: Vec<usize>,
}

/// Why there is no outcome.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum Failure {
    /// No design closes, or has what the goals ask for.
    #[error(
        "none of {drawn} designs within the ranges can be evaluated; {times} of them for one reason, for instance: \
         {reason}"
    )]
    NoStart {
        /// Designs that were drawn.
        drawn: usize,
        /// How many of them failed for the most frequent reason.
        times: usize,
        /// That reason, with the numbers of the first of them.
        reason: String,
    },
    /// All searches ended where the drawing is impossible.
    #[error("the drawing is not possible where the searches ended: {0}")]
    Impossible(String),
    /// The user interrupted it before there was anything.
    #[error("interrupted before a design was found")]
    Interrupted,
}

impl Problem<'_> {
    /// Finds the best design, on so many threads; `finished` is told of each search.
    ///
    /// # Errors
    /// [`Failure`].
    pub fn optimise(
        &self,
        threads: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        finished: &(dyn Fn() + Sync),
    ) -> Result<Outcome, Failure> {
        let (starts, drawn) = self.starts(threads, is_interrupted)?;
        let found = parallel(threads, self, &starts, |problem, (x, evaluation)| {
            let found = search(problem, x, evaluation.clone(), &is_interrupted);
            finished();
            // Loops that close do not say whether the plates are possible.
            problem.is_possible(&found.x).map(|()| found).map_err(|problems| problems.to_string())
        });
        let impossible = found.iter().find_map(|found| found.as_ref().err().cloned());
        let found: Vec<Found> = found.into_iter().flatten().collect();
        let best = (0..found.len()).min_by(|a, b| {
            rank(&found[*a]).partial_cmp(&rank(&found[*b])).unwrap_or(std::cmp::Ordering::Equal)
        });
        let Some(best) = best else {
            return Err(impossible.map_or(Failure::Interrupted, Failure::Impossible));
        };
        let error = |found: &Found| match self.goals.norm {
            Norm::Squares => found.objective.sqrt(),
            Norm::Max => found.objective,
        };
        let enough = (1.0 + SHARE) * error(&found[best]) + BESIDE;
        let has_reached =
            |it: &&Found| it.is_kept() == found[best].is_kept() && error(it) <= enough;
        let reached = found.iter().filter(has_reached).count();
        let mut outcome =
            Outcome { before: self.before(), drawn, best, reached, found, idle: Vec::new() };
        outcome.idle = self.idle(&starts, &outcome.found[best].evaluation);
        self.reset(&mut outcome);
        Ok(outcome)
    }

    /// The variables on which nothing depends, at all starts and at the best design.
    fn idle(&self, starts: &[Start], best: &Evaluation) -> Vec<usize> {
        let evaluations = || starts.iter().map(|(_, evaluation)| evaluation).chain([best]);
        let moves = |variable: usize| {
            let slope = |number: &Number| number.slope[variable].abs();
            evaluations().any(|at| {
                let errors =
                    at.goals.iter().flat_map(|it| it.errors.iter().flatten().chain(&it.spread));
                let kept = at.constraints.iter().map(|kept| &kept.excess);
                errors.chain(kept).any(|number| slope(number) > IDLE)
            })
        };
        (0..self.variables()).filter(|variable| !moves(*variable)).collect()
    }

    /// Variables on which nothing depends get the values of the model in the best design, as far as that is in their ranges.
    /// Goals that are within their limits have no error, but other values there.
    fn reset(&self, outcome: &mut Outcome) {
        let best = &mut outcome.found[outcome.best];
        let mut x = best.x.clone();
        for &variable in &outcome.idle {
            x[variable] = self.share(&self.goals.variables[variable]).clamp(0.0, 1.0);
        }
        // Elsewhere they might count after all.
        let same = |evaluation: &Evaluation| {
            evaluation.objective(&self.goals) <= best.objective + IDLE
                && evaluation.excess() <= best.excess + IDLE
        };
        match self.evaluate(&x) {
            Ok(evaluation) if same(&evaluation) && self.is_possible(&x).is_ok() => {
                (best.objective, best.excess) =
                    (evaluation.objective(&self.goals), evaluation.excess());
                (best.x, best.evaluation) = (x, evaluation);
            }
            _ => outcome.idle.clear(),
        }
    }

    /// The value of the model as a share of a variable's range; not within 0 and 1 where it is outside.
    fn share(&self, variable: &goals::Variable) -> f64 {
        let [low, high] = variable.bounds;
        (self.system.parameters()[variable.parameter] - low) / (high - low)
    }

    /// The design of the model, if it is within the ranges and can be evaluated.
    fn before(&self) -> Option<Evaluation> {
        let x: Vec<f64> = self.goals.variables.iter().map(|it| self.share(it)).collect();
        self.evaluate(&x).ok()
    }

    /// Designs that can be evaluated, and how many were drawn for them.
    fn starts(
        &self,
        threads: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
    ) -> Result<(Vec<Start>, usize), Failure> {
        let wanted = self.goals.starts as usize;
        let (mut starts, mut drawn) = (Vec::new(), 0);
        let mut reasons: BTreeMap<String, (usize, String)> = BTreeMap::new();
        for round in 0..ROUNDS {
            let numbers: Vec<u64> = (0..self.goals.starts).collect();
            let plan = self.hypercube(round);
            let design = sweep::Design::new(&plan);
            let tried = parallel(threads, self, &numbers, |problem, number| {
                if is_interrupted() {
                    return None;
                }
                let x = design.values(*number);
                let possible = problem.is_possible(&x).map_err(|problems| problems.to_string());
                let evaluation = possible.and_then(|()| problem.evaluate(&x));
                let is_finite = |it: &Evaluation| {
                    it.objective(&problem.goals).is_finite() && it.excess().is_finite()
                };
                Some(match evaluation {
                    Ok(evaluation) if is_finite(&evaluation) => Ok((x, evaluation)),
                    Ok(_) => Err("an error is not finite".to_owned()),
                    Err(reason) => Err(reason),
                })
            });
            for tried in tried {
                match tried.ok_or(Failure::Interrupted)? {
                    _ if starts.len() == wanted => break,
                    Ok(start) => starts.push(start),
                    Err(reason) => {
                        let kind = without_numbers(&reason);
                        reasons.entry(kind).or_insert((0, reason)).0 += 1;
                    }
                }
                drawn += 1;
            }
            if starts.len() == wanted {
                break;
            }
        }
        match reasons.into_values().max_by_key(|(times, _)| *times) {
            Some((times, reason)) if starts.is_empty() => {
                Err(Failure::NoStart { drawn, times, reason })
            }
            _ => Ok((starts, drawn)),
        }
    }

    /// A plan that draws the variables from 0 to 1, one value in each of as many parts as there are starts.
    fn hypercube(&self, round: u64) -> Plan {
        let varied = self.goals.variables.iter().map(|variable| Varied {
            quantity: Quantity {
                name: variable.name.clone(),
                target: Target::Parameter(variable.parameter),
                value: 0.5,
                dimension: None,
                has_effect: true,
            },
            distribution: Distribution::Uniform([0.0, 1.0]),
        });
        Plan {
            task: Task::Equilibrium { end: false, energy: false, frequencies: false },
            axes: Vec::new(),
            varied: varied.collect(),
            sampler: Sampler::LatinHypercube,
            samples: self.goals.starts,
            // The rounds of one seed are not those of another one.
            seed: self.goals.seed ^ round.rotate_right(u8::BITS),
        }
    }
}

/// What counts first is whether constraints are kept, then by how much not, then the objective.
fn rank(found: &Found) -> (bool, f64, f64) {
    let excess = if found.is_kept() { 0.0 } else { found.excess };
    (!found.is_kept(), excess, found.objective)
}

/// A reason without its numbers, by which failures are counted together.
fn without_numbers(reason: &str) -> String {
    let words = reason.split(' ').map(|word| {
        let is_number = word.starts_with(|c: char| c.is_ascii_digit() || c == '-');
        if is_number { ".." } else { word }
    });
    words.collect::<Vec<_>>().join(" ")
}

/// Calls a function for each item on so many threads, each with a copy of the problem; the results have the order of the
/// items.
fn parallel<T: Sync, R: Send>(
    threads: usize,
    problem: &Problem<'_>,
    items: &[T],
    f: impl Fn(&Problem<'_>, &T) -> R + Sync,
) -> Vec<R> {
    let next = AtomicUsize::new(0);
    let results = Mutex::new((0..items.len()).map(|_| None).collect::<Vec<Option<R>>>());
    thread::scope(|scope| {
        for _ in 0..threads.clamp(1, items.len().max(1)) {
            let (problem, next, results, f) = (problem.clone(), &next, &results, &f);
            scope.spawn(move || {
                loop {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    let Some(item) = items.get(index) else { break };
                    let result = f(&problem, item);
                    if let Ok(mut results) = results.lock() {
                        results[index] = Some(result);
                    }
                }
            });
        }
    });
    results.into_inner().unwrap_or_default().into_iter().flatten().collect()
}
