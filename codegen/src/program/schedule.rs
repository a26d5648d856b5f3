//! The order of the bodies: what does not depend on each other is put side by side.
//!
//! A processor looks a few hundred instructions ahead. Velocities run from the ground outwards and
//! inertia from the tips inwards; one after the other each would wait for itself. Runs of
//! instructions that belong to one body stay together and are put in the order in which a machine
//! without limits would come to them.
//!
//! Postcondition: every operand precedes its use; runs are in ascending order of their mean time
//! as far as their operands allow.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};

use super::ir::{Function, Op, Value};

/// Longest run.
const LONGEST_RUN: usize = 96;

/// Schedules a function.
pub fn schedule(function: Function) -> Function {
    let instructions = &function.instructions;
    // What is written where it is used takes no place.
    let free = |index: usize| matches!(instructions[index].op, Op::Const(_) | Op::Load(_));
    let mut start: Vec<u32> = Vec::with_capacity(instructions.len());
    let mut runs: Vec<Vec<usize>> = Vec::new();
    let mut run_of = Vec::with_capacity(instructions.len());
    let mut before: Vec<BTreeSet<usize>> = Vec::new();
    let mut subject = None;
    for (index, instruction) in instructions.iter().enumerate() {
        let operands = instruction.op.operands();
        let time = operands.map(|x| start[x.index()] + instructions[x.index()].op.latency()).max();
        start.push(time.unwrap_or(0));
        let full = runs.last().is_none_or(|run| run.len() >= LONGEST_RUN);
        if full || subject != Some(instruction.section.subject) {
            subject = Some(instruction.section.subject);
            runs.push(Vec::new());
            before.push(BTreeSet::new());
        }
        let run = runs.len() - 1;
        run_of.push(run);
        runs[run].push(index);
        let others = instruction.op.operands().map(|x| run_of[x.index()]);
        before[run].extend(others.filter(|&other| other != run));
    }
    let mean = |run: &[usize]| {
        let counted: Vec<usize> = run.iter().copied().filter(|&index| !free(index)).collect();
        let sum: u64 = counted.iter().map(|&index| u64::from(start[index])).sum();
        sum / counted.len().max(1) as u64
    };
    let times: Vec<u64> = runs.iter().map(|run| mean(run)).collect();
    let mut after: Vec<Vec<usize>> = vec![Vec::new(); runs.len()];
    for (run, before) in before.iter().enumerate() {
        before.iter().for_each(|&other| after[other].push(run));
    }
    let mut missing: Vec<usize> = before.iter().map(BTreeSet::len).collect();
    let ready = (0..runs.len()).filter(|&run| missing[run] == 0);
    let mut heap: BinaryHeap<_> = ready.map(|run| Reverse((times[run], run))).collect();
    let mut order = Vec::with_capacity(instructions.len());
    while let Some(Reverse((_, run))) = heap.pop() {
        order.extend_from_slice(&runs[run]);
        for &next in &after[run] {
            missing[next] -= 1;
            if missing[next] == 0 {
                heap.push(Reverse((times[next], next)));
            }
        }
    }
    in_order(function, &order)
}

/// The same instructions in another order.
fn in_order(function: Function, order: &[usize]) -> Function {
    let mut map = vec![Value(usize::MAX); order.len()];
    for (place, &index) in order.iter().enumerate() {
        map[index] = Value(place);
    }
    let moved = |value: Value| map[value.index()];
    let mut slots: Vec<_> = function.instructions.into_iter().map(Some).collect();
    let instructions = order
        .iter()
        .filter_map(|&index| slots[index].take())
        .map(|mut instruction| {
            instruction.op = instruction.op.map(moved);
            instruction
        })
        .collect();
    let mut outputs = function.outputs;
    for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
        *entry = moved(*entry);
    }
    Function { kind: function.kind, instructions, outputs }
}
