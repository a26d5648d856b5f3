//! The yield: which share of the robots that are built by a design meets its goals, and on which tolerances that depends.
//!
//! Robots are points of Sobol's sequence. The share p of n robots is known to within the interval of E. B. Wilson ("Probable inference",
//! 1927), here for a probability of 95 % and for independent robots; those of Sobol's sequence are spread more evenly, so that the
//! interval is on the safe side. Without one tolerance, the same robots are built with the design's value of that parameter: of
//! the b robots that are lost and c that are won by that, the difference of the shares has the standard error sqrt(b + c) / n.

use std::collections::BTreeMap;

use lamc::arithmetic::larger;

use super::evaluate::{Evaluation, Problem, Reached};
use super::goals::{Aim, Goals, Variable, Wanted};
use super::local::KEPT;
use super::robots::{Deviations, deviations};
use super::{parallel, without_numbers};
use crate::sweep::plan::{Target, Varied};

/// 97.5 % of a normal distribution are below so many standard deviations.
const BOTH_SIDES: f64 = 1.959_963_984_540_054;

/// What is known of the robots that are built by a design.
#[derive(Clone, Debug)]
pub struct Yield {
    /// How many were built.
    pub robots: u64,
    /// How many of them meet all goals and constraints.
    pub good: u64,
    /// Why robots are not possible, with how many these are, the most frequent reason first.
    pub failures: Vec<(String, u64)>,
    /// Of each goal and then each constraint.
    pub judged: Vec<Judged>,
    /// Of each tolerance.
    pub tolerances: Vec<Influence>,
}

/// A goal or a constraint over all robots that are possible.
#[derive(Clone, Debug)]
pub struct Judged {
    /// Its name.
    pub name: String,
    /// Its value for the design itself, SI; of a path the largest distance.
    pub nominal: f64,
    /// Its mean, SI.
    pub mean: f64,
    /// Its standard deviation, SI.
    pub deviation: f64,
    /// How many robots meet it; `None` if it does not judge.
    pub good: Option<u64>,
    /// Which share of its variance comes from each tolerance, to first order; empty of a path, and where nothing varies it.
    pub shares: Vec<f64>,
}

/// What a tolerance does.
#[derive(Clone, Debug)]
pub struct Influence {
    /// The parameter.
    pub name: String,
    /// Its standard deviation, SI.
    pub deviation: f64,
    /// How many robots would be good without this tolerance.
    pub good_without: u64,
    /// The standard error of the difference to the robots that are good with it.
    pub error: f64,
}

impl Influence {
    /// From which robots are good with a tolerance, and without.
    fn of(varied: &Varied, good: &[bool], without: &[bool]) -> Self {
        let changed = good.iter().zip(without).filter(|(a, b)| a != b).count();
        Self {
            name: varied.quantity.name.clone(),
            deviation: standard_deviation(varied),
            good_without: without.iter().filter(|good| **good).count() as u64,
            error: (changed as f64).sqrt(),
        }
    }
}

/// A robot: whether it is good, and the values of goals and constraints.
type Robot = Result<(bool, Vec<f64>), String>;

impl Yield {
    /// The interval in which the share of good robots lies with a probability of 95 %.
    pub fn interval(&self) -> [f64; 2] {
        let (n, share) = (self.robots as f64, self.good as f64 / self.robots as f64);
        let z = BOTH_SIDES;
        let middle = share + z * z / (2.0 * n);
        let half = z * (share * (1.0 - share) / n + z * z / (4.0 * n * n)).sqrt();
        let scale = 1.0 + z * z / n;
        [-1.0, 1.0].map(|side: f64| ((middle + side * half) / scale).clamp(0.0, 1.0))
    }
}

