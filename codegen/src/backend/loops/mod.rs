//! Functions as loops over equal parts: the form of an acceleration and a projection that would outgrow the caches as straight-line
//! code.
//!
//! A sheet does the same for every plate and every vertex. What does not differ but in values is a *kernel*, a loop over *records*: a
//! record is a few numbers that say where the loop finds what it reads, and where it puts what it computes. In between, values are
//! in registers.
//!
//! ```text
//! function -> groups   sections of a body or loop, joined where nothing else needs what one hands to the other
//!          -> blocks   groups as statements, in an order that depends on their form alone
//!          -> kernels  blocks of one form; rare ones are taken apart into statements, which are blocks again
//!          -> runs     records of one kernel, one after the other, in an order in which all is known that they read
//!          -> cells    the places of values
//! ```

mod blocks;
mod cells;
mod columns;
mod groups;
mod kernels;
mod nodes;
mod order;

use std::collections::HashMap;

pub use blocks::{Operand, Shape, Statement, Term};

use crate::program::{Argument, Function, Interface, Op, Value};

/// A function as loops.
#[derive(Clone, Debug)]
pub struct Loops {
    /// The arguments that it reads, and the cell at which each begins.
    pub arguments: Vec<(Argument, usize)>,
    /// The kernels.
    pub kernels: Vec<Table>,
    /// The kernel of each run, and how many of its records follow.
    pub runs: Vec<(usize, usize)>,
    /// Of each output the entries that are not zero: index and cell.
    pub outputs: Vec<Vec<(usize, usize)>>,
    /// How many cells there are.
    pub cells: usize,
}

/// A kernel and its records, in the order of the runs.
#[derive(Clone, Debug)]
pub struct Table {
    /// What the loop does for each record.
    pub shape: Shape,
    /// The column and the distance from it at which a record finds what it reads, by place. Angles, sines and cosines have columns of
    /// their own.
    pub reads: Vec<(usize, usize)>,
    /// The column and the distance of what it computes, by place.
    pub writes: Vec<(usize, usize)>,
    /// The numbers, by place.
    pub numbers: Vec<Number>,
    /// By record: a cell for each column, last the place in the list of numbers if there is one.
    pub records: Vec<Vec<usize>>,
}

/// A number of a kernel.
#[derive(Clone, Copy, Debug)]
pub enum Number {
    /// The same for all records.
    Same(f64),
    /// At this distance from the record's place in the list of numbers.
    Listed(usize),
}

/// The numbers of the model that the records of a module read: those of each record follow one another.
#[derive(Clone, Debug, Default)]
pub struct Numbers {
    /// In the order of their first use.
    pub list: Vec<f64>,
    places: HashMap<Vec<u64>, usize>,
}

impl Numbers {
    /// The place of several numbers that follow one another.
    fn place(&mut self, numbers: &[f64]) -> usize {
        let bits = numbers.iter().map(|number| number.to_bits()).collect();
        *self.places.entry(bits).or_insert_with(|| {
            self.list.extend(numbers);
            self.list.len() - numbers.len()
        })
    }
}

impl Loops {
    /// Returns the loops of a function.
    pub fn of(function: &Function, interface: &Interface, numbers: &mut Numbers) -> Self {
        let kernels = kernels::kernels(function);
        let runs = order::runs(&kernels);
        let (arguments, given, first) = arguments(function, interface);
        let entries = function.outputs.iter().map(|output| {
            let entries = output.entries.iter().enumerate();
            entries.filter(|(_, entry)| !is_zero(function, **entry)).collect::<Vec<_>>()
        });
        let entries: Vec<Vec<(usize, &Value)>> = entries.collect();
        let returned: Vec<Value> = entries.iter().flatten().map(|&(_, &entry)| entry).collect();
        let cells = cells::cells(&kernels, &runs, given, first, &returned);
        let mut order: Vec<Vec<usize>> = vec![Vec::new(); kernels.len()];
        for run in &runs {
            order[run.kernel].extend(&run.records);
        }
        let kernels = kernels.iter().zip(order);
        Self {
            arguments,
            kernels: kernels
                .map(|(kernel, order)| columns::table(kernel, &order, &cells.of, numbers))
                .collect(),
            runs: runs.iter().map(|run| (run.kernel, run.records.len())).collect(),
            outputs: entries
                .into_iter()
                .map(|list| {
                    list.into_iter().map(|(index, entry)| (index, cells.of[entry])).collect()
                })
                .collect(),
            cells: cells.count,
        }
    }

    /// Returns a bound on what records, runs and outputs name: cells, records, entries of outputs.
    pub fn longest(&self) -> usize {
        let records = self.kernels.iter().map(|table| table.records.len());
        let entries = self.outputs.iter().flatten().map(|(index, _)| index + 1);
        records.chain(entries).chain([self.cells, self.kernels.len()]).max().unwrap_or(0)
    }
}

fn is_zero(function: &Function, value: Value) -> bool {
    matches!(function.instructions[value.index()].op, Op::Const(number) if number == 0.0)
}

/// The arguments that a function reads, the cells of what it reads of them, and the first cell after them.
fn arguments(
    function: &Function,
    interface: &Interface,
) -> (Vec<(Argument, usize)>, HashMap<Value, usize>, usize) {
    let (mut arguments, mut cells, mut next) = (Vec::new(), HashMap::new(), 0);
    for (index, instruction) in function.instructions.iter().enumerate() {
        let Op::Load(slot) = instruction.op else { continue };
        let (argument, place) = slot.place();
        let known = arguments.iter().find(|(other, _)| *other == argument);
        let first = match known {
            Some(&(_, first)) => first,
            None => {
                arguments.push((argument, next));
                let first = next;
                next += argument.array().shape.length(interface);
                first
            }
        };
        cells.insert(Value(index), first + place);
    }
    (arguments, cells, next)
}
