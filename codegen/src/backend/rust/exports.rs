//! The functions of the C header, which the Rust module exports.

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::Options;
use super::items::{Syntax, needs_marker, number, number_types};
use super::straight_line::has;
use crate::backend::c::{OFFERED, offered};
use crate::program::{Argument, Array, FunctionKind, Program, Shape, Size};

/// Returns the exported functions, which call the methods of the mechanism's type.
pub fn exports(program: &Program, options: &Options, syntax: &Syntax) -> TokenStream {
    let exports = Exports::new(program, options, syntax);
    let (starting, moving) = (exports.starting(), exports.moving());
    let functions = OFFERED.into_iter().filter(|&kind| has(program, kind));
    let functions = functions.filter_map(|kind| exports.offered(kind));
    let torques = (!program.interface.driven().is_empty()).then(|| exports.motor_torques());
    quote! {
        #starting
        #moving
        #(#functions)*
        #torques

        fn status(result: ::core::result::Result<(), ::lamc_runtime::Error>) -> i32 {
            match result {
                Ok(()) => 0,
                Err(error) => error.code(),
            }
        }
    }
}

/// Values that all exported functions need.
struct Exports<'a> {
    program: &'a Program,
    /// The number type.
    real: Ident,
    /// The types of the parameters and of the inputs.
    params: TokenStream,
    inputs: TokenStream,
    /// Statements that bind `robot`: with the parameters and inputs of the caller, with the parameters only, or with
    /// those of the model.
    with_numbers: TokenStream,
    with_parameters: TokenStream,
    with_defaults: TokenStream,
}

