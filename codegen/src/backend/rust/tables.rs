//! Functions of long modules as tables: a text of all of them, and a call that evaluates each.

use lamc_tables::encode;
use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::body::Bodies;
use super::items::number;
use crate::backend::literal::digits;
use crate::backend::tables::Table;
use crate::program::{Argument, Function, Shape};

/// Characters of a table in one line.
const LINE: usize = 120;

impl Bodies<'_> {
    /// Returns the call that evaluates a function's table, which becomes an item of the module `tables`.
    pub(super) fn write_table(&mut self, function: &Function) -> TokenStream {
        let table = Table::of(function, &mut self.numbers);
        let item = function.kind.name().to_uppercase();
        self.tables.push((item.clone(), table.rows));
        let arguments: Vec<_> = function
            .kind
            .inputs(&self.program.interface)
            .map(|argument| self.array(argument))
            .collect();
        let outputs = function.outputs.iter().map(|output| format_ident!("{}", output.name));
        let (item, scalar) = (format_ident!("{item}"), &self.syntax.scalar);
        quote! {
            tables::#item.evaluate::<#scalar>(
                &tables::NUMBERS, &[#(#arguments),*], &mut [#(#outputs),*]
            );
        }
    }

    /// Returns an argument as an array.
    pub(super) fn array(&self, argument: Argument) -> TokenStream {
        let name = format_ident!("{}", argument.name());
        match argument {
            Argument::Parameters => {
                let fields = &self.fields.parameters;
                quote!(&[#(self.params.#fields),*])
            }
            Argument::Inputs => {
                let fields = &self.fields.inputs;
                quote!(&[#(self.inputs.#fields),*])
            }
            Argument::Drawing => quote!(&self.drawing),
            _ if argument.array().shape == Shape::SCALAR => quote!(&[#name]),
            _ => quote!(#name),
        }
    }

    /// Returns the module of the tables, if there are any.
    pub(super) fn tables(&mut self) -> TokenStream {
        if self.tables.is_empty() {
            return TokenStream::new();
        }
        let mut lines =
            vec![format!("    pub static NUMBERS: [f64; {}] = [", self.numbers.list.len())];
        for numbers in self.numbers.list.chunks(6) {
            let sign = |number: &f64| if number.is_sign_negative() { "-" } else { "" };
            let text = |number: &f64| format!("{}{},", sign(number), digits(number.abs()));
            lines.push(numbers.iter().map(text).collect());
        }
        lines.push("    ];".to_owned());
        let (names, rows): (Vec<_>, Vec<_>) = std::mem::take(&mut self.tables).into_iter().unzip();
        lines.push("    ::lamc_runtime::tables! {".to_owned());
        lines.push(format!("    {}", names.join(" ")));
        let text = encode(&rows);
        let parts: Vec<_> = text.as_bytes().chunks(LINE).map(String::from_utf8_lossy).collect();
        lines.push(format!("\"{}\"\n    }}", parts.join("\\\n")));
        self.texts.push(lines.join("\n"));
        let index = number(self.texts.len() - 1);
        quote! {
            /// Functions as tables, for the loops of the runtime, and the numbers of the model that they read, SI.
            #[allow(
                clippy::approx_constant, clippy::excessive_precision,
                reason = "numbers of the drawing"
            )]
            #[rustfmt::skip]
            mod tables {
                __body!(#index);
            }
        }
    }
}
