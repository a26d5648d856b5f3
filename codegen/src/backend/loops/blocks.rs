//! Sections as blocks: statements in an order that depends on their form alone, so that what is computed in the same way
//! for many bodies and loops looks the same.
//!
//! Numbers carry the signs of their terms, terms and statements are sorted by labels. The label of what another section
//! computes says how it is computed there, but not from what, so that the first body of a chain and the tenth have equal
//! labels.
//!
//! Sums are re-associated, so results may differ in rounding from those of straight-line code.

use std::collections::{BTreeMap, HashMap};

use super::nodes::{Node, NodeTerm, Nodes};
use crate::program::{Argument, Phase, Subject, Value};

/// What a statement reads, by its place in a list of the block.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Operand {
    /// A value from outside of the block.
    Read(usize),
    /// The value of an earlier statement of the block.
    Own(usize),
    /// A number of the model.
    Number(usize),
}

/// A product of a sum.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Term {
    /// Whether it is subtracted; never, if a factor is a number.
    pub is_negative: bool,
    /// Its factors; a number comes last.
    pub factors: Vec<Operand>,
}

/// A statement of a block.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub enum Statement {
    /// A sum of products.
    Sum(Vec<Term>),
    /// An operation by its mnemonic.
    Call(&'static str, Vec<Operand>),
    /// Sine and cosine: two values.
    SineCosine(Operand),
}

/// What equal blocks have in common.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Shape {
    /// The statements, each after those that it reads.
    pub statements: Vec<Statement>,
    /// The statements whose values other blocks or the caller read.
    pub kept: Vec<usize>,
}

impl Statement {
    /// Returns what it reads.
    pub fn operands(&self) -> impl Iterator<Item = &Operand> {
        let (terms, operands): (&[Term], &[Operand]) = match self {
            Self::Sum(terms) => (terms, &[]),
            Self::Call(_, operands) => (&[], operands),
            Self::SineCosine(angle) => (&[], std::slice::from_ref(angle)),
        };
        terms.iter().flat_map(|term| &term.factors).chain(operands)
    }
}

impl Shape {
    /// Returns the terms of all sums.
    pub fn terms(&self) -> impl Iterator<Item = &Term> {
        self.statements.iter().flat_map(|statement| match statement {
            Statement::Sum(terms) => &terms[..],
            _ => &[],
        })
    }

    /// Returns the terms of all sums.
    pub fn terms_mut(&mut self) -> impl Iterator<Item = &mut Term> {
        self.statements.iter_mut().flat_map(|statement| match statement {
            Statement::Sum(terms) => &mut terms[..],
            _ => &mut [],
        })
    }

    /// Whether it is a sine and a cosine.
    pub fn is_sine(&self) -> bool {
        matches!(self.statements[..], [Statement::SineCosine(_)])
    }

    /// Returns the statements without their signs.
    pub fn unsigned(&self) -> Vec<Statement> {
        let mut shape = self.clone();
        shape.terms_mut().for_each(|term| term.is_negative = false);
        shape.statements
    }
}

/// A block.
#[derive(Clone, Debug)]
pub struct Block {
    /// Its statements.
    pub shape: Shape,
    /// The values from outside.
    pub reads: Vec<Value>,
    /// The numbers of the model.
    pub numbers: Vec<f64>,
    /// The values of the statements; of sine and cosine there are two.
    pub values: Vec<Value>,
}

/// How a value is computed: what terms and statements are sorted by.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
enum Key {
    Number,
    Argument(Argument),
    Sine,
    Cosine,
    /// Computed in another section of this phase.
    Elsewhere(Phase),
    /// Computed in another section in the way of this label, and whether that section has the same subject.
    Outside(usize, bool),
    /// Of each term: whether it has a number, whether it is subtracted, the labels of its factors.
    Sum(Vec<(bool, bool, Vec<usize>)>),
    Call(&'static str, Vec<usize>),
}

/// What terms and statements are sorted by: first how they are computed but for signs, so that what differs in signs alone
/// has the same order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Label {
    unsigned: usize,
    signed: usize,
}

/// Makes blocks of nodes.
pub struct Blocks<'a> {
    nodes: &'a Nodes,
    labels: HashMap<Key, usize>,
    /// By value: its label where it is read by other groups.
    outside: HashMap<Value, Label>,
}