impl<'a> Exports<'a> {
    fn new(program: &'a Program, options: &Options, syntax: &Syntax) -> Self {
        let model = super::items::model(program);
        let real = format_ident!("{}", if options.c_real().bytes() == 4 { "f32" } else { "f64" });
        let (generic, turbofish) = match syntax.generic.is_empty() {
            true => (quote!(), quote!()),
            false => (quote!(<#real>), quote!(::<#real>)),
        };
        let [params, inputs] = number_types(program, &generic);
        let bare = needs_marker(program, options.scalar)
            .then(|| quote!(, scalar: ::core::marker::PhantomData));
        // In C, the numbers of the drawing follow the parameters.
        let drawing = (program.interface.drawn > 0).then(|| quote!(, drawing: *p.add(1).cast()));
        Self {
            program,
            params,
            inputs,
            with_numbers: quote! {
                let robot = #model #turbofish { params: *p, inputs: *inputs #bare #drawing };
            },
            with_parameters: quote! {
                let inputs = ::core::default::Default::default();
                let robot = #model #turbofish { params: *p, inputs #bare #drawing };
            },
            with_defaults: quote! {
                let robot = <#model #generic as ::core::default::Default>::default();
            },
            real,
        }
    }

    /// Returns a function with the name that it has in the header. A function that can fail returns its
    /// status.
    fn function(
        &self,
        name: &str,
        arguments: &TokenStream,
        returns: Returns,
        body: &TokenStream,
    ) -> TokenStream {
        let name = format_ident!("{}_{name}", self.program.interface.name);
        let doc = format!(" `{name}` of the C header.");
        let returns = matches!(returns, Returns::Status).then(|| quote!(-> i32));
        quote! {
            #[doc = #doc]
            ///
            /// # Safety
            ///
            /// Pointers are as the header declares them: valid, and not overlapping.
            #[allow(unsafe_code, reason = "the C interface")]
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn #name(#arguments) #returns {
                // SAFETY: The caller guarantees what the section above requires.
                unsafe { #body }
            }
        }
    }

    /// Returns the functions for default parameters and inputs, and for the closed initial states.
    fn starting(&self) -> TokenStream {
        let Self { real, params, inputs, with_numbers, .. } = self;
        let constants = quote!(p: *const #params, inputs: *const #inputs);
        let default = |name: &str, argument: &TokenStream, value: &TokenStream| {
            let body = quote!(*#value = ::core::default::Default::default(););
            self.function(name, argument, Returns::Nothing, &body)
        };
        let params_default = match self.program.interface.drawn {
            0 => default("params_default", &quote!(p: *mut #params), &quote!(p)),
            _ => self.drawing(),
        };
        let inputs_default =
            default("inputs_default", &quote!(inputs: *mut #inputs), &quote!(inputs));
        let memory = self.program.interface.memory().count();
        let memory_default = (memory > 0 && has(self.program, FunctionKind::Control)).then(|| {
            let memory = number(memory);
            let with_defaults = &self.with_defaults;
            let body = quote! {
                #with_defaults
                *memory = ::lamc_runtime::Controlled::memory(&robot);
            };
            let argument = quote!(memory: *mut [#real; #memory]);
            self.function("memory_default", &argument, Returns::Nothing, &body)
        });
        let initial = self.function(
            "initial",
            &quote!(q: *mut [#real; NQ], u: *mut [#real; NU], #constants),
            Returns::Status,
            &quote! {
                #with_numbers
                status(robot.assembled().map(|state| {
                    *q = state.q;
                    *u = state.u;
                }))
            },
        );
        let joints = self.joints();
        let assemble = self.function(
            "assemble",
            &quote!(t: #real, q: *mut [#real; NQ], pinned: *const [u8; #joints], #constants),
            Returns::Status,
            &quote! {
                #with_numbers
                let pinned = match pinned.is_null() {
                    true => [false; #joints],
                    false => (*pinned).map(|entry| entry != 0),
                };
                let mut workspace = ::lamc_runtime::Mechanism::workspace(&robot);
                let found =
                    ::lamc_runtime::assemble(&robot, t, &mut *q, &pinned, &mut workspace);
                status(found.map(|_| ()))
            },
        );
        quote!(#params_default #inputs_default #memory_default #initial #assemble)
    }

    /// Returns the functions for default parameters and for the numbers of the drawing.
    fn drawing(&self) -> TokenStream {
        let Self { params, with_defaults, .. } = self;
        let model = super::items::model(self.program);
        let argument = quote!(p: *mut #params);
        let defaults = quote! {
            #with_defaults
            *p = robot.params;
            *p.add(1).cast() = robot.drawing;
        };
        let draw = quote!(*p.add(1).cast() = #model::with_params(*p).drawing;);
        let defaults = self.function("params_default", &argument, Returns::Nothing, &defaults);
        let draw = self.function("draw", &argument, Returns::Nothing, &draw);
        quote!(#defaults #draw)
    }

    /// Returns the functions for projection, the acceleration, and the steps of a motion.
    fn moving(&self) -> TokenStream {
        let Self { real, params, inputs, with_numbers, .. } = self;
        let constants = quote!(p: *const #params, inputs: *const #inputs);
        let project = self.function(
            "project",
            &quote!(t: #real, q: *mut [#real; NQ], u: *mut [#real; NU], #constants),
            Returns::Status,
            &quote! {
                #with_numbers
                let (mut new_q, mut new_u) = (*q, *u);
                let mut workspace = ::lamc_runtime::Mechanism::workspace(&robot);
                let found = ::lamc_runtime::project(
                    &robot, t, &mut new_q, &mut new_u, &mut workspace,
                );
                status(found.map(|_| {
                    *q = new_q;
                    *u = new_u;
                }))
            },
        );
        let state = self.inputs_of(FunctionKind::Acceleration);
        let acceleration = self.function(
            "acceleration",
            &quote!(#state, qdd: *mut [#real; NU]),
            Returns::Status,
            &quote! {
                #with_numbers
                let found = robot.acceleration(t, &*q, &*u);
                status(found.map(|acceleration| *qdd = acceleration))
            },
        );
        let step = self.function(
            "step_rk4",
            &quote! {
                t: *mut #real, q: *mut [#real; NQ], u: *mut [#real; NU], dt: #real, #constants
            },
            Returns::Status,
            &quote! {
                #with_numbers
                let mut state = ::lamc_runtime::State { t: *t, q: *q, u: *u };
                let stepped = ::lamc_runtime::Rk4::new(&robot).step(&robot, &mut state, dt);
                status(stepped.map(|()| {
                    *t = state.t;
                    *q = state.q;
                    *u = state.u;
                }))
            },
        );
        quote!(#project #acceleration #step)
    }

    fn motor_torques(&self) -> TokenStream {
        let Self { real, with_numbers, .. } = self;
        let (state, joints) = (self.inputs_of(FunctionKind::Acceleration), self.joints());
        self.function(
            "motor_torques",
            &quote!(#state, torque: *mut [#real; #joints]),
            Returns::Status,
            &quote! {
                #with_numbers
                let found = ::lamc_runtime::plumbing::motor_torques(&robot, t, &*q, &*u);
                status(found.map(|found| *torque = found))
            },
        )
    }

    /// Returns an exported function that offers a function of the program directly, or `None` if the
    /// function writes nothing for this mechanism.
    fn offered(&self, kind: FunctionKind) -> Option<TokenStream> {
        let signature = kind.signature();
        let outputs: Vec<&Array> = signature.written(&self.program.interface).collect();
        let arguments = self.inputs_of(kind);
        let results = outputs.iter().map(|output| {
            let (name, ty) = (format_ident!("{}", output.name), self.array(output.shape));
            quote!(#name: *mut #ty)
        });
        let inputs = kind.inputs(&self.program.interface);
        let inputs = inputs.filter(|&argument| argument != Argument::Drawing);
        let read = offered(self.program, kind);
        let reads = |argument| read.contains(&argument);
        let robot = match reads(Argument::Parameters) {
            true if reads(Argument::Inputs) => &self.with_numbers,
            true => &self.with_parameters,
            false => &self.with_defaults,
        };
        let given = inputs.filter_map(|argument| match argument {
            Argument::Time => Some(quote!(t)),
            Argument::Parameters | Argument::Inputs => None,
            state => {
                let name = format_ident!("{}", state.name());
                Some(quote!(&*#name))
            }
        });
        let method = format_ident!("{}", signature.name);
        let assignments = outputs.iter().map(|output| {
            let name = format_ident!("{}", output.name);
            // A method with several results returns them as the fields of a struct.
            let field = (signature.outputs.len() > 1).then(|| quote!(.#name));
            match kind {
                FunctionKind::Momentum => {
                    quote!(*#name = [found.centre, found.linear, found.angular];)
                }
                _ => quote!(*#name = found #field;),
            }
        });
        let body = quote! {
            #robot
            let found = robot.#method(#(#given),*);
            #(#assignments)*
        };
        (!outputs.is_empty()).then(|| {
            self.function(
                signature.name,
                &quote!(#arguments, #(#results),*),
                Returns::Nothing,
                &body,
            )
        })
    }

    /// Returns the number of joints: NU where nothing else has speeds.
    fn joints(&self) -> TokenStream {
        let interface = &self.program.interface;
        if interface.free.is_empty() {
            return quote!(NU);
        }
        let joints = number(interface.joints.len());
        quote!(#joints)
    }

    /// Returns what a function reads, as parameters of an exported function.
    fn inputs_of(&self, kind: FunctionKind) -> TokenStream {
        let Self { real, params, inputs, .. } = self;
        let read = offered(self.program, kind).into_iter();
        let parameters = read.map(|argument| match argument {
            Argument::Time => quote!(t: #real),
            Argument::Parameters => quote!(p: *const #params),
            Argument::Inputs => quote!(inputs: *const #inputs),
            state => {
                let (name, array) =
                    (format_ident!("{}", state.name()), self.array(state.array().shape));
                quote!(#name: *const #array)
            }
        });
        quote!(#(#parameters),*)
    }

    /// Returns the type of an array: a matrix of rows and columns, a row, or a single number.
    fn array(&self, shape: Shape) -> TokenStream {
        let real = &self.real;
        let length = |size: Size| match size {
            Size::Coordinates => quote!(NQ),
            Size::Speeds => quote!(NU),
            Size::Rows => quote!(C),
            Size::Residuals => quote!(9 * LOOPS),
            size => {
                let length = number(size.of(&self.program.interface));
                quote!(#length)
            }
        };
        match shape {
            Shape::SCALAR => quote!(#real),
            Shape(rows, Size::Fixed(1)) => {
                let rows = length(rows);
                quote!([#real; #rows])
            }
            Shape(rows, columns) => {
                let (rows, columns) = (length(rows), length(columns));
                quote!([[#real; #columns]; #rows])
            }
        }
    }
}

/// The return type of an exported function.
#[derive(Clone, Copy)]
enum Returns {
    Nothing,
    Status,
}
