//! All goals and constraints of a design, with their derivatives by the variables.

use lamc::arithmetic::larger;
use lamc::pipeline::Compiled;
use lamc::source::Diagnostics;
use lamc_runtime::Mechanism as _;

use super::balance::{Resting, rest};
use super::design::{Design, parameters};
use super::goals::{
    Aim, Clearance, Goal, Goals, Measure, Moved, Moving, Norm, OfState, Stroke, Wanted,
};
use super::motion::at;
use super::number::{Number, length};
use super::path::trace;
use super::settle::settle;
use super::stroke::stroke;
use super::vibration::{frequency, stiffness};
use crate::adjoint::Differentiated;
use crate::execution::Jit;

/// What an optimisation is about.
#[derive(Clone)]
pub struct Problem<'c> {
    /// The model.
    pub compiled: &'c Compiled,
    /// The mechanism with the parameters that do not vary.
    pub system: Jit,
    /// The goals.
    pub goals: Goals,
    /// The mechanism in reverse mode; only where there is a goal about a motion.
    pub(super) differentiated: Option<Differentiated>,
}

/// A design as it is.
#[derive(Clone, Debug)]
pub struct Evaluation {
    /// In the order of the goals.
    pub goals: Vec<Reached>,
    /// Each of them is kept if it is not positive.
    pub constraints: Vec<Kept>,
}

/// How near a goal is.
#[derive(Clone, Debug)]
pub struct Reached {
    /// The number that it is about; of a path the root mean square of its distances, m.
    pub value: f64,
    /// Of a path, the largest distance, m.
    pub largest: Option<f64>,
    /// Its errors, without a unit: of a path one for each target, each with its parts.
    pub errors: Vec<Vec<Number>>,
    /// How much each of them differs between built robots, in as many standard deviations as count; none where the design
    /// itself counts.
    pub spread: Vec<Number>,
}

/// How a constraint is kept.
#[derive(Clone, Debug)]
pub struct Kept {
    /// Its name.
    pub name: String,
    /// The number that it is about, SI.
    pub value: f64,
    /// The limit, SI.
    pub wanted: Wanted,
    /// By how much the limit is exceeded, without a unit.
    pub excess: Number,
}

impl<'c> Problem<'c> {
    /// The goals for a model; `system` has the parameters that do not vary.
    pub fn new(compiled: &'c Compiled, system: Jit, goals: Goals) -> Self {
        let of_goals = goals.goals.iter().filter_map(|goal| match &goal.aim {
            Aim::Number(measure, _) => Some(*measure),
            Aim::Path(_) => None,
        });
        let mut measures = of_goals.chain(goals.constraints.iter().map(|it| it.measure));
        let differentiated = measures
            .any(|measure| matches!(measure, Measure::Moving(_) | Measure::Settle(_)))
            .then(|| Differentiated::new(&compiled.program, system.clone()));
        Self { compiled, system, goals, differentiated }
    }

    /// The number of variables.
    pub fn variables(&self) -> usize {
        self.goals.variables.len()
    }

    /// The values of all parameters at shares of the ranges, SI.
    pub fn parameters(&self, x: &[f64]) -> Vec<f64> {
        parameters(&self.system, &self.goals.variables, x)
    }

    /// Whether the drawing is possible at shares of the ranges, and the mechanism the same.
    ///
    /// # Errors
    /// It is not.
    pub fn is_possible(&self, x: &[f64]) -> Result<(), Diagnostics> {
        self.compiled.topology_at(&self.parameters(x)).map(drop)
    }

    /// Evaluates the design at shares of the ranges, or the robots that are built by it if they count.
    ///
    /// # Errors
    /// It does not close, or has no state of rest; the text says so.
    pub fn evaluate(&self, x: &[f64]) -> Result<Evaluation, String> {
        match self.goals.robust {
            Some(deviations) => self.evaluate_robots(x, deviations),
            None => self.evaluate_one(x).map(|it| it.with_limits(&self.goals)),
        }
    }