impl<'a> Blocks<'a> {
    pub fn of(nodes: &'a Nodes) -> Self {
        let mut blocks = Self { nodes, labels: HashMap::new(), outside: HashMap::new() };
        for &value in nodes.list.keys() {
            let group = nodes.group(value);
            let label =
                blocks.label_of(value, &|blocks, operand| match blocks.outside.get(&operand) {
                    Some(&label) if nodes.group(operand) == group => label,
                    _ => blocks.plain(Key::Elsewhere(nodes.section(operand).phase)),
                });
            blocks.outside.insert(value, label);
        }
        blocks
    }

    /// Returns the block of these values.
    pub fn block(&mut self, members: &[Value]) -> Block {
        let nodes = self.nodes;
        let mut own: BTreeMap<Value, Label> = BTreeMap::new();
        for &value in members {
            let subject = nodes.section(value).subject;
            let label = self.label_of(value, &|blocks, operand| match own.get(&operand) {
                Some(&label) => label,
                None => blocks.of_other(operand, subject),
            });
            own.insert(value, label);
        }
        let mut order: Vec<Value> = members.to_vec();
        order.sort_by_key(|value| (own[value], *value));
        let first = members.first().copied().unwrap_or(Value(0));
        let mut writing = Writing {
            nodes,
            subject: nodes.section(first).subject,
            own: &own,
            places: HashMap::new(),
            read: HashMap::new(),
            block: Block {
                shape: Shape { statements: Vec::new(), kept: Vec::new() },
                reads: Vec::new(),
                numbers: Vec::new(),
                values: Vec::new(),
            },
        };
        for value in order {
            writing.write(value, self);
        }
        writing.block
    }

    /// Returns the label of a value that a section with this subject reads from another one.
    fn of_other(&mut self, value: Value, subject: Subject) -> Label {
        let is_same = self.nodes.section(value).subject == subject;
        let none = Label { unsigned: usize::MAX, signed: usize::MAX };
        let Label { unsigned, signed } = self.outside.get(&value).copied().unwrap_or(none);
        let [unsigned, signed] =
            [unsigned, signed].map(|label| self.label(Key::Outside(label, is_same)));
        Label { unsigned, signed }
    }

    fn label(&mut self, key: Key) -> usize {
        let next = self.labels.len();
        *self.labels.entry(key).or_insert(next)
    }

    /// Returns the label of what has no signs.
    fn plain(&mut self, key: Key) -> Label {
        let label = self.label(key);
        Label { unsigned: label, signed: label }
    }

    /// Returns the label of a leaf, or else what `other` says.
    fn of_operand(&mut self, operand: Value, other: &impl Fn(&mut Self, Value) -> Label) -> Label {
        match self.nodes.leaf(operand) {
            Some(Leaf::Number(_)) => self.plain(Key::Number),
            Some(Leaf::Argument(argument)) => self.plain(Key::Argument(argument)),
            Some(Leaf::Sine) => self.plain(Key::Sine),
            Some(Leaf::Cosine) => self.plain(Key::Cosine),
            None => other(self, operand),
        }
    }

    /// Returns the label of a node.
    fn label_of(&mut self, value: Value, other: &impl Fn(&mut Self, Value) -> Label) -> Label {
        let nodes = self.nodes;
        let node = &nodes.list[&value];
        let labels: HashMap<Value, Label> =
            node.operands().map(|operand| (operand, self.of_operand(operand, other))).collect();
        let unsigned = self.label(key(node, |operand| labels[&operand].unsigned, false));
        let signed = self.label(key(node, |operand| labels[&operand].signed, true));
        Label { unsigned, signed }
    }
}

/// How a node is computed from operands with labels, with or without its signs.
fn key(node: &Node, label: impl Fn(Value) -> usize, has_signs: bool) -> Key {
    match node {
        Node::Sum(terms) => {
            let mut keys = Vec::with_capacity(terms.len());
            for term in terms {
                let mut factors: Vec<usize> =
                    term.factors.iter().map(|&factor| label(factor)).collect();
                factors.sort_unstable();
                let has_number = term.number.is_some();
                keys.push((has_number, has_signs && term.is_negative && !has_number, factors));
            }
            keys.sort();
            Key::Sum(keys)
        }
        Node::Call(name, operands) => {
            Key::Call(name, operands.iter().map(|&operand| label(operand)).collect())
        }
    }
}

