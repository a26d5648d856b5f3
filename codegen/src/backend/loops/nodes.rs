//! Operations as sums of products and calls: what blocks are made of.

use std::collections::{BTreeMap, HashMap};

use super::blocks::Leaf;
use super::groups::groups;
use crate::program::{Function, Op, Section, Value, angles};

/// Terms of a sum that is a block of its own.
const TERMS: usize = 8;

/// A product of a sum.
#[derive(Clone, Debug)]
pub struct NodeTerm {
    pub is_negative: bool,
    /// The product of its constant factors, if it has any.
    pub number: Option<f64>,
    pub factors: Vec<Value>,
}

/// How a value is computed.
#[derive(Clone, Debug)]
pub enum Node {
    Sum(Vec<NodeTerm>),
    /// An operation by its mnemonic.
    Call(&'static str, Vec<Value>),
}

impl Node {
    /// What it reads.
    pub fn operands(&self) -> impl Iterator<Item = Value> {
        let (terms, operands): (&[NodeTerm], &[Value]) = match self {
            Self::Sum(terms) => (terms, &[]),
            Self::Call(_, operands) => (&[], operands),
        };
        terms.iter().flat_map(|term| &term.factors).chain(operands).copied()
    }
}

/// A function as nodes.
pub struct Nodes {
    /// Operands always precede.
    pub list: BTreeMap<Value, Node>,
    /// The angle, the sine and the cosine of each pair.
    pub angles: Vec<[Value; 3]>,
    sections: Vec<Section>,
    groups: Vec<usize>,
    leaves: HashMap<Value, Leaf>,
    /// Whether other groups or the caller read a value.
    shared: Vec<bool>,
}

impl Nodes {
    pub fn of(function: &Function) -> Self {
        let instructions = &function.instructions;
        let mut nodes = Self {
            list: BTreeMap::new(),
            angles: Vec::new(),
            sections: instructions.iter().map(|instruction| instruction.section).collect(),
            groups: groups(function),
            leaves: HashMap::new(),
            shared: vec![false; instructions.len()],
        };
        let absorbed = nodes.absorbed(function);
        for (index, instruction) in instructions.iter().enumerate() {
            let value = Value(index);
            match instruction.op {
                Op::Const(number) => {
                    nodes.leaves.insert(value, Leaf::Number(number));
                }
                Op::Load(slot) => {
                    nodes.leaves.insert(value, Leaf::Argument(slot.place().0));
                }
                Op::Sin(_) => {
                    nodes.leaves.insert(value, Leaf::Sine);
                }
                Op::Cos(_) => {
                    nodes.leaves.insert(value, Leaf::Cosine);
                }
                _ if absorbed[index] => {}
                Op::Add(..) | Op::Sub(..) | Op::Neg(_) | Op::Mul(..) => {
                    let terms = terms(function, value, &absorbed);
                    nodes.list.insert(value, Node::Sum(terms));
                }
                op => {
                    let node = Node::Call(op.mnemonic(), op.operands().collect());
                    nodes.list.insert(value, node);
                }
            }
        }
        for entry in function.outputs.iter().flat_map(|output| &output.entries) {
            if let Op::Const(number) = instructions[entry.index()].op {
                let term =
                    NodeTerm { is_negative: false, number: Some(number), factors: Vec::new() };
                nodes.list.insert(*entry, Node::Sum(vec![term]));
            }
        }
        for pair in angles(function) {
            let section = nodes.section(pair.angle);
            let mut other = || nodes.new_value(section);
            let sine = pair.sine.unwrap_or_else(&mut other);
            let cosine = pair.cosine.unwrap_or_else(&mut other);
            nodes.angles.push([pair.angle, sine, cosine]);
        }
        nodes
    }

    pub fn section(&self, value: Value) -> Section {
        self.sections[value.index()]
    }

    pub fn group(&self, value: Value) -> usize {
        self.groups[value.index()]
    }

    pub fn is_shared(&self, value: Value) -> bool {
        self.shared[value.index()]
    }

