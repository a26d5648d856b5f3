//! A program in single precision: each operation is rounded to `f32`.
//!
//! Sums, products, quotients and square roots of `f32` numbers that are computed in `f64` and then rounded
//! are those of `f32` arithmetic, because `f64` has more than twice its digits (S. A. Figueroa, "When is
//! double rounding innocuous?", 1995). Other functions are rounded correctly.

use lamc::program::{Engine, Executable, FunctionKind, Op, Program, Slot};

/// A program in single precision.
pub type Single = Executable<Rounded>;

/// Runs a program with rounded operations.
#[derive(Clone, Debug)]
pub struct Rounded {
    program: Program,
}

impl Engine for Rounded {
    fn new(program: &Program) -> Self {
        Self { program: program.clone() }
    }

    fn run(&self, kind: FunctionKind, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]) {
        let function = self.program.function_of(kind);
        let mut values: Vec<f64> = Vec::with_capacity(function.instructions.len());
        for instruction in &function.instructions {
            let value = match instruction.op {
                Op::Load(slot) => load(slot),
                op => op.evaluate(|operand| values[operand.index()]),
            };
            values.push(f64::from(value as f32));
        }
        for (output, target) in function.outputs.iter().zip(out) {
            for (entry, slot) in output.entries.iter().zip(target.iter_mut()) {
                *slot = values[entry.index()];
            }
        }
    }
}
