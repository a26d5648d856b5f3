//! The closure's part of the elimination: S = Y D^-1 Y^T, its factor, and how far S is from singular.

#![allow(clippy::needless_range_loop, reason = "one index runs through several rows at once")]

use super::code::Code;
use super::labels::Labels;
use crate::program::{Op, Phase, Value};

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
    pub fn of(
        code: &mut Code,
        labels: &Labels,
        inverse_pivots: &[Value],
        rows: &[Vec<Value>],
    ) -> Self {
        code.enter(Phase::ClosureFactor);
        let mut weighted = Vec::with_capacity(rows.len());
        for (i, row) in rows.iter().enumerate() {
            let over_pivots = row.iter().zip(inverse_pivots).zip(&labels.speeds);
            let over_pivots = over_pivots.map(|((&y, &inverse_pivot), joint)| {
                let name = || format!("y_over_d{}_{joint}", labels.row(i));
                code.named(Op::Mul(y, inverse_pivot), name)
            });
            weighted.push(over_pivots.collect::<Vec<_>>());
        }
        let zero = code.number(0.0);
        let mut s = vec![vec![zero; rows.len()]; rows.len()];
        for i in 0..rows.len() {
            for j in 0..=i {
                s[i][j] = code.dot(&weighted[i], &rows[j]);
                code.rename(s[i][j], || format!("s_{}", labels.pair(i, j)));
            }
        }
        let diagonal: Vec<Value> = (0..rows.len()).map(|i| s[i][i]).collect();
        let [lower, inverse] = factor(code, labels, s);
        let inverse_pivots = (0..rows.len()).map(|k| inverse[k][k]).collect::<Vec<_>>();
        let conditioning = conditioning(code, labels, &lower, &inverse_pivots, &diagonal);
        Self { weighted, lower, inverse_pivots, conditioning }
    }

    /// S^-1 b; `name` is that of its entry for a row.
    pub fn solve(
        &self,
        code: &mut Code,
        b: &[Value],
        name: impl Fn(usize) -> String,
    ) -> Vec<Value> {
        let c = b.len();
        let mut x = b.to_vec();
        for i in 0..c {
            for j in 0..i {
                x[i] = code.less(x[i], self.lower[i][j], x[j]);
            }
            code.rename(x[i], || format!("forward_{}", name(i)));
        }
        for (value, &inverse) in x.iter_mut().zip(&self.inverse_pivots) {
            *value = code.op(Op::Mul(*value, inverse));
        }
        for j in (0..c).rev() {
            code.rename(x[j], || name(j));
            for i in 0..j {
                x[i] = code.less(x[i], self.lower[j][i], x[j]);
            }
        }
        x
    }

    /// D^-1 Y^T, C rows of N.
    pub fn weighted(&self) -> &[Vec<Value>] {
        &self.weighted
    }

    /// See [`conditioning`].
    pub fn conditioning(&self) -> Value {
        self.conditioning
    }

    /// D^-1 Y^T lambda.
    pub fn combined(&self, code: &mut Code, lambda: &[Value], n: usize) -> Vec<Value> {
        let column = |joint: usize| self.weighted.iter().map(|row| row[joint]).collect::<Vec<_>>();
        (0..n).map(|joint| code.dot(&column(joint), lambda)).collect()
    }
}

/// L below its diagonal, and 1 / D on that of the second matrix, of S = L D L^T.
fn factor(code: &mut Code, labels: &Labels, mut s: Vec<Vec<Value>>) -> [Vec<Vec<Value>>; 2] {
    let c = s.len();
    let (zero, one) = (code.number(0.0), code.number(1.0));
    let (mut lower, mut inverse) = (vec![vec![zero; c]; c], vec![vec![zero; c]; c]);
    for k in 0..c {
        let name = || format!("inverse_pivot_loop{}", labels.row(k));
        inverse[k][k] = code.named(Op::Div(one, s[k][k]), name);
        for i in k + 1..c {
            if code.is_zero(s[i][k]) {
                continue;
            }
            let name = || format!("l_{}", labels.pair(i, k));
            lower[i][k] = code.named(Op::Mul(s[i][k], inverse[k][k]), name);
            for j in k + 1..=i {
                s[i][j] = code.less(s[i][j], lower[i][k], s[j][k]);
                let is_last = k + 1 == j;
                if is_last {
                    let name = if i == j { "pivot_loop" } else { "l_times_pivot_" };
                    code.rename(s[i][j], || match i == j {
                        true => format!("{name}{}", labels.row(j)),
                        false => format!("{name}{}", labels.pair(i, j)),
                    });
                }
            }
        }
    }
    [lower, inverse]
}

/// A lower bound of smallest over largest eigenvalue, of S with its rows brought to one length
/// (what the digits of a solution depend on) or a hundred times that of S itself (what the rank
/// depends on), whichever is less.
///
/// With unit diagonal the least is 1 / tr(S^-1) or more; rows of other lengths change it by their
/// least square; the largest is at most the trace.
fn conditioning(
    code: &mut Code,
    labels: &Labels,
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
            code.name(column[i], || format!("inverse_l_{}", labels.pair(i, k)));
            if !code.is_zero(column[i]) {
                let square = code.op(Op::Mul(column[i], column[i]));
                let part = code.op(Op::Mul(square, inverse_pivots[i]));
                entry = code.op(Op::Add(entry, part));
            }
        }
        let scaled = code.op(Op::Mul(diagonal[k], entry));
        inverse_trace = code.op(Op::Add(inverse_trace, scaled));
    }
    code.name(inverse_trace, || "bound_of_trace_of_inverse_s".to_owned());
    let trace = diagonal[1..].iter().fold(diagonal[0], |sum, &x| code.op(Op::Add(sum, x)));
    code.name(trace, || "trace_of_s".to_owned());
    let hundred = code.number(100.0);
    let rank = code.op(Op::Mul(hundred, least));
    let smaller = code.op(Op::Min(trace, rank));
    let below = code.op(Op::Mul(inverse_trace, trace));
    code.op(Op::Div(smaller, below))
}
