//! Values of a model's formulas and their derivatives by time, evaluated directly from the formulas.

use lamc::source::{Binary, Expression, Operator, Unary};

/// The variables of a formula, in SI units and radians.
#[derive(Clone, Debug, Default)]
pub struct Values {
    /// Parameters, in the mechanism's order.
    pub parameters: Vec<f64>,
    /// Inputs, in the mechanism's order.
    pub inputs: Vec<f64>,
    /// Time, s.
    pub t: f64,
    /// Joint angles, rad, then the coordinates of the free bodies.
    pub q: Vec<f64>,
    /// Joint speeds, rad/s, then those of the free bodies.
    pub u: Vec<f64>,
}

impl Values {
    /// The value of a formula.
    pub fn of(&self, formula: &Expression) -> f64 {
        self.jet(formula)[0]
    }

    /// The value of a formula and its first and second derivative by time, at constant q, u and inputs.
    pub fn jet(&self, formula: &Expression) -> Jet {
        match formula {
            Expression::Number(number) => constant(*number),
            Expression::Parameter(id) => constant(self.parameters[id.index()]),
            Expression::Input(id) => constant(self.inputs[id.index()]),
            Expression::Time => [self.t, 1.0, 0.0],
            Expression::Position(id) => constant(self.q[id.index()]),
            Expression::Rate(id) => constant(self.u[id.index()]),
            // Only formulas of controllers have these: no law of the motion.
            Expression::Place(..) | Expression::Memory(_) => constant(f64::NAN),
            Expression::Unary(function, x) => unary(*function, self.jet(x)),
            Expression::Binary(operator, x, y) => binary(*operator, self.jet(x), self.jet(y)),
            Expression::Chain(first, rest) => {
                rest.iter().fold(self.jet(first), |x, (operator, y)| {
                    let y = self.jet(y);
                    match operator {
                        Operator::Add => [0, 1, 2].map(|k| x[k] + y[k]),
                        Operator::Sub => [0, 1, 2].map(|k| x[k] - y[k]),
                        Operator::Mul => product(x, y),
                        Operator::Div => quotient(x, y),
                    }
                })
            }
        }
    }
}

/// A value with its first and second derivative.
pub type Jet = [f64; 3];

const fn constant(value: f64) -> Jet {
    [value, 0.0, 0.0]
}

fn product(x: Jet, y: Jet) -> Jet {
    [x[0] * y[0], x[1] * y[0] + x[0] * y[1], x[2] * y[0] + 2.0 * x[1] * y[1] + x[0] * y[2]]
}

/// z = x / y from x = z y.
fn quotient(x: Jet, y: Jet) -> Jet {
    let value = x[0] / y[0];
    let first = (x[1] - value * y[1]) / y[0];
    [value, first, (x[2] - 2.0 * first * y[1] - value * y[2]) / y[0]]
}

/// f(x) from f and its derivatives at x: the chain rule.
fn chain(x: Jet, [value, first, second]: [f64; 3]) -> Jet {
    // A formula without time has no derivatives, even where those of f are infinite.
    if x[1] == 0.0 && x[2] == 0.0 {
        return constant(value);
    }
    [value, first * x[1], second * x[1] * x[1] + first * x[2]]
}

fn unary(function: Unary, jet: Jet) -> Jet {
    let x = jet[0];
    let derivatives = match function {
        Unary::Neg => [-x, -1.0, 0.0],
        Unary::Sin => [x.sin(), x.cos(), -x.sin()],
        Unary::Cos => [x.cos(), -x.sin(), -x.cos()],
        Unary::Tan => {
            let (tangent, first) = (x.tan(), 1.0 + x.tan() * x.tan());
            [tangent, first, 2.0 * tangent * first]
        }
        Unary::Asin | Unary::Acos => {
            let rest = 1.0 - x * x;
            let (first, second) = (1.0 / rest.sqrt(), x / (rest * rest.sqrt()));
            match function {
                Unary::Asin => [x.asin(), first, second],
                _ => [x.acos(), -first, -second],
            }
        }
        Unary::Atan => {
            let first = 1.0 / (1.0 + x * x);
            [x.atan(), first, -2.0 * x * first * first]
        }
        Unary::Exp => [x.exp(); 3],
        Unary::Log => [x.ln(), 1.0 / x, -1.0 / (x * x)],
        Unary::Sqrt => [x.sqrt(), 0.5 / x.sqrt(), -0.25 / (x * x.sqrt())],
        Unary::Abs => [x.abs(), x.signum(), 0.0],
        Unary::Sign => [if x == 0.0 { 0.0 } else { x.signum() }, 0.0, 0.0],
        Unary::Step => [if x.is_nan() { x } else { f64::from(u8::from(x >= 0.0)) }, 0.0, 0.0],
        Unary::Tanh => {
            let (tangent, first) = (x.tanh(), 1.0 - x.tanh() * x.tanh());
            [tangent, first, -2.0 * tangent * first]
        }
    };
    chain(jet, derivatives)
}

