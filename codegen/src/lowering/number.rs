//! Value numbering: what is computed once is not computed again.
//!
//! Postcondition: no two instructions have the same operation on the same operands, in either
//! order where the operation commutes.

use rustc_hash::{FxBuildHasher, FxHashMap};

use crate::program::{Function, Instruction, Op, Value};

/// Numbers the values of a function.
pub fn number(function: Function) -> Function {
    let count = function.instructions.len();
    let mut known: FxHashMap<Key, Value> =
        FxHashMap::with_capacity_and_hasher(count, FxBuildHasher);
    let mut instructions: Vec<Instruction> = Vec::with_capacity(count);
    let mut map: Vec<Value> = Vec::with_capacity(count);
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
    Function::renumbered(function.kind, instructions, function.outputs, &map)
}

/// An operation with its constant as bits, or the place from which it loads, so that it can be looked up.
pub type Key = (std::mem::Discriminant<Op>, [u64; 2]);

/// Returns an operation as a key.
pub fn key(op: Op) -> Key {
    let words = match op {
        // NaN is NaN with any sign.
        Op::Const(number) if number.is_nan() => [f64::NAN.to_bits(), 0],
        Op::Const(number) => [number.to_bits(), 0],
        Op::Load(slot) => {
            let (argument, index) = slot.place();
            [argument as u64, index as u64]
        }
        _ => {
            let mut operands = op.operands().map(|operand| operand.index() as u64);
            [(); 2].map(|()| operands.next().unwrap_or(u64::MAX))
        }
    };
    (std::mem::discriminant(&op), words)
}

/// Operands of commutative operations in ascending order, constants first.
pub fn canonical(op: Op) -> Op {
    match op {
        Op::Add(x, y) if y < x => Op::Add(y, x),
        Op::Mul(x, y) if y < x => Op::Mul(y, x),
        other => other,
    }
}
