//! Value numbering: what is computed once is not computed again.
//!
//! Postcondition: no two instructions have the same operation on the same operands, in either
//! order where the operation commutes.

use crate::program::{Function, Instruction, Op, Slot, Value};
use std::collections::HashMap;

/// Numbers the values of a function.
pub fn number(function: Function) -> Function {
    let mut known: HashMap<Key, Value> = HashMap::new();
    let mut instructions: Vec<Instruction> = Vec::new();
    let mut map: Vec<Value> = Vec::with_capacity(function.instructions.len());
    for instruction in function.instructions {
        let op = canonical(instruction.op.map(|operand| map[operand.index()]));
        let value = *known.entry(key(op)).or_insert_with(|| {
            instructions.push(Instruction { op, section: instruction.section, name: None });
            Value(instructions.len() - 1)
        });
        let kept = &mut instructions[value.index()].name;
        if kept.is_none() {
            *kept = instruction.name;
        }
        map.push(value);
    }
    let mut outputs = function.outputs;
    for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
        *entry = map[entry.index()];
    }
    Function { kind: function.kind, instructions, outputs }
}

/// An operation with its constant as bits, so that it can be looked up.
type Key = (std::mem::Discriminant<Op>, [u64; 2], Option<Slot>);

fn key(op: Op) -> Key {
    let mut operands = op.operands().map(|operand| operand.index() as u64);
    let first = match op {
        // NaN is NaN with any sign.
        Op::Const(number) if number.is_nan() => f64::NAN.to_bits(),
        Op::Const(number) => number.to_bits(),
        _ => operands.next().unwrap_or(u64::MAX),
    };
    let slot = if let Op::Load(slot) = op { Some(slot) } else { None };
    (std::mem::discriminant(&op), [first, operands.next().unwrap_or(u64::MAX)], slot)
}

/// Operands of commutative operations in ascending order, constants first.
fn canonical(op: Op) -> Op {
    match op {
        Op::Add(x, y) if y < x => Op::Add(y, x),
        Op::Mul(x, y) if y < x => Op::Mul(y, x),
        other => other,
    }
}
