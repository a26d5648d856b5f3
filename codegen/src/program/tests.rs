//! Lowering and every pass against plain evaluation of random trees.

use proptest::prelude::*;

use super::ir::{Function, Instruction, Op, Output, Slot, Value};
use super::signature::FunctionKind;
use super::{dead, fold, number};
use crate::kane::{Phase, Section};
use crate::source::JointId;

const LOADS: usize = 4;

/// Runs a function on some coordinates.
fn run(function: &Function, q: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::new();
    for instruction in &function.instructions {
        let value = match instruction.op {
            Op::Load(Slot::Position(id)) => q[id.index()],
            op => op.evaluate(|operand| values[operand.index()]),
        };
        values.push(value);
    }
    function.outputs[0].entries.iter().map(|entry| values[entry.index()]).collect()
}

/// A random straight-line function over coordinates, small constants and + - * neg sin.
fn functions() -> impl Strategy<Value = Function> {
    let choice = (0..8_u8, any::<prop::sample::Index>(), any::<prop::sample::Index>(), -2..=2_i8);
    prop::collection::vec(choice, 1..60).prop_map(|choices| {
        let mut ops: Vec<Op> = (0..LOADS).map(|j| Op::Load(Slot::Position(JointId(j)))).collect();
        for (kind, x, y, number) in choices {
            let (x, y) = (Value(x.index(ops.len())), Value(y.index(ops.len())));
            ops.push(match kind {
                0 => Op::Const(f64::from(number)),
                1 => Op::Neg(x),
                2 => Op::Sin(x),
                3 => Op::Cos(x),
                4 => Op::Sub(x, y),
                5 => Op::Add(x, y),
                _ => Op::Mul(x, y),
            });
        }
        let entries = (0..ops.len()).rev().step_by(3).map(Value).collect::<Vec<_>>();
        let instruction =
            |op| Instruction { op, section: Section::mechanism(Phase::Formula), name: None };
        Function {
            kind: FunctionKind::Closure,
            instructions: ops.into_iter().map(instruction).collect(),
            outputs: vec![Output { name: "x", rows: entries.len(), columns: 1, entries }],
        }
    })
}

fn assert_same(left: &Function, right: &Function, q: &[f64]) -> Result<(), TestCaseError> {
    for (x, y) in run(left, q).into_iter().zip(run(right, q)) {
        let scale = 1.0 + y.abs();
        // Values that grew beyond any geometry's have nothing to say about rounding.
        if scale < 1e6 {
            prop_assert!((x - y).abs() <= 1e-6 * scale, "{x} is not {y}");
        }
    }
    Ok(())
}

proptest! {
    #[test]
    fn passes_keep_the_values(function in functions(), q in prop::array::uniform4(-1.0..1.0_f64)) {
        let folded = fold::fold(function.clone());
        assert_same(&folded, &function, &q)?;
        let numbered = number::number(folded.clone());
        assert_same(&numbered, &folded, &q)?;
        let live = dead::dead(numbered.clone());
        prop_assert_eq!(run(&live, &q), run(&numbered, &q));
    }

    #[test]
    fn passes_leave_what_they_promise(function in functions()) {
        let folded = fold::fold(function);
        let constant = |v: Value| matches!(folded.instructions[v.index()].op, Op::Const(_));
        let live = dead::dead(folded.clone());
        for instruction in &folded.instructions {
            let mut operands = instruction.op.operands().peekable();
            prop_assert!(operands.peek().is_none() || !operands.all(constant));
            prop_assert!(!matches!(instruction.op, Op::Sub(x, y) if x == y));
        }
        let numbered = number::number(live);
        for (index, one) in numbered.instructions.iter().enumerate() {
            for other in &numbered.instructions[index + 1..] {
                prop_assert_ne!(one.op, other.op);
            }
        }
        let live = dead::dead(numbered);
        let mut used = vec![false; live.instructions.len()];
        let entries = live.outputs.iter().flat_map(|output| output.entries.iter().copied());
        let operands = live.instructions.iter().flat_map(|i| i.op.operands());
        entries.chain(operands).for_each(|value| used[value.index()] = true);
        prop_assert!(used.into_iter().all(|used| used));
    }
}
