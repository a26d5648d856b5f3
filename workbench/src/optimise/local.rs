//! The search from one design.
//!
//! Sums of squares without constraints are made least by a trust region for least squares with bounds (TRF: M. A. Branch,
//! T. F. Coleman and Y. Li, SIAM J. Sci. Comput. 21, 1999), everything else by sequential quadratic programming (SLSQP: D.
//! Kraft, DFVLR-FB 88-28, 1988). The largest error is a variable more, b, that is made least with each error between
//! -b and b: so the problem is smooth.

use std::cell::{Cell, RefCell};
use std::convert::Infallible;
use std::rc::Rc;

use basin::{
    BoxBounds, ConstraintDescription, ConstraintJacobian, ConstraintSet, ConstraintSolveError,
    Constraints, CostFunction, DenseMatrix, Executor, Gradient, Jacobian, NoLinearConstraints,
    NoNonlinearBlock, NonlinearBlock, NonlinearBlocks, NonlinearInequalityValues, PointState,
    Residual, SelectedFirstOrderState, Slsqp, TrustRegionReflective,
};
use nalgebra::RowDVector;

use super::evaluate::{Evaluation, Problem};
use super::goals::Norm;

/// Constraints that are exceeded by less than this together count as kept; they have no unit.
pub const KEPT: f64 = 1e-7;
/// Most steps of a solver.
const STEPS: u64 = 300;
/// The scaled gradient at which the least squares end: errors are of order 1 at most, and so is what they depend on.
const GRADIENT: f64 = 1e-13;
/// The accuracy of sequential quadratic programming, in parts of the objective with which it begins.
const ACCURACY: f64 = 1e-9;
/// It begins anew, from where it came to, while the objective falls by more than this share.
const FALL: f64 = 1e-6;
/// So often at most.
const ROUNDS: usize = 8;

/// What a search found.
#[derive(Clone, Debug)]
pub struct Found {
    /// From where, in shares of the ranges.
    pub start: Vec<f64>,
    /// The best design, in shares of the ranges.
    pub x: Vec<f64>,
    /// The design.
    pub evaluation: Evaluation,
    /// What was made least.
    pub objective: f64,
    /// By how much constraints are exceeded together, without a unit.
    pub excess: f64,
    /// How many designs were evaluated.
    pub evaluations: usize,
    /// After how many evaluations the best objective became this.
    pub history: Vec<(usize, f64)>,
}

impl Found {
    /// Whether all constraints are kept.
    pub fn is_kept(&self) -> bool {
        self.excess <= KEPT
    }

    /// Whether it is better than another one: first constraints count, then the objective.
    fn is_better(&self, objective: f64, excess: f64) -> bool {
        match (self.is_kept(), excess <= KEPT) {
            (true, true) => self.objective < objective,
            (kept, other) if kept != other => kept,
            _ => self.excess < excess,
        }
    }
}

/// A design and what it is; `None` if it does not close.
type Known = (Vec<f64>, Option<Rc<Evaluation>>);

/// Evaluates designs for the solvers, and keeps the best.
struct Search<'p> {
    problem: &'p Problem<'p>,
    is_interrupted: &'p dyn Fn() -> bool,
    /// The last design, which solvers ask for several times.
    last: RefCell<Option<Known>>,
    best: RefCell<Found>,
    count: Cell<usize>,
    lower: Vec<f64>,
    upper: Vec<f64>,
    residuals: usize,
}

/// Searches from a design that closes, in shares of the ranges, with what it is.
pub fn search(
    problem: &Problem<'_>,
    start: &[f64],
    evaluation: Evaluation,
    is_interrupted: &dyn Fn() -> bool,
) -> Found {
    let goals = &problem.goals;
    let residuals = evaluation.residuals(goals).len();
    let (objective, excess) = (evaluation.objective(goals), evaluation.excess());
    let has_constraints = !evaluation.constraints.is_empty();
    let first = Found {
        start: start.to_vec(),
        x: start.to_vec(),
        objective,
        excess,
        evaluations: 0,
        history: vec![(1, objective)],
        evaluation,
    };
    let search = Search {
        problem,
        is_interrupted,
        last: RefCell::new(None),
        best: RefCell::new(first.clone()),
        count: Cell::new(0),
        lower: vec![0.0; start.len()],
        upper: vec![1.0; start.len()],
        residuals,
    };
    if goals.norm == Norm::Squares {
        search.least_squares(start);
        // Where constraints are exceeded, they are taken into account from the beginning.
        let end = search.last.borrow().as_ref().and_then(|(_, known)| known.clone());
        if has_constraints && end.is_none_or(|end| end.excess() > KEPT) {
            search.programming(start);
        }
    } else {
        search.programming(start);
    }
    let found = search.best.into_inner();
    Found { evaluations: search.count.get(), ..found }
}

