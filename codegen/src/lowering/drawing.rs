//! Numbers that follow from the parameters alone move out of the functions: one function computes them all when
//! the parameters change, and an evaluation costs what it costs with numbers in their place.
//!
//! Postcondition of [`Drawing::hoist`]: no instruction but a load has only operands that follow from parameters.

use std::collections::HashMap;

use super::dead;
use super::number::{Key, canonical, key};
use crate::program::{
    Argument, Function, FunctionKind, Instruction, Op, Output, Phase, Section, Slot, Value,
};

/// The numbers that follow from the parameters alone, of all functions together.
#[derive(Default)]
pub struct Drawing {
    instructions: Vec<Instruction>,
    known: HashMap<Key, Value>,
    /// The numbers that functions read, by place.
    table: Vec<Value>,
    places: HashMap<Value, usize>,
}

impl Drawing {
    /// Returns how many numbers functions read.
    pub fn len(&self) -> usize {
        self.table.len()
    }

    /// Replaces what follows from parameters alone by loads.
    pub fn hoist(&mut self, mut function: Function) -> Function {
        let reads = function.kind.signature().inputs;
        let numbers: Vec<Option<Value>> = self.numbers(&function);
        let is_plain = |op: Op| match op {
            Op::Const(_) | Op::Load(Slot::Drawn(_)) => true,
            Op::Load(_) => reads.contains(&Argument::Parameters),
            _ => false,
        };
        for (index, instruction) in function.instructions.iter_mut().enumerate() {
            let Some(number) = numbers[index].filter(|_| !is_plain(instruction.op)) else {
                continue;
            };
            // What other instructions of the table need alone is dropped with the dead code.
            instruction.op = Op::Load(Slot::Drawn(self.place(number)));
            instruction.name = None;
        }
        dead::dead(function)
    }

    /// Returns, for each instruction that follows from parameters alone, what it is in the table.
    fn numbers(&mut self, function: &Function) -> Vec<Option<Value>> {
        let mut numbers: Vec<Option<Value>> = Vec::with_capacity(function.instructions.len());
        for instruction in &function.instructions {
            let number = match instruction.op {
                Op::Load(Slot::Drawn(place)) => Some(self.table[place]),
                Op::Load(Slot::Parameter(_)) | Op::Const(_) => {
                    Some(self.add(instruction, instruction.op))
                }
                Op::Load(_) => None,
                op => {
                    let follows = op.operands().all(|operand| numbers[operand.index()].is_some());
                    let of = |operand: Value| numbers[operand.index()].unwrap_or(operand);
                    follows.then(|| self.add(instruction, op.map(of)))
                }
            };
            numbers.push(number);
        }
        numbers
    }

    fn add(&mut self, instruction: &Instruction, op: Op) -> Value {
        let op = canonical(op);
        let Self { instructions, known, .. } = self;
        *known.entry(key(op)).or_insert_with(|| {
            let section = Section::mechanism(Phase::Drawing);
            instructions.push(Instruction { op, section, name: instruction.name.clone() });
            Value(instructions.len() - 1)
        })
    }

    fn place(&mut self, number: Value) -> usize {
        *self.places.entry(number).or_insert_with(|| {
            self.table.push(number);
            self.table.len() - 1
        })
    }

    /// Returns the function that computes the numbers that `functions` read, and renumbers these: in the order in which
    /// an acceleration reads them, then others.
    pub fn finish(self, functions: &mut [Function]) -> Function {
        let mut renumbered: HashMap<usize, usize> = HashMap::new();
        let mut entries = Vec::new();
        let mut order: Vec<&mut Function> = functions.iter_mut().collect();
        order.sort_by_key(|function| function.kind != FunctionKind::Acceleration);
        for instruction in order.into_iter().flat_map(|function| &mut function.instructions) {
            let Op::Load(Slot::Drawn(place)) = &mut instruction.op else { continue };
            *place = *renumbered.entry(*place).or_insert_with(|| {
                entries.push(self.table[*place]);
                entries.len() - 1
            });
        }
        let kind = FunctionKind::Drawing;
        if entries.is_empty() {
            return Function { kind, instructions: Vec::new(), outputs: Vec::new() };
        }
        let outputs = vec![Output { name: "numbers", rows: entries.len(), columns: 1, entries }];
        dead::dead(Function { kind, instructions: self.instructions, outputs })
    }
}