fn binary(operator: Binary, x: Jet, y: Jet) -> Jet {
    match operator {
        Binary::Min => {
            if x[0] <= y[0] || x[0].is_nan() {
                x
            } else {
                y
            }
        }
        Binary::Max => {
            if x[0] >= y[0] || x[0].is_nan() {
                x
            } else {
                y
            }
        }
        Binary::Pow if y[1] == 0.0 && y[2] == 0.0 => {
            let (base, exponent) = (x[0], y[0]);
            let first = exponent * base.powf(exponent - 1.0);
            let second = exponent * (exponent - 1.0) * base.powf(exponent - 2.0);
            chain(x, [base.powf(exponent), first, second])
        }
        // x^y = exp(y ln x)
        Binary::Pow => {
            let mut jet = unary(Unary::Exp, product(y, unary(Unary::Log, x)));
            jet[0] = x[0].powf(y[0]);
            jet
        }
        // The angle of (y, x) in the order of the arguments changes by (y x' - x y') / (x^2 + y^2).
        Binary::Atan2 => {
            let (sine, cosine) = (x, y);
            let square = [0, 1, 2].map(|k| product(sine, sine)[k] + product(cosine, cosine)[k]);
            let turned = cosine[0] * sine[1] - sine[0] * cosine[1];
            let first = turned / square[0];
            let change = cosine[0] * sine[2] - sine[0] * cosine[2];
            [sine[0].atan2(cosine[0]), first, (change - first * square[1]) / square[0]]
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Derivatives of formulas by time against central differences of fourth order.
    #[test]
    fn derivatives_by_time() {
        for text in [
            "sin(3*t)*exp(-t) + tan(t/3)",
            "(1 + t)^2.5 + (2 + t)^t",
            "atan2(sin(t), 2 + t) - asin(t/4) + acos(t/5)",
            "log(2 + t)*sqrt(1 + t*t)/(3 - t) + tanh(t) - atan(2*t)",
            "abs(t - 3) + max(t, 2*t - 5) + min(t^3, 9)",
        ] {
            let model = format!(
                "name: m\nbodies: {{ a: {{ fixed: true }}, b: {{ point_masses: [{{ mass: 1, at: [1, 0, 0] }}] \
                 }} }}\njoints: {{ j: {{ bodies: [a, b], axis: [[0, 0], [0, 1]], drive: \"{text}\" }} }}\n"
            );
            let file = lamc::source::SourceFile { path: "m.yaml".into(), text: model };
            let (topology, _) = lamc::pipeline::analyse(&file)
                .unwrap_or_else(|problems| panic!("{}", problems.render(&file, false)));
            let drive = topology.mechanism.joints[0].drive.as_ref().unwrap();
            let at = |t: f64| Values { t, ..Values::default() }.of(drive);
            for t in [0.3, 0.7, 1.4] {
                let h = 1e-3;
                let [b, a, o, c, d] = [-2.0, -1.0, 0.0, 1.0, 2.0].map(|k| at(t + k * h));
                let first = (b - 8.0 * a + 8.0 * c - d) / (12.0 * h);
                let second = (-b + 16.0 * a - 30.0 * o + 16.0 * c - d) / (12.0 * h * h);
                let found = Values { t, ..Values::default() }.jet(drive);
                for (found, expected) in found.into_iter().zip([o, first, second]) {
                    let error = (found - expected).abs() / (1.0 + expected.abs());
                    assert!(error < 1e-8, "{text} at {t}: {found} instead of {expected}");
                }
            }
        }
    }
}
