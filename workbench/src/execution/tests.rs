//! Machine code against the interpreter on random functions, several parts long.

use proptest::prelude::*;

use super::MachineCode;
use lamc::program::{
    Engine, Function, FunctionKind, Instruction, Interface, Interpretation, Op, Output, Phase,
    Program, Section, Slot, Value,
};
use lamc::source::CoordinateId;

const LOADS: usize = 4;

/// A random straight-line function over coordinates and constants, of every operation.
fn functions() -> impl Strategy<Value = Function> {
    let choice =
        (0..20_u8, any::<prop::sample::Index>(), any::<prop::sample::Index>(), -2.0..2.0_f64);
    prop::collection::vec(choice, 1..3500).prop_map(|choices| {
        let mut ops: Vec<Op> =
            (0..LOADS).map(|j| Op::Load(Slot::Position(CoordinateId(j)))).collect();
        for (kind, x, y, number) in choices {
            let (x, y) = (Value(x.index(ops.len())), Value(y.index(ops.len())));
            ops.push(match kind {
                0 => Op::Const(number),
                1 => Op::Neg(x),
                2 => Op::Add(x, y),
                3 => Op::Sub(x, y),
                4 => Op::Mul(x, y),
                5 => Op::Div(x, y),
                6 => Op::Sqrt(x),
                7 => Op::Sin(x),
                8 => Op::Cos(x),
                9 => Op::Tan(x),
                10 => Op::Exp(x),
                11 => Op::Abs(x),
                12 => Op::Tanh(x),
                13 => Op::Ln(x),
                14 => Op::Step(x),
                15 => Op::Min(x, y),
                16 => Op::Max(x, y),
                17 => Op::Pow(x, y),
                18 => Op::Atan2(x, y),
                _ => Op::Const(f64::from(number as i8)),
            });
        }
        let entries = (0..ops.len()).rev().step_by(3).map(Value).collect::<Vec<_>>();
        let instruction =
            |op| Instruction { op, section: Section::mechanism(Phase::Formula), name: None };
        Function {
            kind: FunctionKind::Equations,
            instructions: ops.into_iter().map(instruction).collect(),
            outputs: vec![Output { name: "x", rows: entries.len(), columns: 1, entries }],
        }
    })
}

/// A program of this one function.
fn program(function: Function) -> Program {
    let interface = Interface { size: 1.0, ..Interface::default() };
    Program { interface, facts: Vec::new(), functions: vec![function] }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn machine_code_is_the_interpreter_bit_for_bit(
        function in functions(),
        states in prop::collection::vec(prop::array::uniform4(-2.0..2.0_f64), 3),
    ) {
        let length = function.outputs[0].entries.len();
        let program = program(function);
        let (plain, machine) = (Interpretation::new(&program), MachineCode::new(&program));
        prop_assert!(machine.compiled(FunctionKind::Equations).is_some(), "no machine code here");
        // As on a host without.
        let bare = MachineCode::within(&program, None);
        prop_assert!(bare.compiled(FunctionKind::Equations).is_none());
        for q in states {
            let load = |slot| match slot {
                Slot::Position(id) => q[id.index()],
                _ => f64::NAN,
            };
            let (mut expected, mut got) = (vec![0.0; length], vec![0.0; length]);
            plain.run(FunctionKind::Equations, load, &mut [&mut expected]);
            for machine in [&machine, &bare] {
                got.fill(0.0);
                machine.run(FunctionKind::Equations, load, &mut [&mut got]);
                for (x, y) in got.iter().zip(&expected) {
                    let same = x.to_bits() == y.to_bits() || (x.is_nan() && y.is_nan());
                    prop_assert!(same, "{x} is not {y}");
                }
            }
        }
    }
}

/// Threads that share the code while one of them compiles it.
#[test]
fn clones_run_in_threads() {
    let ops = [
        Op::Load(Slot::Position(CoordinateId(0))),
        Op::Sin(Value(0)),
        Op::Const(3.0),
        Op::Mul(Value(1), Value(2)),
    ];
    let section = Section::mechanism(Phase::Formula);
    let instruction = |op| Instruction { op, section, name: None };
    let function = Function {
        kind: FunctionKind::Equations,
        instructions: ops.into_iter().map(instruction).collect(),
        outputs: vec![Output { name: "x", rows: 1, columns: 1, entries: vec![Value(3)] }],
    };
    let machine = MachineCode::new(&program(function));
    let calls = 2 * i32::try_from(super::WORTH).unwrap();
    std::thread::scope(|scope| {
        for thread in 0..4 {
            let machine = machine.clone();
            scope.spawn(move || {
                for call in 0..calls {
                    let angle = f64::from(calls * thread + call) * 1e-3;
                    let mut out = [f64::NAN];
                    machine.run(FunctionKind::Equations, |_| angle, &mut [&mut out]);
                    assert_eq!(out[0].to_bits(), (3.0 * lamc::arithmetic::sin(angle)).to_bits());
                }
            });
        }
    });
}