impl Search<'_> {
    /// The design at shares of the ranges; `None` if it does not close.
    fn at(&self, x: &[f64]) -> Option<Rc<Evaluation>> {
        if let Some((_, known)) = self.last.borrow().as_ref().filter(|(last, _)| last == x) {
            return known.clone();
        }
        if (self.is_interrupted)() {
            return None;
        }
        self.count.set(self.count.get() + 1);
        let known = self.problem.evaluate(x).ok().map(Rc::new);
        if let Some(evaluation) = &known {
            self.keep(x, evaluation);
        }
        *self.last.borrow_mut() = Some((x.to_vec(), known.clone()));
        known
    }

    fn keep(&self, x: &[f64], evaluation: &Evaluation) {
        let (objective, excess) = (evaluation.objective(&self.problem.goals), evaluation.excess());
        let mut best = self.best.borrow_mut();
        if objective.is_finite() && excess.is_finite() && !best.is_better(objective, excess) {
            (best.objective, best.excess) = (objective, excess);
            best.x = x.to_vec();
            best.evaluation = evaluation.clone();
            best.history.push((self.count.get(), objective));
        }
    }

    fn least_squares(&self, start: &[f64]) {
        let solver = TrustRegionReflective::new().with_absolute_scaled_gradient_tolerance(GRADIENT);
        let state = PointState::new(start.to_vec());
        // Whatever ends it, the best design is kept.
        drop(Executor::new(Squares(self), solver, state).max_iter(STEPS).run());
        // The constraints that count are those of the best design.
        let x = self.best.borrow().x.clone();
        self.at(&x);
    }

    fn programming(&self, start: &[f64]) {
        let mut x = start.to_vec();
        let mut last = f64::INFINITY;
        for _ in 0..ROUNDS {
            let Some(begin) = self.at(&x) else { return };
            let size = self.size(&begin);
            if size == 0.0 && begin.excess() == 0.0 {
                return;
            }
            let program = self.program(&begin, size);
            let solver = Slsqp::new().with_absolute_accuracy_tolerance(ACCURACY);
            let mut from = x.clone();
            from.extend((self.problem.goals.norm == Norm::Max).then_some(1.0));
            let state = SelectedFirstOrderState::new(from);
            if Executor::new(program, solver, state).max_iter(STEPS).run().is_err() {
                return;
            }
            let best = self.best.borrow();
            let fallen = last - best.objective;
            if best.x == x || fallen <= FALL * best.objective {
                return;
            }
            (x, last) = (best.x.clone(), best.objective);
        }
    }

    /// What errors are divided by, so that the objective begins at 1.
    fn size(&self, begin: &Evaluation) -> f64 {
        let objective = begin.objective(&self.problem.goals);
        if self.problem.goals.norm == Norm::Max { objective } else { objective.sqrt() }
    }

    fn program<'s>(&'s self, begin: &Evaluation, size: f64) -> Program<'s> {
        let goals = &self.problem.goals;
        let has_bound = goals.norm == Norm::Max;
        let errors = if has_bound { 2 * begin.sizes(goals).len() } else { 0 };
        let (mut lower, mut upper) = (self.lower.clone(), self.upper.clone());
        lower.extend(has_bound.then_some(0.0));
        upper.extend(has_bound.then_some(f64::INFINITY));
        let rows = errors + begin.constraints.len();
        let scale = if size > 0.0 { size.recip() } else { 1.0 };
        Program { search: self, scale, rows, has_bound, lower, upper }
    }
}

/// The least squares of a search.
struct Squares<'s>(&'s Search<'s>);

impl Constraints for Squares<'_> {
    type Set = ConstraintSet<BoxBounds<Vec<f64>>>;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new().with_bounds(BoxBounds::new(Some(&self.0.lower), Some(&self.0.upper)))
    }
}

impl Residual for Squares<'_> {
    type Param = Vec<f64>;
    type Output = Vec<f64>;
    type Error = Infallible;
    fn residual(&self, x: &Vec<f64>) -> Result<Vec<f64>, Infallible> {
        Ok(match self.0.at(x) {
            Some(at) => at.residuals(&self.0.problem.goals).iter().map(|it| it.value).collect(),
            // Such a step is rejected.
            None => vec![f64::NAN; self.0.residuals],
        })
    }
}

impl Jacobian for Squares<'_> {
    type Jacobian = DenseMatrix;
    fn jacobian(&self, x: &Vec<f64>) -> Result<DenseMatrix, Infallible> {
        let (rows, columns) = (self.0.residuals, x.len());
        let entries = match self.0.at(x) {
            Some(at) => {
                let residuals = at.residuals(&self.0.problem.goals);
                residuals.iter().flat_map(|it| it.slope.iter().copied()).collect()
            }
            None => vec![f64::NAN; rows * columns],
        };
        Ok(DenseMatrix::from_row_slice(rows, columns, &entries))
    }
}

