//! Elimination: M du/dt = f + J^T lambda, J du/dt = -gamma solved by straight-line code.
//!
//! ```text
//! M = L^T D L          y = L^-T f     Y = J L^-1     (L^-T: from the leaves to the root)
//! S = Y D^-1 Y^T       S lambda = -gamma - Y D^-1 y
//! du/dt = L^-1 D^-1 (y + Y^T lambda)
//! ```
//!
//! L has the zeros of the tree: a joint's row has entries for those before it on the way from the
//! ground only (R. Featherstone, "Rigid Body Dynamics Algorithms", 2008, 6.5). S is dense per group
//! of loops with common joints, and zero between groups. Nothing is exchanged and nothing decided:
//! the code holds where all pivots of M are positive and S is far from singular, and says by how
//! much; elsewhere the runtime decides on the rank.

#![allow(clippy::needless_range_loop, reason = "one index runs through several rows at once")]

use super::fold::Builder;
use super::ir::{Function, Op, Output, Slot, Value};
use crate::kane::{Phase, Section};
use crate::topology::NodeId;

/// A factor of M, by joint.
pub trait Factor {
    /// 1 / D.
    fn inverse_pivots(&self) -> &[Value];
    /// L^-1 a.
    fn substitute(&self, code: &mut Code, a: &[Value]) -> Vec<Value>;
}

/// A function being extended.
pub struct Code {
    builder: Builder,
    section: Section,
}

impl Code {
    /// Continues a function, whose outputs are left to the caller.
    pub fn after(function: Function) -> (Self, Vec<Output>) {
        let builder = Builder::after(function.instructions);
        (Self { builder, section: Section::mechanism(Phase::Output) }, function.outputs)
    }

    /// The function with these outputs.
    pub fn finish(self, kind: super::FunctionKind, outputs: Vec<Output>) -> Function {
        Function { kind, instructions: self.builder.instructions(), outputs }
    }

    /// What follows belongs to this phase of the whole mechanism.
    pub fn enter(&mut self, phase: Phase) {
        self.section = Section::mechanism(phase);
    }

    fn op(&mut self, op: Op) -> Value {
        self.builder.simplify(op, self.section)
    }

    fn named(&mut self, op: Op, name: impl FnOnce() -> String) -> Value {
        let value = self.op(op);
        self.builder.name(value, name);
        value
    }

    fn is_zero(&self, value: Value) -> bool {
        self.builder.constant(value) == Some(0.0)
    }

    /// A constant.
    pub fn number(&mut self, number: f64) -> Value {
        self.op(Op::Const(number))
    }

    /// a . b, terms that are zero left out.
    fn dot(&mut self, a: &[Value], b: &[Value]) -> Value {
        let mut sum = None;
        for (&a, &b) in a.iter().zip(b) {
            if self.is_zero(a) || self.is_zero(b) {
                continue;
            }
            let product = self.op(Op::Mul(a, b));
            sum = Some(match sum {
                Some(sum) => self.op(Op::Add(sum, product)),
                None => product,
            });
        }
        sum.unwrap_or_else(|| self.number(0.0))
    }

    /// a - b c.
    fn less(&mut self, a: Value, b: Value, c: Value) -> Value {
        if self.is_zero(b) || self.is_zero(c) {
            return a;
        }
        let product = self.op(Op::Mul(b, c));
        self.op(Op::Sub(a, product))
    }

    /// Appends a function, some of whose reads are given; its outputs.
    pub fn inline(
        &mut self,
        function: &Function,
        given: impl Fn(Slot) -> Option<Value>,
    ) -> Vec<Vec<Value>> {
        let mut map: Vec<Value> = Vec::with_capacity(function.instructions.len());
        for instruction in &function.instructions {
            let known = match instruction.op {
                Op::Load(slot) => given(slot),
                _ => None,
            };
            let value = known.unwrap_or_else(|| {
                let op = instruction.op.map(|operand| map[operand.index()]);
                let value = self.builder.simplify(op, instruction.section);
                if let Some(name) = &instruction.name {
                    self.builder.name(value, || name.clone());
                }
                value
            });
            map.push(value);
        }
        let entries = |output: &Output| output.entries.iter().map(|v| map[v.index()]).collect();
        function.outputs.iter().map(entries).collect()
    }
}

/// The factor by body: a function that substitutes.
pub struct ByBody {
    pub inverse_pivots: Vec<Value>,
    pub substitution: Function,
}

impl Factor for ByBody {
    fn inverse_pivots(&self) -> &[Value] {
        &self.inverse_pivots
    }

    fn substitute(&self, code: &mut Code, a: &[Value]) -> Vec<Value> {
        let given = |slot| match slot {
            Slot::Acceleration(joint) => Some(a[joint.index()]),
            _ => None,
        };
        code.inline(&self.substitution, given).swap_remove(0)
    }
}

