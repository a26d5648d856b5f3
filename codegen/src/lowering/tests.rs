//! Every pass: it keeps the values, and what it promises holds afterwards. On random functions, and on the
//! functions of a compiled mechanism.

mod like_terms;
mod postconditions;
mod sections;
mod times;

use proptest::prelude::*;

use super::{balance, dead, fold, number};
use crate::program::tests::random::{LOADS, formula, function, functions};
use crate::program::{Function, Op, Phase, Section, Slot, Value};
use crate::source::CoordinateId;

/// Runs a function on some coordinates.
fn run(function: &Function, q: &[f64]) -> Vec<f64> {
    let values = values(function, q);
    function.outputs[0].entries.iter().map(|entry| values[entry.index()]).collect()
}

/// The value of each instruction.
fn values(function: &Function, q: &[f64]) -> Vec<f64> {
    let mut values: Vec<f64> = Vec::new();
    for instruction in &function.instructions {
        let value = match instruction.op {
            Op::Load(Slot::Position(id)) => q[id.index()],
            op => op.evaluate(|operand| values[operand.index()]),
        };
        values.push(value);
    }
    values
}

/// How far rounding may have moved each entry: the first-order bound of every operation, with its operands moved
/// by their bounds. None after a division by what may be zero.
fn rounding(function: &Function, q: &[f64]) -> Vec<Option<f64>> {
    const EACH: f64 = 1e-15;
    let values = values(function, q);
    let mut bounds: Vec<Option<f64>> = Vec::new();
    for (instruction, value) in function.instructions.iter().zip(&values) {
        let (v, e) = (|x: Value| values[x.index()].abs(), |x: Value| bounds[x.index()]);
        let carried = || match instruction.op {
            Op::Const(_) | Op::Load(_) => Some(0.0),
            Op::Neg(x) | Op::Sin(x) | Op::Cos(x) => e(x),
            Op::Add(x, y) | Op::Sub(x, y) => Some(e(x)? + e(y)? + EACH * (v(x) + v(y))),
            Op::Mul(x, y) => Some(v(x) * e(y)? + (v(y) + e(y)?) * e(x)?),
            Op::Div(x, y) if v(y) > 2.0 * e(y)? => Some((e(x)? + e(y)? * v(x) / v(y)) * 2.0 / v(y)),
            _ => None,
        };
        let bound = carried().map(|carried| carried + EACH * value.abs());
        bounds.push(bound.filter(|bound| bound.is_finite()));
    }
    function.outputs[0].entries.iter().map(|entry| bounds[entry.index()]).collect()
}

/// How many entries of two functions could be compared; an error where they differ.
fn compared(left: &Function, right: &Function, q: &[f64]) -> Result<usize, TestCaseError> {
    let bounds = rounding(right, q);
    let (left, right) = (run(left, q), run(right, q));
    prop_assert_eq!(left.len(), right.len());
    let mut count = 0;
    for ((x, y), bound) in left.into_iter().zip(right).zip(bounds) {
        let scale = 1.0 + y.abs();
        // What a pass may round otherwise, as the quotient of two differences that cancel, has no digits to compare.
        if bound.is_some_and(|bound| bound <= 1e-9 * scale) {
            prop_assert!((x - y).abs() <= 1e-6 * scale, "{x} is not {y}");
            count += 1;
        }
    }
    Ok(count)
}

#[test]
fn passes_keep_the_values() {
    let total = std::cell::Cell::new(0);
    proptest!(|(function in functions(), q in prop::array::uniform4(-1.0..1.0_f64))| {
        let folded = fold::fold(function.clone());
        total.set(total.get() + compared(&folded, &function, &q)?);
        let numbered = number::number(folded.clone());
        compared(&numbered, &folded, &q)?;
        let live = dead::dead(numbered.clone());
        let same = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| a.to_bits() == b.to_bits());
        prop_assert!(same(&run(&live, &q), &run(&numbered, &q)));
        let merged = super::like_terms::merge(live.clone());
        compared(&merged, &live, &q)?;
        let balanced = balance::balance(merged.clone());
        compared(&balanced, &merged, &q)?;
        let ordered = super::sections::sections(balanced.clone());
        prop_assert!(same(&run(&ordered, &q), &run(&balanced, &q)));
    });
    assert!(total.get() > 1000, "only {} values were compared", total.get());
}