/// The nonlinear program of a search: x, and for the largest error its bound b after them.
struct Program<'s> {
    search: &'s Search<'s>,
    /// Errors are multiplied by this.
    scale: f64,
    /// How many inequalities there are.
    rows: usize,
    has_bound: bool,
    lower: Vec<f64>,
    upper: Vec<f64>,
}

impl Program<'_> {
    fn at(&self, all: &[f64]) -> Option<Rc<Evaluation>> {
        self.search.at(&all[..self.search.lower.len()])
    }

    /// Each inequality: its value, not positive where it holds, and its derivatives.
    fn inequalities(&self, all: &[f64]) -> Option<Vec<(f64, RowDVector<f64>)>> {
        let at = self.at(all)?;
        let mut rows = Vec::with_capacity(self.rows);
        let columns = all.len();
        if let (true, Some(bound)) = (self.has_bound, all.last()) {
            for size in at.sizes(&self.search.problem.goals) {
                for sign in [1.0, -1.0] {
                    let slope = (sign * self.scale * &size.slope).insert_column(columns - 1, -1.0);
                    rows.push((sign * self.scale * size.value - bound, slope));
                }
            }
        }
        for kept in &at.constraints {
            let mut slope = kept.excess.slope.clone();
            if self.has_bound {
                slope = slope.insert_column(columns - 1, 0.0);
            }
            rows.push((kept.excess.value, slope));
        }
        Some(rows)
    }
}

impl Constraints for Program<'_> {
    type Set = ConstraintSet<
        BoxBounds<Vec<f64>>,
        NoLinearConstraints,
        NonlinearBlocks<NoNonlinearBlock, NonlinearBlock>,
    >;
    fn constraints(&self) -> <Self::Set as ConstraintDescription>::Borrowed<'_> {
        ConstraintSet::new()
            .with_bounds(BoxBounds::new(Some(&self.lower), Some(&self.upper)))
            .with_nonlinear_inequalities(self.rows)
    }
}

impl CostFunction for Program<'_> {
    type Param = Vec<f64>;
    type Output = f64;
    type Error = Infallible;
    fn cost(&self, all: &Vec<f64>) -> Result<f64, Infallible> {
        Ok(match (self.at(all), self.has_bound) {
            (None, _) => f64::INFINITY,
            (Some(_), true) => all.last().copied().unwrap_or(f64::NAN),
            (Some(at), false) => self.scale * self.scale * at.objective(&self.search.problem.goals),
        })
    }
}

impl Gradient for Program<'_> {
    type Gradient = Vec<f64>;
    fn gradient(&self, all: &Vec<f64>) -> Result<Vec<f64>, Infallible> {
        let mut gradient = vec![0.0; all.len()];
        if self.has_bound {
            gradient.iter_mut().rev().take(1).for_each(|last| *last = 1.0);
            return Ok(gradient);
        }
        let Some(at) = self.at(all) else { return Ok(vec![f64::NAN; all.len()]) };
        for residual in at.residuals(&self.search.problem.goals) {
            let factor = 2.0 * self.scale * self.scale * residual.value;
            gradient
                .iter_mut()
                .zip(residual.slope.iter())
                .for_each(|(sum, by)| *sum += factor * by);
        }
        Ok(gradient)
    }
}

impl NonlinearInequalityValues for Program<'_> {
    type Param = Vec<f64>;
    type Values = Vec<f64>;
    type Error = Infallible;
    fn nonlinear_inequalities(
        &self,
        all: &Vec<f64>,
    ) -> Result<Vec<f64>, ConstraintSolveError<Infallible>> {
        Ok(match self.inequalities(all) {
            Some(rows) => rows.into_iter().map(|(value, _)| value).collect(),
            None => vec![f64::NAN; self.rows],
        })
    }
}

impl ConstraintJacobian for Program<'_> {
    type Param = Vec<f64>;
    type Jacobian = DenseMatrix;
    type Error = Infallible;
    fn constraint_jacobian(
        &self,
        all: &Vec<f64>,
    ) -> Result<DenseMatrix, ConstraintSolveError<Infallible>> {
        let entries: Vec<f64> = match self.inequalities(all) {
            Some(rows) => rows.iter().flat_map(|(_, slope)| slope.iter().copied()).collect(),
            None => vec![f64::NAN; self.rows * all.len()],
        };
        Ok(DenseMatrix::from_row_slice(self.rows, all.len(), &entries))
    }
}
