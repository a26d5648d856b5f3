//! Balanced sums, against what is possible at all.

use super::*;

/// Cycles of an addition.
const ADDITION: u32 = 3;

/// The earliest cycle in which a sum can be known, of terms that arrive at these cycles. A term that is
/// added in `d` additions one after the other is part of at least 2^-d of a binary tree, so that depths can
/// be had if 2^-d adds up to 1 at most (Kraft's inequality).
fn earliest(arrivals: &[u32]) -> u32 {
    let last = arrivals.iter().copied().max().unwrap();
    let possible = |end: u32| {
        let share = |at: &u32| 0.5_f64.powi(((end - at) / ADDITION) as i32);
        arrivals.iter().map(share).sum::<f64>() <= 1.0
    };
    (last..).find(|&end| possible(end)).unwrap()
}

/// A sum, one term after the other, of terms that are each a chain of so many negations (and a product, so
/// that folding could not remove them), some subtracted. Returns the arrival of each term, too.
fn sum(chains: &[(u8, bool)]) -> (Function, Vec<u32>) {
    let mut ops = Vec::new();
    let (mut terms, mut arrivals) = (Vec::new(), Vec::new());
    for (index, &(length, minus)) in chains.iter().enumerate() {
        ops.push(Op::Load(Slot::Position(CoordinateId(index % LOADS))));
        for _ in 0..length {
            ops.push(Op::Neg(Value(ops.len() - 1)));
        }
        terms.push((Value(ops.len() - 1), minus));
        arrivals.push(u32::from(length));
    }
    let mut total = terms[0].0;
    for &(term, minus) in &terms[1..] {
        ops.push(if minus { Op::Sub(total, term) } else { Op::Add(total, term) });
        total = Value(ops.len() - 1);
    }
    (function(ops.into_iter().map(|op| (op, formula())), vec![total]), arrivals)
}

proptest! {
    /// Where waiting takes longer than issuing, a sum is known as early as its terms allow.
    #[test]
    fn balanced_sums_take_no_longer_than_their_terms_demand(
        chains in prop::collection::vec((0..30_u8, any::<bool>()), 2..24),
        q in prop::array::uniform4(-1.0..1.0_f64),
    ) {
        let (sequential, arrivals) = sum(&chains);
        let balanced = balance::balance(sequential.clone());
        compared(&balanced, &sequential, &q)?;
        if sequential.critical_path() * 4 < sequential.cost().total() as u32 {
            prop_assert_eq!(balanced, sequential);
        } else {
            prop_assert_eq!(balanced.critical_path(), earliest(&arrivals));
            prop_assert_eq!(balanced.cost().total(), sequential.cost().total());
        }
    }
}

/// Eight terms at once: three additions instead of seven.
#[test]
fn a_sum_of_eight_terms_becomes_a_tree() {
    let (sequential, _) = sum(&[(0, false); 8]);
    assert_eq!(sequential.critical_path(), 7 * ADDITION);
    assert_eq!(balance::balance(sequential).critical_path(), 3 * ADDITION);
}

/// Where issuing takes longer, nothing changes: many sums side by side.
#[test]
fn sums_that_need_not_wait_stay_as_they_are() {
    let mut ops: Vec<_> = (0..LOADS).map(|j| Op::Load(Slot::Position(CoordinateId(j)))).collect();
    let mut entries = Vec::new();
    for k in 0..40 {
        ops.push(Op::Add(Value(k % LOADS), Value((k + 1) % LOADS)));
        for j in 2..4 {
            ops.push(Op::Add(Value(ops.len() - 1), Value((k + j) % LOADS)));
        }
        entries.push(Value(ops.len() - 1));
    }
    let wide = function(ops.into_iter().map(|op| (op, formula())), entries);
    assert_eq!(balance::balance(wide.clone()), wide);
}
