//! Functions as tables, for the loops of [`lamc_runtime::table`]: the second form of functions that are too long for
//! straight-line code.
//!
//! Operations become rows (`rows`), rows of one kind at one distance from the results become groups (`order`),
//! groups become text (`text`).

mod order;
mod rows;
mod text;

use std::collections::HashMap;

use lamc_runtime::table::{FIRST_NUMBERS, read_table};
pub use lamc_runtime::table::{TableSize, evaluate};

use crate::program::Function;
use rows::Rows;

/// The numbers of the model that the tables of a module read.
#[derive(Clone, Debug)]
pub struct Numbers {
    /// In the order of their first use; the first three are those of the runtime.
    pub list: Vec<f64>,
    places: HashMap<u64, usize>,
}

impl Default for Numbers {
    fn default() -> Self {
        let mut numbers = Self { list: Vec::new(), places: HashMap::new() };
        FIRST_NUMBERS.into_iter().for_each(|number| {
            numbers.place(number);
        });
        numbers
    }
}

impl Numbers {
    /// The index of a number, which is added if it is new.
    fn place(&mut self, number: f64) -> usize {
        *self.places.entry(number.to_bits()).or_insert_with(|| {
            self.list.push(number);
            self.list.len() - 1
        })
    }
}

/// A function as a table.
#[derive(Clone, Debug)]
pub struct Table {
    /// Its text, for [`lamc_runtime::table::Table::new`].
    pub text: String,
    /// Its size.
    pub size: TableSize,
    /// What the runtime evaluates.
    pub words: Vec<u64>,
}

impl Table {
    /// Returns the table of a function. Its arguments and outputs are those of the function's signature, in order.
    pub fn of(function: &Function, numbers: &mut Numbers) -> Self {
        let rows = Rows::of(function, numbers);
        let groups = order::groups(&rows);
        let text = text::text(&groups);
        // Runs, rows, and a second word for each cosine.
        let most = groups.iter().map(|group| 1 + 2 * group.rows.len()).sum();
        let (mut words, mut scratch) = (vec![0; most], vec![[0; 3]; most]);
        let size = read_table(text.as_bytes(), &mut words, &mut scratch);
        words.truncate(size.words);
        Self { text, size, words }
    }

    /// The number of cells with which the runtime evaluates the table.
    pub fn cells(&self) -> usize {
        self.size.cells.next_power_of_two()
    }
}
