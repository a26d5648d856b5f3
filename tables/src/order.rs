//! The steps in which a table is evaluated, and their order.
//!
//! A step is a row, or several: products that are added up, where nothing else uses the sums in between, are one step. It reads
//! and writes the sum once, which is what evaluation spends most of its time on.
//!
//! Steps farthest from the results come first, so that neighbours do not wait for each other and few values are kept. Steps
//! of one kind go on as long as there are some that are not much nearer to the results than others ([`WINDOW`]): whatever
//! evaluates the table branches where the kind changes. When there are no products, everything else follows that can be computed.

use std::collections::{BTreeMap, BTreeSet};

use crate::kind::{self, MOST_PRODUCTS, PRODUCTS, operands};
use crate::rows::{COSINE, Row, Rows};

/// Steps of one kind are taken together if their distances from the results differ by no more than this.
const WINDOW: usize = 32;

/// The same kind goes on if it has so many steps, the first of which is nearly as far from the results as any.
const ENOUGH: usize = 16;

/// What is evaluated at once. Values are named by the rows that compute them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// A kind of words.
    pub kind: usize,
    /// The values that it reads: of a sum of products c, a, b, a, b, ...
    pub reads: Vec<usize>,
    /// The values that it computes.
    pub computes: Vec<usize>,
    /// Fields that are no values.
    pub fields: [usize; 2],
}

/// Returns the steps of a function in groups of one kind, in which no step reads what another one computes.
pub fn groups(rows: &Rows) -> Vec<Vec<Step>> {
    let steps = steps(rows);
    let mut order = Order::of(rows.list.len(), &steps);
    for source in [kind::NUMBER, kind::ARGUMENT] {
        let mut list: Vec<usize> = (0..steps.len()).filter(|&i| steps[i].kind == source).collect();
        list.sort_by_key(|&index| steps[index].fields);
        order.place(list);
    }
    while let Some(next) = order.next() {
        order.place(next);
    }
    let of = |indices: Vec<usize>| indices.into_iter().map(|index| steps[index].clone()).collect();
    let groups = order.groups.into_iter().filter(|group| !group.is_empty());
    let outputs = rows.outputs.iter().enumerate().filter(|(_, entries)| !entries.is_empty());
    let outputs = outputs.map(|(output, entries)| {
        let step = |&(row, index): &(usize, usize)| Step {
            kind: kind::OUTPUT + output,
            reads: vec![row],
            computes: Vec::new(),
            fields: [index, 0],
        };
        entries.iter().map(step).collect()
    });
    groups.map(of).chain(outputs).collect()
}

fn is_product(row: &Row) -> bool {
    (kind::MUL..=kind::MUL_ADD).contains(&row.kind)
}

/// a, b and c of a row that is a b + c: sums multiply by 1, differences by -1, products add -0.
fn product(row: &Row) -> [usize; 3] {
    const ONE: usize = 0;
    const MINUS_ONE: usize = 1;
    const MINUS_ZERO: usize = 2;
    let [x, y, z] = row.fields;
    match row.kind {
        kind::MUL => [x, y, MINUS_ZERO],
        kind::ADD => [x, ONE, y],
        kind::SUB => [y, MINUS_ONE, x],
        kind::NEG => [x, MINUS_ONE, MINUS_ZERO],
        _ => [x, y, z],
    }
}

