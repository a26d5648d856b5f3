//! The order of the sections: statements of one body or loop and one phase are together under one
//! heading.
//!
//! Of the sections whose operands are known, the one comes next whose first instruction came first:
//! the derivation's own order. If sections depend on each other, the one with the fewest missing
//! operands includes them. The order in time is left to the compiler, which schedules a block of
//! straight-line code anyway.
//!
//! Postcondition: every operand precedes its use; the instructions of a section follow one another.

use crate::program::{Function, Op, Section, Value};
use std::collections::{BTreeMap, BTreeSet};

/// Puts the instructions of each section together.
pub fn sections(mut function: Function) -> Function {
    let homes = homes(&function);
    for (instruction, home) in function.instructions.iter_mut().zip(homes) {
        instruction.section = home;
    }
    let (order, homes) = Ordering::of(&function).order();
    for (instruction, home) in function.instructions.iter_mut().zip(homes) {
        instruction.section = home;
    }
    in_order(function, &order)
}

/// Instructions that are not all placed yet.
struct Ordering<'a> {
    function: &'a Function,
    /// Of each instruction, who uses it.
    users: Vec<Vec<usize>>,
    /// Of each instruction, the number of its section: by first instruction.
    home: Vec<usize>,
    /// By section.
    sections: Vec<Section>,
    /// By section: its instructions.
    members: Vec<Vec<usize>>,
    /// By section: how often its instructions use one of another section that is not placed.
    missing: Vec<usize>,
    /// Sections that miss nothing and are not placed.
    ready: BTreeSet<usize>,
    /// Instructions in their new order.
    order: Vec<usize>,
    placed: Vec<bool>,
}

impl<'a> Ordering<'a> {
    fn of(function: &'a Function) -> Self {
        let count = function.instructions.len();
        let mut numbers: BTreeMap<Section, usize> = BTreeMap::new();
        let (mut sections, mut members) = (Vec::new(), Vec::<Vec<usize>>::new());
        let mut home = Vec::with_capacity(count);
        let mut users = vec![Vec::new(); count];
        for (index, instruction) in function.instructions.iter().enumerate() {
            let number = *numbers.entry(instruction.section).or_insert_with(|| {
                sections.push(instruction.section);
                members.push(Vec::new());
                members.len() - 1
            });
            members[number].push(index);
            home.push(number);
            instruction.op.operands().for_each(|operand| users[operand.index()].push(index));
        }
        let mut missing = vec![0; members.len()];
        for (index, users) in users.iter().enumerate() {
            users.iter().filter(|&&user| home[user] != home[index]).for_each(|&user| {
                missing[home[user]] += 1;
            });
        }
        let ready = (0..members.len()).filter(|&number| missing[number] == 0).collect();
        let (order, placed) = (Vec::with_capacity(count), vec![false; count]);
        Self { function, users, home, sections, members, missing, ready, order, placed }
    }

    /// The instructions in order, and the section of each.
    fn order(mut self) -> (Vec<usize>, Vec<Section>) {
        // A value that is written inline at its use has no position of its own.
        for index in 0..self.placed.len() {
            if matches!(self.function.instructions[index].op, Op::Const(_) | Op::Load(_)) {
                self.place(index);
            }
        }
        let mut open: BTreeSet<usize> = (0..self.members.len()).collect();
        while let Some(next) = self.next(&open) {
            open.remove(&next);
            self.ready.remove(&next);
            for index in self.members[next].clone() {
                if !self.placed[index] {
                    self.place_with_operands(index, next);
                }
            }
        }
        let homes = self.home.iter().map(|&number| self.sections[number]).collect();
        (self.order, homes)
    }

    /// The first section that is ready, or else the one that misses least.
    fn next(&self, open: &BTreeSet<usize>) -> Option<usize> {
        let ready = self.ready.first().copied();
        ready.or_else(|| open.iter().copied().min_by_key(|&number| self.missing[number]))
    }

    /// Places an instruction in a section, after all that it needs.
    fn place_with_operands(&mut self, index: usize, section: usize) {
        let mut waiting = vec![index];
        while let Some(&next) = waiting.last() {
            let operands = self.function.instructions[next].op.operands();
            let unknown: Vec<usize> =
                operands.map(Value::index).filter(|&operand| !self.placed[operand]).collect();
            if unknown.is_empty() {
                waiting.pop();
                if !self.placed[next] {
                    self.place(next);
                    self.home[next] = section;
                }
            } else {
                waiting.extend(unknown);
            }
        }
    }

    fn place(&mut self, index: usize) {
        self.placed[index] = true;
        self.order.push(index);
        let home = self.home[index];
        for &user in &self.users[index] {
            let other = self.home[user];
            if other != home {
                self.missing[other] -= 1;
                if self.missing[other] == 0 {
                    self.ready.insert(other);
                }
            }
        }
    }
}

/// The section in which each instruction is written: an unnamed value that is used once is written
/// where it is used.
fn homes(function: &Function) -> Vec<Section> {
    let mut user: Vec<Option<usize>> = vec![None; function.instructions.len()];
    let mut shared = vec![false; function.instructions.len()];
    for (index, instruction) in function.instructions.iter().enumerate() {
        for operand in instruction.op.operands() {
            shared[operand.index()] |= user[operand.index()].replace(index).is_some();
        }
    }
    for entry in function.outputs.iter().flat_map(|output| &output.entries) {
        shared[entry.index()] = true;
    }
    let mut homes: Vec<Section> = function.instructions.iter().map(|i| i.section).collect();
    for index in (0..homes.len()).rev() {
        let instruction = &function.instructions[index];
        if let (None, false, Some(user)) = (&instruction.name, shared[index], user[index]) {
            homes[index] = homes[user];
        }
    }
    homes
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
        .filter_map(|&index| {
            let mut instruction = slots[index].take()?;
            instruction.op = instruction.op.map(moved);
            Some(instruction)
        })
        .collect();
    let mut outputs = function.outputs;
    for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
        *entry = moved(*entry);
    }
    Function { kind: function.kind, instructions, outputs }
}
