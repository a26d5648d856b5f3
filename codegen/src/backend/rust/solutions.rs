//! The implementations of what solves: `StraightLine`, and `Batch` for a design in each lane.

use proc_macro2::{Ident, TokenStream};
use quote::quote;

use super::ScalarChoice;
use super::body::{Bodies, constant};
use super::items::{FieldNames, Syntax, allowances, filled, model};
use crate::program::{FunctionKind, Program};

/// The functions that solve, where the program has them.
pub fn straight_line(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    bodies: &mut Bodies,
) -> TokenStream {
    let (scalar, zero) = (&syntax.scalar, constant(choice, 0.0));
    let none = quote!(::lamc_runtime::Margin::none());
    let solving = quote! {
        let Some(q) = q.first_chunk::<N>() else { return #none };
        let Some(u) = u.first_chunk::<N>() else { return #none };
        let margin = &mut [#zero; 2];
    };
    let mut functions = TokenStream::new();
    let acceleration = program.function_of(FunctionKind::Acceleration);
    let trusted = quote! {
        ::lamc_runtime::Margin { inverse_pivot: margin[0], conditioning: margin[1] }
    };
    if !acceleration.outputs.is_empty() {
        let body = filled(acceleration, syntax, &["out"], &solving, bodies, &none);
        functions.extend(quote! {
            fn write_acceleration(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar], out: &mut [#scalar],
            ) -> ::lamc_runtime::Margin<#scalar> { #body #trusted }
        });
    }
    let projection = program.function_of(FunctionKind::Projection);
    let places = ["out.residual", "out.positions", "out.speeds"];
    if !projection.outputs.is_empty() {
        let body = filled(projection, syntax, &places, &solving, bodies, &none);
        functions.extend(quote! {
            fn write_projection(
                &self, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::ProjectionMut<'_, #scalar>,
            ) -> ::lamc_runtime::Margin<#scalar> { #body #trusted }
        });
    }
    let jacobian = program.function_of(FunctionKind::Jacobian);
    let places = ["out.acceleration", "out.dq", "out.du", "out.dt"];
    if !jacobian.outputs.is_empty() {
        let body = filled(jacobian, syntax, &places, &solving, bodies, &none);
        functions.extend(quote! {
            fn write_jacobian(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::JacobianMut<'_, #scalar>,
            ) -> ::lamc_runtime::Margin<#scalar> { #body #trusted }
        });
    }
    let Syntax { generic, arithmetic, .. } = syntax;
    let (model, allowances) = (model(program), allowances());
    quote! {
        #allowances
        impl #arithmetic ::lamc_runtime::StraightLine for #model #generic {
            type Number = #scalar;
            #functions
        }
    }
}

/// A design in each lane, of a module for every number type.
pub fn batch(program: &Program, choice: ScalarChoice, fields: &FieldNames) -> TokenStream {
    if choice != ScalarChoice::Generic {
        return TokenStream::new();
    }
    let model = model(program);
    let of_lane = |of: TokenStream, fields: &[Ident]| match fields {
        [] => quote!(marker: ::core::marker::PhantomData),
        fields => quote!(#(#fields: #of.#fields.lane(lane)),*),
    };
    let parameters = of_lane(quote!(self.params), &fields.parameters);
    let inputs = of_lane(quote!(self.inputs), &fields.inputs);
    let allowances = allowances();
    quote! {
        #allowances
        impl<S: ::lamc_runtime::Lanes> ::lamc_runtime::Batch<S, N, C> for #model<S> {
            type Lane = #model<S::Number>;
            type Residual = [S; 9 * LOOPS];

            fn lane(&self, lane: usize) -> Self::Lane {
                #model { params: Params { #parameters }, inputs: Inputs { #inputs } }
            }
        }
    }
}
