//! Function bodies in no particular language: instructions become statements, grouped by the body
//! they belong to.
//!
//! Constants and reads are written where they are used, and so are unnamed values used once: what
//! remains has a name of the derivation.

use std::collections::HashMap;

use super::identifiers::Names;
use crate::kane::Section;
use crate::program::{Function, Op, Program, Slot, Value};

/// Operations written into one expression at most.
const LONGEST_EXPRESSION: usize = 10;

/// A statement of straight-line code.
#[derive(Clone, Debug)]
pub enum Statement {
    /// What follows belongs to this body or loop.
    Section(String),
    /// A new name for a value.
    Let {
        /// The name.
        name: String,
        /// The value.
        value: Expression,
    },
    /// New names for sine, cosine or both of an angle.
    SineCosine {
        /// Of the sine.
        sine: Option<String>,
        /// Of the cosine.
        cosine: Option<String>,
        /// The angle, rad.
        angle: Expression,
    },
}

/// An expression; parentheses are there where the order of operations needs them.
#[derive(Clone, Debug)]
#[allow(missing_docs, reason = "each is the operation of its name")]
pub enum Expression {
    Constant(f64),
    Load(Slot),
    Name(String),
    Parenthesised(Box<Expression>),
    Negated(Box<Expression>),
    Infix(Box<Expression>, Infix, Box<Expression>),
    /// A function by its mnemonic.
    Call(&'static str, Vec<Expression>),
}

/// The operator of an [`Expression::Infix`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[allow(missing_docs, reason = "each is the operation of its name")]
pub enum Infix {
    Add,
    Sub,
    Mul,
    Div,
}

impl Infix {
    /// As Rust and C write it.
    pub fn symbol(self) -> char {
        match self {
            Self::Add => '+',
            Self::Sub => '-',
            Self::Mul => '*',
            Self::Div => '/',
        }
    }
}

/// How tightly an expression holds together, loosest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Atom,
}

impl Expression {
    fn binding(&self) -> Binding {
        match self {
            Self::Infix(_, Infix::Add | Infix::Sub, _) => Binding::Sum,
            Self::Infix(..) | Self::Negated(_) => Binding::Product,
            _ => Binding::Atom,
        }
    }

    /// As an operand that must hold at least as tightly as `least`.
    fn within(&self, least: Binding) -> Box<Self> {
        let operand = Box::new(self.clone());
        if self.binding() < least { Box::new(Self::Parenthesised(operand)) } else { operand }
    }

    /// Operations in it.
    fn size(&self) -> usize {
        match self {
            Self::Constant(_) | Self::Load(_) | Self::Name(_) => 0,
            Self::Parenthesised(x) => x.size(),
            Self::Negated(x) => x.size() + 1,
            Self::Infix(x, _, y) => x.size() + y.size() + 1,
            Self::Call(_, arguments) => arguments.iter().map(Self::size).sum::<usize>() + 1,
        }
    }
}

/// The statements of a function and, per output, its entries.
pub struct Statements<'a> {
    program: &'a Program,
    function: &'a Function,
    names: Names,
    written: Vec<Option<Expression>>,
    list: Vec<Statement>,
    section: Option<Section>,
}

impl<'a> Statements<'a> {
    /// Of every instruction of `function`; no local name is one of `reserved`.
    pub fn new(program: &'a Program, function: &'a Function, reserved: &[&str]) -> Self {
        let mut statements = Self {
            program,
            function,
            names: Names::reserving(reserved),
            written: vec![None; function.instructions.len()],
            list: Vec::new(),
            section: None,
        };
        statements.write();
        statements
    }

    /// The statements, in order.
    pub fn list(&self) -> &[Statement] {
        &self.list
    }

    /// The entries of an output, by name.
    pub fn output(&self, name: &str) -> impl Iterator<Item = &Expression> {
        let output = self.function.outputs.iter().find(|output| output.name == name);
        let entries = output.map(|output| output.entries.as_slice()).unwrap_or_default();
        entries.iter().map(|&entry| self.of(entry))
    }

    fn of(&self, value: Value) -> &Expression {
        match &self.written[value.index()] {
            Some(expression) => expression,
            None => unreachable!("operands precede their use"),
        }
    }

