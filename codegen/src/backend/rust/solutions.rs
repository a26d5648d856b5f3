//! The methods of `Mechanism` that solve the equations in straight-line code.

use proc_macro2::TokenStream;
use quote::quote;

use super::reduction;
use super::straight_line::{has, method};
use crate::program::{FunctionKind, Program};

/// Returns the trait methods that solve the equations, if the program has functions for them.
pub fn solutions(program: &Program, scalar: &TokenStream, zero: &TokenStream) -> TokenStream {
    let mut functions = writers(program, scalar, zero);
    let margin = margin(scalar);
    functions.extend(reduction::shown(program, scalar));
    if has(program, FunctionKind::Jacobian) {
        let jacobian = method(FunctionKind::Jacobian);
        functions.extend(quote! {
            fn write_jacobian(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::JacobianMut<'_, #scalar>,
            ) -> #margin {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                let margin = &mut [#zero; 3];
                self.#jacobian(
                    t, exactly(q)?, exactly(u)?, exactly_mut(out.acceleration)?,
                    exactly_mut(out.dq)?, exactly_mut(out.du)?, exactly_mut(out.dt)?, margin,
                );
                let [inverse_pivot, conditioning, pivot] = *margin;
                Ok(Some(::lamc_runtime::plumbing::Margin { inverse_pivot, conditioning, pivot }))
            }
        });
    }
    if has(program, FunctionKind::JacobianParams) {
        let jacobian = method(FunctionKind::JacobianParams);
        functions.extend(quote! {
            fn write_jacobian_params(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar],
                acceleration: &mut [#scalar], dp: &mut [#scalar],
            ) -> #margin {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                let margin = &mut [#zero; 3];
                self.#jacobian(
                    t, exactly(q)?, exactly(u)?, exactly_mut(acceleration)?, exactly_mut(dp)?, margin,
                );
                let [inverse_pivot, conditioning, pivot] = *margin;
                Ok(Some(::lamc_runtime::plumbing::Margin { inverse_pivot, conditioning, pivot }))
            }
        });
    }
    functions
}

/// Returns the type of what methods that solve the equations return.
fn margin(scalar: &TokenStream) -> TokenStream {
    quote! {
        ::core::result::Result<
            ::core::option::Option<::lamc_runtime::plumbing::Margin<#scalar>>,
            ::lamc_runtime::Error,
        >
    }
}

/// Returns the trait methods for acceleration and projection, for single numbers or for lanes, if the
/// program has functions for them.
pub fn writers(program: &Program, scalar: &TokenStream, zero: &TokenStream) -> TokenStream {
    let margin = margin(scalar);
    let [acceleration, projection] =
        [FunctionKind::Acceleration, FunctionKind::Projection].map(method);
    let mut functions = TokenStream::new();
    if has(program, FunctionKind::Acceleration) {
        functions.extend(quote! {
            fn write_acceleration(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar], out: &mut [#scalar],
            ) -> #margin {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                let margin = &mut [#zero; 3];
                self.#acceleration(t, exactly(q)?, exactly(u)?, exactly_mut(out)?, margin);
                let [inverse_pivot, conditioning, pivot] = *margin;
                Ok(Some(::lamc_runtime::plumbing::Margin { inverse_pivot, conditioning, pivot }))
            }
        });
    }
    if has(program, FunctionKind::Projection) {
        functions.extend(quote! {
            fn write_projection(
                &self, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::plumbing::ProjectionMut<'_, #scalar>,
            ) -> #margin {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                let margin = &mut [#zero; 3];
                self.#projection(
                    exactly(q)?, exactly(u)?, exactly_mut(out.residual)?,
                    exactly_mut(out.positions)?, exactly_mut(out.speeds)?, margin,
                );
                let [inverse_pivot, conditioning, pivot] = *margin;
                Ok(Some(::lamc_runtime::plumbing::Margin { inverse_pivot, conditioning, pivot }))
            }
        });
    }
    functions
}
