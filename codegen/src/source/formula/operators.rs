//! The operators of expressions: their binding powers and chains.

use crate::source::expression::{Expression, Operator};

/// Binding powers: left, right.
const SUM: (u8, u8) = (10, 11);
const PRODUCT: (u8, u8) = (20, 21);
pub(super) const SIGN: u8 = 30;
pub(super) const POWER: (u8, u8) = (41, 40);

/// An operator between two operands.
#[derive(Clone, Copy)]
pub(super) enum Infix {
    Chained(Operator),
    Power,
}

impl Infix {
    /// Returns the operator with this symbol.
    pub(super) fn of(symbol: char) -> Option<Self> {
        Some(match symbol {
            '+' => Self::Chained(Operator::Add),
            '-' => Self::Chained(Operator::Sub),
            '*' => Self::Chained(Operator::Mul),
            '/' => Self::Chained(Operator::Div),
            '^' => Self::Power,
            _ => return None,
        })
    }

    pub(super) fn powers(self) -> (u8, u8) {
        match self {
            Self::Chained(operator) => powers(operator),
            Self::Power => POWER,
        }
    }
}

/// Returns the binding powers of an operator of chains.
pub(super) fn powers(operator: Operator) -> (u8, u8) {
    match operator {
        Operator::Add | Operator::Sub => SUM,
        Operator::Mul | Operator::Div => PRODUCT,
    }
}

/// Applies an operator. If `left` is a chain of operators of the same precedence, it is extended.
pub(super) fn chained(left: Expression, operator: Operator, right: Expression) -> Expression {
    match left {
        Expression::Chain(first, mut rest)
            if rest.first().is_some_and(|(other, _)| powers(*other) == powers(operator)) =>
        {
            rest.push((operator, right));
            Expression::Chain(first, rest)
        }
        first => Expression::Chain(Box::new(first), vec![(operator, right)]),
    }
}
