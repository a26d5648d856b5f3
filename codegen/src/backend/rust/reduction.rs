//! What the runtime needs to solve for independent speeds.

use proc_macro2::TokenStream;
use quote::quote;

use super::items::{Syntax, model, number};
use super::straight_line::method;
use crate::program::{FunctionKind, Program};

/// Returns the sizes of the reduction.
pub fn sizes(program: &Program) -> TokenStream {
    let Some(reduction) = program.reduction() else {
        return quote!(::lamc_runtime::plumbing::ReductionSizes::NONE);
    };
    let [branches, depth, independent, coefficients] = [
        reduction.branches.len(),
        reduction.depth(),
        reduction.independent.len(),
        reduction.columns.len(),
    ]
    .map(number);
    quote! {
        ::lamc_runtime::plumbing::ReductionSizes {
            branches: #branches, depth: #depth, independent: #independent,
            coefficients: #coefficients,
        }
    }
}

/// Returns the method of `Mechanism` that shows the reduction, if the program has one.
pub fn shown(program: &Program, scalar: &TokenStream) -> TokenStream {
    let Some(info) = program.reduction() else { return TokenStream::new() };
    let is_for_driven = program.solves();
    let numbers = |values: &[u16]| {
        let values = values.iter().map(|&value| number(value.into()));
        quote!([#(#values),*])
    };
    let pairs = |pairs: &[(u16, u16)]| {
        let pairs = pairs.iter().map(|&(a, b)| {
            let [a, b] = [a, b].map(|value| number(value.into()));
            quote!((#a, #b))
        });
        quote!([#(#pairs),*])
    };
    let (branches, dependent) = (pairs(&info.branches), pairs(&info.dependent));
    let (independent, columns) = (numbers(&info.independent), numbers(&info.columns));
    let [count, of_independent, of_dependent, of_columns] =
        [info.branches.len(), info.independent.len(), info.dependent.len(), info.columns.len()]
            .map(number);
    quote! {
        fn reduction(
            &self,
        ) -> ::core::option::Option<::lamc_runtime::plumbing::Reduction<'_, #scalar>> {
            use ::lamc_runtime::plumbing::{Branch, Dependent, Reduction};
            const BRANCHES: [Branch; #count] = Branch::all(#branches);
            const INDEPENDENT: [u16; #of_independent] = #independent;
            const DEPENDENT: [Dependent; #of_dependent] = Dependent::all(#dependent);
            const COLUMNS: [u16; #of_columns] = #columns;
            Some(Reduction {
                branches: &BRANCHES, independent: &INDEPENDENT, dependent: &DEPENDENT,
                columns: &COLUMNS, is_for_driven: #is_for_driven, parts: self,
            })
        }
    }
}

/// Returns what writes the parts of the reduction, if the program has one.
pub fn parts(program: &Program, syntax: &Syntax) -> TokenStream {
    if program.reduction().is_none() {
        return TokenStream::new();
    }
    let Syntax { generic, bound, scalar, .. } = syntax;
    let model = model(program);
    let [acceleration, projection] =
        [FunctionKind::Reduction, FunctionKind::ProjectionReduction].map(method);
    let result = quote!(::core::result::Result<(), ::lamc_runtime::Error>);
    quote! {
        impl #bound ::lamc_runtime::plumbing::ReductionParts<#scalar> for #model #generic {
            fn write_acceleration(
                &self, (t, q, u): (#scalar, &[#scalar], &[#scalar]),
                out: ::lamc_runtime::plumbing::ReductionMut<'_, #scalar>,
                given: &mut [#scalar], forces: &mut [#scalar],
            ) -> #result {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#acceleration(
                    t, exactly(q)?, exactly(u)?, exactly_mut(out.axes)?, exactly_mut(out.momenta)?,
                    exactly_mut(out.rotors)?, exactly_mut(out.coefficients)?,
                    exactly_mut(out.largest)?, exactly_mut(given)?, exactly_mut(forces)?,
                );
                Ok(())
            }
            fn write_projection(
                &self, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::plumbing::ReductionMut<'_, #scalar>,
                closing: ::lamc_runtime::plumbing::ProjectionMut<'_, #scalar>,
            ) -> #result {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#projection(
                    exactly(q)?, exactly(u)?, exactly_mut(out.axes)?, exactly_mut(out.momenta)?,
                    exactly_mut(out.rotors)?, exactly_mut(out.coefficients)?,
                    exactly_mut(out.largest)?, exactly_mut(closing.residual)?,
                    exactly_mut(closing.positions)?, exactly_mut(closing.speeds)?,
                );
                Ok(())
            }
        }
    }
}
