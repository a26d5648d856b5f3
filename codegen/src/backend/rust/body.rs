//! Function bodies: instructions become `let` statements, grouped by the body they belong to.
//!
//! Constants and reads are written where they are used, and so are unnamed values used once: what
//! remains has a name of the derivation.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{format_ident, quote};

use super::ScalarChoice;
use super::items::FieldNames;
use crate::backend::identifiers::Names;
use crate::kane::Section;
use crate::program::{Function, Moving, Op, Program, Slot, Value};

/// Operations written into one expression at most.
const LONGEST_EXPRESSION: usize = 10;

/// What a value is written as where it is used.
#[derive(Clone)]
struct Written {
    tokens: TokenStream,
    /// Operations in the expression; 0 for a name or a number.
    size: usize,
    binding: Binding,
}

/// How tightly an expression holds together, loosest first.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Binding {
    Sum,
    Product,
    Atom,
}

impl Written {
    fn atom(tokens: TokenStream) -> Self {
        Self { tokens, size: 0, binding: Binding::Atom }
    }

    /// The expression as an operand that must hold at least as tightly as `least`.
    fn within(&self, least: Binding) -> TokenStream {
        let tokens = &self.tokens;
        if self.binding < least { quote!((#tokens)) } else { quote!(#tokens) }
    }
}

/// Writes the statements of a function and, per output, its entries as expressions.
pub struct Body<'a> {
    program: &'a Program,
    function: &'a Function,
    scalar: ScalarChoice,
    fields: &'a FieldNames,
    names: Names,
    written: Vec<Written>,
    statements: TokenStream,
    section: Option<Section>,
}

impl<'a> Body<'a> {
    /// Writes every instruction of `function`.
    pub fn new(
        program: &'a Program,
        function: &'a Function,
        scalar: ScalarChoice,
        fields: &'a FieldNames,
    ) -> Self {
        let reserved = [
            "t", "q", "u", "a", "lambda", "dt", "dq", "du", "dp", "di", "c", "at", "change", "out",
            "mass", "forcing", "jacobian", "gamma", "residual", "forces", "closure", "visit",
        ];
        let mut body = Self {
            program,
            function,
            scalar,
            fields,
            names: Names::reserving(&reserved),
            written: Vec::with_capacity(function.instructions.len()),
            statements: TokenStream::new(),
            section: None,
        };
        body.write();
        body
    }

    /// The statements.
    pub fn statements(&self) -> &TokenStream {
        &self.statements
    }

    /// The entries of an output, by name.
    pub fn output(&self, name: &str) -> Vec<TokenStream> {
        let output = self.function.outputs.iter().find(|output| output.name == name);
        let entries = output.map(|output| output.entries.as_slice()).unwrap_or_default();
        entries.iter().map(|entry| self.written[entry.index()].tokens.clone()).collect()
    }

    fn write(&mut self) {
        let uses = uses(self.function);
        let partners = partners(self.function);
        for (index, &uses) in uses.iter().enumerate() {
            if self.written.len() > index && !self.written[index].tokens.is_empty() {
                continue;
            }
            let instruction = &self.function.instructions[index];
            let written = match instruction.op {
                Op::Const(number) => Written::atom(constant(self.scalar, number)),
                Op::Load(slot) => Written::atom(self.load(slot)),
                Op::Sin(x) | Op::Cos(x) => self.sine_cosine(index, x, &partners),
                op => {
                    let written = self.expression(op);
                    let inline = instruction.name.is_none() && uses == 1;
                    if inline && written.size <= LONGEST_EXPRESSION {
                        written
                    } else {
                        self.bind(index, &written.tokens)
                    }
                }
            };
            if self.written.len() > index {
                self.written[index] = written;
            } else {
                self.written.push(written);
            }
        }
    }

    /// One call for sine and cosine of an angle, where both are wanted.
    fn sine_cosine(&mut self, index: usize, x: Value, partners: &[Option<usize>]) -> Written {
        let angle = self.written[x.index()].within(Binding::Sum);
        let is_sine = matches!(self.function.instructions[index].op, Op::Sin(_));
        let scalar = self.trait_path();
        let Some(partner) = partners[index] else {
            let part = Literal::usize_unsuffixed(usize::from(!is_sine));
            return self.bind(index, &quote!(#scalar::sin_cos(#angle).#part));
        };
        let mine = self.name(index);
        let other = self.name(partner);
        let (sine, cosine) = if is_sine { (&mine, &other) } else { (&other, &mine) };
        self.heading(index);
        self.statements.extend(quote!(let (#sine, #cosine) = #scalar::sin_cos(#angle);));
        let blank = Written::atom(TokenStream::new());
        self.written.resize(self.written.len().max(partner + 1), blank);
        self.written[partner] = Written::atom(quote!(#other));
        Written::atom(quote!(#mine))
    }

    /// `let name = value;`
    fn bind(&mut self, index: usize, value: &TokenStream) -> Written {
        let name = self.name(index);
        self.heading(index);
        self.statements.extend(quote!(let #name = #value;));
        Written::atom(quote!(#name))
    }

    fn name(&mut self, index: usize) -> Ident {
        let instruction = &self.function.instructions[index];
        let name = instruction.name.clone().unwrap_or_else(|| match instruction.section {
            Section::Node(node) => format!("{}_part", self.program.interface.nodes[node.index()]),
            Section::Loop(id) => format!("loop{}_part", id.index()),
            Section::Mechanism => "part".to_owned(),
        });
        Ident::new(&self.names.give(&name), Span::call_site())
    }

    /// A comment before the first statement of another section.
    fn heading(&mut self, index: usize) {
        let section = self.function.instructions[index].section;
        if self.section.replace(section) != Some(section) {
            let text = match section {
                Section::Mechanism => "the whole mechanism".to_owned(),
                Section::Node(node) => self.program.interface.nodes[node.index()].clone(),
                Section::Loop(id) => format!("loop {}", id.index()),
            };
            self.statements.extend(quote!(__section!(#text);));
        }
    }

    /// Parentheses only where the order of operations needs them.
    fn expression(&self, op: Op) -> Written {
        use Binding::{Atom, Product, Sum};
        let of = |x: Value, least| self.written[x.index()].within(least);
        let infix = |x, operator: TokenStream, y, [left, right]: [Binding; 2]| {
            let (x, y) = (of(x, left), of(y, right));
            quote!(#x #operator #y)
        };
        let (tokens, binding) = match op {
            Op::Neg(x) => {
                let x = of(x, Product);
                (quote!(-#x), Product)
            }
            Op::Add(x, y) => (infix(x, quote!(+), y, [Sum, Product]), Sum),
            Op::Sub(x, y) => (infix(x, quote!(-), y, [Sum, Product]), Sum),
            Op::Mul(x, y) => (infix(x, quote!(*), y, [Product, Atom]), Product),
            Op::Div(x, y) => (infix(x, quote!(/), y, [Product, Atom]), Product),
            op => {
                let scalar = self.trait_path();
                let function = format_ident!("{}", op.mnemonic());
                let arguments = op.operands().map(|x| of(x, Sum));
                (quote!(#scalar::#function(#(#arguments),*)), Atom)
            }
        };
        let size = op.operands().map(|x| self.written[x.index()].size).sum::<usize>() + 1;
        Written { tokens, size, binding }
    }

    fn trait_path(&self) -> TokenStream {
        match self.scalar {
            ScalarChoice::Generic => quote!(S),
            _ => quote!(::lamc_runtime::Scalar),
        }
    }

    fn load(&self, slot: Slot) -> TokenStream {
        let index = |i: usize| Literal::usize_unsuffixed(i);
        match slot {
            Slot::Time => quote!(t),
            Slot::Position(id) => {
                let i = index(id.index());
                quote!(q[#i])
            }
            Slot::Rate(id) => {
                let i = index(id.index());
                quote!(u[#i])
            }
            Slot::Parameter(id) => {
                let field = &self.fields.parameters[id.index()];
                quote!(self.params.#field)
            }
            Slot::Input(id) => {
                let field = &self.fields.inputs[id.index()];
                quote!(self.inputs.#field)
            }
            Slot::Acceleration(id) => {
                let i = index(id.index());
                quote!(a[#i])
            }
            Slot::Multiplier(row) => {
                let i = index(row);
                quote!(lambda[#i])
            }
            Slot::Change(moving) => {
                let (rates, i) = match moving {
                    Moving::Time => return quote!(dt),
                    Moving::Position(id) => (quote!(dq), id.index()),
                    Moving::Rate(id) => (quote!(du), id.index()),
                    Moving::Parameter(id) => (quote!(dp), id.index()),
                    Moving::Input(id) => (quote!(di), id.index()),
                };
                let i = index(i);
                quote!(#rates[#i])
            }
        }
    }
}

/// A number of the module's type.
pub fn constant(scalar: ScalarChoice, number: f64) -> TokenStream {
    let literal = |number: f64| {
        if number.is_finite() {
            let magnitude = float(number.abs(), |x| format!("{x:?}"));
            if number.is_sign_negative() { quote!(-#magnitude) } else { quote!(#magnitude) }
        } else if number.is_nan() {
            quote!(f64::NAN)
        } else if number > 0.0 {
            quote!(f64::INFINITY)
        } else {
            quote!(f64::NEG_INFINITY)
        }
    };
    match scalar {
        ScalarChoice::Generic => {
            let number = literal(number);
            quote!(c(#number))
        }
        ScalarChoice::F64 => {
            let number = literal(number);
            quote!(#number)
        }
        ScalarChoice::F32 if number.is_finite() => {
            let short = float(number.abs(), |x| format!("{:?}", x as f32));
            if number < 0.0 { quote!(-#short) } else { quote!(#short) }
        }
        ScalarChoice::F32 => {
            let number = literal(number);
            quote!(#number as f32)
        }
    }
}

/// The shortest digits that read back as the same number; Rust's `{:?}` chooses exponents well.
fn float(magnitude: f64, digits: impl Fn(f64) -> String) -> Literal {
    let text = if magnitude != 0.0 && magnitude < 1e-2 {
        // Rust would write up to five leading zeros.
        let plain = digits(magnitude);
        match plain.strip_prefix("0.") {
            Some(fraction) => {
                let digits = fraction.trim_start_matches('0');
                let exponent = fraction.len() - digits.len() + 1;
                let (first, rest) = digits.split_at(1);
                let point = if rest.is_empty() { "" } else { "." };
                format!("{first}{point}{rest}e-{exponent}")
            }
            None => plain,
        }
    } else {
        digits(magnitude)
    };
    text.parse().unwrap_or_else(|_| Literal::f64_unsuffixed(magnitude))
}

/// How often each value is used.
fn uses(function: &Function) -> Vec<usize> {
    let mut uses = vec![0; function.instructions.len()];
    let operands = function.instructions.iter().flat_map(|i| i.op.operands());
    let entries = function.outputs.iter().flat_map(|o| o.entries.iter().copied());
    operands.chain(entries).for_each(|value| uses[value.index()] += 1);
    uses
}

/// For the first of a sine and a cosine of one angle, the other.
fn partners(function: &Function) -> Vec<Option<usize>> {
    let mut seen: std::collections::HashMap<Value, usize> = std::collections::HashMap::new();
    let mut partners = vec![None; function.instructions.len()];
    for (index, instruction) in function.instructions.iter().enumerate() {
        if let Op::Sin(x) | Op::Cos(x) = instruction.op
            && let Some(first) = seen.insert(x, index)
        {
            partners[first] = Some(index);
        }
    }
    partners
}
