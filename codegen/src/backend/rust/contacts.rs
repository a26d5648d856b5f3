//! The trait methods of mechanisms with contacts.

use proc_macro2::TokenStream;
use quote::quote;

use super::straight_line::{has, method};
use crate::program::{FunctionKind, Program};

/// Returns the trait methods that write forces and gaps of contact points, if the program has functions for them.
pub fn contacts(program: &Program, scalar: &TokenStream) -> TokenStream {
    let mut functions = TokenStream::new();
    if has(program, FunctionKind::Contacts) && !program.interface.contacts.is_empty() {
        let contacts = method(FunctionKind::Contacts);
        functions.extend(quote! {
            fn write_contacts(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar], out: &mut [#scalar],
            ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#contacts(t, exactly(q)?, exactly(u)?, exactly_mut(out)?);
                Ok(())
            }
        });
    }
    if has(program, FunctionKind::Gaps) {
        let gaps = method(FunctionKind::Gaps);
        functions.extend(quote! {
            fn write_gaps(
                &self, t: #scalar, q: &[#scalar],
                out: ::lamc_runtime::plumbing::GapsMut<'_, #scalar>,
            ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#gaps(
                    t, exactly(q)?, exactly_mut(out.gap)?, exactly_mut(out.friction)?,
                    exactly_mut(out.normal)?, exactly_mut(out.rows)?,
                );
                Ok(())
            }
        });
    }
    functions
}
