//! Elimination of the closure with chosen pivots: N and p of a = N y + p.

use crate::program::{Phase, Section};
use std::collections::BTreeMap;

use crate::kane::binder::Binder;
use crate::kane::closure::Closure;
use crate::source::JointId;
use crate::symbolic::Expr;
use crate::topology::{LoopId, Pivot, Reduction};

/// The closure after its elimination.
pub struct Elimination {
    /// Pivots with the other entries of their row, by column.
    rows: Vec<(Pivot, BTreeMap<usize, Expr>)>,
    /// 1 / pivot.
    inverse_pivots: Vec<Expr>,
    /// Multiples of an earlier pivot row that were taken from each pivot row: its place and the factor.
    factors: Vec<Vec<(usize, Expr)>>,
    /// Length of u.
    speeds: usize,
    /// The loop of each row of the closure.
    loops: Vec<LoopId>,
    /// N, by speed, one number per independent joint; free bodies, which the closure leaves out, have zeros. Empty
    /// until [`with_null_space`](Self::with_null_space).
    pub null_space: Vec<Vec<Expr>>,
}

impl Elimination {
    pub fn new(binder: &mut Binder, closure: &Closure, reduction: &Reduction) -> Self {
        let n = binder.mechanism().speeds();
        let entries = |row: usize| -> BTreeMap<usize, Expr> {
            let row = closure.jacobian[row * n..][..n].iter().enumerate();
            row.filter(|(_, entry)| !entry.is_zero()).map(|(j, x)| (j, x.clone())).collect()
        };
        let mut waiting: Vec<_> =
            reduction.pivots.iter().map(|&pivot| (pivot, entries(pivot.row))).collect();
        let loops: Vec<_> = closure.rows().iter().map(|row| row.closed).collect();
        let section_of = |row: usize| Section::closure(loops[row], Phase::Elimination);
        let mut factors = vec![Vec::new(); waiting.len()];
        let mut inverse_pivots = Vec::with_capacity(waiting.len());
        for done in 0..waiting.len() {
            let (head, later) = waiting.split_at_mut(done + 1);
            let (Pivot { row, joint }, pivot_row) = &mut head[done];
            let pivot = pivot_row.remove(&joint.index()).unwrap_or_else(Expr::zero);
            let section = section_of(*row);
            let pivot = binder.bind(section, format!("pivot_row{row}"), pivot);
            let inverse = binder.bind(section, format!("inverse_pivot_row{row}"), pivot.power(-1));
            for (ahead, (Pivot { row: other, .. }, entries)) in later.iter_mut().enumerate() {
                let Some(entry) = entries.remove(&joint.index()) else { continue };
                let section = section_of(*other);
                let factor =
                    binder.bind(section, format!("factor_row{other}_{row}"), &entry * &inverse);
                for (&column, value) in pivot_row.iter() {
                    let name = binder.speed_name(column);
                    let name = format!("row{other}_less_{row}_{name}");
                    let entry = entries.entry(column).or_insert_with(Expr::zero);
                    *entry = binder.bind(section, name, &*entry - &(&factor * value));
                }
                factors[done + 1 + ahead].push((done, factor));
            }
            inverse_pivots.push(inverse);
        }
        Self { rows: waiting, inverse_pivots, factors, speeds: n, loops, null_space: Vec::new() }
    }

    /// Derives N.
    pub fn with_null_space(mut self, binder: &mut Binder, reduction: &Reduction) -> Self {
        self.null_space = self.null_space(binder, reduction);
        self
    }

    /// Returns the pivots of the dependent joints, each after those that its speed follows from: minus 1 / pivot times the
    /// sum of the entries of its row times the speeds of their columns.
    fn rows(&self) -> impl Iterator<Item = (Pivot, &Expr, &BTreeMap<usize, Expr>)> {
        let rows = self.rows.iter().zip(&self.inverse_pivots).rev();
        rows.map(|((pivot, row), inverse)| (*pivot, inverse, row))
    }

    /// Returns the loop of a row of the closure.
    pub fn loop_of(&self, row: usize) -> LoopId {
        self.loops[row]
    }

    /// Returns the pivots in their order, with their inverses.
    pub fn pivots(&self) -> impl Iterator<Item = (Pivot, &Expr)> {
        self.rows.iter().map(|(pivot, _)| *pivot).zip(&self.inverse_pivots)
    }

    /// Returns the speed of a joint per unit of each independent speed.
    pub fn speeds_by(&self, joint: JointId) -> &[Expr] {
        &self.null_space[joint.index()]
    }

