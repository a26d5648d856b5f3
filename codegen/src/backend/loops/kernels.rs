//! Blocks of one shape as records of one kernel.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::blocks::{Block, Blocks, Operand, Shape, Statement};
use super::nodes::Nodes;
use crate::program::{Function, Value};

/// Blocks of one shape that are worth a kernel of their own. Others are taken apart into statements.
const ENOUGH: usize = 4;

/// A kernel: what a loop does for each of its records.
#[derive(Clone, Debug)]
pub struct Kernel {
    pub shape: Shape,
    pub records: Vec<Record>,
}

/// A block of a kernel.
#[derive(Clone, Debug)]
pub struct Record {
    pub reads: Vec<Value>,
    pub numbers: Vec<f64>,
    pub writes: Vec<Value>,
}

/// Returns the kernels of a function.
pub fn kernels(function: &Function) -> Vec<Kernel> {
    let mut nodes = Nodes::of(function);
    let mut groups: BTreeMap<usize, Vec<Value>> = BTreeMap::new();
    for &value in nodes.list.keys() {
        groups.entry(nodes.group(value)).or_default().push(value);
    }
    let mut found = Kernels::default();
    for &[angle, sine, cosine] in &nodes.angles {
        let statement = Statement::SineCosine(Operand::Read(0));
        let shape = Shape { statements: vec![statement], kept: vec![0] };
        let values = vec![sine, cosine];
        found.add(Block { shape, reads: vec![angle], numbers: Vec::new(), values });
    }
    let whole = frequent(&nodes, &groups);
    let apart = || whole.iter().zip(groups.values()).filter(|(block, _)| block.is_none());
    apart().flat_map(|(_, members)| members).for_each(|&value| nodes.keep(value));
    let parts: Vec<Value> = apart().flat_map(|(_, members)| members.clone()).collect();
    let parts: Vec<Value> = parts.into_iter().flat_map(|value| nodes.cut(value)).collect();
    whole.into_iter().flatten().for_each(|block| found.add(block));
    let mut blocks = Blocks::of(&nodes);
    parts.into_iter().for_each(|value| found.add(blocks.block(&[value])));
    found.list.into_iter().map(kernel).collect()
}

/// The blocks of groups, where there are [`ENOUGH`] of their shape.
fn frequent(nodes: &Nodes, groups: &BTreeMap<usize, Vec<Value>>) -> Vec<Option<Block>> {
    let mut blocks = Blocks::of(nodes);
    let block = |members: &Vec<Value>| (members.len() > 1).then(|| blocks.block(members));
    let whole: Vec<Option<Block>> = groups.values().map(block).collect();
    let mut counts: HashMap<Vec<Statement>, usize> = HashMap::new();
    for block in whole.iter().flatten() {
        *counts.entry(block.shape.unsigned()).or_insert(0) += 1;
    }
    let is_frequent = |block: &Block| counts[&block.shape.unsigned()] >= ENOUGH;
    whole.into_iter().map(|block| block.filter(is_frequent)).collect()
}

/// Blocks whose shapes differ in signs and in what is kept alone.
type Alike = Vec<Block>;

/// The kernel of blocks. It keeps what any of them does, and the sign of a term that is subtracted in some of them is a number,
/// 1 or -1.
fn kernel(alike: Alike) -> Kernel {
    let mut shape = alike[0].shape.clone();
    let mut records: Vec<Record> = Vec::with_capacity(alike.len());
    let mut signs: Vec<Vec<bool>> = Vec::with_capacity(alike.len());
    let kept: BTreeSet<usize> = alike.iter().flat_map(|block| &block.shape.kept).copied().collect();
    shape.kept = kept.into_iter().collect();
    let is_sine = shape.is_sine();
    for Block { shape: own, reads, numbers, values } in alike {
        signs.push(own.terms().map(|term| term.is_negative).collect());
        let writes = match is_sine {
            true => values,
            false => shape.kept.iter().map(|&place| values[place]).collect(),
        };
        records.push(Record { reads, numbers, writes });
    }
    for (place, term) in shape.terms_mut().enumerate() {
        if signs.iter().all(|signs| signs[place] == term.is_negative) {
            continue;
        }
        term.is_negative = false;
        term.factors.push(Operand::Number(records[0].numbers.len()));
        for (record, signs) in records.iter_mut().zip(&signs) {
            record.numbers.push(if signs[place] { -1.0 } else { 1.0 });
        }
    }
    Kernel { shape, records }
}

/// Blocks in the order in which their forms were found.
#[derive(Default)]
struct Kernels {
    list: Vec<Alike>,
    places: HashMap<Vec<Statement>, usize>,
}

impl Kernels {
    fn add(&mut self, block: Block) {
        let place = *self.places.entry(block.shape.unsigned()).or_insert_with(|| {
            self.list.push(Vec::new());
            self.list.len() - 1
        });
        self.list[place].push(block);
    }
}
