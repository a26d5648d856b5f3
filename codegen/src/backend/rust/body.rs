//! Prints function bodies as Rust. They are text, because they are far too long for tokens.
//!
//! A product that is added or subtracted becomes one fused operation with the sum, if the target has
//! one.

use crate::program::{Argument, Form, Function, Part, Parts, Program, Quantity, Shape, Slot};
use std::collections::BTreeSet;

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use lamc_tables::Rows;

use super::ScalarChoice;
use super::fused::{Fused, bare, fused};
use super::items::{FieldNames, Syntax, number};
use super::numbered::shorten;
use crate::backend::constants::{Constant, Constants};
use crate::backend::identifiers::reserved;
use crate::backend::literal::digits;
use crate::backend::loops::{self, Loops};
use crate::backend::statements::{Expression, Infix, SineCosine, Statement, Stretch};
use crate::backend::statements::{numbered, statements};
use crate::backend::tables::Numbers;
use crate::backend::text::wrap;

/// Names that function bodies use besides their arguments: the conversion of constants, the fused
/// multiply-add, the array that the parts of a function share, and the closure that receives the
/// drives.
pub const HELPERS: [&str; 4] = ["c", "mul_add", "kept", "visit"];

/// Largest number of instructions of a function that is not split: rustc 1.95 with optimisation and
/// debug information overflows its stack at some 8,000 consecutive `let`s.
const WHOLE: usize = 4000;

/// Largest number of instructions of a part. Shorter parts move more values through memory; longer
/// parts take more compile time per instruction.
const PART: usize = 1000;

/// Indentation of a statement.
const INDENT: &str = "        ";

/// The function bodies of a module, and the functions into which long bodies are split.
pub struct Bodies<'a> {
    pub(super) program: &'a Program,
    scalar: ScalarChoice,
    pub(super) syntax: &'a Syntax,
    pub(super) fields: &'a FieldNames,
    constants: Constants,
    pub(super) texts: Vec<String>,
    parts: TokenStream,
    /// Numbers that the tables read.
    pub(super) numbers: Numbers,
    /// The tables, by name.
    pub(super) tables: Vec<(String, Rows)>,
    /// Numbers that the loops read.
    pub(super) loop_numbers: loops::Numbers,
    /// The loops, by name.
    pub(super) loops: Vec<(String, Loops)>,
}

impl<'a> Bodies<'a> {
    /// Creates the collection without any body.
    pub fn new(
        program: &'a Program,
        scalar: ScalarChoice,
        syntax: &'a Syntax,
        fields: &'a FieldNames,
    ) -> Self {
        let forms = |form| program.functions.iter().filter(move |f| program.form(f.kind) == form);
        let constants = match forms(Form::StraightLine).next() {
            Some(_) => Constants::of(program, &program.functions, &[]),
            None => Constants::numbered(forms(Form::Numbered)),
        };
        Self {
            program,
            scalar,
            syntax,
            fields,
            constants,
            texts: Vec::new(),
            parts: TokenStream::new(),
            numbers: Numbers::default(),
            tables: Vec::new(),
            loop_numbers: loops::Numbers::default(),
            loops: Vec::new(),
        }
    }

