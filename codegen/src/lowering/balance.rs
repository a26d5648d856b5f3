//! Sums in the order in which their terms are ready: the processor adds what it has while it waits
//! for the rest.
//!
//! Postcondition: where the longest chain of operations takes longer than issuing all of them, no
//! sum is longer, in additions one after the other, than its terms' times of arrival demand.
//! Elsewhere nothing changes: a sum of products one after the other takes fewer fused operations.
//! Sums are re-associated, so results may differ in rounding.

use crate::program::{Function, Instruction, Op, Value};
use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::like_terms::{absorbed, uses};

/// Operations that a processor issues in a cycle.
const ISSUE_WIDTH: u32 = 4;

/// A term of a sum: when it is ready, which it is, and whether it is subtracted.
type Term = Reverse<(u32, Value, bool)>;

/// Balances the sums of a function.
pub fn balance(function: Function) -> Function {
    if function.critical_path() * ISSUE_WIDTH < function.cost().total() as u32 {
        return function;
    }
    let uses = uses(&function);
    let absorbed = absorbed(&function, &uses);
    let mut balancing = Balancing { instructions: Vec::new(), ready: Vec::new() };
    let mut terms: Vec<Vec<(Value, bool)>> = Vec::with_capacity(function.instructions.len());
    let mut map: Vec<Value> = Vec::with_capacity(function.instructions.len());
    for (index, instruction) in function.instructions.into_iter().enumerate() {
        let mut own = Vec::new();
        if let Op::Add(x, y) | Op::Sub(x, y) = instruction.op {
            let subtracts = matches!(instruction.op, Op::Sub(..));
            for (operand, minus) in [(x, false), (y, subtracts)] {
                if absorbed[operand.index()] {
                    let inner = std::mem::take(&mut terms[operand.index()]);
                    own.extend(inner.into_iter().map(|(value, sign)| (value, sign != minus)));
                } else {
                    own.push((map[operand.index()], minus));
                }
            }
        }
        let value = if own.is_empty() {
            let op = instruction.op.map(|operand| map[operand.index()]);
            balancing.push(Instruction { op, ..instruction })
        } else if absorbed[index] {
            // Never looked at: the sum it belongs to takes its terms.
            Value(usize::MAX)
        } else {
            balancing.sum(&own, instruction)
        };
        terms.push(own);
        map.push(value);
    }
    Function::renumbered(function.kind, balancing.instructions, function.outputs, &map)
}

struct Balancing {
    instructions: Vec<Instruction>,
    /// When each value is there, in cycles after the function's start.
    ready: Vec<u32>,
}

impl Balancing {
    fn push(&mut self, instruction: Instruction) -> Value {
        let op = instruction.op;
        let start = op.operands().map(|x| self.ready[x.index()]).max().unwrap_or(0);
        self.ready.push(start + op.latency());
        self.instructions.push(instruction);
        Value(self.instructions.len() - 1)
    }

    /// Adds the two terms that are available first, until one term remains.
    fn sum(&mut self, terms: &[(Value, bool)], instruction: Instruction) -> Value {
        let term = |this: &Self, value: Value, minus| -> Term {
            Reverse((this.ready[value.index()], value, minus))
        };
        let mut heap: BinaryHeap<Term> =
            terms.iter().map(|&(value, minus)| term(self, value, minus)).collect();
        loop {
            let (Some(Reverse((_, x, minus_x))), Some(Reverse((_, y, minus_y)))) =
                (heap.pop(), heap.pop())
            else {
                unreachable!("a sum has two terms, and two become one");
            };
            let (op, minus) = match (minus_x, minus_y) {
                (false, true) => (Op::Sub(x, y), false),
                (true, false) => (Op::Sub(y, x), false),
                (minus, _) => (Op::Add(x, y), minus),
            };
            let last = heap.is_empty();
            let name = if last && !minus { instruction.name.clone() } else { None };
            let value = self.push(Instruction { op, name, ..instruction });
            if !last {
                heap.push(term(self, value, minus));
            } else if minus {
                return self.push(Instruction { op: Op::Neg(value), ..instruction });
            } else {
                return value;
            }
        }
    }
}
