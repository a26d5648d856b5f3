//! Balanced sums and the order of the instructions, against what is possible at all.

use std::collections::BTreeMap;

use super::*;
use crate::topology::NodeId;

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
        ops.push(Op::Load(Slot::Position(JointId(index % LOADS))));
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
    let mut ops: Vec<_> = (0..LOADS).map(|j| Op::Load(Slot::Position(JointId(j)))).collect();
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

/// Bodies of some instructions each, which take their operands from bodies before or from themselves.
fn bodies() -> impl Strategy<Value = Function> {
    let choice = (0..4_u8, any::<prop::sample::Index>(), any::<prop::sample::Index>());
    let body = prop::collection::vec(choice, 1..20);
    prop::collection::vec(body, 2..12).prop_map(|bodies| {
        let mut ops: Vec<(Op, Section)> = Vec::new();
        for (index, body) in bodies.into_iter().enumerate() {
            let section = Section::body(NodeId(index), Phase::Formula);
            ops.push((Op::Load(Slot::Position(JointId(index % LOADS))), section));
            for (kind, x, y) in body {
                // Near operands make chains.
                let near = ops.len().saturating_sub(12);
                let pick = |x: prop::sample::Index| Value(near + x.index(ops.len() - near));
                let (x, y) = (pick(x), pick(y));
                let op = match kind {
                    0 => Op::Sin(x),
                    1 => Op::Add(x, y),
                    2 => Op::Sqrt(x),
                    _ => Op::Mul(x, y),
                };
                ops.push((op, section));
            }
        }
        let entries = (0..ops.len()).rev().step_by(5).map(Value).collect();
        function(ops, entries)
    })
}

/// The runs of a function by their bodies, in order, with their mean start on a machine without limits.
fn runs(function: &Function) -> Vec<(Section, u64)> {
    let mut starts: Vec<u32> = Vec::new();
    let mut times: BTreeMap<Section, Vec<u64>> = BTreeMap::new();
    let mut order = Vec::new();
    for instruction in &function.instructions {
        let operands = instruction.op.operands();
        let ready =
            operands.map(|x| starts[x.index()] + function.instructions[x.index()].op.latency());
        starts.push(ready.max().unwrap_or(0));
        if order.last() != Some(&instruction.section) {
            order.push(instruction.section);
        }
        let times = times.entry(instruction.section).or_default();
        if !matches!(instruction.op, Op::Const(_) | Op::Load(_)) {
            times.push(u64::from(*starts.last().unwrap()));
        }
    }
    let mean = |section: &Section| {
        let times = &times[section];
        times.iter().sum::<u64>() / times.len().max(1) as u64
    };
    order.iter().map(|section| (*section, mean(section))).collect()
}

/// Whether a body takes an operand from another.
fn takes(function: &Function, body: Section, from: Section) -> bool {
    let section = |value: Value| function.instructions[value.index()].section;
    let own = function.instructions.iter().filter(|instruction| instruction.section == body);
    own.flat_map(|instruction| instruction.op.operands()).any(|x| section(x) == from)
}

proptest! {
    /// Bodies stay whole; operands precede; and a body comes before one of an earlier time only where the
    /// latter takes an operand from it.
    #[test]
    fn bodies_are_in_the_order_of_their_times(function in bodies()) {
        let before = runs(&function);
        let scheduled = schedule::schedule(function);
        for (index, instruction) in scheduled.instructions.iter().enumerate() {
            prop_assert!(instruction.op.operands().all(|operand| operand.index() < index));
        }
        let after = runs(&scheduled);
        let mut sorted = [before.clone(), after.clone()];
        sorted.iter_mut().for_each(|runs| runs.sort());
        prop_assert_eq!(&sorted[0], &sorted[1], "a body was torn apart, or lost");
        for pair in after.windows(2) {
            let [(first, early), (second, late)] = pair else { unreachable!() };
            prop_assert!(
                early <= late || takes(&scheduled, *second, *first),
                "{first:?} at {early} before {second:?} at {late}"
            );
        }
    }
}

/// Two bodies that do not wait for each other, written one after the other, end up in the order of their
/// times although the later one was written first.
#[test]
fn what_is_ready_comes_first() {
    let [slow, quick] = [0, 1].map(|body| Section::body(NodeId(body), Phase::Formula));
    let load = Op::Load(Slot::Position(JointId(0)));
    let ops = [
        (load, formula()),
        (Op::Sin(Value(0)), formula()),
        (Op::Sin(Value(1)), slow),
        (Op::Neg(Value(0)), quick),
    ];
    let scheduled = schedule::schedule(function(ops, vec![Value(2), Value(3)]));
    let order: Vec<_> = scheduled.instructions.iter().map(|i| i.section).collect();
    assert_eq!(order, [formula(), formula(), quick, slow]);
}
