//! Derivatives of the functions of a program, exact to rounding: forward mode, instruction by instruction.
//!
//! With v = f(x, y), the derivatives along K directions are dv = f_x dx + f_y dy (A. Griewank and A. Walther,
//! "Evaluating Derivatives", 2008, chapter 3). The values have the bits of the interpreter.

use lamc::arithmetic::{cos, sin};
use lamc::program::{Function, Op, Slot, Value};

/// The outputs of a function, one after the other, with their derivatives.
#[derive(Clone, Debug, Default)]
pub struct Outputs {
    /// The numbers, in SI.
    pub values: Vec<f64>,
    /// For each of them a row with its derivative along each direction.
    pub tangents: Vec<f64>,
    /// How many directions there are.
    pub directions: usize,
}

impl Outputs {
    /// The derivatives of one number.
    pub fn row(&self, index: usize) -> &[f64] {
        &self.tangents[index * self.directions..][..self.directions]
    }
}

/// Evaluates a function along so many directions: `load` gives the value of a slot, `seed` its derivatives, which are zero
/// before.
pub fn outputs(
    function: &Function,
    directions: usize,
    load: impl Fn(Slot) -> f64,
    seed: impl Fn(Slot, &mut [f64]),
) -> Outputs {
    let count = function.instructions.len();
    let mut values: Vec<f64> = Vec::with_capacity(count);
    let mut tangents = vec![0.0; count * directions];
    for (index, instruction) in function.instructions.iter().enumerate() {
        let (before, rest) = tangents.split_at_mut(index * directions);
        let row = &mut rest[..directions];
        let value = match instruction.op {
            Op::Load(slot) => {
                seed(slot, row);
                load(slot)
            }
            op => {
                let value = op.evaluate(|operand: Value| values[operand.index()]);
                for (operand, share) in op.operands().zip(slopes(op, value, &values)) {
                    let from = &before[operand.index() * directions..][..directions];
                    for (sum, change) in row.iter_mut().zip(from) {
                        // What does not change does not count, even where the slope is infinite.
                        if *change != 0.0 {
                            *sum += share * change;
                        }
                    }
                }
                value
            }
        };
        values.push(value);
    }
    let entries = || function.outputs.iter().flat_map(|output| &output.entries);
    Outputs {
        values: entries().map(|entry| values[entry.index()]).collect(),
        tangents: entries()
            .flat_map(|entry| &tangents[entry.index() * directions..][..directions])
            .copied()
            .collect(),
        directions,
    }
}

/// The derivatives of an operation by its operands.
fn slopes(op: Op, value: f64, values: &[f64]) -> [f64; 2] {
    let of = |operand: Value| values[operand.index()];
    match op {
        Op::Const(_) | Op::Load(_) | Op::Step(_) => [0.0; 2],
        Op::Neg(_) => [-1.0, 0.0],
        Op::Add(..) => [1.0; 2],
        Op::Sub(..) => [1.0, -1.0],
        Op::Mul(x, y) => [of(y), of(x)],
        Op::Div(_, y) => [of(y).recip(), -value / of(y)],
        Op::Sqrt(_) => [0.5 / value, 0.0],
        Op::Sin(x) => [cos(of(x)), 0.0],
        Op::Cos(x) => [-sin(of(x)), 0.0],
        Op::Tan(_) => [1.0 + value * value, 0.0],
        Op::Exp(_) => [value, 0.0],
        Op::Abs(x) => [if of(x) < 0.0 { -1.0 } else { 1.0 }, 0.0],
        Op::Tanh(_) => [1.0 - value * value, 0.0],
        Op::Ln(x) => [of(x).recip(), 0.0],
        // At a kink, the derivative of the first.
        Op::Min(x, y) => {
            if of(x) <= of(y) {
                [1.0, 0.0]
            } else {
                [0.0, 1.0]
            }
        }
        Op::Max(x, y) => {
            if of(x) >= of(y) {
                [1.0, 0.0]
            } else {
                [0.0, 1.0]
            }
        }
        Op::Pow(x, y) => [of(y) * libm::pow(of(x), of(y) - 1.0), value * libm::log(of(x))],
        Op::Atan2(y, x) => {
            let square = of(x) * of(x) + of(y) * of(y);
            [of(x) / square, -of(y) / square]
        }
    }
}

#[cfg(test)]
mod tests {
    use lamc::program::{FunctionKind, Instruction, Output, Phase, Section};
    use lamc::source::ParameterId;

    use super::*;

    /// A function of two parameters.
    fn function(op: impl Fn(Value, Value) -> Op) -> Function {
        let load = |index| Op::Load(Slot::Parameter(ParameterId(index)));
        let ops = [load(0), load(1), op(Value(0), Value(1))];
        let instructions = ops.map(|op| Instruction {
            op,
            section: Section::mechanism(Phase::Drawing),
            name: None,
        });
        let output = Output { name: "numbers", rows: 1, columns: 1, entries: vec![Value(2)] };
        Function {
            kind: FunctionKind::Drawing,
            instructions: instructions.into(),
            outputs: vec![output],
        }
    }

    /// Central differences with this step have an error of about its square, 1e-10.
    const STEP: f64 = 1e-5;

    #[test]
    fn every_operation_has_the_derivatives_of_central_differences() {
        let operations: [fn(Value, Value) -> Op; 19] = [
            |x, _| Op::Neg(x),
            |x, y| Op::Add(x, y),
            |x, y| Op::Sub(x, y),
            |x, y| Op::Mul(x, y),
            |x, y| Op::Div(x, y),
            |x, _| Op::Sqrt(x),
            |x, _| Op::Sin(x),
            |x, _| Op::Cos(x),
            |x, _| Op::Tan(x),
            |x, _| Op::Exp(x),
            |x, _| Op::Abs(x),
            |x, _| Op::Tanh(x),
            |x, _| Op::Ln(x),
            |x, _| Op::Step(x),
            |x, y| Op::Min(x, y),
            |x, y| Op::Max(x, y),
            |x, y| Op::Pow(x, y),
            |x, y| Op::Atan2(x, y),
            |x, y| Op::Atan2(y, x),
        ];
        for (number, op) in operations.into_iter().enumerate() {
            let function = function(op);
            let at = |x: [f64; 2]| {
                let load = |slot: Slot| x[slot.place().1];
                outputs(&function, 2, load, |slot, row| row[slot.place().1] = 1.0)
            };
            let x = [0.7, 1.9];
            let found = at(x);
            for direction in 0..2 {
                let moved = |by: f64| {
                    let mut x = x;
                    x[direction] += by;
                    at(x).values[0]
                };
                let slope = (moved(STEP) - moved(-STEP)) / (2.0 * STEP);
                let error = (found.row(0)[direction] - slope).abs();
                assert!(error < 1e-8, "operation {number}, operand {direction}: {error}");
            }
        }
    }

    #[test]
    fn an_infinite_slope_of_what_does_not_change_is_no_number_that_counts() {
        let function = function(|x, _| Op::Sqrt(x));
        let found = outputs(&function, 1, |_| 0.0, |_, _| ());
        assert_eq!((found.values[0], found.row(0)[0]), (0.0, 0.0));
    }
}