    /// Evaluates the design itself. The errors of goals with a limit are negative where it is kept.
    pub(super) fn evaluate_one(&self, x: &[f64]) -> Result<Evaluation, String> {
        let design = self.design(x);
        let mut resting = None;
        let mut constraints = Vec::new();
        let mut goals = Vec::new();
        for goal in &self.goals.goals {
            let reached = self.reached(goal, &design, x, &mut resting, &mut constraints);
            goals.push(reached.map_err(|reason| format!("`{}`: {reason}", goal.name))?);
        }
        for constraint in &self.goals.constraints {
            let number = self.number(constraint.measure, &design, x, &mut resting);
            let number = number.map_err(|reason| format!("`{}`: {reason}", constraint.name))?;
            let error = self.error(constraint.measure, &number, constraint.wanted);
            constraints.push(Kept {
                name: constraint.name.clone(),
                value: number.value,
                wanted: constraint.wanted,
                excess: error,
            });
        }
        Ok(Evaluation { goals, constraints })
    }

    fn reached(
        &self,
        goal: &Goal,
        design: &Design<'_>,
        x: &[f64],
        resting: &mut Option<Resting>,
        constraints: &mut Vec<Kept>,
    ) -> Result<Reached, String> {
        let path = match &goal.aim {
            Aim::Path(path) => path,
            Aim::Number(measure, wanted) => {
                let number = self.number(*measure, design, x, resting)?;
                return Ok(Reached {
                    value: number.value,
                    largest: None,
                    errors: vec![vec![self.error(*measure, &number, *wanted)]],
                    spread: Vec::new(),
                });
            }
        };
        let traced = trace(path, design)?;
        for (joint, excess) in traced.limits {
            let name = &design.system.interface().joints[joint].name;
            let name = format!("limits of `{name}` on `{}`", goal.name);
            constraints.push(Kept {
                name,
                value: excess.value,
                wanted: Wanted::AtMost(0.0),
                excess,
            });
        }
        let distances: Vec<f64> =
            traced.errors.iter().map(|parts| length(parts).value.abs()).collect();
        let mean = distances.iter().map(|it| it * it).sum::<f64>() / distances.len() as f64;
        let share = self.system.size().recip();
        let scaled =
            |parts: &Vec<Number>| parts.iter().map(|part| part.scaled(0.0, share)).collect();
        Ok(Reached {
            value: mean.sqrt(),
            largest: distances.into_iter().reduce(larger),
            errors: traced.errors.iter().map(scaled).collect(),
            spread: Vec::new(),
        })
    }

    /// The error of a number, without a unit; positive where a limit is exceeded.
    fn error(&self, measure: Measure, number: &Number, wanted: Wanted) -> Number {
        let scale = match measure {
            Measure::Angle(_) | Measure::Moving(Moving { of: OfState::Angle(_), .. }) => 1.0,
            Measure::Position { .. }
            | Measure::Extent(_)
            | Measure::Clearance(_)
            | Measure::Moving(Moving { of: OfState::Position { .. }, .. }) => self.system.size(),
            Measure::Stroke(Stroke { of: Moved::Joint(_), .. }) => 1.0,
            Measure::Stroke(_) => self.system.size(),
            Measure::Frequency(_)
            | Measure::Stiffness { .. }
            | Measure::Torque(_)
            | Measure::Force(_)
            | Measure::Mass(_)
            | Measure::Energy
            | Measure::Settle(_)
            | Measure::Moving(_) => wanted.value().abs(),
        };
        let sign = if matches!(wanted, Wanted::AtLeast(_)) { -1.0 } else { 1.0 };
        number.scaled(wanted.value(), sign / scale)
    }

