//! The postconditions of passes.

use super::*;
use crate::arithmetic::is_same;
use crate::pipeline;
use crate::program::{FunctionKind, Program, Slot, verify};
use crate::source::SourceFile;

/// The first instruction that folding should have simplified, with the reason.
fn unfolded(function: &Function) -> Option<String> {
    let op = |value: Value| function.instructions[value.index()].op;
    let constant = |value: Value| match op(value) {
        Op::Const(number) => Some(number),
        _ => None,
    };
    let is_negated = |value: Value| matches!(op(value), Op::Neg(_));
    let is = |value: Value, numbers: &[f64]| constant(value).is_some_and(|x| numbers.contains(&x));
    let reason = |one: Op| {
        let mut operands = one.operands().peekable();
        if operands.peek().is_some() && operands.all(|operand| constant(operand).is_some()) {
            return Some("its operands are all constant");
        }
        match one {
            Op::Add(x, y) if is(x, &[0.0]) || is(y, &[0.0]) => Some("adds 0"),
            Op::Add(x, y) if is_negated(x) || is_negated(y) => Some("adds a negation"),
            Op::Sub(x, y) if x == y => Some("subtracts a value from itself"),
            Op::Sub(_, y) if is(y, &[0.0]) => Some("subtracts 0"),
            Op::Sub(_, y) if is_negated(y) => Some("subtracts a negation"),
            Op::Mul(x, y) if [x, y].iter().any(|&factor| is(factor, &[0.0, 1.0, -1.0])) => {
                Some("multiplies by 0, 1 or -1")
            }
            Op::Mul(x, y) => [(x, y), (y, x)].into_iter().find_map(|(factor, rest)| {
                let outer = constant(factor)?;
                let Op::Mul(a, b) = op(rest) else { return None };
                let inner = constant(a).or(constant(b))?;
                (outer * inner).is_finite().then_some("multiplies by two constants")
            }),
            Op::Neg(x) if is_negated(x) => Some("negates a negation"),
            _ => None,
        }
    };
    let mut found = function.instructions.iter().enumerate();
    found.find_map(|(index, one)| reason(one.op).map(|why| format!("v{index}: {:?} {why}", one.op)))
}

/// Two instructions of the same operation on the same operands, in either order where it commutes.
fn repeated(function: &Function) -> Option<[usize; 2]> {
    let swapped = |op: Op| match op {
        Op::Add(x, y) => Op::Add(y, x),
        Op::Mul(x, y) => Op::Mul(y, x),
        other => other,
    };
    let mut known = std::collections::HashMap::new();
    function.instructions.iter().enumerate().find_map(|(index, one)| {
        let first = [one.op, swapped(one.op)].map(|op| known.get(&format!("{op:?}")).copied());
        known.insert(format!("{:?}", one.op), index);
        first.into_iter().flatten().next().map(|first| [first, index])
    })
}

/// An instruction that no output needs.
fn unneeded(function: &Function) -> Option<usize> {
    let mut needed = vec![false; function.instructions.len()];
    let mut open: Vec<Value> =
        function.outputs.iter().flat_map(|output| output.entries.iter().copied()).collect();
    while let Some(value) = open.pop() {
        if !std::mem::replace(&mut needed[value.index()], true) {
            open.extend(function.instructions[value.index()].op.operands());
        }
    }
    needed.iter().position(|needed| !needed)
}

proptest! {
    #[test]
    fn of_random_functions(function in functions()) {
        let folded = fold::fold(function);
        prop_assert_eq!(unfolded(&folded), None);
        let numbered = number::number(folded);
        prop_assert_eq!(repeated(&numbered), None);
        let live = dead::dead(numbered);
        prop_assert_eq!((unneeded(&live), repeated(&live)), (None, None));
    }
}

fn compiled(example: &str) -> Program {
    let path = format!("{}/../examples/{example}.yaml", env!("CARGO_MANIFEST_DIR"));
    let file = SourceFile::read(&path).unwrap();
    pipeline::compile(&file).unwrap_or_else(|error| panic!("{error}")).program
}

