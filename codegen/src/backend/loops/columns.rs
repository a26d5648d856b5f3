//! The records of a kernel as rows of cells: values that keep their distance in all records share a column.

use std::collections::HashMap;

use super::kernels::{Kernel, Record};
use super::{Number, Numbers, Table};
use crate::program::Value;

/// Cells of one column are no farther apart than this.
const FAR: usize = 1024;

/// Returns the table of a kernel whose records come in this order.
pub fn table(
    kernel: &Kernel,
    order: &[usize],
    cells: &HashMap<Value, usize>,
    numbers: &mut Numbers,
) -> Table {
    let records: Vec<&Record> = order.iter().map(|&place| &kernel.records[place]).collect();
    let (reads, writes) = (records[0].reads.len(), records[0].writes.len());
    let mut columns = Columns { is_shared: !kernel.shape.is_sine(), ..Columns::default() };
    for place in 0..reads {
        columns.add(records.iter().map(|record| cells[&record.reads[place]]).collect());
    }
    // A sine and its cosine have one cell after the other, and the cell of the sine alone is a column.
    for place in 0..if columns.is_shared { writes } else { 1 } {
        columns.add(records.iter().map(|record| cells[&record.writes[place]]).collect());
    }
    let (columns, places) = columns.finish();
    let forms = forms(&records);
    let is_listed = |form: &Number| matches!(form, Number::Listed(_));
    let row = |(row, record): (usize, &&Record)| {
        let mut cells: Vec<usize> = columns.iter().map(|column| column[row]).collect();
        let listed = forms.iter().zip(&record.numbers).filter(|(form, _)| is_listed(form));
        let listed: Vec<f64> = listed.map(|(_, &number)| number).collect();
        if !listed.is_empty() {
            cells.push(numbers.place(&listed));
        }
        cells
    };
    Table {
        shape: kernel.shape.clone(),
        reads: places[..reads].to_vec(),
        writes: places[reads..].to_vec(),
        records: records.iter().enumerate().map(row).collect(),
        numbers: forms,
    }
}

/// How a record finds each of its numbers.
fn forms(records: &[&Record]) -> Vec<Number> {
    let mut listed = 0;
    let form = |(place, &first): (usize, &f64)| {
        if records.iter().all(|record| record.numbers[place].to_bits() == first.to_bits()) {
            return Number::Same(first);
        }
        listed += 1;
        Number::Listed(listed - 1)
    };
    records[0].numbers.iter().enumerate().map(form).collect()
}

#[derive(Default)]
struct Columns {
    is_shared: bool,
    /// By column and record: the cell of the first value that was found there.
    list: Vec<Vec<usize>>,
    /// By value: its column, and its distance from the first one.
    places: Vec<(usize, isize)>,
}

impl Columns {
    /// Finds the column of a value, whose cells are given by record.
    fn add(&mut self, cells: Vec<usize>) {
        let distance = |column: &Vec<usize>| {
            let distance = cells[0] as isize - column[0] as isize;
            let keeps = |(&a, &b): (&usize, &usize)| a as isize - b as isize == distance;
            let is_near = self.is_shared && distance.unsigned_abs() <= FAR;
            (is_near && cells.iter().zip(column).all(keeps)).then_some(distance)
        };
        let columns = self.list.iter().enumerate();
        let known = columns.map(|(at, column)| (at, distance(column)));
        let known = known.into_iter().find_map(|(at, distance)| Some((at, distance?)));
        let place = known.unwrap_or((self.list.len(), 0));
        self.places.push(place);
        if place.0 == self.list.len() {
            self.list.push(cells);
        }
    }

    /// The columns, each the cell of its nearest value, and the column and the distance of each value.
    fn finish(mut self) -> (Vec<Vec<usize>>, Vec<(usize, usize)>) {
        let nearest = |column: usize| {
            let of_column = self.places.iter().filter(|(at, _)| *at == column);
            of_column.map(|(_, distance)| *distance).min().unwrap_or(0)
        };
        let nearest: Vec<isize> = (0..self.list.len()).map(nearest).collect();
        for (column, nearest) in self.list.iter_mut().zip(&nearest) {
            column.iter_mut().for_each(|cell| *cell = cell.saturating_add_signed(*nearest));
        }
        let place = |(column, distance): (usize, isize)| {
            (column, (distance - nearest[column]).unsigned_abs())
        };
        (self.list, self.places.into_iter().map(place).collect())
    }
}
