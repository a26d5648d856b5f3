//! Folding: arithmetic that is known now is done now.
//!
//! Postcondition: no operation has only constant operands; there is no addition of 0, no
//! multiplication by 0, 1 or -1, no negation of a negation, no addition or subtraction of a
//! negation, no difference of a value and itself, and at most one constant in a product of
//! constants and one value, unless the constants' product overflows.
//!
//! Products of constants are re-associated, so results may differ in rounding. `0 * x` is 0 for
//! every x, even if x is not finite: a zero factor comes from the geometry and means that x has no
//! effect.

use crate::program::{Function, Instruction, Op, Section, Value};

/// Prefix of the name of a negated value: `minus_omega_left_x`.
pub const MINUS: &str = "minus_";

/// Folds a function.
pub fn fold(function: Function) -> Function {
    let mut folding = Builder { instructions: Vec::with_capacity(function.instructions.len()) };
    let mut map: Vec<Value> = Vec::with_capacity(function.instructions.len());
    for instruction in function.instructions {
        let Instruction { op, section, name } = instruction;
        let value = folding.simplify(op.map(|operand| map[operand.index()]), section);
        if let Some(name) = name {
            folding.name(value, || name);
        }
        map.push(value);
    }
    Function::renumbered(function.kind, folding.instructions, function.outputs, &map)
}

/// A function in the making, whose operations are folded as they come.
pub struct Builder {
    instructions: Vec<Instruction>,
}

impl Builder {
    /// Continues folded instructions.
    pub fn after(instructions: Vec<Instruction>) -> Self {
        Self { instructions }
    }

    /// The instructions.
    pub fn instructions(self) -> Vec<Instruction> {
        self.instructions
    }

    /// Names a value that has none, if it is an operation; where it is the opposite of a nameless
    /// value, that one, too: negations move on to where they cost nothing.
    pub fn name(&mut self, value: Value, name: impl FnOnce() -> String) {
        if self.takes_name(value) && self.instructions[value.index()].name.is_none() {
            self.rename(value, name);
        }
    }

    /// As [`name`](Self::name), in place of the name that it has.
    pub fn rename(&mut self, value: Value, name: impl FnOnce() -> String) {
        if !self.takes_name(value) {
            return;
        }
        let name = name();
        if let Some(inner) = self.negated(value)
            && self.takes_name(inner)
        {
            let inner = &mut self.instructions[inner.index()].name;
            inner.get_or_insert_with(|| format!("{MINUS}{name}"));
        }
        self.instructions[value.index()].name = Some(name);
    }

    fn takes_name(&self, value: Value) -> bool {
        !matches!(self.op(value), Op::Const(_) | Op::Load(_))
    }

    fn op(&self, value: Value) -> Op {
        self.instructions[value.index()].op
    }

    /// The number a value is.
    pub fn constant(&self, value: Value) -> Option<f64> {
        match self.op(value) {
            Op::Const(number) => Some(number),
            _ => None,
        }
    }

    fn negated(&self, value: Value) -> Option<Value> {
        match self.op(value) {
            Op::Neg(inner) => Some(inner),
            _ => None,
        }
    }

    /// The value of `op`, simplified; operands are values of the folded function.
    pub fn simplify(&mut self, op: Op, section: Section) -> Value {
        let known: Vec<Option<f64>> = op.operands().map(|x| self.constant(x)).collect();
        if !known.is_empty() && known.iter().all(Option::is_some) {
            // Adding 0 makes -0 the same constant as 0.
            let number = op.evaluate(|x| self.constant(x).unwrap_or(f64::NAN)) + 0.0;
            return self.push(Op::Const(number), section);
        }
        match op {
            Op::Neg(x) => match self.negated(x) {
                Some(inner) => inner,
                None => self.push(op, section),
            },
            Op::Add(x, y) => {
                match (self.constant(x), self.constant(y), self.negated(x), self.negated(y)) {
                    (Some(0.0), ..) => y,
                    (_, Some(0.0), ..) => x,
                    (_, _, _, Some(y)) => self.simplify(Op::Sub(x, y), section),
                    (_, _, Some(x), None) => self.simplify(Op::Sub(y, x), section),
                    _ => self.push(op, section),
                }
            }
            Op::Sub(x, y) => match (self.constant(x), self.constant(y), self.negated(y)) {
                _ if x == y => self.push(Op::Const(0.0), section),
                (Some(0.0), ..) => self.simplify(Op::Neg(y), section),
                (_, Some(0.0), _) => x,
                (_, _, Some(y)) => self.simplify(Op::Add(x, y), section),
                _ => self.push(op, section),
            },
            Op::Mul(x, y) => self.product(x, y, section),
            Op::Div(x, y) => match (self.constant(x), self.constant(y)) {
                (Some(0.0), _) => x,
                (_, Some(1.0)) => x,
                _ => self.push(op, section),
            },
            _ => self.push(op, section),
        }
    }

    fn product(&mut self, x: Value, y: Value, section: Section) -> Value {
        let (number, value) = match (self.constant(x), self.constant(y)) {
            (Some(number), _) => (number, y),
            (_, Some(number)) => (number, x),
            _ => {
                return match (self.negated(x), self.negated(y)) {
                    (Some(x), Some(y)) => self.push(Op::Mul(x, y), section),
                    (Some(x), None) => self.negated_product(x, y, section),
                    (None, Some(y)) => self.negated_product(x, y, section),
                    (None, None) => self.push(Op::Mul(x, y), section),
                };
            }
        };
        if let Some(inner) = self.negated(value) {
            let number = self.push(Op::Const(-number), section);
            return self.product(number, inner, section);
        }
        // Two factors may overflow where each by itself does not: 1e200 * (1e200 * x).
        if let Op::Mul(factor, rest) = self.op(value)
            && let Some(inner) = self.constant(factor)
            && (number * inner).is_finite()
        {
            let number = self.push(Op::Const(number * inner), section);
            return self.product(number, rest, section);
        }
        match number {
            0.0 => self.push(Op::Const(0.0), section),
            1.0 => value,
            -1.0 => self.push(Op::Neg(value), section),
            _ => {
                let number = self.push(Op::Const(number), section);
                self.push(Op::Mul(number, value), section)
            }
        }
    }

    fn negated_product(&mut self, x: Value, y: Value, section: Section) -> Value {
        let product = self.push(Op::Mul(x, y), section);
        self.push(Op::Neg(product), section)
    }

    fn push(&mut self, op: Op, section: Section) -> Value {
        self.instructions.push(Instruction { op, section, name: None });
        Value(self.instructions.len() - 1)
    }
}