/// Tests of the invariants of all functions that a backend receives. A broken function is rejected,
/// which shows that debug builds and tests verify functions between the passes.
#[test]
fn of_the_functions_of_a_compiled_mechanism() {
    let program = compiled("sixbar");
    assert_eq!(verify(&program), Ok(()));
    let instructions: usize = program.functions.iter().map(|f| f.instructions.len()).sum();
    assert!(instructions > 1000, "{instructions} instructions");
    for function in &program.functions {
        assert_eq!(repeated(function), None, "{:?}", function.kind);
        assert_eq!(unneeded(function), None, "{:?}", function.kind);
        assert_eq!(unfolded(function), None, "{:?}", function.kind);
    }
}

/// The instructions that subtract or negate a number of the drawing.
fn subtracted_numbers(function: &Function) -> usize {
    let is_drawn =
        |value: Value| matches!(function.instructions[value.index()].op, Op::Load(Slot::Drawn(_)));
    let is_fault = |op: Op| matches!(op, Op::Sub(_, x) | Op::Neg(x) if is_drawn(x));
    function.instructions.iter().filter(|instruction| is_fault(instruction.op)).count()
}

#[test]
fn numbers_of_the_drawing_are_added_and_opposites_come_last() {
    let program = compiled("optimise/sixbar_plates");
    for function in &program.functions {
        assert_eq!(subtracted_numbers(function), 0, "{:?}", function.kind);
    }
    let drawing = &program.functions[FunctionKind::Drawing as usize];
    let is_opposite = |place: usize| {
        let entry = drawing.outputs[0].entries[place];
        matches!(drawing.instructions[entry.index()].op, Op::Neg(_))
    };
    let mut places = Vec::new();
    for instruction in &program.functions[FunctionKind::Acceleration as usize].instructions {
        places.extend(match instruction.op {
            Op::Load(Slot::Drawn(place)) => Some(place),
            _ => None,
        });
    }
    places.sort_unstable();
    places.dedup();
    assert!(places.iter().any(|&place| is_opposite(place)));
    assert!(places.is_sorted_by_key(|&place| is_opposite(place)));
    assert_eq!(places, Vec::from_iter(0..places.len()), "an acceleration reads the first numbers");
}

#[test]
#[should_panic(expected = "Order")]
fn a_function_that_a_pass_broke_is_refused() {
    let interface = compiled("pendulum").interface;
    let broken = function([(Op::Neg(Value(0)), formula())], vec![Value(0)]);
    super::super::check(&interface, broken);
}

/// A product of constants that overflows stays two products.
#[test]
fn constants_are_not_multiplied_beyond_what_a_number_holds() {
    let load = (Op::Load(Slot::Position(CoordinateId(0))), formula());
    let large = (Op::Const(1e200), formula());
    let ops = [
        load,
        large,
        (Op::Mul(Value(1), Value(0)), formula()),
        (Op::Mul(Value(1), Value(2)), formula()),
    ];
    let folded = fold::fold(function(ops, vec![Value(3)]));
    assert_eq!(run(&folded, &[1e-150]), [1e200 * (1e200 * 1e-150)]);
    assert_eq!(unfolded(&folded), None);
}

#[test]
fn the_text_form_says_body_phase_and_equation() {
    let text = compiled("pendulum").to_string();
    let headings: Vec<&str> = text.lines().filter(|line| line.starts_with("  ; ")).collect();
    let heading = "  ; arm: kinetic energy: m v . v / 2 + v . (w x h) + w . I w / 2";
    assert!(headings.contains(&heading), "{headings:#?}");
}

/// Numbers of all functions that differ by rounding only are one.
#[test]
fn numbers_do_not_differ_by_rounding() {
    let program = compiled("sixbar");
    let instructions = program.functions.iter().flat_map(|function| &function.instructions);
    let numbers = instructions.filter_map(|instruction| match instruction.op {
        Op::Const(number) => Some(number.abs().to_bits()),
        _ => None,
    });
    let numbers: std::collections::BTreeSet<u64> = numbers.collect();
    let numbers: Vec<f64> = numbers.into_iter().map(f64::from_bits).collect();
    assert!(numbers.len() > 100, "{}", numbers.len());
    for pair in numbers.windows(2) {
        assert!(!is_same(pair[0], pair[1]), "{pair:?}");
    }
}
