//! Expressions of the model file (`torque: "motor - 0.02*sin(2*pi*t)"`) after name resolution.
//!
//! SI and radians throughout.

use crate::arithmetic;

use serde::{Deserialize, Serialize};

use super::ids::{InputId, JointId, MemoryId, ParameterId, PointId};

/// A scalar expression over numbers, parameters, inputs, time, coordinates and speeds.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Expression {
    /// A number.
    Number(f64),
    /// A parameter, settable at run time.
    Parameter(ParameterId),
    /// An input, set by the caller at every step.
    Input(InputId),
    /// Time t in seconds.
    Time,
    /// `q.<joint>`, radians.
    Position(JointId),
    /// `u.<joint>`, radians per second.
    Rate(JointId),
    /// `x.<point>`, `y.<point>` or `z.<point>` in a controller: a coordinate of the point in the base frame, m.
    Place(PointId, usize),
    /// What a controller remembers.
    Memory(MemoryId),
    /// A function of one argument.
    Unary(Unary, Box<Expression>),
    /// A power, or a function of two arguments.
    Binary(Binary, Box<Expression>, Box<Expression>),
    /// A first operand, then the operations on it in order: `a - b + c`. A chain holds either sums
    /// and differences or products and quotients. It is one node whatever its length, because later
    /// stages walk trees recursively.
    Chain(Box<Expression>, Vec<(Operator, Expression)>),
}

/// Functions of one argument.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names of the variants say what they are")]
pub enum Unary {
    Neg,
    Sin,
    Cos,
    Tan,
    Asin,
    Acos,
    Atan,
    Exp,
    /// The natural logarithm.
    Log,
    Sqrt,
    Abs,
    /// -1 below zero, 0 at zero, 1 above.
    Sign,
    /// 0 below zero, 1 from zero on.
    Step,
    Tanh,
}

/// Powers and functions of two arguments.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names of the variants say what they are")]
pub enum Binary {
    Pow,
    Atan2,
    Min,
    Max,
}

/// The operators of chains.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
#[allow(missing_docs, reason = "the names of the variants say what they are")]
pub enum Operator {
    Add,
    Sub,
    Mul,
    Div,
}

impl Expression {
    /// The expression `0`.
    pub const ZERO: Self = Self::Number(0.0);

    /// Returns the number if the expression is a number.
    pub fn as_number(&self) -> Option<f64> {
        match self {
            Self::Number(number) => Some(*number),
            _ => None,
        }
    }

    /// Evaluates the expression. `of` gives the values of the leaves that are not numbers.
    pub fn evaluate(&self, of: &impl Fn(&Self) -> f64) -> f64 {
        match self {
            Self::Number(number) => *number,
            Self::Unary(function, x) => function.apply(x.evaluate(of)),
            Self::Binary(function, x, y) => function.apply(x.evaluate(of), y.evaluate(of)),
            Self::Chain(first, rest) => rest
                .iter()
                .fold(first.evaluate(of), |x, (operator, y)| operator.apply(x, y.evaluate(of))),
            leaf => of(leaf),
        }
    }

    /// Returns whether the expression contains this leaf.
    pub fn contains(&self, leaf: &Self) -> bool {
        match self {
            Self::Unary(_, x) => x.contains(leaf),
            Self::Binary(_, x, y) => x.contains(leaf) || y.contains(leaf),
            Self::Chain(first, rest) => {
                first.contains(leaf) || rest.iter().any(|(_, x)| x.contains(leaf))
            }
            other => other == leaf,
        }
    }

    /// Replaces every `old` by `new`.
    pub(super) fn replace(&mut self, old: &Self, new: &Self) {
        if self == old {
            *self = new.clone();
            return;
        }
        match self {
            Self::Unary(_, x) => x.replace(old, new),
            Self::Binary(_, x, y) => {
                x.replace(old, new);
                y.replace(old, new);
            }
            Self::Chain(first, rest) => {
                first.replace(old, new);
                rest.iter_mut().for_each(|(_, x)| x.replace(old, new));
            }
            _ => {}
        }
    }

    /// Returns the value of a constant expression, such as `2*pi`. It is not finite for `1/0`.
    pub fn constant(&self) -> Option<f64> {
        self.at(&[])
    }

    /// Returns the value of an expression that depends on parameters only, given in their order.
    pub fn at(&self, parameters: &[f64]) -> Option<f64> {
        Some(match self {
            Self::Number(number) => *number,
            Self::Parameter(id) => *parameters.get(id.index())?,
            Self::Unary(function, x) => function.apply(x.at(parameters)?),
            Self::Binary(function, x, y) => function.apply(x.at(parameters)?, y.at(parameters)?),
            Self::Chain(first, rest) => {
                rest.iter().try_fold(first.at(parameters)?, |x, (operator, y)| {
                    Some(operator.apply(x, y.at(parameters)?))
                })?
            }
            _ => return None,
        })
    }
}

impl Unary {
    /// Evaluates the function.
    pub fn apply(self, x: f64) -> f64 {
        match self {
            Self::Neg => -x,
            Self::Sin => arithmetic::sin(x),
            Self::Cos => arithmetic::cos(x),
            Self::Tan => arithmetic::tan(x),
            Self::Asin => arithmetic::asin(x),
            Self::Acos => arithmetic::acos(x),
            Self::Atan => arithmetic::atan(x),
            Self::Exp => arithmetic::exp(x),
            Self::Log => arithmetic::ln(x),
            Self::Sqrt => x.sqrt(),
            Self::Abs => x.abs(),
            Self::Sign => lamc_runtime::Arithmetic::step(x) - lamc_runtime::Arithmetic::step(-x),
            Self::Step => lamc_runtime::Arithmetic::step(x),
            Self::Tanh => arithmetic::tanh(x),
        }
    }
}

impl Binary {
    /// Evaluates the function.
    pub fn apply(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Pow => arithmetic::pow(x, y),
            Self::Atan2 => arithmetic::atan2(x, y),
            Self::Min => x.min(y),
            Self::Max => x.max(y),
        }
    }
}

impl Operator {
    /// Evaluates the function.
    pub fn apply(self, x: f64, y: f64) -> f64 {
        match self {
            Self::Add => x + y,
            Self::Sub => x - y,
            Self::Mul => x * y,
            Self::Div => x / y,
        }
    }
}
