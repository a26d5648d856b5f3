//! Expressions of the model (torques, forces, stiffness, ...) in the algebra.
//!
//! Every operation is bound by itself: the user's formula is evaluated as written, never
//! simplified into one with another domain.

use super::derivation::Derivation;
use super::equations::Section;
use crate::source::{Binary, Expression, Span, Unary};
use crate::symbolic::{Expr, Function};

/// Largest magnitude of an exponent that becomes multiplications.
const LARGEST_POWER: f64 = 16.0;

impl Derivation<'_> {
    /// An expression of the model as a bound symbol. `what` and `span` name it in an error.
    pub fn scalar(&mut self, expression: &Expression, what: &str, span: Option<Span>) -> Expr {
        if let Some(value) = expression.constant() {
            return self.constant(value);
        }
        let value = match expression {
            Expression::Number(value) => self.constant(*value),
            Expression::Parameter(id) => self.parameters[id.index()].clone(),
            Expression::Input(id) => self.inputs[id.index()].clone(),
            Expression::Time => self.t.clone(),
            Expression::Position(id) => self.q[id.index()].clone(),
            Expression::Rate(id) => self.u[id.index()].clone(),
            Expression::Unary(operator, x) => {
                let x = self.scalar(x, what, span);
                match operator {
                    Unary::Neg => -&x,
                    Unary::Sin => Expr::apply(Function::Sin, &[x]),
                    Unary::Cos => Expr::apply(Function::Cos, &[x]),
                    Unary::Tan => Expr::apply(Function::Tan, &[x]),
                    Unary::Exp => Expr::apply(Function::Exp, &[x]),
                    Unary::Sqrt => Expr::apply(Function::Sqrt, &[x]),
                    Unary::Abs => Expr::apply(Function::Abs, &[x]),
                    Unary::Tanh => Expr::apply(Function::Tanh, &[x]),
                }
            }
            Expression::Binary(operator, x, y) => {
                let exponent = y.constant().filter(|_| *operator == Binary::Pow);
                let x = self.scalar(x, what, span);
                let y = self.scalar(y, what, span);
                self.binary(*operator, x, y, exponent, what, span)
            }
        };
        // Whole numbers stay within -1, 0, 1 in the algebra, which therefore cannot overflow.
        let value = match value.as_integer() {
            Some(number) => self.constant(number as f64),
            None => value,
        };
        self.bind(Section::Mechanism, what.replace(['.', ' '], "_"), value)
    }

    fn binary(
        &mut self,
        operator: Binary,
        x: Expr,
        y: Expr,
        exponent: Option<f64>,
        what: &str,
        span: Option<Span>,
    ) -> Expr {
        let whole = exponent.filter(|n| n.fract() == 0.0 && n.abs() <= LARGEST_POWER);
        let divides = operator == Binary::Div && y.is_zero();
        if divides || (x.is_zero() && whole.is_some_and(|n| n < 0.0)) {
            self.division_by_zero(span, what);
            return Expr::zero();
        }
        match (operator, whole) {
            (Binary::Add, _) => &x + &y,
            (Binary::Sub, _) => &x - &y,
            (Binary::Mul, _) => &x * &y,
            (Binary::Div, _) => &x * &y.power(-1),
            (Binary::Pow, Some(exponent)) => x.power(exponent as i64),
            (Binary::Pow, None) => Expr::apply(Function::Pow, &[x, y]),
            (Binary::Min, _) => Expr::apply(Function::Min, &[x, y]),
            (Binary::Max, _) => Expr::apply(Function::Max, &[x, y]),
        }
    }
}
