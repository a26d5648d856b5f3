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

/// Loops whose cells and numbers all have numbers of two bytes.
const SHORT: usize = 1 << 16;

impl Bodies<'_> {
    /// Returns the call that evaluates a function as loops, which become items of the module `loops`.
    pub(super) fn write_loops(&mut self, function: &Function) -> TokenStream {
        let loops = Loops::of(function, &self.program.interface, &mut self.loop_numbers);
        let name = function.kind.name();
        let arguments: Vec<_> =
            loops.arguments.iter().map(|&(argument, _)| self.array(argument)).collect();
        let outputs = function.outputs.iter().map(|output| format_ident!("{}", output.name));
        let (item, scalar) = (format_ident!("{name}"), &self.syntax.scalar);
        let call = quote! {
            loops::#item::<#scalar>([#(#arguments),*], [#(#outputs),*]);
        };
        self.loops.push((name.to_owned(), loops));
        call
    }

    /// Returns the module of the loops, if there are any.
    pub(super) fn loops(&mut self) -> TokenStream {
        if self.loops.is_empty() {
            return TokenStream::new();
        }
        let numbers = &self.loop_numbers.list;
        let length = numbers.len();
        let most = self.loops.iter().map(|(_, loops)| loops.cells).max().unwrap_or(0);
        let place = if most.max(numbers.len()) <= SHORT { "u16" } else { "u32" };
        let mut lines = vec![
            "    use ::lamc_runtime::Arithmetic;".to_owned(),
            "    use ::lamc_runtime::loops::{Cells, Place, run, window};".to_owned(),
        ];
        let numbers: Vec<_> = numbers.iter().map(|&number| literal(number)).collect();
        data(&mut lines, &format!("static NUMBERS: [f64; {length}]"), &numbers);
        for (name, loops) in std::mem::take(&mut self.loops) {
            Text { name: &name, loops: &loops, place, lines: &mut lines }.write();
        }
        self.texts.push(lines.join("\n"));
        let index = number(self.texts.len() - 1);
        quote! {
            /// Functions as loops over records, and the numbers of the model that they read, SI.
            #[allow(
                clippy::all, clippy::approx_constant, clippy::excessive_precision,
                reason = "numbers of the drawing"
            )]
            #[rustfmt::skip]
            mod loops {
                __body!(#index);
            }
        }
    }
}

/// The text of a function.
struct Text<'a> {
    name: &'a str,
    loops: &'a Loops,
    /// The type of a record's entries.
    place: &'static str,
    lines: &'a mut Vec<String>,
}

impl Text<'_> {
    fn write(self) {
        let Self { name, loops, place, lines } = self;
        let upper = name.to_uppercase();
        let cells = format!("Cells<S, {}>", loops.cells);
        let mut arms = Vec::new();
        for (kernel, table) in loops.kernels.iter().enumerate() {
            let columns = table.records.first().map_or(0, Vec::len);
            let count = table.records.len();
            let row = |record: &Vec<usize>| {
                let cells: Vec<_> = record.iter().map(usize::to_string).collect();
                format!("[{}]", cells.join(","))
            };
            let item = format!("{name}_{kernel}");
            let records: Vec<_> = table.records.iter().map(row).collect();
            let list = format!("static {upper}_{kernel}: [[{place}; {columns}]; {count}]");
            data(lines, &list, &records);
            let records = format!("run(&{upper}_{kernel}, first, count)");
            if is_sine(table) {
                let [angle, sine] =
                    [table.reads[0], table.writes[0]].map(|(at, far)| format!("[{at}, {far}]"));
                arms.push(format!("{kernel} => cells.sines({records}, {angle}, {sine}),"));
                continue;
            }
            lines.push("    #[inline(never)]".to_owned());
            lines.push(format!(
                "    fn {item}<S: Arithmetic>(cells: &mut {cells}, records: &[[{place}; {columns}]]) {{"
            ));
            lines.push("        for r in records {".to_owned());
            Body { table }.write(lines);
            lines.push("        }\n    }".to_owned());
            arms.push(format!("{kernel} => {item}(cells, {records}),"));
        }
        let mut done = vec![0; loops.kernels.len()];
        let run = |&(kernel, count): &(usize, usize)| {
            let first = done[kernel];
            done[kernel] += count;
            format!("[{kernel},{first},{count}]")
        };
        let runs: Vec<_> = loops.runs.iter().map(run).collect();
        data(lines, &format!("static {upper}_RUNS: [[{place}; 3]; {}]", runs.len()), &runs);
        for (output, entries) in loops.outputs.iter().enumerate() {
            let entries: Vec<_> =
                entries.iter().map(|(index, cell)| format!("[{index},{cell}]")).collect();
            let list = format!("static {upper}_OUTPUT_{output}: [[{place}; 2]; {}]", entries.len());
            data(lines, &list, &entries);
        }
        lines.push(format!(
            "    pub fn {name}<S: Arithmetic>(arguments: [&[S]; {}], outputs: [&mut [S]; {}]) {{",
            loops.arguments.len(),
            loops.outputs.len()
        ));
        lines.push(format!("        let cells: &mut {cells} = &mut Cells::default();"));
        for (index, (_, first)) in loops.arguments.iter().enumerate() {
            lines.push(format!("        cells.take({first}, arguments[{index}]);"));
        }
        lines.push(format!("        for &[kernel, first, count] in &{upper}_RUNS {{\n            match kernel {{"));
        lines.extend(arms.into_iter().map(|arm| format!("                {arm}")));
        lines.push("                _ => {}\n            }\n        }".to_owned());
        let outputs: Vec<_> = (0..loops.outputs.len()).map(|output| format!("o{output}")).collect();
        lines.push(format!("        let [{}] = outputs;", outputs.join(", ")));
        for output in 0..loops.outputs.len() {
            lines.push(format!("        cells.give(o{output}, &{upper}_OUTPUT_{output});"));
        }
        lines.push("    }".to_owned());
    }
}

fn is_sine(table: &Table) -> bool {
    matches!(table.shape.statements[..], [Statement::SineCosine(_)])
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
                "            let Some(n)=window::<_,{listed}>(&NUMBERS,r[{columns}].index()) else {{ break }};"
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
                    line.push_str(&format!(
                        "let c{column}=cells.window::<{width}>(r[{column}].index());"
                    ));
                }
            }
            line.push_str(&format!("let v{place}={};", self.value(statement)));
            if let Some((_, (column, distance))) = kept.next_if(|(at, _)| **at == place) {
                line.push_str(&format!("cells.put(r[{column}].index()+{distance},v{place});"));
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
                        (Some(sum), factors) => {
                            let (last, others) = factors.split_last().unwrap_or((&factors[0], &[]));
                            let last = self.operand(last);
                            format!("S::mul_add({sign}({}),{last},{sum})", join(others, "*"))
                        }
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

/// Writes an array, several entries in a line.
fn data(lines: &mut Vec<String>, declaration: &str, entries: &[String]) {
    lines.push(format!("    {declaration} = ["));
    let mut line = String::new();
    for entry in entries {
        if line.len() + entry.len() >= LINE {
            lines.push(std::mem::take(&mut line));
        }
        line.push_str(entry);
        line.push(',');
    }
    lines.push(line);
    lines.push("    ];".to_owned());
}
