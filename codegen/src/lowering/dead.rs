//! Dead code: what no output needs is dropped.
//!
//! Postcondition: every instruction is needed by an output.

use crate::program::{Function, Value};

/// Drops the instructions no output needs.
pub fn dead(function: Function) -> Function {
    let mut needed = vec![false; function.instructions.len()];
    for entry in function.outputs.iter().flat_map(|output| &output.entries) {
        needed[entry.index()] = true;
    }
    for index in (0..needed.len()).rev() {
        if needed[index] {
            for operand in function.instructions[index].op.operands() {
                needed[operand.index()] = true;
            }
        }
    }
    let mut map: Vec<Value> = Vec::with_capacity(needed.len());
    let mut kept = Vec::new();
    for (index, mut instruction) in function.instructions.into_iter().enumerate() {
        map.push(Value(kept.len()));
        if needed[index] {
            instruction.op = instruction.op.map(|operand| map[operand.index()]);
            kept.push(instruction);
        }
    }
    let mut outputs = function.outputs;
    for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
        *entry = map[entry.index()];
    }
    Function { kind: function.kind, instructions: kept, outputs }
}