    /// Returns the statements that assign every output of `function` to the array with the output's
    /// name. The values that the function reads have the names from [`given`].
    pub fn write(&mut self, function: &Function) -> TokenStream {
        let form = self.program.form(function.kind);
        match form {
            Form::Tables => return self.write_table(function),
            Form::Loops => return self.write_loops(function),
            _ => {}
        }
        let parts = parts(function);
        let reserved = reserved(function.kind.signature(), HELPERS);
        let (program, constants) = (self.program, &self.constants);
        let stretches = match form {
            Form::Numbered => numbered(program, constants, function, &parts, (&reserved, "kept")),
            _ => statements(program, constants, function, &parts, &reserved),
        };
        if let [stretch] = &stretches[..] {
            return self.text(stretch, form);
        }
        let (scalar, cells) = (&self.syntax.scalar, number(parts.cells));
        let zero: TokenStream = constant(self.scalar, 0.0);
        let mut calls = quote!(let kept = &mut [#zero; #cells];);
        for (index, (part, stretch)) in parts.list.iter().zip(&stretches).enumerate() {
            let name = format_ident!("{}_part_{}", function.kind.name(), index + 1);
            let mut parameters = self.given(part);
            parameters.push((format_ident!("kept"), quote!(&mut [#scalar; #cells])));
            for output in &function.outputs {
                if stretch.entries.iter().any(|(name, ..)| *name == output.name) {
                    let length = number(output.entries.len());
                    let place = format_ident!("{}", output.name);
                    parameters.push((place, quote!(&mut [#scalar; #length])));
                }
            }
            let (names, types): (Vec<_>, Vec<_>) = parameters.into_iter().unzip();
            let (locals, body) = (&self.syntax.locals, self.text(stretch, form));
            calls.extend(quote!(self.#name(#(#names),*);));
            self.parts.extend(quote! {
                #[inline(never)]
                fn #name(&self, #(#names: #types),*) { #locals #body }
            });
        }
        calls
    }

    /// Returns the functions for the parts of long bodies, and the texts that the `__body!`
    /// placeholders stand for.
    pub fn finish(self) -> (TokenStream, Vec<String>) {
        (self.parts, self.texts)
    }

    /// Returns the parameters for what a part reads, and their types.
    fn given(&self, part: &Part) -> Vec<(proc_macro2::Ident, TokenStream)> {
        let arguments: BTreeSet<_> = part.reads.iter().map(|slot| slot.place().0).collect();
        arguments.into_iter().filter_map(|argument| self.parameter(argument)).collect()
    }

    /// Returns the parameters of a function and their types: first what it reads, then what it writes.
    pub fn arguments(&self, function: &Function) -> (Vec<proc_macro2::Ident>, Vec<TokenStream>) {
        let signature = function.kind.signature();
        let inputs = function.kind.inputs(&self.program.interface);
        let inputs = inputs.filter_map(|argument| self.parameter(argument));
        let outputs = signature.outputs.iter().map(|output| {
            let (scalar, length) =
                (&self.syntax.scalar, number(output.shape.length(&self.program.interface)));
            (format_ident!("{}", output.name), quote!(&mut [#scalar; #length]))
        });
        inputs.chain(outputs).unzip()
    }

    /// Returns the parameter for an argument, or `None` if the argument is a field of the mechanism.
    fn parameter(&self, argument: Argument) -> Option<(proc_macro2::Ident, TokenStream)> {
        let scalar = &self.syntax.scalar;
        let ty = match (argument, argument.array().shape) {
            (Argument::Parameters | Argument::Inputs | Argument::Drawing, _) => return None,
            (_, Shape::SCALAR) => scalar.clone(),
            (_, shape) => {
                let length = number(shape.length(&self.program.interface));
                quote!(&[#scalar; #length])
            }
        };
        Some((format_ident!("{}", argument.name()), ty))
    }

    /// Returns the table of constants as a module.
    pub fn table(&mut self) -> TokenStream {
        let ty = if self.scalar == ScalarChoice::F32 { "f32" } else { "f64" };
        let mut lines = Vec::new();
        for group in self.constants.groups() {
            lines.push(format!("    // {}", group.heading(&self.program.interface.nodes)));
            for Constant { name, value, .. } in group.constants {
                let number = literal(self.scalar, *value);
                lines.push(format!("    pub const {name}: {ty} = {number};"));
            }
        }
        if lines.is_empty() {
            return TokenStream::new();
        }
        self.texts.push(lines.join("\n"));
        let index = number(self.texts.len() - 1);
        let legend = self.constants.legend().iter().map(|Quantity { name, meaning }| {
            format!(" - `{}_..`: {meaning}", name.to_ascii_uppercase())
        });
        quote! {
            /// Numbers of the model in SI units, without their signs:
            ///
            #(#[doc = #legend])*
            #[allow(
                clippy::approx_constant, clippy::excessive_precision,
                reason = "numbers of the drawing"
            )]
            mod constants {
                __body!(#index);
            }
            use constants::*;
        }
    }

    /// Stores the text of a stretch and returns the tokens of its placeholder.
    fn text(&mut self, stretch: &Stretch, form: Form) -> TokenStream {
        let mut lines = Vec::new();
        for (name, cell) in &stretch.takes {
            line(&mut lines, format!("let {name} = kept[{cell}];"));
        }
        for statement in &stretch.list {
            self.statement(statement, &mut lines);
        }
        for (output, index, entry) in &stretch.entries {
            line(&mut lines, format!("{output}[{index}] = {};", self.expression(entry)));
        }
        for (name, cell) in &stretch.leaves {
            line(&mut lines, format!("kept[{cell}] = {name};"));
        }
        if form == Form::Numbered {
            lines = shorten(lines);
        }
        self.texts.push(lines.join("\n"));
        let index = number(self.texts.len() - 1);
        quote!(__body!(#index);)
    }

    fn statement(&self, statement: &Statement, lines: &mut Vec<String>) {
        match statement {
            Statement::Section(section) => {
                let heading = section.heading(&self.program.interface.nodes);
                lines.push(format!("{INDENT}// {heading}"));
            }
            Statement::Let { name, value } => {
                line(lines, format!("let {name} = {};", self.expression(value)));
            }
            Statement::SineCosine(pairs) => self.sines(pairs, lines),
        }
    }

    fn sines(&self, pairs: &[SineCosine], lines: &mut Vec<String>) {
        let scalar = trait_path(self.scalar);
        let name = |name: &Option<String>| name.clone().unwrap_or_else(|| "_".to_owned());
        let names = |pair: &SineCosine| format!("({}, {})", name(&pair.sine), name(&pair.cosine));
        if let [pair] = pairs {
            let angle = self.expression(&pair.angle);
            return line(lines, format!("let {} = {scalar}::sin_cos({angle});", names(pair)));
        }
        line(lines, "let [".to_owned());
        pairs.iter().for_each(|pair| line(lines, format!("    {},", names(pair))));
        let angles: Vec<_> = pairs.iter().map(|pair| self.expression(&pair.angle)).collect();
        line(lines, format!("] = {scalar}::sin_cos_all([{}]);", angles.join(", ")));
    }

    fn expression(&self, expression: &Expression) -> String {
        match expression {
            Expression::Constant(number) => constant_text(self.scalar, *number),
            Expression::Number { name, negative } => named(self.scalar, name, *negative),
            Expression::Load(slot) => self.load(*slot),
            Expression::Name(name) => name.clone(),
            Expression::Parenthesised(x) if fused(x).is_some() => self.expression(x),
            Expression::Parenthesised(x) => format!("({})", self.expression(x)),
            Expression::Negated(x) => negated(self.expression(x)),
            Expression::Infix(x, operator, y) => match fused(expression) {
                Some(Fused { negative, factors: [a, b], sum, less }) => {
                    // A constant comes first, so that it takes the sign of the product: negating a
                    // constant costs nothing.
                    let [a, b] = if matches!(b, Expression::Constant(_) | Expression::Number { .. })
                    {
                        [b, a]
                    } else {
                        [a, b]
                    };
                    let (a, b) = (self.signed(a, negative), self.signed(b, false));
                    let sum = self.signed(sum, less);
                    format!("mul_add({a}, {b}, {sum})")
                }
                None => {
                    let (x, y) = (self.expression(x), self.expression(y));
                    format!("{x} {} {y}", operator.symbol())
                }
            },
            Expression::Call(function, arguments) => {
                let arguments: Vec<_> = arguments.iter().map(|x| self.expression(x)).collect();
                format!("{}::{function}({})", trait_path(self.scalar), arguments.join(", "))
            }
        }
    }

    /// Returns the text of an argument, or of its negative.
    fn signed(&self, expression: &Expression, negative: bool) -> String {
        match bare(expression) {
            x if !negative => self.expression(x),
            Expression::Constant(number) => constant_text(self.scalar, -number),
            Expression::Number { name, negative } => named(self.scalar, name, !negative),
            Expression::Negated(x) => self.expression(bare(x)),
            x @ Expression::Infix(_, Infix::Add | Infix::Sub, _) if fused(x).is_none() => {
                format!("-({})", self.expression(x))
            }
            x => negated(self.expression(x)),
        }
    }

    fn load(&self, slot: Slot) -> String {
        let (argument, index) = slot.place();
        match argument {
            Argument::Parameters => format!("self.params.{}", self.fields.parameters[index]),
            Argument::Inputs => format!("self.inputs.{}", self.fields.inputs[index]),
            Argument::Drawing => format!("self.drawing[{index}]"),
            _ if argument.array().shape == Shape::SCALAR => argument.name().to_owned(),
            _ => format!("{}[{index}]", argument.name()),
        }
    }
}

/// Appends a statement to the lines of a function, wrapped to the line width.
fn line(lines: &mut Vec<String>, text: String) {
    wrap(&format!("{INDENT}{text}"), lines);
}

/// Returns the path of the type or trait that has the operations without an operator.
fn trait_path(scalar: ScalarChoice) -> &'static str {
    match scalar {
        ScalarChoice::Generic => "S",
        _ => "::lamc_runtime::Arithmetic",
    }
}

fn negated(text: String) -> String {
    if text.starts_with('-') { format!("-({text})") } else { format!("-{text}") }
}

/// Returns a number as a literal of the module's number type.
pub fn constant(scalar: ScalarChoice, number: f64) -> TokenStream {
    let text = constant_text(scalar, number);
    text.parse().unwrap_or_else(|error| unreachable!("{text} is no number: {error}"))
}

/// Returns a constant of the table, or its negative.
fn named(scalar: ScalarChoice, name: &str, negative: bool) -> String {
    let sign = if negative { "-" } else { "" };
    match scalar {
        ScalarChoice::Generic => format!("c({sign}{name})"),
        _ => format!("{sign}{name}"),
    }
}

fn constant_text(scalar: ScalarChoice, number: f64) -> String {
    let literal = literal(scalar, number);
    match scalar {
        ScalarChoice::Generic => format!("c({literal})"),
        ScalarChoice::F32 if !number.is_finite() => format!("{literal} as f32"),
        _ => literal,
    }
}

/// Returns a number as a Rust literal.
fn literal(scalar: ScalarChoice, number: f64) -> String {
    let sign = if number.is_sign_negative() { "-" } else { "" };
    match number {
        _ if number.is_nan() => "f64::NAN".to_owned(),
        _ if number.is_infinite() && number > 0.0 => "f64::INFINITY".to_owned(),
        _ if number.is_infinite() => "f64::NEG_INFINITY".to_owned(),
        _ if scalar == ScalarChoice::F32 => format!("{sign}{}", digits(number.abs() as f32)),
        _ => format!("{sign}{}", digits(number.abs())),
    }
}

/// Splits a function into parts of bounded length, or into a single part if it is short.
fn parts(function: &Function) -> Parts {
    let is_short = function.instructions.len() <= WHOLE;
    Parts::of_at_most(function, if is_short { WHOLE } else { PART })
}
