//! Numbers that differ by rounding only become one.
//!
//! Products of the geometry are formed in different orders, so that one number comes with several
//! last digits. Of such numbers the one with the fewest digits is kept in all functions.
//!
//! Postcondition: no two numbers of the functions are within a few units in the last place of each
//! other, but for their sign. Results may differ in rounding.

use crate::program::{Function, Op};
use std::collections::{BTreeSet, HashMap};

use crate::arithmetic::is_same;

/// Makes numbers that differ by rounding only one.
pub fn snap(functions: &mut [Function]) {
    let kept = kept(functions);
    for instruction in functions.iter_mut().flat_map(|function| &mut function.instructions) {
        if let Op::Const(number) = &mut instruction.op
            && let Some(magnitude) = kept.get(&number.abs().to_bits())
        {
            *number = magnitude.copysign(*number);
        }
    }
}

/// Entry for each magnitude.
fn kept(functions: &[Function]) -> HashMap<u64, f64> {
    let instructions = functions.iter().flat_map(|function| &function.instructions);
    let numbers = instructions.filter_map(|instruction| match instruction.op {
        Op::Const(number) if number.is_finite() => Some(number.abs().to_bits()),
        _ => None,
    });
    // Of numbers that are not negative the bits are in the same order.
    let sorted: Vec<f64> =
        numbers.collect::<BTreeSet<_>>().into_iter().map(f64::from_bits).collect();
    let mut kept = HashMap::new();
    for group in sorted.chunk_by(|&x, &y| is_same(x, y)) {
        let digits = |number: &&f64| format!("{number:e}").len();
        if let Some(&shortest) = group.iter().min_by_key(digits) {
            kept.extend(group.iter().map(|number| (number.to_bits(), shortest)));
        }
    }
    kept
}
