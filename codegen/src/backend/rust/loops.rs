//! Functions of long modules as loops: a kernel for each shape, its records, and the runs that call them.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::body::Bodies;
use super::items::number;
use crate::backend::literal::digits;
use crate::backend::loops::{Loops, Number, Operand, Statement, Table, Term};
use crate::program::Function;

/// Characters of data in one line.
const LINE: usize = 120;

/// The mnemonic of divisions.
const DIVISION: &str = "div";

/// No list that records name places of may be longer: they have two bytes for each.
const MOST: usize = u16::MAX as usize;

impl Bodies<'_> {
    /// Returns the call that evaluates a function as loops, which become items of the module `loops`; a table for a function that is
    /// too long for that.
    pub(super) fn write_loops(&mut self, function: &Function) -> TokenStream {
        let mut numbers = self.loop_numbers.clone();
        let loops = Loops::of(function, &self.program.interface, &mut numbers);
        if loops.longest().max(numbers.list.len()) > MOST {
            return self.write_table(function);
        }
        self.loop_numbers = numbers;
        let name = function.kind.name();
        let arguments: Vec<_> =
            loops.arguments.iter().map(|&(argument, _)| self.array(argument)).collect();
        let outputs = function.outputs.iter().map(|output| format_ident!("{}", output.name));
        let (item, scalar) = (format_ident!("{name}"), &self.syntax.scalar);
        self.loops.push((name.to_owned(), loops));
        quote! {
            loops::#item::<#scalar>([#(#arguments),*], [#(#outputs),*]);
        }
    }

    /// Returns the module of the loops, if there are any.
    pub(super) fn loops(&mut self) -> TokenStream {
        if self.loops.is_empty() {
            return TokenStream::new();
        }
        let mut lines = vec![
            "    use ::lamc_runtime::Arithmetic;".to_owned(),
            "    use ::lamc_runtime::loops::{Cells, entries, numbers, records, run};".to_owned(),
        ];
        let numbers = std::mem::take(&mut self.loop_numbers).list;
        let places: Vec<usize> = numbers.iter().map(|&number| self.numbers.place(number)).collect();
        let declaration = format!("static NUMBERS: [f64; {}]", places.len());
        data(&mut lines, &declaration, "numbers(&super::tables::NUMBERS, ", places);
        for (name, loops) in std::mem::take(&mut self.loops) {
            write(&name, &loops, &mut lines);
        }
        self.texts.push(lines.join("\n"));
        let index = number(self.texts.len() - 1);
        quote! {
            /// Functions as loops over records.
            #[rustfmt::skip]
            #[allow(
                clippy::all, clippy::approx_constant, clippy::excessive_precision,
                reason = "numbers of the drawing; statements of one form"
            )]
            mod loops {
                __body!(#index);
            }
        }
    }
}

/// Writes the items of a function.
fn write(name: &str, loops: &Loops, lines: &mut Vec<String>) {
    let upper = name.to_uppercase();
    let cells = format!("Cells<S, {}>", loops.cells);
    let mut arms = Vec::new();
    for (kernel, table) in loops.kernels.iter().enumerate() {
        let columns = table.records.first().map_or(0, Vec::len);
        let (list, item) = (format!("{upper}_{kernel}"), format!("{name}_{kernel}"));
        write_records(lines, &list, &table.records);
        let records = format!("run(&{list}, first, count)");
        if table.shape.is_sine() {
            arms.push(format!("{kernel} => cells.sines({records}),"));
            continue;
        }
        lines.push("    #[inline(never)]".to_owned());
        lines.push(format!(
            "    fn {item}<S: Arithmetic>(cells: &mut {cells}, records: &[[u16; {columns}]]) {{"
        ));
        lines.push("        for r in records {".to_owned());
        Body { table }.write(lines);
        lines.push("        }\n    }".to_owned());
        arms.push(format!("{kernel} => {item}(cells, {records}),"));
    }
    let mut done = vec![0; loops.kernels.len()];
    let run = |&(kernel, count): &(usize, usize)| {
        done[kernel] += count;
        vec![kernel, done[kernel] - count, count]
    };
    write_records(lines, &format!("{upper}_RUNS"), &loops.runs.iter().map(run).collect::<Vec<_>>());
    for (output, entries) in loops.outputs.iter().enumerate() {
        let entries: Vec<_> = entries.iter().map(|&(index, cell)| vec![index, cell]).collect();
        write_records(lines, &format!("{upper}_OUTPUT_{output}"), &entries);
    }
    let [arguments, outputs] = [loops.arguments.len(), loops.outputs.len()];
    lines.push(format!(
        "    pub fn {name}<S: Arithmetic>(arguments: [&[S]; {arguments}], outputs: [&mut [S]; {outputs}]) {{"
    ));
    lines.push(format!("        let cells: &mut {cells} = &mut Cells::default();"));
    for (index, (_, first)) in loops.arguments.iter().enumerate() {
        lines.push(format!("        cells.take({first}, arguments[{index}]);"));
    }
    lines.push(format!("        for &[kernel, first, count] in &{upper}_RUNS {{"));
    lines.push("            match kernel {".to_owned());
    lines.extend(arms.into_iter().map(|arm| format!("                {arm}")));
    lines.push("                _ => {}\n            }\n        }".to_owned());
    let names: Vec<_> = (0..outputs).map(|output| format!("output_{output}")).collect();
    lines.push(format!("        let [{}] = outputs;", names.join(", ")));
    for (output, name) in names.iter().enumerate() {
        lines.push(format!("        cells.give({name}, &{upper}_OUTPUT_{output});"));
    }
    lines.push("    }".to_owned());
}