    fn null_space(&self, binder: &mut Binder, reduction: &Reduction) -> Vec<Vec<Expr>> {
        let d = reduction.independent.len();
        let mut table = vec![vec![Expr::zero(); d]; self.speeds];
        for (k, joint) in reduction.independent.iter().enumerate() {
            table[joint.index()][k] = Expr::one();
        }
        for (Pivot { row, joint }, inverse, entries) in self.rows() {
            let section = Section::closure(self.loops[row], Phase::NullSpace);
            let mut speed = |k: usize| {
                let terms = entries.iter().map(|(column, value)| value * &table[*column][k]);
                let sum = terms.fold(Expr::zero(), |sum, term| &sum - &term);
                let name = format!("{}_by_{k}", binder.mechanism().joints[joint.index()].name);
                binder.bind(section, name, inverse * &sum)
            };
            table[joint.index()] = (0..d).map(&mut speed).collect();
        }
        table
    }

    /// Returns p, by speed, with zeros for the independent speeds, for b by row.
    pub fn solve(&self, binder: &mut Binder, wanted: &[Expr], name: &str) -> Vec<Expr> {
        let section_of = |row: usize| Section::closure(self.loops[row], Phase::DependentPart);
        let mut right: Vec<Expr> = Vec::with_capacity(self.rows.len());
        for ((Pivot { row, .. }, _), factors) in self.rows.iter().zip(&self.factors) {
            let mut sum = wanted[*row].clone();
            for (earlier, factor) in factors {
                sum = &sum - &(factor * &right[*earlier]);
            }
            right.push(binder.bind(section_of(*row), format!("{name}_row{row}"), sum));
        }
        let mut solution = vec![Expr::zero(); self.speeds];
        for (at, (Pivot { row, joint }, entries)) in self.rows.iter().enumerate().rev() {
            let mut sum = right[at].clone();
            for (&column, value) in entries {
                sum = &sum - &(value * &solution[column]);
            }
            let name = format!("{name}_{}", binder.mechanism().joints[joint.index()].name);
            let value = &self.inverse_pivots[at] * &sum;
            solution[joint.index()] = binder.bind(section_of(*row), name, value);
        }
        solution
    }

    /// Returns what speeds u of the joints open: the p with J p = J u and zeros for the independent joints, u - N u_i.
    pub fn opened(&self, binder: &mut Binder, reduction: &Reduction) -> Vec<Expr> {
        let mut opened = vec![Expr::zero(); self.speeds];
        for (Pivot { row, joint }, _) in &self.rows {
            let along = reduction.independent.iter().zip(self.speeds_by(*joint));
            let terms = along.map(|(independent, n)| n * &binder.speed(independent.index()));
            let rest = terms.fold(binder.speed(joint.index()), |rest, term| &rest - &term);
            let name = format!("opened_{}", binder.speed_name(joint.index()));
            let section = Section::closure(self.loops[*row], Phase::DependentPart);
            opened[joint.index()] = binder.bind(section, name, rest);
        }
        opened
    }

    /// Returns p + `sign` N y.
    pub fn combined(
        &self,
        binder: &mut Binder,
        given: &[Expr],
        y: &[Expr],
        name: &str,
        sign: f64,
    ) -> Vec<Expr> {
        let mut sections = vec![Section::mechanism(Phase::Combination); given.len()];
        for (Pivot { row, joint }, _) in &self.rows {
            sections[joint.index()] = Section::closure(self.loops[*row], Phase::Combination);
        }
        let mut solution = Vec::with_capacity(given.len());
        for (speed, (given, row)) in given.iter().zip(&self.null_space).enumerate() {
            let mut sum = given.clone();
            for (n, y) in row.iter().zip(y) {
                let term = n * y;
                sum = if sign < 0.0 { &sum - &term } else { &sum + &term };
            }
            let name = format!("{name}_{}", binder.speed_name(speed));
            solution.push(binder.bind(sections[speed], name, sum));
        }
        solution
    }
}

/// Returns N^T x.
pub fn transposed(null_space: &[Vec<Expr>], x: &[Expr]) -> Vec<Expr> {
    let d = null_space.first().map_or(0, Vec::len);
    let sum = |k: usize| {
        let terms = null_space.iter().zip(x).map(|(row, x)| &row[k] * x);
        terms.fold(Expr::zero(), |sum, term| &sum + &term)
    };
    (0..d).map(sum).collect()
}
