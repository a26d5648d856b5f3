//! Functions of long modules as tables: rows as arrays, the cases of the loop that evaluates them, and the calls.
//!
//! The rows are those of the Rust module. C reads no text at compile time, so that they are written as numbers.

use std::collections::BTreeSet;

use lamc_tables::{Words, kind};
use serde::Serialize;

use super::Real;
use super::body::{call, constant};
use crate::backend::tables::{Numbers, Table};
use crate::program::{Argument, Function, Interface, Shape};

/// Characters of rows in one line.
const LINE: usize = 120;

/// Mnemonics of the kinds of rows that call functions.
const FUNCTIONS: [(usize, &str); 11] = [
    (kind::MIN, "min"),
    (kind::MAX, "max"),
    (kind::POW, "pow"),
    (kind::ATAN2, "atan2"),
    (kind::SQRT, "sqrt"),
    (kind::TAN, "tan"),
    (kind::EXP, "exp"),
    (kind::ABS, "abs"),
    (kind::TANH, "tanh"),
    (kind::LN, "ln"),
    (kind::STEP, "step"),
];

/// A kind of rows whose results are calls of a function.
#[derive(Serialize)]
pub struct Case {
    kind: usize,
    /// The result of `row`.
    value: String,
}

/// The rows of a function.
#[derive(Serialize)]
struct Rows {
    name: String,
    lines: Vec<String>,
}

/// The numbers of the kinds of rows whose loops are in the template.
#[derive(Serialize)]
struct Kinds {
    number: usize,
    argument: usize,
    sine_cosine: usize,
    products: usize,
    most_products: usize,
    quotient: usize,
    output: usize,
}

impl Default for Kinds {
    fn default() -> Self {
        Self {
            number: kind::NUMBER,
            argument: kind::ARGUMENT,
            sine_cosine: kind::SINE_COSINE,
            products: kind::PRODUCTS,
            most_products: kind::MOST_PRODUCTS,
            quotient: kind::DIV,
            output: kind::OUTPUT,
        }
    }
}

/// The tables of a module.
#[derive(Default, Serialize)]
pub struct Tables {
    rows: Vec<Rows>,
    /// Cells for the longest.
    cells: usize,
    /// Numbers of the model.
    numbers: Vec<String>,
    cases: Vec<Case>,
    /// The functions for sine and cosine, if angles have them.
    sines: Vec<String>,
    kinds: Kinds,
    #[serde(skip)]
    found: Numbers,
    #[serde(skip)]
    used: BTreeSet<usize>,
}

impl Tables {
    /// Adds the table of a function and returns the statements that evaluate it. `parameters` and `inputs` are the
    /// fields of the module's types.
    pub fn add(
        &mut self,
        function: &Function,
        interface: &Interface,
        [parameters, inputs]: [&[String]; 2],
    ) -> Vec<String> {
        let table = Table::of(function, &mut self.found);
        self.cells = self.cells.max(table.words.cells);
        let name = format!("{}_rows", function.kind.name());
        let lines = self.lines(&table.words);
        self.rows.push(Rows { name: name.clone(), lines });

        let mut statements = Vec::new();
        let mut copied = |argument: Argument, fields: &[String]| {
            let (name, count) = (argument.name(), fields.len());
            if count == 0 {
                return "0".to_owned();
            }
            let values: Vec<_> = fields.iter().map(|field| format!("{name}->{field}")).collect();
            let list = values.join(", ");
            statements.push(format!("const real {name}_values[{count}] = {{ {list} }};"));
            format!("{name}_values")
        };
        let arguments = function.kind.inputs(interface).map(|argument| match argument {
            Argument::Parameters => copied(argument, parameters),
            Argument::Inputs => copied(argument, inputs),
            Argument::Drawing => {
                format!("{}->{}", Argument::Parameters.name(), argument.name())
            }
            _ if argument.array().shape == Shape::SCALAR => format!("&{}", argument.name()),
            _ => argument.name().to_owned(),
        });
        let arguments: Vec<_> = arguments.collect();
        let signature = function.kind.signature();
        let outputs = signature.outputs.iter().zip(signature.lengths(interface));
        let outputs = outputs.map(|(output, length)| match length {
            0 => "{ 0, 0 }".to_owned(),
            _ => format!("{{ {}, {length} }}", output.name),
        });
        let outputs: Vec<_> = outputs.collect();
        let (arguments, outputs) = (arguments.join(", "), outputs.join(", "));
        statements.push(format!("const real *const arguments[] = {{ {arguments} }};"));
        statements.push(format!("const struct results results[] = {{ {outputs} }};"));
        let words: usize = table.words.runs.iter().map(|run| 2 + run.words.len()).sum();
        let count = signature.outputs.len();
        statements.push(format!("evaluate_table({name}, {words}, arguments, results, {count});"));
        statements
    }

    /// The words of a table as pairs of numbers, and the kinds of its runs.
    fn lines(&mut self, words: &Words) -> Vec<String> {
        let (mut lines, mut line) = (Vec::new(), String::new());
        for run in &words.runs {
            self.used.insert(run.kind);
            let (kind, count) = (run.kind, run.words.len());
            line.push_str(&format!("{kind},0,{},{},", count & 0xffff, count >> 16));
            for [low, high] in &run.words {
                line.push_str(&format!("{low},{high},"));
                if line.len() > LINE {
                    lines.push(std::mem::take(&mut line));
                }
            }
        }
        lines.extend((!line.is_empty()).then_some(line));
        lines
    }

    /// Completes what all tables share.
    pub fn finish(&mut self, real: Real) {
        self.numbers = self.found.list.iter().map(|&number| constant(real, number)).collect();
        let used = FUNCTIONS.into_iter().filter(|(kind, _)| self.used.contains(kind));
        let case = |(kind, mnemonic)| {
            let operands = ["cells[row[0]]", "cells[row[1]]"];
            let operands = &operands[..kind::fields(kind)];
            Case { kind, value: call(real, mnemonic, operands) }
        };
        self.cases = used.map(case).collect();
        if self.used.contains(&kind::SINE_COSINE) {
            self.sines = ["sin", "cos"].map(|name| format!("{name}{}", real.suffix())).into();
        }
    }
}