    fn write(&mut self) {
        let uses = uses(self.function);
        let partners = partners(self.function);
        for (index, &uses) in uses.iter().enumerate() {
            if self.written[index].is_some() {
                continue;
            }
            let instruction = &self.function.instructions[index];
            let expression = match instruction.op {
                Op::Const(number) => Expression::Constant(number),
                Op::Load(slot) => Expression::Load(slot),
                Op::Sin(x) | Op::Cos(x) => self.sine_cosine(index, x, partners[index]),
                op => {
                    let expression = self.expression(op);
                    let inline = instruction.name.is_none() && uses == 1;
                    if inline && expression.size() <= LONGEST_EXPRESSION {
                        expression
                    } else {
                        let name = self.name(index);
                        self.push(index, Statement::Let { name: name.clone(), value: expression });
                        Expression::Name(name)
                    }
                }
            };
            self.written[index] = Some(expression);
        }
    }

    /// One statement for sine and cosine of an angle, where both are wanted.
    fn sine_cosine(&mut self, index: usize, x: Value, partner: Option<usize>) -> Expression {
        let angle = self.of(x).clone();
        let is_sine = matches!(self.function.instructions[index].op, Op::Sin(_));
        let mine = self.name(index);
        let other = partner.map(|partner| {
            let name = self.name(partner);
            self.written[partner] = Some(Expression::Name(name.clone()));
            name
        });
        let this = Some(mine.clone());
        let (sine, cosine) = if is_sine { (this, other) } else { (other, this) };
        self.push(index, Statement::SineCosine { sine, cosine, angle });
        Expression::Name(mine)
    }

    fn name(&mut self, index: usize) -> String {
        let instruction = &self.function.instructions[index];
        let name = instruction.name.clone().unwrap_or_else(|| match instruction.section {
            Section::Node(node) => format!("{}_part", self.program.interface.nodes[node.index()]),
            Section::Loop(id) => format!("loop{}_part", id.index()),
            Section::Mechanism => "part".to_owned(),
        });
        self.names.give(&name)
    }

    /// A statement, after a heading where another section begins.
    fn push(&mut self, index: usize, statement: Statement) {
        let section = self.function.instructions[index].section;
        if self.section.replace(section) != Some(section) {
            self.list.push(Statement::Section(match section {
                Section::Mechanism => "the whole mechanism".to_owned(),
                Section::Node(node) => self.program.interface.nodes[node.index()].clone(),
                Section::Loop(id) => format!("loop {}", id.index()),
            }));
        }
        self.list.push(statement);
    }

    fn expression(&self, op: Op) -> Expression {
        use Binding::{Atom, Product, Sum};
        let infix = |x, operator, y, [left, right]: [Binding; 2]| {
            Expression::Infix(self.of(x).within(left), operator, self.of(y).within(right))
        };
        match op {
            Op::Neg(x) => Expression::Negated(self.of(x).within(Product)),
            Op::Add(x, y) => infix(x, Infix::Add, y, [Sum, Product]),
            Op::Sub(x, y) => infix(x, Infix::Sub, y, [Sum, Product]),
            Op::Mul(x, y) => infix(x, Infix::Mul, y, [Product, Atom]),
            Op::Div(x, y) => infix(x, Infix::Div, y, [Product, Atom]),
            op => {
                let arguments = op.operands().map(|x| self.of(x).clone()).collect();
                Expression::Call(op.mnemonic(), arguments)
            }
        }
    }
}

/// How often each value is used.
fn uses(function: &Function) -> Vec<usize> {
    let mut uses = vec![0; function.instructions.len()];
    let operands = function.instructions.iter().flat_map(|i| i.op.operands());
    let entries = function.outputs.iter().flat_map(|o| o.entries.iter().copied());
    operands.chain(entries).for_each(|value| uses[value.index()] += 1);
    uses
}

/// For the first of a sine and a cosine of one angle, the other.
fn partners(function: &Function) -> Vec<Option<usize>> {
    let mut seen: HashMap<Value, usize> = HashMap::new();
    let mut partners = vec![None; function.instructions.len()];
    for (index, instruction) in function.instructions.iter().enumerate() {
        if let Op::Sin(x) | Op::Cos(x) = instruction.op
            && let Some(first) = seen.insert(x, index)
        {
            partners[first] = Some(index);
        }
    }
    partners
}
