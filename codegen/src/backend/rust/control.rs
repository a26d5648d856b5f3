//! The controllers of a module: their names, their methods, and the trait of the runtime.

use proc_macro2::TokenStream;
use quote::quote;

use super::ScalarChoice;
use super::body::constant;
use super::items::{FieldNames, Syntax, allowances, model, number, unused};
use super::straight_line::{has, method};
use crate::program::{ControllerInfo, FunctionKind, Program};

/// The numbers of a program's controllers as tokens, if it has controllers and their function.
struct Counts {
    controllers: proc_macro2::Literal,
    memory: proc_macro2::Literal,
    commands: proc_macro2::Literal,
    /// The argument for the memory of the straight-line function, which has none where nothing is remembered.
    argument: TokenStream,
}

fn counts(program: &Program) -> Option<Counts> {
    let interface = &program.interface;
    let memory = interface.memory().count();
    let is_there = has(program, FunctionKind::Control);
    is_there.then(|| Counts {
        controllers: number(interface.controllers.len()),
        memory: number(memory),
        commands: number(interface.commands().count()),
        argument: if memory > 0 { quote!(memory,) } else { TokenStream::new() },
    })
}

/// Returns the constants with the names of controllers, of what they remember, and of the inputs that they drive.
pub fn names(program: &Program) -> TokenStream {
    let Some(Counts { controllers: count, memory, commands, .. }) = counts(program) else {
        return TokenStream::new();
    };
    let interface = &program.interface;
    let controllers = interface.controllers.iter().map(|controller| &controller.name);
    let remembered = interface.controllers.iter().flat_map(|controller| {
        controller.memory.iter().map(|(name, _)| format!("{}.{name}", controller.name))
    });
    let driven = interface.commands().map(|id| &interface.inputs[id.index()]);
    let unused = unused();
    quote! {
        /// Controllers.
        #unused
        pub const CONTROLLERS: [&str; #count] = [#(#controllers),*];
        /// What the controllers remember, in the order of their memory.
        #unused
        pub const MEMORY: [&str; #memory] = [#(#remembered),*];
        /// The inputs that the controllers drive, in the order of their commands.
        #unused
        pub const COMMANDS: [&str; #commands] = [#(#driven),*];
    }
}

/// Returns the methods for controllers, if there are any.
pub fn methods(program: &Program, syntax: &Syntax) -> TokenStream {
    let Some(Counts { memory, commands, argument, .. }) = counts(program) else {
        return TokenStream::new();
    };
    let Syntax { scalar, zero, .. } = syntax;
    let [nq, n] = [program.interface.coordinates(), program.interface.speeds()].map(number);
    let control = method(FunctionKind::Control);
    quote! {
        /// What all controllers remember at the next sample and command now, from a state and their memory. Before the
        /// first sample the memory is [`Controlled::memory`](::lamc_runtime::Controlled::memory).
        pub fn control(
            &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n], memory: &[#scalar; #memory],
        ) -> ::lamc_runtime::Control<#scalar, #memory, #commands> {
            let (mut next, mut commands) = (*memory, [#zero; #commands]);
            self.#control(t, q, u, #argument &mut next, &mut commands);
            ::lamc_runtime::Control { next, commands }
        }
    }
}

/// Returns the implementation of `Controlled`, if there are controllers.
pub fn controlled(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    fields: &FieldNames,
) -> TokenStream {
    let Some(Counts { controllers: count, memory, commands, argument }) = counts(program) else {
        return TokenStream::new();
    };
    let Syntax { scalar, generic, bound, zero, constants, .. } = syntax;
    let (model, allowances, interface) = (model(program), allowances(), &program.interface);
    let control = method(FunctionKind::Control);
    let remembered = interface.memory().map(|(_, initial)| constant(choice, *initial));
    let descriptions = interface.controllers.iter().map(|it| description(it, choice));
    let inputs = interface.commands().enumerate().map(|(command, id)| {
        let (command, input) = (number(command), &fields.inputs[id.index()]);
        quote!(#command => &mut self.inputs.#input,)
    });
    let memory_of = match argument.is_empty() {
        true => TokenStream::new(),
        false => quote!(exactly(memory)?,),
    };
    let unread = argument.is_empty().then(|| quote!(let _ = memory;));
    quote! {
        #allowances
        impl #bound ::lamc_runtime::Controlled for #model #generic {
            type Memory = [#scalar; #memory];
            type Commands = [#scalar; #commands];
            type Clocks = [::lamc_runtime::Clock; #count];

            fn memory(&self) -> Self::Memory { #constants [#(#remembered),*] }
            fn commands(&self) -> Self::Commands { [#zero; #commands] }
            fn clocks(&self) -> Self::Clocks { ::core::default::Default::default() }
            fn controller(&self, index: usize) -> ::lamc_runtime::Controller<#scalar> {
                #constants
                let controllers: [::lamc_runtime::Controller<#scalar>; #count] = [#(#descriptions),*];
                controllers[index]
            }
            fn write_control(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar], memory: &[#scalar],
                next: &mut [#scalar], commands: &mut [#scalar],
            ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                #unread
                self.#control(
                    t, exactly(q)?, exactly(u)?, #memory_of exactly_mut(next)?, exactly_mut(commands)?,
                );
                Ok(())
            }
            fn set_command(&mut self, command: usize, value: #scalar) {
                let input = match command {
                    #(#inputs)*
                    _ => return,
                };
                *input = value;
            }
        }
    }
}

/// Returns a controller as a value of the runtime.
fn description(controller: &ControllerInfo, choice: ScalarChoice) -> TokenStream {
    let number_of = |value: f64| constant(choice, value);
    let pwm = match &controller.pwm {
        None => quote!(::core::option::Option::None),
        Some(pwm) => {
            let period = number_of(pwm.period);
            let [lower, upper] = pwm.levels.map(number_of);
            let [least, greatest] = pwm.duty.map(number_of);
            quote! {
                ::core::option::Option::Some(::lamc_runtime::Pwm {
                    period: #period, levels: [#lower, #upper], duty: [#least, #greatest],
                })
            }
        }
    };
    let [sample, delay] = [controller.sample, controller.delay].map(number_of);
    let [memory, commands] = [controller.memory.len(), controller.inputs.len()].map(number);
    quote! {
        ::lamc_runtime::Controller {
            sample: #sample, delay: #delay, memory: #memory, commands: #commands, pwm: #pwm,
        }
    }
}
