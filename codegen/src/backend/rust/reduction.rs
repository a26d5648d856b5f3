//! What the runtime needs to solve for independent speeds.

use proc_macro2::TokenStream;
use quote::quote;

use super::items::{Syntax, model, number};
use super::straight_line::method;
use crate::program::{FunctionKind, Program, SparseRows};

/// Returns the sizes of the reduction.
pub fn sizes(program: &Program) -> TokenStream {
    let Some(reduction) = program.reduction() else {
        return quote!(::lamc_runtime::plumbing::ReductionSizes::NONE);
    };
    let [branches, depth, independent, closure, factors] = [
        reduction.branches.len(),
        reduction.depth(),
        reduction.independent.len(),
        reduction.closure.columns.len(),
        reduction.factors(),
    ]
    .map(number);
    quote! {
        ::lamc_runtime::plumbing::ReductionSizes {
            branches: #branches, depth: #depth, independent: #independent, closure: #closure,
            factors: #factors,
        }
    }
}

/// Returns the method of `Mechanism` that shows the reduction, if the program has one.
pub fn shown(program: &Program, scalar: &TokenStream) -> TokenStream {
    let Some(info) = program.reduction() else { return TokenStream::new() };
    let is_beside_solution = program.solves();
    let numbers = |values: &[u16]| {
        let values = values.iter().map(|&value| number(value.into()));
        quote!([#(#values),*])
    };
    let pairs = info.branches.iter().map(|&(joint, depth)| {
        let [joint, depth] = [joint, depth].map(|value| number(value.into()));
        quote!((#joint, #depth))
    });
    let rows = |rows: &SparseRows| {
        let (ends, columns) =
            (rows.ends.iter().map(|&end| number(end as usize)), numbers(&rows.columns));
        quote!(Rows { ends: &[#(#ends),*], columns: &#columns })
    };
    let [closure, lower, upper] = [&info.closure, &info.lower, &info.upper].map(rows);
    let [independent, places] = [&info.independent, &info.places()].map(|values| numbers(values));
    let rows_of_equations = info.rows.iter().map(|&row| number(row as usize));
    let steps = info.padded_steps().into_iter().map(|joints| numbers(&joints));
    let count = number(info.branches.len());
    quote! {
        fn reduction(
            &self,
        ) -> ::core::option::Option<::lamc_runtime::plumbing::Reduction<'_, #scalar>> {
            use ::lamc_runtime::plumbing::{Branch, Reduction, Rows};
            const BRANCHES: [Branch; #count] = Branch::all([#(#pairs),*]);
            const CLOSURE: Rows = #closure;
            const LOWER: Rows = #lower;
            const UPPER: Rows = #upper;
            Some(Reduction {
                branches: &BRANCHES, independent: &#independent, steps: &[#(#steps),*],
                rows: &[#(#rows_of_equations),*], places: &#places,
                closure: CLOSURE, lower: LOWER, upper: UPPER,
                is_beside_solution: #is_beside_solution, parts: self,
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
                opening: &mut [#scalar], forces: &mut [#scalar],
            ) -> #result {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#acceleration(
                    t, exactly(q)?, exactly(u)?, exactly_mut(out.axes)?, exactly_mut(out.momenta)?,
                    exactly_mut(out.rotors)?, exactly_mut(out.closure)?, exactly_mut(opening)?,
                    exactly_mut(forces)?,
                );
                Ok(())
            }
            fn write_projection(
                &self, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::plumbing::ReductionMut<'_, #scalar>,
                residual: &mut [#scalar], openings: [&mut [#scalar]; 2],
            ) -> #result {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                let [row_residual, row_velocity] = openings;
                self.#projection(
                    exactly(q)?, exactly(u)?, exactly_mut(out.axes)?, exactly_mut(out.momenta)?,
                    exactly_mut(out.rotors)?, exactly_mut(out.closure)?, exactly_mut(residual)?,
                    exactly_mut(row_residual)?, exactly_mut(row_velocity)?,
                );
                Ok(())
            }
        }
    }
}
