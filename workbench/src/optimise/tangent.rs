//! Derivatives of the functions of a program, exact to rounding: forward mode, instruction by instruction.
//!
//! With v = f(x, y), the derivatives along K directions are dv = f_x dx + f_y dy (A. Griewank and A. Walther,
//! "Evaluating Derivatives", 2008, chapter 3). The values have the bits of the interpreter. Along one more direction, dv
//! changes by f_x dx' + f_y dy' + f_x' dx + f_y' dy, where a dash is the change along it: second derivatives.

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
                        *sum += share_of(share, *change);
                    }
                }
                value
            }
        };
        values.push(value);
    }
    of_entries(function, directions, &values, &tangents)
}

/// As [`outputs`], and how these numbers and derivatives change along one further direction: `turn` is the change of a slot,
/// whose `seed` does not change. The derivatives of the drawing by the parameters do: they are not what `seed` is for.
pub fn bent(
    function: &Function,
    directions: usize,
    load: impl Fn(Slot) -> f64,
    seed: impl Fn(Slot, &mut [f64]),
    turn: impl Fn(Slot) -> f64,
) -> [Outputs; 2] {
    let count = function.instructions.len();
    let (mut values, mut changes) = (Vec::with_capacity(count), Vec::with_capacity(count));
    let mut tangents = vec![0.0; count * directions];
    let mut bends = vec![0.0; count * directions];
    for (index, instruction) in function.instructions.iter().enumerate() {
        let (before, rest) = tangents.split_at_mut(index * directions);
        let (bent, left) = bends.split_at_mut(index * directions);
        let (row, bend) = (&mut rest[..directions], &mut left[..directions]);
        if let Op::Load(slot) = instruction.op {
            seed(slot, row);
            values.push(load(slot));
            changes.push(turn(slot));
            continue;
        }
        let op = instruction.op;
        let value = op.evaluate(|operand: Value| values[operand.index()]);
        let shares = slopes(op, value, &values);
        let along = op.operands().zip(shares).map(|(x, share)| share_of(share, changes[x.index()]));
        let change = along.sum();
        let turned = turned(op, [value, change], &values, &changes);
        for ((operand, share), turned) in op.operands().zip(shares).zip(turned) {
            let place = operand.index() * directions;
            for direction in 0..directions {
                let (by, bend_by) = (before[place + direction], bent[place + direction]);
                row[direction] += share_of(share, by);
                bend[direction] += share_of(share, bend_by) + share_of(turned, by);
            }
        }
        values.push(value);
        changes.push(change);
    }
    [(&values, &tangents), (&changes, &bends)]
        .map(|(values, tangents)| of_entries(function, directions, values, tangents))
}

/// What does not change does not count, even where the slope is infinite.
fn share_of(slope: f64, change: f64) -> f64 {
    if change == 0.0 { 0.0 } else { slope * change }
}

/// The numbers of the outputs, of those of all instructions.
fn of_entries(function: &Function, directions: usize, values: &[f64], tangents: &[f64]) -> Outputs {
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

/// How the derivatives of an operation by its operands change where its value and its operands do.
fn turned(op: Op, [value, change]: [f64; 2], values: &[f64], changes: &[f64]) -> [f64; 2] {
    let of = |operand: Value| (values[operand.index()], changes[operand.index()]);
    match op {
        Op::Const(_) | Op::Load(_) | Op::Step(_) | Op::Neg(_) | Op::Add(..) | Op::Sub(..) => {
            [0.0; 2]
        }
        Op::Abs(_) | Op::Min(..) | Op::Max(..) => [0.0; 2],
        Op::Mul(x, y) => [of(y).1, of(x).1],
        Op::Div(_, y) => {
            let (y, dy) = of(y);
            [-dy / (y * y), (value * dy / y - change) / y]
        }
        Op::Sqrt(_) => [share_of(-0.5 / (value * value), change), 0.0],
        Op::Sin(x) | Op::Cos(x) => [-value * of(x).1, 0.0],
        Op::Tan(_) => [2.0 * value * change, 0.0],
        Op::Exp(_) => [change, 0.0],
        Op::Tanh(_) => [-2.0 * value * change, 0.0],
        Op::Ln(x) => [-of(x).1 / (of(x).0 * of(x).0), 0.0],
        Op::Pow(x, y) => {
            let ((x, dx), (y, dy)) = (of(x), of(y));
            let (log, by_base) = (libm::log(x), y * libm::pow(x, y - 1.0));
            let of_base = share_of(y * (y - 1.0) * libm::pow(x, y - 2.0), dx)
                + share_of(libm::pow(x, y - 1.0) * (1.0 + y * log), dy);
            [
                of_base,
                share_of(by_base * log + libm::pow(x, y - 1.0), dx)
                    + share_of(value * log * log, dy),
            ]
        }
        Op::Atan2(y, x) => {
            let ((y, dy), (x, dx)) = (of(y), of(x));
            let square = x * x + y * y;
            let share = 2.0 * (x * dx + y * dy) / square;
            [(dx - x * share) / square, (y * share - dy) / square]
        }
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

    const OPERATIONS: [fn(Value, Value) -> Op; 19] = [
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

    #[test]
    fn every_operation_has_the_derivatives_of_central_differences() {
        for (number, op) in OPERATIONS.into_iter().enumerate() {
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
    fn second_derivatives_are_those_of_differences_of_the_first() {
        for (number, op) in OPERATIONS.into_iter().enumerate() {
            let function = function(op);
            let (x, way) = ([0.7, 1.9], [0.6, -0.8]);
            let seed = |slot: Slot, row: &mut [f64]| row[slot.place().1] = 1.0;
            let load = |slot: Slot| x[slot.place().1];
            let [found, change] = bent(&function, 2, load, seed, |slot| way[slot.place().1]);
            let moved = |by: f64| {
                outputs(&function, 2, |slot| x[slot.place().1] + by * way[slot.place().1], seed)
            };
            let (plus, minus) = (moved(STEP), moved(-STEP));
            assert_eq!((found.values[0], found.row(0)), (moved(0.0).values[0], moved(0.0).row(0)));
            let slope = (plus.values[0] - minus.values[0]) / (2.0 * STEP);
            assert!((change.values[0] - slope).abs() < 1e-8, "operation {number}");
            for direction in 0..2 {
                let slope = (plus.row(0)[direction] - minus.row(0)[direction]) / (2.0 * STEP);
                let error = (change.row(0)[direction] - slope).abs();
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