/// The factor of a matrix, and its joints from the root to the leaves.
pub struct ByEntry {
    order: Vec<usize>,
    inverse_pivots: Vec<Value>,
    /// L, rows by joint; only entries before the diagonal in `order` are used.
    lower: Vec<Vec<Value>>,
}

impl ByEntry {
    /// Factors M, N x N. `names` are the joints'.
    pub fn of(code: &mut Code, mass: &[Value], order: &[usize], names: &[&str]) -> Self {
        let n = order.len();
        let mut m: Vec<Vec<Value>> = mass.chunks_exact(n.max(1)).map(<[_]>::to_vec).collect();
        let zero = code.number(0.0);
        let one = code.number(1.0);
        let mut lower = vec![vec![zero; n]; n];
        let mut inverse_pivots = vec![zero; n];
        for (index, &k) in order.iter().enumerate().rev() {
            code.section = Section::body(NodeId(index), Phase::MassFactor);
            let name = || format!("inverse_pivot_{}", names[k]);
            inverse_pivots[k] = code.named(Op::Div(one, m[k][k]), name);
            let before: Vec<usize> =
                order[..index].iter().copied().filter(|&i| !code.is_zero(m[k][i])).collect();
            for (position, &i) in before.iter().enumerate() {
                let name = || format!("factor_{}_{}", names[k], names[i]);
                let factor = code.named(Op::Mul(m[k][i], inverse_pivots[k]), name);
                lower[k][i] = factor;
                for &j in &before[..=position] {
                    let entry = code.less(m[i][j], factor, m[k][j]);
                    m[i][j] = entry;
                    m[j][i] = entry;
                }
            }
        }
        code.enter(Phase::Output);
        Self { order: order.to_vec(), inverse_pivots, lower }
    }

    /// L^-T b.
    pub fn reduce(&self, code: &mut Code, b: &[Value]) -> Vec<Value> {
        let mut y = b.to_vec();
        for (index, &k) in self.order.iter().enumerate().rev() {
            for &i in &self.order[..index] {
                y[i] = code.less(y[i], self.lower[k][i], y[k]);
            }
        }
        y
    }
}

impl Factor for ByEntry {
    fn inverse_pivots(&self) -> &[Value] {
        &self.inverse_pivots
    }

    fn substitute(&self, code: &mut Code, a: &[Value]) -> Vec<Value> {
        let mut x = a.to_vec();
        for (index, &k) in self.order.iter().enumerate() {
            for &i in &self.order[..index] {
                x[k] = code.less(x[k], self.lower[k][i], x[i]);
            }
        }
        x
    }
}

/// The closure's rows beyond a factor, and S = L D L^T of them.
pub struct Closure {
    /// D^-1 Y^T, C rows of N.
    weighted: Vec<Vec<Value>>,
    /// Below the diagonal.
    lower: Vec<Vec<Value>>,
    inverse_pivots: Vec<Value>,
    /// See [`conditioning`].
    conditioning: Value,
}

impl Closure {
    /// Of Y, C rows of N.
    pub fn of(code: &mut Code, inverse_pivots: &[Value], rows: &[Vec<Value>]) -> Self {
        code.enter(Phase::ClosureFactor);
        let c = rows.len();
        let weighted: Vec<Vec<Value>> = rows
            .iter()
            .map(|row| {
                let pairs = row.iter().zip(inverse_pivots);
                pairs.map(|(&y, &d)| code.op(Op::Mul(y, d))).collect()
            })
            .collect();
        let zero = code.number(0.0);
        let one = code.number(1.0);
        let mut s = vec![vec![zero; c]; c];
        for i in 0..c {
            for j in 0..=i {
                s[i][j] = code.dot(&weighted[i], &rows[j]);
            }
        }
        let diagonal: Vec<Value> = (0..c).map(|i| s[i][i]).collect();
        let mut lower = vec![vec![zero; c]; c];
        let mut inverse = vec![zero; c];
        for k in 0..c {
            inverse[k] = code.op(Op::Div(one, s[k][k]));
            for i in k + 1..c {
                if code.is_zero(s[i][k]) {
                    continue;
                }
                lower[i][k] = code.op(Op::Mul(s[i][k], inverse[k]));
                for j in k + 1..=i {
                    s[i][j] = code.less(s[i][j], lower[i][k], s[j][k]);
                }
            }
        }
        let conditioning = conditioning(code, &lower, &inverse, &diagonal);
        Self { weighted, lower, inverse_pivots: inverse, conditioning }
    }