    pub fn leaf(&self, value: Value) -> Option<Leaf> {
        self.leaves.get(&value).copied()
    }

    /// Cuts the sum of a value into sums of [`TERMS`] terms at most; returns the values of these, the sum itself last.
    pub fn cut(&mut self, value: Value) -> Vec<Value> {
        let mut parts = Vec::new();
        while let Some(Node::Sum(terms)) = self.list.get(&value)
            && terms.len() > TERMS
        {
            let terms = terms.clone();
            let section = self.section(value);
            let mut sums = Vec::new();
            for terms in terms.chunks(TERMS) {
                let part = self.new_value(section);
                self.list.insert(part, Node::Sum(terms.to_vec()));
                parts.push(part);
                sums.push(NodeTerm { is_negative: false, number: None, factors: vec![part] });
            }
            self.list.insert(value, Node::Sum(sums));
        }
        parts.push(value);
        parts
    }

    /// Has a value kept, whoever reads it.
    pub fn keep(&mut self, value: Value) {
        self.shared[value.index()] = true;
    }

    fn new_value(&mut self, section: Section) -> Value {
        self.sections.push(section);
        self.groups.push(usize::MAX);
        self.shared.push(true);
        Value(self.sections.len() - 1)
    }

    /// Whether a value is a part of the only sum or product that reads it, in the same group; notes what other groups read.
    fn absorbed(&mut self, function: &Function) -> Vec<bool> {
        let instructions = &function.instructions;
        let (mut users, mut user) = (vec![0; instructions.len()], vec![0; instructions.len()]);
        for (index, instruction) in instructions.iter().enumerate() {
            for operand in instruction.op.operands() {
                users[operand.index()] += 1;
                user[operand.index()] = index;
                self.shared[operand.index()] |= self.group(operand) != self.groups[index];
            }
        }
        for entry in function.outputs.iter().flat_map(|output| &output.entries) {
            self.shared[entry.index()] = true;
        }
        let is_sum = |op: Op| matches!(op, Op::Add(..) | Op::Sub(..) | Op::Neg(_));
        let is_part = |index: usize| {
            let op = instructions[index].op;
            let by = instructions[user[index]].op;
            users[index] == 1
                && !self.shared[index]
                && (is_sum(op) && is_sum(by)
                    || matches!(op, Op::Mul(..)) && (is_sum(by) || matches!(by, Op::Mul(..))))
        };
        (0..instructions.len()).map(is_part).collect()
    }
}

/// The terms of a sum, with those of the sums that are parts of it.
fn terms(function: &Function, sum: Value, absorbed: &[bool]) -> Vec<NodeTerm> {
    let mut terms = Vec::new();
    let mut left = vec![(sum, false)];
    while let Some((value, is_negative)) = left.pop() {
        let is_part = value == sum || absorbed[value.index()];
        match function.instructions[value.index()].op {
            Op::Add(x, y) if is_part => left.extend([(y, is_negative), (x, is_negative)]),
            Op::Sub(x, y) if is_part => left.extend([(y, !is_negative), (x, is_negative)]),
            Op::Neg(x) if is_part => left.push((x, !is_negative)),
            _ => terms.push(term(function, value, is_negative, is_part, absorbed)),
        }
    }
    terms
}

/// The factors of a product, with those of the products that are parts of it.
fn term(
    function: &Function,
    product: Value,
    is_negative: bool,
    is_part: bool,
    absorbed: &[bool],
) -> NodeTerm {
    let mut term = NodeTerm { is_negative, number: None, factors: Vec::new() };
    let mut left = vec![product];
    while let Some(value) = left.pop() {
        let is_open = (value == product && is_part) || absorbed[value.index()];
        match function.instructions[value.index()].op {
            Op::Mul(x, y) if is_open => left.extend([y, x]),
            Op::Const(number) => term.number = Some(term.number.unwrap_or(1.0) * number),
            _ => term.factors.push(value),
        }
    }
    term
}
