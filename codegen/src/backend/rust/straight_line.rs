//! The functions of the program as straight-line code: private methods that read and write arrays, for
//! single numbers and for SIMD lanes.

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::body::Bodies;
use super::items::{Syntax, allowances, model, unused};
use crate::program::{FunctionKind, Program};

/// Returns the name of the method for a function of the program.
pub fn method(kind: FunctionKind) -> Ident {
    format_ident!("{}_into", kind.name())
}

/// Returns whether the program has a function of this kind.
pub fn has(program: &Program, kind: FunctionKind) -> bool {
    !program.function_of(kind).outputs.is_empty()
}

/// Returns a method for each function that writes at least one output.
pub fn straight_line(program: &Program, syntax: &Syntax, bodies: &mut Bodies) -> TokenStream {
    let Syntax { generic, arithmetic, locals, .. } = syntax;
    let (model, allowances, unused) = (model(program), allowances(), unused());
    let mut methods = TokenStream::new();
    for kind in FunctionKind::ALL.into_iter().filter(|&kind| has(program, kind)) {
        let function = program.function_of(kind);
        let doc = format!(" {}.", kind.signature().doc);
        let name = method(kind);
        let (names, types) = bodies.arguments(function);
        let is_empty = function.outputs.iter().all(|output| output.entries.is_empty());
        let body = match is_empty {
            true => TokenStream::new(),
            false => {
                let body = bodies.write(function);
                quote!(#locals #body)
            }
        };
        methods.extend(quote! {
            #[doc = #doc]
            fn #name(&self, #(#names: #types),*) { #body }
        });
    }
    quote! { #allowances #unused impl #arithmetic #model #generic { #methods } }
}
