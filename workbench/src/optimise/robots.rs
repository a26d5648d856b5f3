//! Robots that are built by a design: they differ from it by tolerances.
//!
//! A robot has the parameters of the design plus deviations that do not depend on it. So the same few deviations, from Sobol's
//! sequence, stand for all robots at every design: mean m and standard deviation s of an error e over n robots are smooth
//! functions of the design,
//!
//! ```text
//! m = sum e_i / n,    s^2 = sum (e_i - m)^2 / (n - 1),    ds = sum (e_i - m) de_i / ((n - 1) s)
//! ```
//!
//! (A. Shapiro, D. Dentcheva, A. Ruszczynski, "Lectures on Stochastic Programming", 2009, chapter 5).

use super::evaluate::{Evaluation, Problem};
use super::goals::{Goals, Variable};
use super::number::Number;
use crate::sweep;
use crate::sweep::plan::{Plan, Sampler, Target, Task, Varied};

/// By how much the parameters of a robot differ from the design: the place of each, and the difference, SI.
pub type Deviations = Vec<(usize, f64)>;

/// The deviations of so many robots.
pub fn deviations(goals: &Goals, count: u64) -> Vec<Deviations> {
    let plan = Plan {
        task: Task::Equilibrium { end: false, energy: false, frequencies: false },
        axes: Vec::new(),
        varied: goals.tolerances.clone(),
        sampler: Sampler::Sobol,
        samples: count,
        seed: goals.seed,
    };
    let design = sweep::Design::new(&plan);
    let one = |robot| {
        let values = goals.tolerances.iter().zip(design.values(robot));
        values.filter_map(|(varied, value)| deviation(varied, value)).collect()
    };
    (0..count).map(one).collect()
}

fn deviation(varied: &Varied, value: f64) -> Option<(usize, f64)> {
    match varied.quantity.target {
        Target::Parameter(parameter) => Some((parameter, value - varied.quantity.value)),
        Target::Input(_) | Target::Initial(_) => None,
    }
}

impl Problem<'_> {
    /// The problem of a robot: its design at the same shares of the ranges.
    pub(super) fn built(&self, deviations: &Deviations) -> Self {
        let mut robot = self.clone();
        robot.goals.robust = None;
        for (parameter, by) in deviations {
            let own = robot.goals.variables.iter_mut().find(|it| it.parameter == *parameter);
            if let Some(Variable { bounds, .. }) = own {
                bounds.iter_mut().for_each(|bound| *bound += by);
            }
            let name = &self.system.interface().parameters[*parameter].name;
            let value = self.system.parameters()[*parameter] + by;
            let set = robot.system.set_parameter(name, value);
            debug_assert_eq!(set, Ok(()));
        }
        robot
    }

    /// The design, with the means of errors and constraints over built robots, and so many standard deviations.
    pub(super) fn evaluate_robots(&self, x: &[f64], count: f64) -> Result<Evaluation, String> {
        let mut all = self.evaluate_one(x)?;
        let robots = deviations(&self.goals, self.goals.robots);
        let robots = robots.iter().map(|it| self.built(it).evaluate_one(x));
        let robots: Vec<Evaluation> = robots
            .collect::<Result<_, _>>()
            .map_err(|reason| format!("a robot that is built by the design: {reason}"))?;
        for (index, reached) in all.goals.iter_mut().enumerate() {
            let is_limit = self.goals.goals[index].has_limit();
            for (error, parts) in reached.errors.iter_mut().enumerate() {
                let mut square = Number::constant(0.0, x.len());
                for (part, number) in parts.iter_mut().enumerate() {
                    let of = |robot: &Evaluation| robot.goals[index].errors[error][part].clone();
                    let (mean, deviation) = moments(robots.iter().map(of));
                    *number = mean;
                    square = square.plus(1.0, &squared(&deviation));
                }
                let spread = root(&square).scaled(0.0, count);
                match is_limit {
                    true => parts.iter_mut().for_each(|mean| *mean = mean.plus(1.0, &spread)),
                    false => reached.spread.push(spread),
                }
            }
        }
        for (index, kept) in all.constraints.iter_mut().enumerate() {
            let (mean, deviation) =
                moments(robots.iter().map(|robot| robot.constraints[index].excess.clone()));
            kept.excess = mean.plus(count, &deviation);
        }
        Ok(all.with_limits(&self.goals))
    }
}

fn squared(number: &Number) -> Number {
    Number { value: number.value * number.value, slope: 2.0 * number.value * &number.slope }
}

/// The square root; where it is zero, its derivatives are zero too.
fn root(number: &Number) -> Number {
    let value = number.value.sqrt();
    match value > 0.0 {
        true => Number { value, slope: &number.slope / (2.0 * value) },
        false => Number::constant(0.0, number.slope.len()),
    }
}

/// Mean and standard deviation of at least two numbers.
fn moments(numbers: impl ExactSizeIterator<Item = Number> + Clone) -> (Number, Number) {
    let count = numbers.len() as f64;
    let variables = numbers.clone().next().map_or(0, |first| first.slope.len());
    let zero = Number::constant(0.0, variables);
    let mean = numbers.clone().fold(zero.clone(), |sum, it| sum.plus(1.0 / count, &it));
    let variance = numbers
        .fold(zero, |sum, it| sum.plus(1.0 / (count - 1.0), &squared(&it.plus(-1.0, &mean))));
    (mean, root(&variance))
}