/// A value that no block computes.
#[derive(Clone, Copy, Debug)]
pub enum Leaf {
    Number(f64),
    Argument(Argument),
    Sine,
    Cosine,
}

/// A block in the making.
struct Writing<'a> {
    nodes: &'a Nodes,
    subject: Subject,
    /// Labels of the values of the block.
    own: &'a BTreeMap<Value, Label>,
    /// The statement of each value that is written.
    places: HashMap<Value, usize>,
    /// The place of each value in the list of reads.
    read: HashMap<Value, usize>,
    block: Block,
}

impl Writing<'_> {
    /// Writes the statement of a value, after all that it reads.
    fn write(&mut self, value: Value, blocks: &mut Blocks) {
        let mut waiting = vec![value];
        while let Some(&next) = waiting.last() {
            if self.places.contains_key(&next) {
                waiting.pop();
                continue;
            }
            let node = self.sorted(&self.nodes.list[&next], blocks);
            let is_missing = |operand: &Value| {
                self.own.contains_key(operand) && !self.places.contains_key(operand)
            };
            let missing: Vec<Value> = node.operands().filter(is_missing).collect();
            if !missing.is_empty() {
                waiting.extend(missing.into_iter().rev());
                continue;
            }
            let statement = match node {
                Node::Sum(terms) => {
                    Statement::Sum(terms.into_iter().map(|term| self.term(term)).collect())
                }
                Node::Call(name, operands) => {
                    let operands = operands.into_iter().map(|operand| self.operand(operand));
                    Statement::Call(name, operands.collect())
                }
            };
            let place = self.block.shape.statements.len();
            self.block.shape.statements.push(statement);
            self.places.insert(next, place);
            self.block.values.push(next);
            if self.nodes.is_shared(next) || self.own.len() == 1 {
                self.block.shape.kept.push(place);
            }
        }
    }

    /// Returns a node with the terms of a sum, and their factors, in the order of their labels.
    fn sorted(&self, node: &Node, blocks: &mut Blocks) -> Node {
        let Node::Sum(terms) = node else { return node.clone() };
        let mut sorted = Vec::with_capacity(terms.len());
        for term in terms {
            let mut factors: Vec<(Label, Value)> =
                term.factors.iter().map(|&factor| (self.label(factor, blocks), factor)).collect();
            factors.sort_unstable();
            let (labels, factors): (Vec<_>, Vec<_>) = factors.into_iter().unzip();
            let unsigned: Vec<_> = labels.iter().map(|label: &Label| label.unsigned).collect();
            let has_number = term.number.is_some();
            let key = (has_number, unsigned, labels, term.is_negative && !has_number);
            sorted.push((key, NodeTerm { factors, ..*term }));
        }
        sorted.sort_by(|(a, _), (b, _)| a.cmp(b));
        Node::Sum(sorted.into_iter().map(|(_, term)| term).collect())
    }

    fn term(&mut self, term: NodeTerm) -> Term {
        let NodeTerm { is_negative, number, factors } = term;
        let mut factors: Vec<_> = factors.into_iter().map(|factor| self.operand(factor)).collect();
        let Some(number) = number else { return Term { is_negative, factors } };
        self.block.numbers.push(if is_negative { -number } else { number });
        factors.push(Operand::Number(self.block.numbers.len() - 1));
        Term { is_negative: false, factors }
    }

    fn label(&self, value: Value, blocks: &mut Blocks) -> Label {
        let own = self.own;
        blocks.of_operand(value, &|blocks, operand| match own.get(&operand) {
            Some(&label) => label,
            None => blocks.of_other(operand, self.subject),
        })
    }

    fn operand(&mut self, value: Value) -> Operand {
        if let Some(&place) = self.places.get(&value) {
            return Operand::Own(place);
        }
        if let Some(Leaf::Number(number)) = self.nodes.leaf(value) {
            self.block.numbers.push(number);
            return Operand::Number(self.block.numbers.len() - 1);
        }
        let block = &mut self.block;
        Operand::Read(*self.read.entry(value).or_insert_with(|| {
            block.reads.push(value);
            block.reads.len() - 1
        }))
    }
}
