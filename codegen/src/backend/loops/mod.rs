//! Functions as loops over equal parts: the second form of functions that are too long for straight-line code.
//!
//! A sheet does the same for every plate and every vertex. [`blocks`] writes each section of a function in an order that depends
//! on its form alone; blocks of one shape are the records of one [kernel](kernels), a loop that holds their values in registers. A
//! record is a few numbers: where the loop finds what it reads, and where it puts what it computes.

mod blocks;
mod cells;
mod groups;
mod kernels;
mod nodes;
mod order;

use std::collections::HashMap;

pub use blocks::{Operand, Shape, Statement, Term};
use kernels::Kernel;

use crate::program::{Argument, Function, Interface, Op, Value};

/// Cells of one column are no farther apart than this.
const FAR: usize = 1024;

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
                .map(|(kernel, order)| table(kernel, &order, &cells.of, numbers))
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

/// The records of a kernel. Cells that keep their distance in all records share a column.
fn table(
    kernel: &Kernel,
    order: &[usize],
    cells: &HashMap<Value, usize>,
    numbers: &mut Numbers,
) -> Table {
    let records = || order.iter().map(|&place| &kernel.records[place]);
    let model = &kernel.records[order[0]];
    let is_sine = kernel.shape.is_sine();
    let mut columns: Vec<Vec<usize>> = Vec::new();
    let mut least: Vec<usize> = Vec::new();
    let mut found: Vec<(usize, isize)> = Vec::new();
    let (reads, writes) = (model.reads.len(), model.writes.len());
    for place in 0..reads + writes {
        let column: Vec<usize> = records()
            .map(|record| match place.checked_sub(reads) {
                None => cells[&record.reads[place]],
                Some(place) => cells[&record.writes[place]],
            })
            .collect();
        let distance = |other: &Vec<usize>| {
            let distance = column[0] as isize - other[0] as isize;
            let keeps = |(&a, &b): (&usize, &usize)| a as isize - b as isize == distance;
            let is_near = distance.unsigned_abs() <= FAR && (!is_sine || place > reads);
            (is_near && column.iter().zip(other).all(keeps)).then_some(distance)
        };
        let shared =
            columns.iter().enumerate().find_map(|(at, other)| Some((at, distance(other)?)));
        found.push(shared.unwrap_or_else(|| {
            columns.push(column.clone());
            (columns.len() - 1, 0)
        }));
    }
    for column in 0..columns.len() {
        let distances = found.iter().filter(|(at, _)| *at == column).map(|(_, distance)| *distance);
        let nearest = distances.min().unwrap_or(0);
        least.push((-nearest) as usize);
        for cell in &mut columns[column] {
            *cell = (*cell as isize + nearest) as usize;
        }
    }
    let found: Vec<(usize, usize)> = found
        .into_iter()
        .map(|(column, distance)| (column, (distance + least[column] as isize) as usize))
        .collect();
    let mut listed = 0;
    let numbers_of_model = model.numbers.iter().enumerate();
    let forms: Vec<Number> = numbers_of_model
        .map(|(place, &first)| {
            if records().all(|record| record.numbers[place].to_bits() == first.to_bits()) {
                return Number::Same(first);
            }
            listed += 1;
            Number::Listed(listed - 1)
        })
        .collect();
    let is_listed = |form: &Number| matches!(form, Number::Listed(_));
    let rows = records().enumerate().map(|(row, record)| {
        let mut cells: Vec<usize> = columns.iter().map(|column| column[row]).collect();
        if listed > 0 {
            let of_record = forms.iter().zip(&record.numbers);
            let of_record: Vec<f64> =
                of_record.filter(|(form, _)| is_listed(form)).map(|(_, number)| *number).collect();
            cells.push(numbers.place(&of_record));
        }
        cells
    });
    let records = rows.collect();
    Table {
        shape: kernel.shape.clone(),
        reads: found[..reads].to_vec(),
        writes: found[reads..].to_vec(),
        numbers: forms,
        records,
    }
}
