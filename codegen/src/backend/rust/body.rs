//! Function bodies as Rust.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{format_ident, quote};

use super::ScalarChoice;
use super::items::FieldNames;
use crate::backend::literal::digits;
use crate::backend::statements::{Expression, Infix, Statement, Statements};
use crate::program::{Function, Moving, Program, Slot};

/// What locals must not be called.
const RESERVED: [&str; 26] = [
    "t",
    "q",
    "u",
    "a",
    "lambda",
    "dt",
    "dq",
    "du",
    "dp",
    "di",
    "c",
    "at",
    "change",
    "out",
    "mass",
    "forcing",
    "jacobian",
    "gamma",
    "residual",
    "forces",
    "closure",
    "visit",
    "acceleration",
    "misfit",
    "speeds",
    "correction",
];

/// The statements of a function and, per output, its entries as expressions.
pub struct Body<'a> {
    scalar: ScalarChoice,
    fields: &'a FieldNames,
    statements: Statements<'a>,
}

impl<'a> Body<'a> {
    /// Of every instruction of `function`.
    pub fn new(
        program: &'a Program,
        function: &'a Function,
        scalar: ScalarChoice,
        fields: &'a FieldNames,
    ) -> Self {
        Self { scalar, fields, statements: Statements::new(program, function, &RESERVED) }
    }

    /// The statements.
    pub fn statements(&self) -> TokenStream {
        self.statements.list().iter().map(|statement| self.statement(statement)).collect()
    }

    /// The entries of an output, by name.
    pub fn output(&self, name: &str) -> Vec<TokenStream> {
        self.statements.output(name).map(|entry| self.expression(entry)).collect()
    }

    fn statement(&self, statement: &Statement) -> TokenStream {
        let ident = |name: &String| Ident::new(name, Span::call_site());
        match statement {
            Statement::Section(text) => quote!(__section!(#text);),
            Statement::Let { name, value } => {
                let (name, value) = (ident(name), self.expression(value));
                quote!(let #name = #value;)
            }
            Statement::SineCosine { sine, cosine, angle } => {
                let (angle, scalar) = (self.expression(angle), self.trait_path());
                match (sine.as_ref().map(ident), cosine.as_ref().map(ident)) {
                    (Some(sine), Some(cosine)) => {
                        quote!(let (#sine, #cosine) = #scalar::sin_cos(#angle);)
                    }
                    (Some(sine), None) => quote!(let #sine = #scalar::sin_cos(#angle).0;),
                    (None, Some(cosine)) => quote!(let #cosine = #scalar::sin_cos(#angle).1;),
                    (None, None) => TokenStream::new(),
                }
            }
        }
    }

    fn expression(&self, expression: &Expression) -> TokenStream {
        match expression {
            Expression::Constant(number) => constant(self.scalar, *number),
            Expression::Load(slot) => self.load(*slot),
            Expression::Name(name) => {
                let name = Ident::new(name, Span::call_site());
                quote!(#name)
            }
            Expression::Parenthesised(x) => {
                let x = self.expression(x);
                quote!((#x))
            }
            Expression::Negated(x) => {
                let x = self.expression(x);
                quote!(-#x)
            }
            Expression::Infix(x, operator, y) => {
                let (x, y) = (self.expression(x), self.expression(y));
                match operator {
                    Infix::Add => quote!(#x + #y),
                    Infix::Sub => quote!(#x - #y),
                    Infix::Mul => quote!(#x * #y),
                    Infix::Div => quote!(#x / #y),
                }
            }
            Expression::Call(function, arguments) => {
                let (scalar, function) = (self.trait_path(), format_ident!("{function}"));
                let arguments = arguments.iter().map(|x| self.expression(x));
                quote!(#scalar::#function(#(#arguments),*))
            }
        }
    }

    fn trait_path(&self) -> TokenStream {
        match self.scalar {
            ScalarChoice::Generic => quote!(S),
            _ => quote!(::lamc_runtime::Arithmetic),
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
            let magnitude = float(number.abs(), digits(number.abs()));
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
            let short = float(number.abs(), digits(number.abs() as f32));
            if number < 0.0 { quote!(-#short) } else { quote!(#short) }
        }
        ScalarChoice::F32 => {
            let number = literal(number);
            quote!(#number as f32)
        }
    }
}

fn float(magnitude: f64, digits: String) -> Literal {
    digits.parse().unwrap_or_else(|_| Literal::f64_unsuffixed(magnitude))
}
