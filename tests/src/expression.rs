//! Values of model expressions, evaluated directly from their tree.

use lamc::source::{Binary, Expression, Operator, Unary};

/// Variables of an expression, in SI and radians.
#[derive(Clone, Debug, Default)]
pub struct Values {
    /// Parameters, in the mechanism's order.
    pub parameters: Vec<f64>,
    /// Inputs, in the mechanism's order.
    pub inputs: Vec<f64>,
    /// Time, s.
    pub t: f64,
    /// Joint angles, rad.
    pub q: Vec<f64>,
    /// Joint speeds, rad/s.
    pub u: Vec<f64>,
}

impl Values {
    /// The value of an expression.
    pub fn of(&self, expression: &Expression) -> f64 {
        match expression {
            Expression::Number(number) => *number,
            Expression::Parameter(id) => self.parameters[id.index()],
            Expression::Input(id) => self.inputs[id.index()],
            Expression::Time => self.t,
            Expression::Position(id) => self.q[id.index()],
            Expression::Rate(id) => self.u[id.index()],
            Expression::Unary(function, x) => {
                let x = self.of(x);
                match function {
                    Unary::Neg => -x,
                    Unary::Sin => x.sin(),
                    Unary::Cos => x.cos(),
                    Unary::Tan => x.tan(),
                    Unary::Asin => x.asin(),
                    Unary::Acos => x.acos(),
                    Unary::Atan => x.atan(),
                    Unary::Exp => x.exp(),
                    Unary::Log => x.ln(),
                    Unary::Sqrt => x.sqrt(),
                    Unary::Abs => x.abs(),
                    Unary::Sign if x == 0.0 => 0.0,
                    Unary::Sign => x.signum(),
                    Unary::Step if x.is_nan() => x,
                    Unary::Step => f64::from(u8::from(x >= 0.0)),
                    Unary::Tanh => x.tanh(),
                }
            }
            Expression::Binary(operator, x, y) => {
                let (x, y) = (self.of(x), self.of(y));
                match operator {
                    Binary::Pow => x.powf(y),
                    Binary::Atan2 => x.atan2(y),
                    Binary::Min => x.min(y),
                    Binary::Max => x.max(y),
                }
            }
            Expression::Chain(first, rest) => {
                let mut x = self.of(first);
                for (operator, y) in rest {
                    let y = self.of(y);
                    match operator {
                        Operator::Add => x += y,
                        Operator::Sub => x -= y,
                        Operator::Mul => x *= y,
                        Operator::Div => x /= y,
                    }
                }
                x
            }
        }
    }
}