impl Problem<'_> {
    /// Builds so many robots by the model as it is, on so many threads.
    ///
    /// # Errors
    /// The design itself is not possible, or nothing judges; the text says so. `None`: interrupted.
    pub fn built_robots(
        &self,
        count: u64,
        threads: usize,
        is_interrupted: &(dyn Fn() -> bool + Sync),
        finished: &(dyn Fn() + Sync),
    ) -> Result<Option<Yield>, String> {
        let of_tolerances = self.by_tolerances();
        let middle = vec![0.5; of_tolerances.goals.variables.len()];
        let nominal = of_tolerances
            .evaluate_one(&middle)
            .map_err(|reason| format!("the design itself: {reason}"))?;
        let judges = |goals: &Goals| {
            let mut goals = goals.goals.iter();
            goals.any(|goal| goal.within.is_some() || goal.has_limit())
        };
        if !judges(&self.goals) && nominal.constraints.is_empty() {
            return Err("nothing judges a robot: give a goal `within`, or a constraint".to_owned());
        }
        let mut plain = self.clone();
        // Robots need no derivatives.
        plain.goals.variables.clear();
        let all = deviations(&self.goals, count);
        let build = |all: &[Deviations]| -> Option<Vec<Robot>> {
            let robots = parallel(threads, &plain, all, |problem, deviations| {
                if is_interrupted() {
                    return None;
                }
                let robot = problem.built(deviations).robot();
                finished();
                Some(robot)
            });
            robots.into_iter().collect()
        };
        let Some(robots) = build(&all) else { return Ok(None) };
        let is_good = |robot: &Robot| robot.as_ref().is_ok_and(|(good, _)| *good);
        let good: Vec<bool> = robots.iter().map(is_good).collect();
        let mut tolerances = Vec::new();
        for (index, varied) in self.goals.tolerances.iter().enumerate() {
            let exact = |deviations: &Deviations| {
                let mut deviations = deviations.clone();
                deviations[index].1 = 0.0;
                deviations
            };
            let Some(others) = build(&all.iter().map(exact).collect::<Vec<_>>()) else {
                return Ok(None);
            };
            let without: Vec<bool> = others.iter().map(is_good).collect();
            tolerances.push(Influence::of(varied, &good, &without));
        }
        Ok(Some(Yield {
            robots: count,
            good: good.iter().filter(|good| **good).count() as u64,
            failures: failures(&robots),
            judged: self.judged(&nominal, &robots),
            tolerances,
        }))
    }

    /// The problem with the toleranced parameters as variables: one standard deviation to each side.
    fn by_tolerances(&self) -> Self {
        let mut problem = self.clone();
        problem.goals.variables = self
            .goals
            .tolerances
            .iter()
            .filter_map(|varied| {
                let Target::Parameter(parameter) = varied.quantity.target else { return None };
                let (value, by) = (self.system.parameters()[parameter], standard_deviation(varied));
                Some(Variable {
                    name: varied.quantity.name.clone(),
                    parameter,
                    bounds: [value - by, value + by],
                    span: lamc::source::Span::default(),
                })
            })
            .collect();
        problem
    }

    /// Whether this robot meets all goals, and their values.
    fn robot(&self) -> Robot {
        if !self.is_within_ranges() {
            self.is_possible(&[]).map_err(|problems| problems.to_string())?;
        }
        let evaluation = self.evaluate_one(&[])?;
        let values = values(&evaluation);
        match values.iter().all(|value| value.is_finite()) {
            true => Ok((self.verdicts(&values).iter().all(|it| *it != Some(false)), values)),
            false => Err("a value is not finite".to_owned()),
        }
    }

    /// Whether all parameters with a tolerance are in the ranges of the model, in which the drawing is known to be possible.
    fn is_within_ranges(&self) -> bool {
        let Some(model) = &self.compiled.model else { return false };
        self.goals.tolerances.iter().all(|varied| {
            let Target::Parameter(parameter) = varied.quantity.target else { return true };
            let value = self.system.parameters()[parameter];
            let range = model.parameters.get(parameter).and_then(|it| it.range.as_ref());
            range.is_some_and(|range| (range.value[0]..=range.value[1]).contains(&value))
        })
    }

    /// Whether values of goals and constraints are good; `None` of those that do not judge.
    fn verdicts(&self, values: &[f64]) -> Vec<Option<bool>> {
        let goals = self.goals.goals.iter().map(|goal| (&goal.aim, goal.within));
        let keeps = |value: f64, wanted: Wanted| match wanted {
            Wanted::Target(_) => None,
            Wanted::AtMost(most) => Some(value <= most + KEPT * most.abs()),
            Wanted::AtLeast(least) => Some(value >= least - KEPT * least.abs()),
        };
        let goals = goals.zip(values).map(|((aim, within), &value)| match (aim, within) {
            (Aim::Path(_), Some(within)) => Some(value <= within),
            (Aim::Number(_, Wanted::Target(target)), Some(within)) => {
                Some((value - target).abs() <= within)
            }
            (Aim::Number(_, wanted), _) => keeps(value, *wanted),
            (Aim::Path(_), None) => None,
        });
        let mut verdicts: Vec<Option<bool>> = goals.collect();
        // Those of the file, and before them the limits of joints on paths.
        let kept = &values[verdicts.len()..];
        let of_paths = kept.len() - self.goals.constraints.len();
        verdicts.extend(kept[..of_paths].iter().map(|excess| Some(*excess <= KEPT)));
        let own = self.goals.constraints.iter().zip(&kept[of_paths..]);
        verdicts.extend(own.map(|(constraint, value)| keeps(*value, constraint.wanted)));
        verdicts
    }

    fn judged(&self, nominal: &Evaluation, robots: &[Robot]) -> Vec<Judged> {
        let of_goals = self.goals.goals.iter().map(|goal| goal.name.clone());
        let names = of_goals.chain(nominal.constraints.iter().map(|kept| kept.name.clone()));
        let possible: Vec<&Vec<f64>> = robots.iter().flatten().map(|(_, values)| values).collect();
        let verdicts: Vec<Vec<Option<bool>>> =
            possible.iter().map(|values| self.verdicts(values)).collect();
        let shares = shares(&self.goals, nominal);
        names
            .zip(values(nominal))
            .enumerate()
            .map(|(index, (name, nominal))| {
                let of: Vec<f64> = possible.iter().map(|values| values[index]).collect();
                let (mean, deviation) = moments(&of);
                let judges = verdicts.first().is_some_and(|it| it[index].is_some());
                let good = verdicts.iter().filter(|it| it[index] == Some(true)).count() as u64;
                let shares = shares.get(index).cloned().unwrap_or_default();
                Judged { name, nominal, mean, deviation, good: judges.then_some(good), shares }
            })
            .collect()
    }
}

