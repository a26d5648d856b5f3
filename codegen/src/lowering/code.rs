//! A function in the making: operations are folded, and named for what they are, as they come.

use super::fold::Builder;
use crate::program::{Function, FunctionKind, Op, Output, Phase, Section, Slot, Value};

/// A function being extended.
pub struct Code {
    builder: Builder,
    /// The section that what follows belongs to.
    pub section: Section,
}

impl Code {
    /// Continues a function; the caller sets its outputs.
    pub fn after(function: Function) -> (Self, Vec<Output>) {
        let builder = Builder::after(function.instructions);
        (Self { builder, section: Section::mechanism(Phase::Output) }, function.outputs)
    }

    /// The function with these outputs.
    pub fn finish(self, kind: FunctionKind, outputs: Vec<Output>) -> Function {
        Function { kind, instructions: self.builder.instructions(), outputs }
    }

    /// Starts a section for this phase of the whole mechanism.
    pub fn enter(&mut self, phase: Phase) {
        self.section = Section::mechanism(phase);
    }

    /// An operation.
    pub fn op(&mut self, op: Op) -> Value {
        self.builder.simplify(op, self.section)
    }

    /// An operation with a name, unless the value has one already.
    pub fn named(&mut self, op: Op, name: impl FnOnce() -> String) -> Value {
        let value = self.op(op);
        self.builder.name(value, name);
        value
    }

    /// Names a value that has no name.
    pub fn name(&mut self, value: Value, name: impl FnOnce() -> String) {
        self.builder.name(value, name);
    }

    /// Names a value for its meaning in this function and replaces its former name.
    pub fn rename(&mut self, value: Value, name: impl FnOnce() -> String) {
        self.builder.rename(value, name);
    }

    /// Whether a value is the number 0.
    pub fn is_zero(&self, value: Value) -> bool {
        self.builder.constant(value) == Some(0.0)
    }

    /// A constant.
    pub fn number(&mut self, number: f64) -> Value {
        self.op(Op::Const(number))
    }

    /// a . b, without terms that are zero.
    pub fn dot(&mut self, a: &[Value], b: &[Value]) -> Value {
        let mut sum = None;
        for (&a, &b) in a.iter().zip(b) {
            if self.is_zero(a) || self.is_zero(b) {
                continue;
            }
            let product = self.op(Op::Mul(a, b));
            sum = Some(match sum {
                Some(sum) => self.op(Op::Add(sum, product)),
                None => product,
            });
        }
        sum.unwrap_or_else(|| self.number(0.0))
    }

    /// a - b c.
    pub fn less(&mut self, a: Value, b: Value, c: Value) -> Value {
        if self.is_zero(b) || self.is_zero(c) {
            return a;
        }
        let product = self.op(Op::Mul(b, c));
        self.op(Op::Sub(a, product))
    }

    /// Appends a function, some of whose reads are given; its outputs. `rename` makes the names of
    /// the values out of those in the function.
    pub fn inline(
        &mut self,
        function: &Function,
        given: impl Fn(Slot) -> Option<Value>,
        rename: impl Fn(&str) -> String,
    ) -> Vec<Vec<Value>> {
        let mut map: Vec<Value> = Vec::with_capacity(function.instructions.len());
        for instruction in &function.instructions {
            let known = match instruction.op {
                Op::Load(slot) => given(slot),
                _ => None,
            };
            let value = known.unwrap_or_else(|| {
                let op = instruction.op.map(|operand| map[operand.index()]);
                let value = self.builder.simplify(op, instruction.section);
                if let Some(name) = &instruction.name {
                    self.builder.name(value, || rename(name));
                }
                value
            });
            map.push(value);
        }
        let entries = |output: &Output| output.entries.iter().map(|v| map[v.index()]).collect();
        function.outputs.iter().map(entries).collect()
    }
}