    /// S^-1 b.
    fn solve(&self, code: &mut Code, b: &[Value]) -> Vec<Value> {
        let c = b.len();
        let mut x = b.to_vec();
        for i in 0..c {
            for j in 0..i {
                x[i] = code.less(x[i], self.lower[i][j], x[j]);
            }
        }
        for (value, &inverse) in x.iter_mut().zip(&self.inverse_pivots) {
            *value = code.op(Op::Mul(*value, inverse));
        }
        for j in (0..c).rev() {
            for i in 0..j {
                x[i] = code.less(x[i], self.lower[j][i], x[j]);
            }
        }
        x
    }

    /// D^-1 Y^T lambda.
    fn combined(&self, code: &mut Code, lambda: &[Value], n: usize) -> Vec<Value> {
        let column = |joint: usize| self.weighted.iter().map(|row| row[joint]).collect::<Vec<_>>();
        (0..n).map(|joint| code.dot(&column(joint), lambda)).collect()
    }
}

/// A lower bound of smallest over largest eigenvalue, of S with its rows brought to one length
/// (what the digits of a solution depend on) or a hundred times that of S itself (what the rank
/// depends on), whichever is less.
///
/// With unit diagonal the least is 1 / tr(S^-1) or more; rows of other lengths change it by their
/// least square; the largest is at most the trace.
fn conditioning(
    code: &mut Code,
    lower: &[Vec<Value>],
    inverse_pivots: &[Value],
    diagonal: &[Value],
) -> Value {
    code.enter(Phase::ClosureConditioning);
    let c = diagonal.len();
    let (zero, one) = (code.number(0.0), code.number(1.0));
    let Some(least) = diagonal.iter().copied().reduce(|least, x| code.op(Op::Min(least, x))) else {
        return one;
    };
    // (S^-1)_kk = sum over i of (L^-1)_ik^2 / D_i, column by column.
    let mut inverse_trace = zero;
    for k in 0..c {
        let mut column = vec![zero; c];
        column[k] = one;
        let mut entry = inverse_pivots[k];
        for i in k + 1..c {
            for j in k..i {
                column[i] = code.less(column[i], lower[i][j], column[j]);
            }
            if !code.is_zero(column[i]) {
                let square = code.op(Op::Mul(column[i], column[i]));
                let part = code.op(Op::Mul(square, inverse_pivots[i]));
                entry = code.op(Op::Add(entry, part));
            }
        }
        let scaled = code.op(Op::Mul(diagonal[k], entry));
        inverse_trace = code.op(Op::Add(inverse_trace, scaled));
    }
    let trace = diagonal[1..].iter().fold(diagonal[0], |sum, &x| code.op(Op::Add(sum, x)));
    let hundred = code.number(100.0);
    let rank = code.op(Op::Mul(hundred, least));
    let smaller = code.op(Op::Min(trace, rank));
    let below = code.op(Op::Mul(inverse_trace, trace));
    code.op(Op::Div(smaller, below))
}

/// L^-1 D^-1 (y + Y^T lambda) and lambda, for y (N) and gamma (C).
pub fn solve(
    code: &mut Code,
    factor: &impl Factor,
    closure: &Closure,
    y: &[Value],
    gamma: &[Value],
) -> [Vec<Value>; 2] {
    code.enter(Phase::Multiplier);
    let pairs = y.iter().zip(factor.inverse_pivots());
    let mut a: Vec<Value> = pairs.map(|(&y, &d)| code.op(Op::Mul(y, d))).collect();
    let mut wanted = Vec::with_capacity(gamma.len());
    for (row, &gamma) in closure.weighted.iter().zip(gamma) {
        let there = code.dot(row, y);
        let sum = code.op(Op::Add(gamma, there));
        wanted.push(code.op(Op::Neg(sum)));
    }
    let lambda = closure.solve(code, &wanted);
    code.enter(Phase::Acceleration);
    let closing = closure.combined(code, &lambda, a.len());
    for (a, closing) in a.iter_mut().zip(closing) {
        *a = code.op(Op::Add(*a, closing));
    }
    [factor.substitute(code, &a), lambda]
}

/// M^-1 J^T (J M^-1 J^T)^-1 x.
pub fn correction(
    code: &mut Code,
    factor: &impl Factor,
    closure: &Closure,
    x: &[Value],
) -> Vec<Value> {
    code.enter(Phase::Correction);
    let lambda = closure.solve(code, x);
    let closing = closure.combined(code, &lambda, factor.inverse_pivots().len());
    factor.substitute(code, &closing)
}

/// By how much results can be trusted: the least of 1 / D, and the conditioning of S.
pub fn margin(code: &mut Code, factor: &impl Factor, closure: &Closure) -> Output {
    code.enter(Phase::ClosureConditioning);
    let pivots = factor.inverse_pivots().iter().copied();
    let least = pivots.reduce(|least, d| code.op(Op::Min(least, d)));
    let least = least.unwrap_or_else(|| code.number(1.0));
    let entries = vec![least, closure.conditioning];
    Output { name: "margin", rows: 2, columns: 1, entries }
}