/// The values of goals, of a path the largest distance, and of constraints.
fn values(evaluation: &Evaluation) -> Vec<f64> {
    let goals =
        evaluation.goals.iter().map(|Reached { value, largest, .. }| largest.unwrap_or(*value));
    goals.chain(evaluation.constraints.iter().map(|kept| kept.value)).collect()
}

/// Of each goal and constraint, the share of each tolerance in its variance, to first order: the square of slope times deviation.
fn shares(goals: &Goals, nominal: &Evaluation) -> Vec<Vec<f64>> {
    let of_goals = nominal.goals.iter().zip(&goals.goals).map(|(reached, goal)| match goal.aim {
        Aim::Path(_) => None,
        Aim::Number(..) => reached.errors.first().and_then(|parts| parts.first()),
    });
    let all = of_goals.chain(nominal.constraints.iter().map(|kept| Some(&kept.excess)));
    all.map(|number| {
        let squares: Vec<f64> =
            number.iter().flat_map(|it| it.slope.iter().map(|slope| slope * slope)).collect();
        let sum: f64 = squares.iter().sum();
        match sum > 0.0 {
            true => squares.into_iter().map(|square| square / sum).collect(),
            false => Vec::new(),
        }
    })
    .collect()
}

/// The standard deviation of a tolerance, SI.
fn standard_deviation(varied: &Varied) -> f64 {
    use crate::sweep::plan::Distribution::{LogUniform, Normal, Uniform};
    match varied.distribution {
        Normal([_, deviation]) => deviation,
        Uniform([low, high]) => (high - low) / 12_f64.sqrt(),
        // With L = ln(high / low): mean (high - low) / L, mean square (high^2 - low^2) / (2 L).
        LogUniform([low, high]) => {
            let ratio = libm::log(high / low);
            let mean = (high - low) / ratio;
            larger((high * high - low * low) / (2.0 * ratio) - mean * mean, 0.0).sqrt()
        }
    }
}

/// Mean and standard deviation.
fn moments(numbers: &[f64]) -> (f64, f64) {
    let count = numbers.len() as f64;
    let mean = numbers.iter().sum::<f64>() / count;
    let square: f64 = numbers.iter().map(|it| (it - mean) * (it - mean)).sum();
    (mean, (square / (count - 1.0)).sqrt())
}

fn failures(robots: &[Robot]) -> Vec<(String, u64)> {
    let mut reasons: BTreeMap<String, u64> = BTreeMap::new();
    for reason in robots.iter().filter_map(|robot| robot.as_ref().err()) {
        *reasons.entry(without_numbers(reason)).or_default() += 1;
    }
    let mut reasons: Vec<(String, u64)> = reasons.into_iter().collect();
    reasons.sort_by_key(|(_, times)| std::cmp::Reverse(*times));
    reasons
}
