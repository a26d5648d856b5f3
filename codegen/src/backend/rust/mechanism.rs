//! The type of the mechanism, with its parameters and inputs.

use proc_macro2::TokenStream;
use quote::quote;

use super::ScalarChoice;
use super::items::number;
use super::items::{Syntax, model, needs_marker, number_types, unused};
use crate::program::Program;
use crate::source::free::COORDINATES;

/// Returns the type of the mechanism.
pub fn model_item(program: &Program, choice: ScalarChoice, syntax: &Syntax) -> TokenStream {
    let interface = &program.interface;
    let Syntax { generic, arithmetic, .. } = syntax;
    let model = model(program);
    let mut docs = vec![format!(" The mechanism `{}`.", interface.name), String::new()];
    docs.push(" | q | joint | turns | against |".to_owned());
    docs.push(" |---|---|---|---|".to_owned());
    for (index, joint) in interface.joints.iter().enumerate() {
        let [first, second] = &joint.bodies;
        docs.push(format!(" | {index} | `{}` | `{second}` | `{first}` |", joint.name));
    }
    let first = interface.joints.len();
    for (index, body) in interface.free.iter().enumerate() {
        let at = first + COORDINATES * index;
        let last = at + COORDINATES - 1;
        docs.push(format!(" | {at} to {last} | | `{}` | moves freely |", body.name));
    }
    docs.push(String::new());
    docs.push(format!(
        " Mobility {}; {} closed loop(s).",
        interface.mobility,
        interface.loops.len()
    ));
    let [params, inputs] = number_types(program, generic);
    let (bare, bare_value) = match needs_marker(program, choice) {
        true => (
            quote!(scalar: ::core::marker::PhantomData<S>,),
            quote!(scalar: ::core::marker::PhantomData,),
        ),
        false => Default::default(),
    };
    let unused = unused();
    if interface.drawn > 0 {
        return drawn_model_item(program, syntax, &docs);
    }
    quote! {
        #(#[doc = #docs])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #unused
        pub struct #model #generic {
            /// Parameters.
            pub params: #params,
            /// Inputs.
            pub inputs: #inputs,
            #bare
        }

        impl #arithmetic ::core::default::Default for #model #generic {
            fn default() -> Self {
                Self {
                    params: ::core::default::Default::default(),
                    inputs: ::core::default::Default::default(),
                    #bare_value
                }
            }
        }
    }
}

/// Returns the type of a mechanism whose drawing depends on parameters: they are set together with the numbers that
/// follow from them.
fn drawn_model_item(program: &Program, syntax: &Syntax, docs: &[String]) -> TokenStream {
    let Syntax { generic, arithmetic, scalar, .. } = syntax;
    let model = model(program);
    let [params, inputs] = number_types(program, generic);
    let (unused, drawn, zero) = (unused(), number(program.interface.drawn), syntax.zero.clone());
    quote! {
        #(#[doc = #docs])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        #unused
        pub struct #model #generic {
            params: #params,
            /// Inputs.
            pub inputs: #inputs,
            drawing: [#scalar; #drawn],
        }

        impl #arithmetic ::core::default::Default for #model #generic {
            fn default() -> Self {
                Self::with_params(::core::default::Default::default())
            }
        }

        #unused
        impl #arithmetic #model #generic {
            /// The mechanism with these parameters, and all inputs zero.
            pub fn with_params(params: #params) -> Self {
                let mut robot = Self {
                    params,
                    inputs: ::core::default::Default::default(),
                    drawing: [#zero; #drawn],
                };
                robot.set_params(params);
                robot
            }

            /// The parameters.
            pub fn params(&self) -> &#params {
                &self.params
            }

            /// Changes the parameters, and computes the numbers of the drawing that follow from them.
            pub fn set_params(&mut self, params: #params) {
                self.params = params;
                let mut drawing = self.drawing;
                self.drawing_into(&mut drawing);
                self.drawing = drawing;
            }
        }
    }
}
