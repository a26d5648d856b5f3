//! Operations as rows of tables.
//!
//! A product that only one sum uses is fused with the sum, as in straight-line code. A row has no signs: what is
//! subtracted is negated first, in a row that all its users share.

use std::collections::HashMap;

use lamc_tables::kind::{self, FIRST_NUMBERS};
use lamc_tables::{COSINE, Row, Rows};

use super::Numbers;
use crate::backend::naming::{Users, users};
use crate::program::{Argument, Function, Op, Slot, Value};

/// Returns the rows of a function.
pub fn rows(function: &Function, numbers: &mut Numbers) -> Rows {
    let (users, mut known) = (users(function), HashMap::new());
    let mut list = Vec::new();
    for index in 0..FIRST_NUMBERS.len() {
        let row = Row { kind: kind::NUMBER, fields: [index, 0, 0] };
        known.insert(row, list.len());
        list.push(row);
    }
    let mut lowering = Lowering {
        function,
        fused: fused(function, &users),
        of: vec![None; function.instructions.len()],
        numbers,
        known,
        list,
    };
    for (index, instruction) in function.instructions.iter().enumerate() {
        let is_inline = matches!(instruction.op, Op::Const(_) | Op::Load(_));
        if !is_inline && !lowering.fused[index] {
            lowering.row(Value(index));
        }
    }
    let outputs = function.outputs.iter().map(|output| {
        let entries = output.entries.iter().enumerate();
        let entries = entries.filter(|(_, entry)| !is_zero(function, **entry));
        entries.map(|(index, &entry)| (lowering.row(entry), index)).collect()
    });
    let outputs = outputs.collect();
    Rows { list: lowering.list, outputs }
}

fn is_zero(function: &Function, value: Value) -> bool {
    matches!(function.instructions[value.index()].op, Op::Const(number) if number == 0.0)
}

/// Whether the row of a sum computes a value, by value. If both terms are products, it is the second.
fn fused(function: &Function, users: &[Users]) -> Vec<bool> {
    let mut fused = vec![false; users.len()];
    for instruction in &function.instructions {
        if let Op::Add(x, y) | Op::Sub(x, y) = instruction.op {
            let is_term = |value: &Value| {
                let op = function.instructions[value.index()].op;
                matches!(op, Op::Mul(..)) && matches!(users[value.index()], Users::Sum(_))
            };
            if let Some(product) = [y, x].into_iter().find(is_term) {
                fused[product.index()] = true;
            }
        }
    }
    fused
}

struct Lowering<'a> {
    function: &'a Function,
    fused: Vec<bool>,
    /// Row of each value.
    of: Vec<Option<usize>>,
    numbers: &'a mut Numbers,
    known: HashMap<Row, usize>,
    list: Vec<Row>,
}

impl Lowering<'_> {
    /// The row of a value.
    fn row(&mut self, value: Value) -> usize {
        if let Some(row) = self.of[value.index()] {
            return row;
        }
        let row = match self.function.instructions[value.index()].op {
            Op::Const(number) => self.number(number),
            Op::Load(slot) => self.argument(slot),
            Op::Neg(x) => self.negative(x),
            Op::Add(x, y) => self.sum(x, y, false),
            Op::Sub(x, y) => self.sum(x, y, true),
            Op::Sin(x) => self.sine(x),
            Op::Cos(x) => self.sine(x) + 1,
            op => self.plain(op),
        };
        self.of[value.index()] = Some(row);
        row
    }

    fn push(&mut self, kind: usize, fields: [usize; 3]) -> usize {
        let row = Row { kind, fields };
        *self.known.entry(row).or_insert_with(|| {
            self.list.push(row);
            self.list.len() - 1
        })
    }

    fn number(&mut self, number: f64) -> usize {
        let place = self.numbers.place(number);
        self.push(kind::NUMBER, [place, 0, 0])
    }

    fn argument(&mut self, slot: Slot) -> usize {
        let (argument, index) = slot.place();
        let signature = self.function.kind.signature();
        let position = signature.inputs.iter().position(|&input| input == argument);
        // The numbers of the drawing follow the others.
        let last = (argument == Argument::Drawing).then_some(signature.inputs.len());
        let Some(place) = position.or(last) else { unreachable!("the verifier checks reads") };
        self.push(kind::ARGUMENT, [place, index, 0])
    }

    fn sine(&mut self, angle: Value) -> usize {
        let angle = self.row(angle);
        let count = self.list.len();
        let row = self.push(kind::SINE_COSINE, [angle, 0, 0]);
        if row == count {
            self.list.push(Row { kind: COSINE, fields: [row, 0, 0] });
        }
        row
    }

    fn negative(&mut self, x: Value) -> usize {
        let row = self.row(x);
        match self.list[row] {
            Row { kind: kind::NEG, fields: [x, ..] } => x,
            Row { kind: kind::NUMBER, fields: [place, ..] } => {
                let number = self.numbers.list[place];
                self.number(-number)
            }
            _ => self.push(kind::NEG, [row, 0, 0]),
        }
    }

    /// x + y, or x - y.
    fn sum(&mut self, x: Value, y: Value, less: bool) -> usize {
        let product =
            |value: Value, fused: &[bool]| match self.function.instructions[value.index()].op {
                Op::Mul(a, b) if fused[value.index()] => Some((a, b)),
                _ => None,
            };
        match (product(y, &self.fused), product(x, &self.fused)) {
            (Some((a, b)), _) => {
                let is_number = matches!(self.function.instructions[b.index()].op, Op::Const(_));
                let (a, b) = if is_number { (b, a) } else { (a, b) };
                let a = if less { self.negative(a) } else { self.row(a) };
                let fields = [a, self.row(b), self.row(x)];
                self.push(kind::MUL_ADD, fields)
            }
            (None, Some((a, b))) => {
                let y = if less { self.negative(y) } else { self.row(y) };
                let fields = [self.row(a), self.row(b), y];
                self.push(kind::MUL_ADD, fields)
            }
            (None, None) => {
                let fields = [self.row(x), self.row(y), 0];
                self.push(if less { kind::SUB } else { kind::ADD }, fields)
            }
        }
    }

    fn plain(&mut self, op: Op) -> usize {
        let kind = match op {
            Op::Mul(..) => kind::MUL,
            Op::Div(..) => kind::DIV,
            Op::Min(..) => kind::MIN,
            Op::Max(..) => kind::MAX,
            Op::Pow(..) => kind::POW,
            Op::Atan2(..) => kind::ATAN2,
            Op::Sqrt(_) => kind::SQRT,
            Op::Tan(_) => kind::TAN,
            Op::Exp(_) => kind::EXP,
            Op::Abs(_) => kind::ABS,
            Op::Tanh(_) => kind::TANH,
            Op::Ln(_) => kind::LN,
            Op::Step(_) => kind::STEP,
            _ => unreachable!("{} has a row of another kind", op.mnemonic()),
        };
        let mut fields = [0; 3];
        for (field, operand) in fields.iter_mut().zip(op.operands()) {
            *field = self.row(operand);
        }
        self.push(kind, fields)
    }
}
