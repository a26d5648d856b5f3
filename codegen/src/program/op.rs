//! Queries on an operation that every pass uses: its operands and its value.

use super::ir::{Op, Value};
use crate::arithmetic;

impl Op {
    /// The operands, in order.
    pub fn operands(self) -> impl Iterator<Item = Value> {
        let (first, second) = match self {
            Self::Const(_) | Self::Load(_) => (None, None),
            Self::Neg(x)
            | Self::Sqrt(x)
            | Self::Sin(x)
            | Self::Cos(x)
            | Self::Tan(x)
            | Self::Exp(x)
            | Self::Abs(x)
            | Self::Tanh(x)
            | Self::Ln(x)
            | Self::Step(x) => (Some(x), None),
            Self::Add(x, y)
            | Self::Sub(x, y)
            | Self::Mul(x, y)
            | Self::Div(x, y)
            | Self::Min(x, y)
            | Self::Max(x, y)
            | Self::Pow(x, y)
            | Self::Atan2(x, y) => (Some(x), Some(y)),
        };
        first.into_iter().chain(second)
    }

    /// The same operation on other operands.
    pub fn map(self, f: impl Fn(Value) -> Value) -> Self {
        match self {
            Self::Const(_) | Self::Load(_) => self,
            Self::Neg(x) => Self::Neg(f(x)),
            Self::Sqrt(x) => Self::Sqrt(f(x)),
            Self::Sin(x) => Self::Sin(f(x)),
            Self::Cos(x) => Self::Cos(f(x)),
            Self::Tan(x) => Self::Tan(f(x)),
            Self::Exp(x) => Self::Exp(f(x)),
            Self::Abs(x) => Self::Abs(f(x)),
            Self::Tanh(x) => Self::Tanh(f(x)),
            Self::Ln(x) => Self::Ln(f(x)),
            Self::Step(x) => Self::Step(f(x)),
            Self::Add(x, y) => Self::Add(f(x), f(y)),
            Self::Sub(x, y) => Self::Sub(f(x), f(y)),
            Self::Mul(x, y) => Self::Mul(f(x), f(y)),
            Self::Div(x, y) => Self::Div(f(x), f(y)),
            Self::Min(x, y) => Self::Min(f(x), f(y)),
            Self::Max(x, y) => Self::Max(f(x), f(y)),
            Self::Pow(x, y) => Self::Pow(f(x), f(y)),
            Self::Atan2(x, y) => Self::Atan2(f(x), f(y)),
        }
    }

    /// The value of the operation for given operands, the same bits on every machine; NaN for a
    /// load.
    pub fn evaluate(self, of: impl Fn(Value) -> f64) -> f64 {
        match self {
            Self::Const(number) => number,
            Self::Load(_) => f64::NAN,
            Self::Neg(x) => -of(x),
            Self::Sqrt(x) => of(x).sqrt(),
            Self::Sin(x) => arithmetic::sin(of(x)),
            Self::Cos(x) => arithmetic::cos(of(x)),
            Self::Tan(x) => arithmetic::tan(of(x)),
            Self::Exp(x) => arithmetic::exp(of(x)),
            Self::Abs(x) => of(x).abs(),
            Self::Tanh(x) => arithmetic::tanh(of(x)),
            Self::Ln(x) => arithmetic::ln(of(x)),
            Self::Step(x) => lamc_runtime::Arithmetic::step(of(x)),
            Self::Add(x, y) => of(x) + of(y),
            Self::Sub(x, y) => of(x) - of(y),
            Self::Mul(x, y) => of(x) * of(y),
            Self::Div(x, y) => of(x) / of(y),
            Self::Min(x, y) => lamc_runtime::Arithmetic::min(of(x), of(y)),
            Self::Max(x, y) => lamc_runtime::Arithmetic::max(of(x), of(y)),
            Self::Pow(x, y) => arithmetic::pow(of(x), of(y)),
            Self::Atan2(x, y) => arithmetic::atan2(of(x), of(y)),
        }
    }

    /// Cycles until the result can be used, roughly those of the processors of 2020.
    pub fn latency(self) -> u32 {
        match self {
            Self::Const(_) | Self::Load(_) => 0,
            Self::Neg(_) | Self::Abs(_) => 1,
            Self::Add(..) | Self::Sub(..) | Self::Mul(..) | Self::Min(..) | Self::Max(..) => 3,
            Self::Div(..) | Self::Sqrt(_) => 14,
            _ => 40,
        }
    }

    /// The operation's name in the text form.
    pub fn mnemonic(self) -> &'static str {
        match self {
            Self::Const(_) => "const",
            Self::Load(_) => "load",
            Self::Neg(_) => "neg",
            Self::Add(..) => "add",
            Self::Sub(..) => "sub",
            Self::Mul(..) => "mul",
            Self::Div(..) => "div",
            Self::Sqrt(_) => "sqrt",
            Self::Sin(_) => "sin",
            Self::Cos(_) => "cos",
            Self::Tan(_) => "tan",
            Self::Exp(_) => "exp",
            Self::Abs(_) => "abs",
            Self::Tanh(_) => "tanh",
            Self::Ln(_) => "ln",
            Self::Step(_) => "step",
            Self::Min(..) => "min",
            Self::Max(..) => "max",
            Self::Pow(..) => "pow",
            Self::Atan2(..) => "atan2",
        }
    }
}
