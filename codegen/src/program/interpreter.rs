//! The plain interpreter: what every backend must agree with.

use std::cell::RefCell;
use std::sync::Arc;

use super::engine::Engine;
use super::executable::Executable;
use super::ir::{Op, Output, Program, Slot, Value};
use super::signature::FunctionKind;

/// A program run instruction by instruction.
pub type Interpreter = Executable<Interpretation>;

/// Runs functions instruction by instruction. Clones share them.
#[derive(Clone, Debug)]
pub struct Interpretation {
    functions: Arc<[(Vec<Op>, Vec<Output>)]>,
    values: RefCell<Vec<f64>>,
}

impl Engine for Interpretation {
    fn new(program: &Program) -> Self {
        let ops = |f: &super::ir::Function| f.instructions.iter().map(|i| i.op).collect();
        Self {
            functions: program.functions.iter().map(|f| (ops(f), f.outputs.clone())).collect(),
            values: RefCell::default(),
        }
    }

    fn run(&self, kind: FunctionKind, load: impl Fn(Slot) -> f64, out: &mut [&mut [f64]]) {
        let (ops, outputs) = &self.functions[kind as usize];
        let mut values = self.values.borrow_mut();
        values.clear();
        for op in ops {
            let value = match op {
                Op::Load(slot) => load(*slot),
                op => op.evaluate(|operand: Value| values[operand.index()]),
            };
            values.push(value);
        }
        for (output, target) in outputs.iter().zip(out) {
            for (entry, slot) in output.entries.iter().zip(target.iter_mut()) {
                *slot = values[entry.index()];
            }
        }
    }
}
