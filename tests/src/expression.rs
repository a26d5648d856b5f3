//! Values of model expressions, evaluated directly from their tree.

use lamc::source::{Binary, Expression, Unary};

/// What an expression may depend on. SI and radians.
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
                    Unary::Exp => x.exp(),
                    Unary::Sqrt => x.sqrt(),
                    Unary::Abs => x.abs(),
                    Unary::Tanh => x.tanh(),
                }
            }
            Expression::Binary(operator, x, y) => {
                let (x, y) = (self.of(x), self.of(y));
                match operator {
                    Binary::Add => x + y,
                    Binary::Sub => x - y,
                    Binary::Mul => x * y,
                    Binary::Div => x / y,
                    Binary::Pow => x.powf(y),
                    Binary::Min => x.min(y),
                    Binary::Max => x.max(y),
                }
            }
        }
    }
}
