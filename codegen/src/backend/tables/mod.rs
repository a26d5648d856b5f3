//! Functions as tables, for the loops of [`lamc_runtime::table`]: the second form of functions that are too long for
//! straight-line code.
//!
//! Operations become rows (`rows`); the crate `lamc_tables` puts these in order, and writes them as text.

mod rows;

use std::collections::HashMap;

use lamc_tables::kind::FIRST_NUMBERS;
use lamc_tables::{Rows, Words, words};

use crate::program::Function;

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
    pub fn place(&mut self, number: f64) -> usize {
        *self.places.entry(number.to_bits()).or_insert_with(|| {
            self.list.push(number);
            self.list.len() - 1
        })
    }
}

/// A function as a table.
#[derive(Clone, Debug)]
pub struct Table {
    /// Its rows.
    pub rows: Rows,
    /// What the runtime evaluates.
    pub words: Words,
}

impl Table {
    /// Returns the table of a function. Its arguments and outputs are those of the function's signature, in order.
    pub fn of(function: &Function, numbers: &mut Numbers) -> Self {
        let rows = rows::rows(function, numbers);
        let words = words(&rows);
        Self { rows, words }
    }
}