/// The steps of all rows, in the order of the rows.
fn steps(rows: &Rows) -> Vec<Step> {
    let list = &rows.list;
    let mut uses = vec![0; list.len()];
    for row in list.iter().filter(|row| row.kind != COSINE) {
        row.fields[..operands(row.kind)].iter().for_each(|&operand| uses[operand] += 1);
    }
    rows.outputs.iter().flatten().for_each(|&(row, _)| uses[row] += 1);
    // Steps of products that may take part in another one, by row.
    let mut open: Vec<Option<Vec<usize>>> = vec![None; list.len()];
    let mut steps: Vec<Option<Step>> = vec![None; list.len()];
    for (index, row) in list.iter().enumerate() {
        if row.kind == COSINE {
            continue;
        }
        if is_product(row) {
            let [mut a, b, mut c] = product(row);
            let is_open = |value: usize| {
                let reads = open[value].as_ref().filter(|_| uses[value] == 1);
                reads.is_some_and(|reads| reads.len() < 2 * MOST_PRODUCTS + 1)
            };
            // Both orders of a sum give the same bits.
            if row.kind == kind::ADD && !is_open(c) && is_open(a) {
                (a, c) = (c, a);
            }
            let mut reads = match is_open(c) && a != c {
                true => {
                    steps[c] = None;
                    open[c].take().unwrap_or_default()
                }
                false => vec![c],
            };
            reads.extend([a, b]);
            open[index] = Some(reads);
            let step = Step { kind: 0, reads: Vec::new(), computes: vec![index], fields: [0; 2] };
            steps[index] = Some(step);
            continue;
        }
        let count = operands(row.kind);
        let is_sine = row.kind == kind::SINE_COSINE;
        steps[index] = Some(Step {
            kind: row.kind,
            reads: row.fields[..count].to_vec(),
            computes: if is_sine { vec![index, index + 1] } else { vec![index] },
            fields: if count == 0 { [row.fields[0], row.fields[1]] } else { [0; 2] },
        });
    }
    for (step, reads) in steps.iter_mut().zip(open) {
        if let (Some(step), Some(reads)) = (step, reads) {
            step.kind = PRODUCTS + reads.len() / 2 - 1;
            step.reads = reads;
        }
    }
    steps.into_iter().flatten().collect()
}

struct Order<'a> {
    steps: &'a [Step],
    /// By value: the steps that read it.
    users: Vec<Vec<usize>>,
    /// By step: how many values that it reads are not computed.
    missing: Vec<usize>,
    /// By step: length of the longest chain of users.
    heights: Vec<usize>,
    /// Steps of products that are ready, by their number of products and distance from the results.
    products: [BTreeSet<(usize, usize)>; MOST_PRODUCTS],
    /// Other steps that are ready, by kind.
    others: BTreeMap<usize, Vec<usize>>,
    /// The number of products of the last group, less one.
    last: Option<usize>,
    groups: Vec<Vec<usize>>,
}

impl<'a> Order<'a> {
    fn of(values: usize, steps: &'a [Step]) -> Self {
        let mut users = vec![Vec::new(); values];
        for (index, step) in steps.iter().enumerate() {
            step.reads.iter().for_each(|&value| users[value].push(index));
        }
        let mut heights = vec![0; steps.len()];
        for index in (0..steps.len()).rev() {
            let above = steps[index].computes.iter().flat_map(|&value| &users[value]);
            heights[index] = above.map(|&user| heights[user] + 1).max().unwrap_or(0);
        }
        Self {
            steps,
            users,
            missing: steps.iter().map(|step| step.reads.len()).collect(),
            heights,
            products: Default::default(),
            others: BTreeMap::new(),
            last: None,
            groups: Vec::new(),
        }
    }

    /// The steps that come next.
    fn next(&mut self) -> Option<Vec<usize>> {
        let farthest = |ready: &BTreeSet<(usize, usize)>| ready.last().map(|step| step.0);
        let lengths = self.products.iter().enumerate();
        let ready = lengths.filter_map(|(length, ready)| Some((farthest(ready)?, length)));
        let Some((height, length)) = ready.max() else {
            self.last = None;
            return self.others.pop_first().map(|(_, steps)| steps);
        };
        let goes_on = self.last.filter(|&last| {
            let ready = &self.products[last];
            ready.len() >= ENOUGH && farthest(ready).is_some_and(|it| it + WINDOW / 4 >= height)
        });
        let length = goes_on.unwrap_or(length);
        self.last = Some(length);
        let nearest = (height.saturating_sub(WINDOW), 0);
        let taken = self.products[length].split_off(&nearest);
        Some(taken.into_iter().map(|(_, step)| step).collect())
    }

    fn place(&mut self, group: Vec<usize>) {
        for &index in &group {
            for &value in &self.steps[index].computes {
                for at in 0..self.users[value].len() {
                    self.give(self.users[value][at]);
                }
            }
        }
        self.groups.push(group);
    }

    /// A step is given one of the values that it reads.
    fn give(&mut self, index: usize) {
        self.missing[index] -= 1;
        if self.missing[index] > 0 {
            return;
        }
        let kind = self.steps[index].kind;
        match kind::sum(kind) {
            Some(length) => {
                self.products[length].insert((self.heights[index], index));
            }
            None => self.others.entry(kind).or_default().push(index),
        }
    }
}
