//! Groups of operations that blocks are made of: sections, and phases of one body or loop together where they can be.
//!
//! What one phase computes for a body and only the next phase reads for the same body need not be stored. Two phases become one
//! for all bodies and loops, if no group then waits for itself.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, HashMap};

use crate::program::{Function, Instruction, Op, Phase, Section, Subject, Value};

/// Returns the group of each operation.
pub fn groups(function: &Function) -> Vec<usize> {
    let turned = turned(function);
    let mut merged = Merged::default();
    for (from, to) in passes(function) {
        let before = merged.clone();
        merged.merge(from, to);
        if !is_acyclic(function, &grouped(function, &turned, &merged)) {
            merged = before;
        }
    }
    grouped(function, &turned, &merged)
}

fn is_leaf(function: &Function, value: Value) -> bool {
    matches!(function.instructions[value.index()].op, Op::Const(_) | Op::Load(_))
}

/// The sections that compute an angle whose sine or cosine something reads: as a whole they might wait for themselves.
fn turned(function: &Function) -> BTreeSet<Section> {
    let angle = |instruction: &Instruction| match instruction.op {
        Op::Sin(angle) | Op::Cos(angle) => Some(angle).filter(|angle| !is_leaf(function, *angle)),
        _ => None,
    };
    let angles = function.instructions.iter().filter_map(angle);
    angles.map(|angle| function.instructions[angle.index()].section).collect()
}

/// The phases that hand values to each other for the same body or loop, those with most values first.
fn passes(function: &Function) -> Vec<(Phase, Phase)> {
    let instructions = &function.instructions;
    let mut passed: BTreeMap<(Phase, Phase), usize> = BTreeMap::new();
    for instruction in instructions {
        let to = instruction.section;
        for operand in instruction.op.operands() {
            let from = instructions[operand.index()].section;
            let is_one = from.subject == to.subject && from.subject != Subject::Mechanism;
            if is_one && from.phase != to.phase && !is_leaf(function, operand) {
                *passed.entry((from.phase, to.phase)).or_insert(0) += 1;
            }
        }
    }
    let mut pairs: Vec<_> = passed.into_iter().collect();
    pairs.sort_by_key(|&(pair, count)| (Reverse(count), pair));
    pairs.into_iter().map(|(pair, _)| pair).collect()
}

/// The group of each operation. Sines and cosines, which are computed several at a time, are groups of their own, as is each
/// operation of a section that is `turned`.
fn grouped(function: &Function, turned: &BTreeSet<Section>, merged: &Merged) -> Vec<usize> {
    let mut places: HashMap<Section, usize> = HashMap::new();
    let mut count = 0;
    let group = |instruction: &Instruction| {
        let Instruction { op, section, .. } = instruction;
        let next = count;
        let group = match matches!(op, Op::Sin(_) | Op::Cos(_)) || turned.contains(section) {
            true => next,
            false => *places.entry(merged.section(*section)).or_insert(next),
        };
        count += usize::from(group == next);
        group
    };
    function.instructions.iter().map(group).collect()
}

/// Phases that are one.
#[derive(Clone, Debug, Default)]
struct Merged {
    /// The phase that stands for another one.
    into: HashMap<Phase, Phase>,
}

impl Merged {
    fn phase(&self, phase: Phase) -> Phase {
        self.into.get(&phase).copied().unwrap_or(phase)
    }

    fn merge(&mut self, from: Phase, to: Phase) {
        let (from, to) = (self.phase(from), self.phase(to));
        for phase in Phase::ALL {
            if self.phase(*phase) == to {
                self.into.insert(*phase, from);
            }
        }
    }

    fn section(&self, section: Section) -> Section {
        match section.subject {
            Subject::Mechanism => section,
            _ => Section { phase: self.phase(section.phase), ..section },
        }
    }
}

/// Whether no group reads, directly or not, what waits for it.
fn is_acyclic(function: &Function, groups: &[usize]) -> bool {
    let count = groups.iter().max().map_or(0, |last| last + 1);
    let mut users: Vec<Vec<usize>> = vec![Vec::new(); count];
    let mut missing = vec![0; count];
    for (index, instruction) in function.instructions.iter().enumerate() {
        for operand in instruction.op.operands() {
            let (from, to) = (groups[operand.index()], groups[index]);
            if from != to && !is_leaf(function, operand) {
                users[from].push(to);
                missing[to] += 1;
            }
        }
    }
    let mut ready: Vec<usize> = (0..count).filter(|&group| missing[group] == 0).collect();
    let mut done = 0;
    while let Some(group) = ready.pop() {
        done += 1;
        for &user in &users[group] {
            missing[user] -= 1;
            if missing[user] == 0 {
                ready.push(user);
            }
        }
    }
    done == count
}
