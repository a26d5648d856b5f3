//! Expressions of the model (torques, forces, stiffness, ...) in the algebra.
//!
//! Every operation is bound separately: the user's formula is evaluated as written, and never
//! simplified into a formula with a different domain.

use super::binder::Binder;
use crate::program::{Fact, Phase, Section, Subject};
use crate::source::{Binary, Expression, Operator, Span, Unary};
use crate::symbolic::{Expr, Function};

/// Largest magnitude of an exponent for which a power becomes multiplications.
const LARGEST_POWER: f64 = 16.0;

impl Binder<'_> {
    /// Returns an expression of the model as a bound symbol. `what` and `span` identify it in an error
    /// message.
    pub fn formula(&mut self, expression: &Expression, what: &str, span: Option<Span>) -> Expr {
        if let Some(value) = expression.constant() {
            return self.folded(value, what, span);
        }
        let value = match expression {
            Expression::Number(value) => self.number_of(what, *value),
            Expression::Parameter(id) => self.parameter(*id),
            Expression::Input(id) => self.input(*id),
            Expression::Time => self.time(),
            Expression::Position(id) => self.coordinate(id.index()),
            Expression::Rate(id) => self.speed(id.index()),
            Expression::Place(id, axis) => self.place(*id, *axis),
            Expression::Memory(id) => self.memory(*id),
            Expression::Unary(function, x) => {
                let x = self.formula(x, what, span);
                if let Some(x) = self.value(&x) {
                    return self.folded(function.apply(x), what, span);
                }
                self.unary(*function, x, what)
            }
            Expression::Binary(function, x, y) => {
                let x = self.formula(x, what, span);
                let y = self.formula(y, what, span);
                let (known, exponent) = (self.value(&x), self.value(&y));
                if let (Some(x), Some(y)) = (known, exponent) {
                    return self.folded(function.apply(x, y), what, span);
                }
                let exponent = exponent.filter(|_| *function == Binary::Pow);
                self.binary(*function, x, y, exponent, what, span)
            }
            Expression::Chain(first, rest) => return self.chain(first, rest, what, span),
        };
        self.operation(what, value)
    }

    /// Binds one operation of an expression.
    fn operation(&mut self, what: &str, value: Expr) -> Expr {
        self.bind(Section::mechanism(Phase::Formula), identifier(what), value)
    }

    /// Returns a number that occurs in a formula, named after the formula.
    fn number_of(&mut self, what: &str, value: f64) -> Expr {
        let (name, subject) = (identifier(what), Subject::Mechanism);
        self.name(Fact { name, quantity: None, subject, value });
        self.constant(value)
    }

    /// Returns a number that is in the formula or that the algebra computed, as in
    /// `exp(1000 + q.j - q.j)`.
    fn folded(&mut self, value: f64, what: &str, span: Option<Span>) -> Expr {
        if value.is_finite() {
            return self.number_of(what, value);
        }
        self.not_finite(value, span, what);
        Expr::zero()
    }

    /// Applies the operations from left to right. Constant parts are evaluated to numbers.
    fn chain(
        &mut self,
        first: &Expression,
        rest: &[(Operator, Expression)],
        what: &str,
        span: Option<Span>,
    ) -> Expr {
        let mut number = first.constant();
        let mut value = match number {
            Some(_) => Expr::zero(),
            None => self.formula(first, what, span),
        };
        for (operator, next) in rest {
            if let (Some(x), Some(y)) = (number, next.constant()) {
                number = Some(operator.apply(x, y));
                continue;
            }
            if let Some(number) = number.take() {
                value = self.number_of(what, number);
            }
            let next = self.formula(next, what, span);
            let known = self.value(&next);
            if *operator == Operator::Div && known == Some(0.0) {
                self.division_by_zero(span, what);
                return Expr::zero();
            }
            if let (Some(x), Some(y)) = (self.value(&value), known) {
                value = self.folded(operator.apply(x, y), what, span);
                continue;
            }
            let result = match operator {
                Operator::Add => &value + &next,
                Operator::Sub => &value - &next,
                Operator::Mul => &value * &next,
                Operator::Div => &value * &next.power(-1),
            };
            value = self.operation(what, result);
        }
        value
    }

    /// Applies a function of one argument. The inverse sine and cosine are computed as angles of a
    /// point on the unit circle, so that they keep their digits near 1 and -1.
    fn unary(&mut self, function: Unary, x: Expr, what: &str) -> Expr {
        match function {
            Unary::Neg => -&x,
            Unary::Sin => Expr::apply(Function::Sin, &[x]),
            Unary::Cos => Expr::apply(Function::Cos, &[x]),
            Unary::Tan => Expr::apply(Function::Tan, &[x]),
            Unary::Asin => {
                let beside = self.beside(&x, what);
                Expr::apply(Function::Atan2, &[x, beside])
            }
            Unary::Acos => {
                let beside = self.beside(&x, what);
                Expr::apply(Function::Atan2, &[beside, x])
            }
            Unary::Atan => Expr::apply(Function::Atan2, &[x, Expr::one()]),
            Unary::Exp => Expr::apply(Function::Exp, &[x]),
            Unary::Log => Expr::apply(Function::Ln, &[x]),
            Unary::Sqrt => Expr::apply(Function::Sqrt, &[x]),
            Unary::Abs => Expr::apply(Function::Abs, &[x]),
            Unary::Sign => {
                let [above, below] = [x.clone(), -&x].map(|x| Expr::apply(Function::Step, &[x]));
                let [above, below] = [above, below].map(|step| self.operation(what, step));
                &above - &below
            }
            Unary::Step => Expr::apply(Function::Step, &[x]),
            Unary::Tanh => Expr::apply(Function::Tanh, &[x]),
        }
    }

    /// Returns sqrt((1 - x) (1 + x)), which is not a number if x is beyond -1 or 1.
    fn beside(&mut self, x: &Expr, what: &str) -> Expr {
        let [less, more] = [&Expr::one() - x, &Expr::one() + x].map(|x| self.operation(what, x));
        let square = self.operation(what, &less * &more);
        let root = Expr::apply(Function::Sqrt, &[square]);
        self.operation(what, root)
    }

    fn binary(
        &mut self,
        function: Binary,
        x: Expr,
        y: Expr,
        exponent: Option<f64>,
        what: &str,
        span: Option<Span>,
    ) -> Expr {
        let whole = exponent.filter(|n| n.fract() == 0.0 && n.abs() <= LARGEST_POWER);
        if x.is_zero() && whole.is_some_and(|n| n < 0.0) {
            self.division_by_zero(span, what);
            return Expr::zero();
        }
        match (function, whole) {
            (Binary::Pow, Some(exponent)) => x.power(exponent as i64),
            (Binary::Pow, None) => Expr::apply(Function::Pow, &[x, y]),
            (Binary::Atan2, _) => Expr::apply(Function::Atan2, &[x, y]),
            (Binary::Min, _) => Expr::apply(Function::Min, &[x, y]),
            (Binary::Max, _) => Expr::apply(Function::Max, &[x, y]),
        }
    }
}

/// Returns the name of a formula in a form that can be part of an identifier.
fn identifier(what: &str) -> String {
    what.replace(['.', ' '], "_")
}
