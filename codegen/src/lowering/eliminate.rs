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

use super::closure_factor::Closure;
use super::code::Code;
use super::labels::{Called, Labels};
use crate::program::{Function, Op, Output, Phase, Section, Slot, Value};
use crate::topology::NodeId;

/// A factor of M, by speed.
pub trait Factor {
    /// 1 / D.
    fn inverse_pivots(&self) -> &[Value];
    /// L^-1 a.
    fn substitute(&self, code: &mut Code, a: &[Value]) -> Vec<Value>;
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
        code.inline(&self.substitution, given, str::to_owned).swap_remove(0)
    }
}

/// The factor of a matrix, and its speeds from the root to the leaves.
pub struct ByEntry {
    order: Vec<usize>,
    inverse_pivots: Vec<Value>,
    /// L, rows by speed; only entries before the diagonal in `order` are used.
    lower: Vec<Vec<Value>>,
}

impl ByEntry {
    /// Factors M, N x N.
    pub fn of(
        code: &mut Code,
        mass: &[Value],
        speeds: &[(NodeId, usize)],
        labels: &Labels,
    ) -> Self {
        let order: Vec<usize> = speeds.iter().map(|(_, speed)| *speed).collect();
        let n = order.len();
        let mut m: Vec<Vec<Value>> = mass.chunks_exact(n.max(1)).map(<[_]>::to_vec).collect();
        let zero = code.number(0.0);
        let one = code.number(1.0);
        let mut lower = vec![vec![zero; n]; n];
        let mut inverse_pivots = vec![zero; n];
        for (index, &(node, k)) in speeds.iter().enumerate().rev() {
            code.section = Section::body(node, Phase::MassFactor);
            let name = || format!("inverse_pivot_{}", labels.speeds[k]);
            inverse_pivots[k] = code.named(Op::Div(one, m[k][k]), name);
            let before: Vec<usize> =
                order[..index].iter().copied().filter(|&i| !code.is_zero(m[k][i])).collect();
            for (position, &i) in before.iter().enumerate() {
                let name = || format!("l_{}_{}", labels.speeds[k], labels.speeds[i]);
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
        Self { order, inverse_pivots, lower }
    }

    /// L^-T b; `name` is that of its entry for a joint.
    pub fn reduce(
        &self,
        code: &mut Code,
        b: &[Value],
        name: impl Fn(usize) -> String,
    ) -> Vec<Value> {
        let mut y = b.to_vec();
        for (index, &k) in self.order.iter().enumerate().rev() {
            code.name(y[k], || name(k));
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

/// A factor of M and that of the closure.
pub struct Factors<'a, F> {
    pub mass: &'a F,
    pub closure: &'a Closure,
    pub labels: &'a Labels,
}

impl<F: Factor> Factors<'_, F> {
    /// L^-1 D^-1 (y + Y^T lambda) and lambda, for y (N) and gamma (C).
    pub fn solve(
        &self,
        code: &mut Code,
        called: &Called,
        y: &[Value],
        gamma: &[Value],
    ) -> [Vec<Value>; 2] {
        code.enter(Phase::Multiplier);
        let labels = self.labels;
        let mut wanted = Vec::with_capacity(gamma.len());
        for (row, &gamma) in self.closure.weighted().iter().zip(gamma) {
            let there = code.dot(row, y);
            let sum = code.op(Op::Add(gamma, there));
            wanted.push(code.op(Op::Neg(sum)));
        }
        let lambda = self.closure.solve(code, &wanted, |row| called.multiplier(labels, row));
        code.enter(Phase::Acceleration);
        let pairs = y.iter().zip(self.mass.inverse_pivots());
        let mut held: Vec<Value> = pairs.map(|(&y, &d)| code.op(Op::Mul(y, d))).collect();
        let closing = self.closure.combined(code, &lambda, held.len());
        for (joint, (held, closing)) in held.iter_mut().zip(closing).enumerate() {
            *held = code.op(Op::Add(*held, closing));
            code.name(*held, || format!("held_{}", called.solution(labels, joint)));
        }
        [self.substituted(code, called, &held), lambda]
    }

    /// M^-1 J^T (J M^-1 J^T)^-1 x.
    pub fn correction(&self, code: &mut Code, called: &Called, x: &[Value]) -> Vec<Value> {
        code.enter(Phase::Correction);
        let labels = self.labels;
        let lambda = self.closure.solve(code, x, |row| called.multiplier(labels, row));
        let held = self.closure.combined(code, &lambda, self.mass.inverse_pivots().len());
        for (joint, &held) in held.iter().enumerate() {
            code.name(held, || format!("held_{}", called.solution(labels, joint)));
        }
        self.substituted(code, called, &held)
    }

    /// L^-1 `held`: what each joint has while those before it are held, and what they move it by.
    fn substituted(&self, code: &mut Code, called: &Called, held: &[Value]) -> Vec<Value> {
        let solution = self.mass.substitute(code, held);
        for (joint, &value) in solution.iter().enumerate() {
            code.rename(value, || called.solution(self.labels, joint));
        }
        solution
    }

    /// By how much results can be trusted: the least of 1 / D, and the conditioning of S. No pivot of the closure is
    /// divided by.
    pub fn margin(&self, code: &mut Code) -> Output {
        code.enter(Phase::ClosureConditioning);
        let pivots = self.mass.inverse_pivots().iter().copied();
        let least = pivots.reduce(|least, d| code.op(Op::Min(least, d)));
        let least = least.unwrap_or_else(|| code.number(1.0));
        let entries = vec![least, self.closure.conditioning(), code.number(1.0)];
        Output { name: "margin", rows: 3, columns: 1, entries }
    }
}
