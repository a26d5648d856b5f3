//! Numbers that follow from the parameters alone move out of the functions: one function computes them all when
//! the parameters change, and an evaluation costs what it costs with numbers in their place.
//!
//! Postconditions: after [`Drawing::hoist`] no instruction but a load has only operands that follow from parameters; after
//! [`Drawing::sign`] no number of the table is subtracted or negated, nor a product with one that is used once.

use std::collections::HashMap;

use super::dead;
use super::fold::MINUS;
use super::like_terms::uses;
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

    /// Adds the opposites of numbers where they, or their products, are subtracted: opposites have places of their own.
    ///
    /// Compilers make vectors of similar terms. The signs of constants cost nothing there, those of numbers from memory
    /// cost instructions (docs/decisions/0066-numbers-of-the-drawing.md).
    pub fn sign(&mut self, function: Function) -> Function {
        if self.table.is_empty() {
            return function;
        }
        let count = function.instructions.len();
        let uses = uses(&function);
        let mut signing = Signing {
            drawing: self,
            old: &function.instructions,
            uses,
            instructions: Vec::with_capacity(count),
            map: Vec::with_capacity(count),
        };
        for instruction in &function.instructions {
            let value = signing.signed(instruction);
            signing.map.push(value);
        }
        let Signing { instructions, map, .. } = signing;
        dead::dead(Function::renumbered(function.kind, instructions, function.outputs, &map))
    }

    /// Returns the place of the opposite of the number at a place.
    fn opposite(&mut self, place: usize) -> usize {
        let number = self.table[place];
        let opposite = match self.instructions[number.index()].op {
            Op::Neg(inner) => inner,
            _ => {
                let section = Section::mechanism(Phase::Drawing);
                let op = Op::Neg(number);
                self.add(&Instruction { op, section, name: None }, op)
            }
        };
        self.place(opposite)
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
    /// an acceleration reads them, opposites last, then others.
    pub fn finish(self, functions: &mut [Function]) -> Function {
        let mut renumbered: HashMap<usize, usize> = HashMap::new();
        let mut entries = Vec::new();
        let mut order: Vec<&mut Function> = functions.iter_mut().collect();
        order.sort_by_key(|function| function.kind != FunctionKind::Acceleration);
        for function in &order {
            let loads =
                function.instructions.iter().filter_map(|instruction| match instruction.op {
                    Op::Load(Slot::Drawn(place)) => Some(place),
                    _ => None,
                });
            let (opposites, others): (Vec<usize>, Vec<usize>) = loads.partition(|&place| {
                matches!(self.instructions[self.table[place].index()].op, Op::Neg(_))
            });
            for place in others.into_iter().chain(opposites) {
                renumbered.entry(place).or_insert_with(|| {
                    entries.push(self.table[place]);
                    entries.len() - 1
                });
            }
        }
        for instruction in order.into_iter().flat_map(|function| &mut function.instructions) {
            if let Op::Load(Slot::Drawn(place)) = &mut instruction.op {
                *place = renumbered[place];
            }
        }
        let kind = FunctionKind::Drawing;
        if entries.is_empty() {
            return Function::none(kind);
        }
        let outputs = vec![Output { name: "numbers", rows: entries.len(), columns: 1, entries }];
        dead::dead(Function { kind, instructions: self.instructions, outputs })
    }
}

/// A function whose numbers of the table get signs.
struct Signing<'a> {
    drawing: &'a mut Drawing,
    old: &'a [Instruction],
    /// How often each old value is used.
    uses: Vec<usize>,
    instructions: Vec<Instruction>,
    /// The new value of each old one.
    map: Vec<Value>,
}

impl Signing<'_> {
    /// Appends what an old instruction becomes.
    fn signed(&mut self, instruction: &Instruction) -> Value {
        let Instruction { op, section, name } = instruction.clone();
        let opposite = match op {
            Op::Sub(_, term) | Op::Neg(term) => self.opposite(term),
            _ => None,
        };
        let map = |value: Value| self.map[value.index()];
        let op = match (op, opposite) {
            (Op::Sub(x, _), Some(opposite)) => Op::Add(map(x), opposite),
            (Op::Neg(_), Some(opposite)) => return opposite,
            _ => op.map(map),
        };
        self.push(Instruction { op, section, name })
    }

    /// Appends the opposite of an old value, if it is a number of the table or a product of one.
    fn opposite(&mut self, term: Value) -> Option<Value> {
        let Instruction { op, section, name } = self.old[term.index()].clone();
        let drawn = |value: Value| match self.old[value.index()].op {
            Op::Load(Slot::Drawn(place)) => Some(place),
            _ => None,
        };
        let (place, factor) = match op {
            Op::Load(Slot::Drawn(place)) => (place, None),
            Op::Mul(x, y) if self.uses[term.index()] == 1 => match (drawn(x), drawn(y)) {
                (Some(place), _) => (place, Some(y)),
                (None, Some(place)) => (place, Some(x)),
                (None, None) => return None,
            },
            _ => return None,
        };
        let op = Op::Load(Slot::Drawn(self.drawing.opposite(place)));
        let number = self.push(Instruction { op, section, name: None });
        let Some(factor) = factor else { return Some(number) };
        let op = Op::Mul(number, self.map[factor.index()]);
        let name = name.map(|name| match name.strip_prefix(MINUS) {
            Some(opposite) => opposite.to_owned(),
            None => format!("{MINUS}{name}"),
        });
        Some(self.push(Instruction { op, section, name }))
    }

    fn push(&mut self, instruction: Instruction) -> Value {
        self.instructions.push(instruction);
        Value(self.instructions.len() - 1)
    }
}
