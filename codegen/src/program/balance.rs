//! Balancing: sums and products of many terms join those first that are known first, so that what
//! takes long is waited for once.
//!
//! Always joining the two earliest is best (D. A. Huffman, 1952, for sums of maxima: M. C. Golumbic,
//! "Combinatorial merging", 1976).
//!
//! Postcondition: no value is known later than before, by the latencies here; as many operations.
//! Sums and products are re-associated, so results may differ in rounding.

use super::ir::{Function, Instruction, Op, Value};

/// Cycles until the result of an operation is known, about those of current processors.
fn latency(op: Op) -> u32 {
    match op {
        Op::Const(_) | Op::Load(_) => 0,
        Op::Neg(_) | Op::Abs(_) => 1,
        Op::Add(..) | Op::Sub(..) | Op::Mul(..) => 4,
        Op::Min(..) | Op::Max(..) | Op::Step(_) => 4,
        Op::Div(..) | Op::Sqrt(_) => 13,
        Op::Sin(_) | Op::Cos(_) | Op::Tan(_) | Op::Exp(_) | Op::Tanh(_) | Op::Ln(_) => 60,
        Op::Pow(..) => 60,
    }
}

/// Balances a function.
pub fn balance(function: Function) -> Function {
    let mut balancing = Balancing {
        sole_users: sole_users(&function),
        known: Vec::with_capacity(function.instructions.len()),
        instructions: Vec::with_capacity(function.instructions.len()),
        map: Vec::with_capacity(function.instructions.len()),
        old: &function.instructions,
    };
    for index in 0..function.instructions.len() {
        let value = balancing.rewrite(index);
        balancing.map.push(value);
    }
    let Balancing { instructions, map, .. } = balancing;
    let mut outputs = function.outputs;
    for entry in outputs.iter_mut().flat_map(|output| &mut output.entries) {
        *entry = map[entry.index()];
    }
    Function { kind: function.kind, instructions, outputs }
}

/// A term of a sum, or a factor of a product.
#[derive(Clone, Copy)]
struct Term {
    known: u32,
    negative: bool,
    value: Value,
}

struct Balancing<'a> {
    old: &'a [Instruction],
    /// The one instruction that uses a value, once.
    sole_users: Vec<Option<usize>>,
    instructions: Vec<Instruction>,
    /// When a value is known, cycles.
    known: Vec<u32>,
    /// The new value of an old one; of what is part of a larger sum or product, none of its own.
    map: Vec<Value>,
}

impl Balancing<'_> {
    fn rewrite(&mut self, index: usize) -> Value {
        let old = self.old;
        let instruction = &old[index];
        let value = match instruction.op {
            _ if self.is_part(Value(index)) => return Value(usize::MAX),
            Op::Add(..) | Op::Sub(..) | Op::Mul(..) => {
                let mut terms = Vec::new();
                self.collect(Value(index), false, &mut terms);
                self.join(terms, instruction)
            }
            op => self.push(op.map(|operand| self.map[operand.index()]), instruction),
        };
        self.instructions[value.index()].name.clone_from(&instruction.name);
        value
    }

    /// Whether a sum is only a term of another, or a product only a factor of another.
    fn is_part(&self, value: Value) -> bool {
        let is_sum = |index: usize| matches!(self.old[index].op, Op::Add(..) | Op::Sub(..));
        let is_product = |index: usize| matches!(self.old[index].op, Op::Mul(..));
        self.sole_users[value.index()].is_some_and(|user| {
            is_sum(value.index()) && is_sum(user) || is_product(value.index()) && is_product(user)
        })
    }

    /// The terms or factors of what is joined at `value`.
    fn collect(&self, value: Value, negative: bool, terms: &mut Vec<Term>) {
        let op = self.old[value.index()].op;
        let is_sum = !matches!(op, Op::Mul(..));
        for (position, operand) in op.operands().enumerate() {
            let negative = negative ^ (position == 1 && matches!(op, Op::Sub(..)));
            if self.is_part(operand) {
                self.collect(operand, negative, terms);
                continue;
            }
            let value = self.map[operand.index()];
            // A product is fused with the sum it is for.
            let is_fused = is_sum
                && self.sole_users[operand.index()].is_some()
                && matches!(self.old[operand.index()].op, Op::Mul(..));
            let head_start = if is_fused { latency(self.old[operand.index()].op) } else { 0 };
            terms.push(Term { known: self.known[value.index()] - head_start, negative, value });
        }
    }

    fn join(&mut self, mut terms: Vec<Term>, like: &Instruction) -> Value {
        terms.sort_by_key(|term| term.known);
        while let [first, second, ..] = terms[..] {
            let (x, y) = (first.value, second.value);
            let (op, negative) = match (like.op, first.negative, second.negative) {
                (Op::Mul(..), ..) => (Op::Mul(x, y), false),
                (_, false, true) => (Op::Sub(x, y), false),
                (_, true, false) => (Op::Sub(y, x), false),
                (_, _, negative) => (Op::Add(x, y), negative),
            };
            let value = self.push(op, like);
            let known = first.known.max(second.known) + latency(op);
            self.known[value.index()] = known;
            terms.drain(..2);
            let place = terms.partition_point(|term| term.known <= known);
            terms.insert(place, Term { known, negative, value });
        }
        // The first term of a sum is never negative.
        terms[0].value
    }

    fn push(&mut self, op: Op, like: &Instruction) -> Value {
        let operands = op.operands().map(|operand| self.known[operand.index()]);
        self.known.push(operands.max().unwrap_or(0) + latency(op));
        self.instructions.push(Instruction { op, section: like.section, name: None });
        Value(self.instructions.len() - 1)
    }
}

/// For each value that one operand of one instruction is and no output, that instruction.
fn sole_users(function: &Function) -> Vec<Option<usize>> {
    let mut uses = vec![0_usize; function.instructions.len()];
    let mut users = vec![None; function.instructions.len()];
    for (index, instruction) in function.instructions.iter().enumerate() {
        for operand in instruction.op.operands() {
            uses[operand.index()] += 1;
            users[operand.index()] = Some(index);
        }
    }
    for entry in function.outputs.iter().flat_map(|output| &output.entries) {
        users[entry.index()] = None;
    }
    users.iter().zip(uses).map(|(user, uses)| user.filter(|_| uses == 1)).collect()
}