    fn number(
        &self,
        measure: Measure,
        design: &Design<'_>,
        x: &[f64],
        resting: &mut Option<Resting>,
    ) -> Result<Number, String> {
        match measure {
            Measure::Mass(body) => return self.mass(body, x),
            Measure::Extent(axis) => return self.extent(axis, x),
            Measure::Stroke(of) => return stroke(&of, design),
            Measure::Clearance(of @ Clearance { turned: Some(turned), .. }) => {
                return self.clearance_on_the_way(&of, turned, design, x);
            }
            Measure::Moving(moving) => {
                return at(self.compiled, &self.moving(design)?, design, moving);
            }
            _ => {}
        }
        let resting = match resting {
            Some(known) => known,
            None => resting.insert(rest(self.compiled, design)?),
        };
        match measure {
            Measure::Angle(joint) => Ok(resting.number(design, OfState::Angle(joint))),
            Measure::Position { point, axis } => {
                Ok(resting.number(design, OfState::Position { point, axis }))
            }
            Measure::Frequency(mode) => frequency(self.compiled, design, resting, mode),
            Measure::Stiffness { point, axis } => stiffness(design, resting, (point, axis)),
            Measure::Torque(joint) => Ok(resting.torque(joint)),
            Measure::Force(joint) => Ok(resting.force(design, joint)),
            Measure::Clearance(of) => self.clearance_at_rest(&of, x, resting),
            Measure::Settle(of) => {
                settle(self.compiled, &self.moving(design)?, design, resting, &of)
            }
            _ => Ok(resting.number(design, OfState::Energy(1))),
        }
    }

    /// The mechanism in reverse mode at the values of a design.
    fn moving(&self, design: &Design<'_>) -> Result<Differentiated, String> {
        let prepared = self.differentiated.as_ref().ok_or("no motion was prepared")?;
        Ok(prepared.with(design.system.clone()))
    }

    pub(super) fn design(&self, x: &[f64]) -> Design<'_> {
        Design::new(&self.compiled.program, &self.system, &self.goals.variables, x)
    }
}

impl Evaluation {
    /// What is made least, by the norm; without a unit.
    pub fn objective(&self, goals: &Goals) -> f64 {
        match goals.norm {
            Norm::Squares => self.residuals(goals).iter().map(|it| it.value * it.value).sum(),
            Norm::Max => self.sizes(goals).iter().map(|it| it.value.abs()).fold(0.0, larger),
        }
    }

    /// Where a goal has a limit that is kept, there is no error.
    pub(super) fn with_limits(mut self, goals: &Goals) -> Self {
        for (reached, goal) in self.goals.iter_mut().zip(&goals.goals) {
            for error in reached.errors.iter_mut().flatten() {
                if goal.has_limit() && error.value <= 0.0 {
                    *error = Number::constant(0.0, error.slope.len());
                }
            }
        }
        self
    }

    /// The numbers whose squares are summed: of each goal sqrt(weight / errors) times each part of each error, and each spread.
    pub fn residuals(&self, goals: &Goals) -> Vec<Number> {
        let each = self.goals.iter().zip(&goals.goals).flat_map(|(reached, goal)| {
            let factor = (goal.weight / reached.errors.len() as f64).sqrt();
            let parts = reached.errors.iter().flatten().chain(&reached.spread);
            parts.map(move |part| part.scaled(0.0, factor))
        });
        each.collect()
    }

    /// The weighted size of each error, with a sign where an error has one part. With a spread s, the size of such an error e
    /// is the larger one of e + s and e - s.
    pub fn sizes(&self, goals: &Goals) -> Vec<Number> {
        let mut sizes = Vec::new();
        for (reached, goal) in self.goals.iter().zip(&goals.goals) {
            for (index, parts) in reached.errors.iter().enumerate() {
                let size = length(parts).scaled(0.0, goal.weight);
                let Some(spread) = reached.spread.get(index) else {
                    sizes.push(size);
                    continue;
                };
                sizes.push(size.plus(goal.weight, spread));
                if parts.len() == 1 {
                    sizes.push(size.plus(-goal.weight, spread));
                }
            }
        }
        sizes
    }

    /// By how much constraints are exceeded together; 0 if all are kept.
    pub fn excess(&self) -> f64 {
        self.constraints.iter().map(|kept| larger(kept.excess.value, 0.0)).sum()
    }
}