/// The statements of a kernel.
struct Body<'a> {
    table: &'a Table,
}

impl Body<'_> {
    fn write(&self, lines: &mut Vec<String>) {
        let table = self.table;
        let listed = table.numbers.iter().filter(|number| matches!(number, Number::Listed(_)));
        let listed = listed.count();
        let columns = table.records[0].len() - usize::from(listed > 0);
        if listed > 0 {
            lines.push(format!(
                "            let Some(n)=entries::<_,{listed}>(&NUMBERS,r[{columns}]) else {{ break }};"
            ));
        }
        let mut widths = vec![0; columns];
        for &(column, distance) in &table.reads {
            widths[column] = widths[column].max(distance + 1);
        }
        let mut known = vec![false; columns];
        let mut kept = table.shape.kept.iter().zip(&table.writes).peekable();
        for (place, statement) in table.shape.statements.iter().enumerate() {
            let mut line = String::from("            ");
            for operand in statement.operands() {
                let Operand::Read(at) = *operand else { continue };
                let (column, _) = table.reads[at];
                if !std::mem::replace(&mut known[column], true) {
                    let width = widths[column];
                    line.push_str(&format!("let c{column}=cells.get::<{width}>(r[{column}]);"));
                }
            }
            line.push_str(&format!("let v{place}={};", self.value(statement)));
            if let Some((_, (column, distance))) = kept.next_if(|(at, _)| **at == place) {
                line.push_str(&format!("cells.put(r[{column}],{distance},v{place});"));
            }
            lines.push(line);
        }
    }

    fn operand(&self, operand: &Operand) -> String {
        match *operand {
            Operand::Read(at) => {
                let (column, distance) = self.table.reads[at];
                format!("c{column}[{distance}]")
            }
            Operand::Own(place) => format!("v{place}"),
            Operand::Number(place) => match self.table.numbers[place] {
                Number::Same(number) => format!("S::from_f64({})", literal(number)),
                Number::Listed(distance) => format!("S::from_f64(n[{distance}])"),
            },
        }
    }

    fn value(&self, statement: &Statement) -> String {
        let join = |operands: &[Operand], by: &str| {
            let operands: Vec<_> = operands.iter().map(|operand| self.operand(operand)).collect();
            operands.join(by)
        };
        match statement {
            Statement::Sum(terms) => {
                let sum = terms.iter().fold(None, |sum: Option<String>, term| {
                    let Term { is_negative, factors } = term;
                    let sign = if *is_negative { "-" } else { "" };
                    Some(match (sum, &factors[..]) {
                        (None, factors) => format!("{sign}{}", join(factors, "*")),
                        (Some(sum), [term]) => {
                            let sign = if *is_negative { "-" } else { "+" };
                            format!("{sum}{sign}{}", self.operand(term))
                        }
                        (Some(sum), [factor, last]) => {
                            let [factor, last] = [factor, last].map(|it| self.operand(it));
                            format!("S::mul_add({sign}{factor},{last},{sum})")
                        }
                        (Some(sum), [factors @ .., last]) => {
                            let (factors, last) = (join(factors, "*"), self.operand(last));
                            let product =
                                if *is_negative { format!("-({factors})") } else { factors };
                            format!("S::mul_add({product},{last},{sum})")
                        }
                        (Some(_), []) => unreachable!("a term has a factor"),
                    })
                });
                sum.unwrap_or_else(|| "S::ZERO".to_owned())
            }
            Statement::Call(DIVISION, operands) => join(operands, "/"),
            Statement::Call(name, operands) => format!("S::{name}({})", join(operands, ",")),
            Statement::SineCosine(_) => unreachable!("sines have a loop of their own"),
        }
    }
}

fn literal(number: f64) -> String {
    let sign = if number.is_sign_negative() { "-" } else { "" };
    format!("{sign}{}", digits(number.abs()))
}

/// Writes records as text, which the runtime reads while the module is compiled.
fn write_records(lines: &mut Vec<String>, name: &str, records: &[Vec<usize>]) {
    let columns = records.first().map_or(2, Vec::len);
    let declaration = format!("static {name}: [[u16; {columns}]; {}]", records.len());
    data(lines, &declaration, "records(", records.iter().flatten().copied());
}

/// Writes numbers as text: see `lamc_runtime::loops`.
fn data(
    lines: &mut Vec<String>,
    declaration: &str,
    read: &str,
    numbers: impl IntoIterator<Item = usize>,
) {
    const DIGITS: usize = 3;
    let alphabet: Vec<u8> = (b'!'..=b'~').filter(|byte| !b"\"\\".contains(byte)).collect();
    let digit = |mut number: usize| {
        [(); DIGITS].map(|()| {
            let digit = alphabet[number % alphabet.len()];
            number /= alphabet.len();
            char::from(digit)
        })
    };
    let text: Vec<char> = numbers.into_iter().flat_map(digit).collect();
    let parts: Vec<String> = text.chunks(LINE).map(|part| part.iter().collect()).collect();
    lines.push(format!("    {declaration} = {read}\"\\"));
    lines.push(format!("{}\");", parts.join("\\\n")));
}
