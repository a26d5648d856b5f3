//! Functions of random operations.

use proptest::prelude::*;

use crate::program::{
    Function, FunctionKind, Instruction, Op, Output, Phase, Section, Slot, Value,
};
use crate::source::CoordinateId;

/// Coordinates that they read.
pub const LOADS: usize = 4;

/// A function of these operations; its results are these values.
pub fn function(ops: impl IntoIterator<Item = (Op, Section)>, entries: Vec<Value>) -> Function {
    let instruction = |(op, section)| Instruction { op, section, name: None };
    Function {
        kind: FunctionKind::Closure,
        instructions: ops.into_iter().map(instruction).collect(),
        outputs: vec![Output { name: "x", rows: entries.len(), columns: 1, entries }],
    }
}

pub fn formula() -> Section {
    Section::mechanism(Phase::Formula)
}

/// A random straight-line function over coordinates, small constants and + - * / neg sin.
pub fn functions() -> impl Strategy<Value = Function> {
    let choice = (0..9_u8, any::<prop::sample::Index>(), any::<prop::sample::Index>(), -2..=2_i8);
    prop::collection::vec(choice, 1..60).prop_map(|choices| {
        let mut ops: Vec<Op> =
            (0..LOADS).map(|j| Op::Load(Slot::Position(CoordinateId(j)))).collect();
        for (kind, x, y, number) in choices {
            let (x, y) = (Value(x.index(ops.len())), Value(y.index(ops.len())));
            ops.push(match kind {
                0 => Op::Const(f64::from(number)),
                1 => Op::Neg(x),
                2 => Op::Sin(x),
                3 => Op::Cos(x),
                4 => Op::Sub(x, y),
                5 => Op::Add(x, y),
                6 => Op::Div(x, y),
                _ => Op::Mul(x, y),
            });
        }
        let entries = (0..ops.len()).rev().step_by(3).map(Value).collect::<Vec<_>>();
        function(ops.into_iter().map(|op| (op, formula())), entries)
    })
}
