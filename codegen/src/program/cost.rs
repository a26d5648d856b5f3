//! Operation counts.

use std::collections::{BTreeMap, HashSet};
use std::fmt;
use std::ops::AddAssign;

use super::ir::{Function, Instruction, Op, Value};
use super::section::Subject;

/// How many operations of each kind.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cost {
    /// Additions, subtractions and negations.
    pub add: usize,
    /// Multiplications.
    pub mul: usize,
    /// Divisions.
    pub div: usize,
    /// Sines and cosines, a pair of one angle counted once.
    pub sin_cos: usize,
    /// Everything else: square roots, powers, minima, ...
    pub other: usize,
}

impl Cost {
    /// All operations, each counted as one.
    pub fn total(&self) -> usize {
        self.add + self.mul + self.div + self.sin_cos + self.other
    }

    fn of(op: Op) -> Self {
        let mut cost = Self::default();
        match op {
            Op::Const(_) | Op::Load(_) | Op::Cos(_) => {}
            Op::Neg(_) | Op::Add(..) | Op::Sub(..) => cost.add = 1,
            Op::Mul(..) => cost.mul = 1,
            Op::Div(..) => cost.div = 1,
            Op::Sin(_) => cost.sin_cos = 1,
            _ => cost.other = 1,
        }
        cost
    }
}

impl AddAssign for Cost {
    fn add_assign(&mut self, other: Self) {
        self.add += other.add;
        self.mul += other.mul;
        self.div += other.div;
        self.sin_cos += other.sin_cos;
        self.other += other.other;
    }
}

impl fmt::Display for Cost {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { add, mul, div, sin_cos, other } = self;
        write!(f, "{} operations: {add} add, {mul} mul, {div} div", self.total())?;
        write!(f, ", {sin_cos} sin_cos, {other} other")
    }
}

impl Function {
    /// Cycles that the longest chain of dependent operations takes.
    pub fn critical_path(&self) -> u32 {
        let mut ready: Vec<u32> = Vec::with_capacity(self.instructions.len());
        for instruction in &self.instructions {
            let operands = instruction.op.operands();
            let start = operands.map(|x| ready[x.index()]).max().unwrap_or(0);
            ready.push(start + instruction.op.latency());
        }
        ready.into_iter().max().unwrap_or(0)
    }

    /// Operations per evaluation.
    pub fn cost(&self) -> Cost {
        let mut sum = Cost::default();
        self.costs().into_values().for_each(|cost| sum += cost);
        sum
    }

    /// Operations per evaluation by the body or loop they belong to. A cosine whose sine is not
    /// needed counts as a pair.
    pub fn costs(&self) -> BTreeMap<Subject, Cost> {
        let mut costs: BTreeMap<Subject, Cost> = BTreeMap::new();
        let sine = |instruction: &Instruction| match instruction.op {
            Op::Sin(x) => Some(x),
            _ => None,
        };
        let sines: HashSet<Value> = self.instructions.iter().filter_map(sine).collect();
        for instruction in &self.instructions {
            let mut cost = Cost::of(instruction.op);
            if let Op::Cos(x) = instruction.op
                && !sines.contains(&x)
            {
                cost.sin_cos = 1;
            }
            if cost != Cost::default() {
                *costs.entry(instruction.section.subject).or_default() += cost;
            }
        }
        costs
    }
}
