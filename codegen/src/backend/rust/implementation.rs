//! Implementations of the runtime's traits: `Mechanism`, and `Batch`, which computes one design per
//! SIMD lane.

use proc_macro2::{Ident, TokenStream};
use quote::{format_ident, quote};

use super::ScalarChoice;
use super::body::constant;
use super::contacts::contacts;
use super::items::{FieldNames, Syntax, allowances, model, needs_marker, number};
use super::reduction;
use super::solutions::{solutions, writers};
use super::straight_line::{has, method};
use crate::program::{FunctionKind, JointInfo, Program};

/// Returns the implementation of `Mechanism`.
pub fn mechanism(program: &Program, choice: ScalarChoice, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, generic, bound, constants, zero, .. } = syntax;
    let (model, interface) = (model(program), &program.interface);
    let [nq, n] = [interface.coordinates(), interface.speeds()].map(number);
    let square = number(interface.speeds() * interface.speeds());
    let (bodies, points) = (number(interface.bodies.len()), number(interface.points.len()));
    let table = |f: &dyn Fn(&JointInfo) -> f64, free: Vec<f64>| {
        let entries = interface.joints.iter().map(f).chain(free);
        let entries: Vec<_> = entries.map(|value| constant(choice, value)).collect();
        quote!([#(#entries),*])
    };
    let limits = interface.joints.iter().map(|joint| {
        let [least, greatest] = joint.limits.map(|limit| constant(choice, limit));
        quote!([#least, #greatest])
    });
    let unlimited = [f64::NEG_INFINITY, f64::INFINITY].map(|limit| constant(choice, limit));
    let free = &interface.free;
    let positions = table(&|joint| joint.initial_q, free.iter().flat_map(|body| body.q).collect());
    let speeds = table(&|joint| joint.initial_u, free.iter().flat_map(|body| body.u).collect());
    let pinned = interface.joints.iter().map(|joint| joint.initial_given);
    let (dimensions, allowances) = (dimensions(program), allowances());
    let (evaluations, functions) = (evaluations(program, syntax), functions(program, syntax));
    let (size, steps) = (constant(choice, interface.size), steps(program, scalar, false));
    quote! {
        #dimensions

        #allowances
        impl #bound ::lamc_runtime::Mechanism for #model #generic {
            type Scalar = #scalar;
            type Coordinates = [#scalar; #nq];
            type Speeds = [#scalar; #n];
            type Matrix = [#scalar; #square];
            type Workspace = [#scalar; ::lamc_runtime::plumbing::workspace_len(DIMENSIONS)];
            type Poses = [[#scalar; 12]; #bodies];
            type Points = [[#scalar; 3]; #points];

            fn dimensions(&self) -> ::lamc_runtime::plumbing::Dimensions { DIMENSIONS }
            fn speeds(&self) -> Self::Speeds { [#zero; #n] }
            fn matrix(&self) -> Self::Matrix { [#zero; #square] }
            fn workspace(&self) -> Self::Workspace {
                [#zero; ::lamc_runtime::plumbing::workspace_len(DIMENSIONS)]
            }
            fn size(&self) -> #scalar { #constants #size }
            fn limits(&self, joint: usize) -> [#scalar; 2] {
                #constants
                [#(#limits),*].get(joint).copied().unwrap_or([#(#unlimited),*])
            }
            fn initial(&self) -> ::lamc_runtime::StateOf<Self> {
                #constants
                ::lamc_runtime::State { t: #zero, q: #positions, u: #speeds }
            }
            fn is_pinned(&self, joint: usize) -> bool {
                [#(#pinned),*].get(joint).copied().unwrap_or(false)
            }
            #steps
            #evaluations
            #functions
        }
    }
}

/// Returns the trait methods that change the coordinates of free bodies, if there are any; for lanes without
/// the one that no algorithm of theirs needs.
fn steps(program: &Program, scalar: &TokenStream, in_lanes: bool) -> TokenStream {
    if program.interface.free.is_empty() {
        return TokenStream::new();
    }
    let joints = number(program.interface.joints.len());
    let difference = (!in_lanes).then(|| {
        quote! {
            fn write_difference(&self, from: &[#scalar], to: &[#scalar], out: &mut [#scalar]) {
                ::lamc_runtime::free_body::write_difference(from, to, out, #joints);
            }
        }
    });
    quote! {
        fn advance(&self, q: &mut [#scalar], step: &[#scalar]) {
            ::lamc_runtime::free_body::advance(q, step, #joints);
        }
        fn write_rates(&self, q: &[#scalar], u: &[#scalar], out: &mut [#scalar]) {
            ::lamc_runtime::free_body::write_rates(q, u, out, #joints);
        }
        #difference
        fn normalise(&self, q: &mut [#scalar]) {
            ::lamc_runtime::free_body::normalise(q, #joints);
        }
    }
}

/// Returns the trait methods that evaluate a state besides its equations, if the program has functions
/// for them.
fn evaluations(program: &Program, syntax: &Syntax) -> TokenStream {
    let scalar = &syntax.scalar;
    let model = model(program);
    let result = |ty: TokenStream| quote!(::core::result::Result<#ty, ::lamc_runtime::Error>);
    let mut functions = TokenStream::new();
    if has(program, FunctionKind::Energy) {
        let result = result(quote!(::lamc_runtime::Energy<#scalar>));
        functions.extend(quote! {
            fn energy(&self, t: #scalar, q: &Self::Coordinates, u: &Self::Speeds) -> #result {
                Ok(#model::energy(self, t, q, u))
            }
        });
    }
    if has(program, FunctionKind::Momentum) {
        let result = result(quote!(::lamc_runtime::Momentum<#scalar>));
        functions.extend(quote! {
            fn momentum(&self, q: &Self::Coordinates, u: &Self::Speeds) -> #result {
                Ok(#model::momentum(self, q, u))
            }
        });
    }
    if has(program, FunctionKind::Poses) {
        let result = result(quote!(Self::Poses));
        functions.extend(quote! {
            fn poses(&self, q: &Self::Coordinates) -> #result { Ok(#model::poses(self, q)) }
        });
    }
    if has(program, FunctionKind::Points) {
        let result = result(quote!(Self::Points));
        let points = match program.interface.points.is_empty() {
            true => quote!([]),
            false => quote!(#model::points(self, q)),
        };
        functions.extend(quote! {
            fn points(&self, q: &Self::Coordinates) -> #result { Ok(#points) }
        });
    }
    functions
}

fn dimensions(program: &Program) -> TokenStream {
    let interface = &program.interface;
    let [nq, nu, joints, rows, rank, loops, bodies, points, contacts, drives, parameters, inputs] =
        [
            interface.coordinates(),
            interface.speeds(),
            interface.joints.len(),
            interface.rows,
            interface.rank,
            interface.loops.len(),
            interface.bodies.len(),
            interface.points.len(),
            interface.contacts.len(),
            interface.driven().len(),
            interface.parameters.len(),
            interface.inputs.len(),
        ]
        .map(number);
    let reduction = reduction::sizes(program);
    quote! {
        const DIMENSIONS: ::lamc_runtime::plumbing::Dimensions =
            ::lamc_runtime::plumbing::Dimensions {
                coordinates: #nq, speeds: #nu, joints: #joints, rows: #rows, rank: #rank, loops: #loops,
                bodies: #bodies, points: #points, contacts: #contacts, drives: #drives,
                parameters: #parameters, inputs: #inputs, reduction: #reduction,
            };
    }
}

/// Returns the trait methods that read and write slices.
fn functions(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let [equations, closure] = [FunctionKind::Equations, FunctionKind::Closure].map(method);
    let (drives, balances) = (drives(program, syntax), balances(program, scalar));
    let solutions = solutions(program, scalar, zero);
    quote! {
        fn write_equations(
            &self, t: #scalar, q: &[#scalar], u: &[#scalar],
            out: ::lamc_runtime::plumbing::EquationsMut<'_, #scalar>,
        ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
            use ::lamc_runtime::plumbing::{exactly, exactly_mut};
            self.#equations(
                t, exactly(q)?, exactly(u)?, exactly_mut(out.mass)?, exactly_mut(out.forcing)?,
                exactly_mut(out.jacobian)?, exactly_mut(out.gamma)?,
            );
            Ok(())
        }
        fn write_closure(
            &self, q: &[#scalar], residual: &mut [#scalar], jacobian: &mut [#scalar],
        ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
            use ::lamc_runtime::plumbing::{exactly, exactly_mut};
            self.#closure(exactly(q)?, exactly_mut(residual)?, exactly_mut(jacobian)?);
            Ok(())
        }
        #balances
        #drives
        #solutions
    }
}

/// Returns the trait methods that write forces: those of contacts, and those that read accelerations and
/// closure forces, if the program has functions for them.
fn balances(program: &Program, scalar: &TokenStream) -> TokenStream {
    let [reactions, tangent] = [FunctionKind::Reactions, FunctionKind::Tangent].map(method);
    let balance = quote! {
        at.t, exactly(at.q)?, exactly(at.u)?, exactly(at.acceleration)?, exactly(at.multipliers)?
    };
    let mut functions = contacts(program, scalar);
    if has(program, FunctionKind::Reactions) {
        functions.extend(quote! {
            fn write_reactions(
                &self, at: ::lamc_runtime::plumbing::Balance<'_, #scalar>, out: &mut [#scalar],
            ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#reactions(#balance, exactly_mut(out)?);
                Ok(())
            }
        });
    }
    if has(program, FunctionKind::Tangent) {
        functions.extend(quote! {
            fn write_tangent(
                &self, at: ::lamc_runtime::plumbing::Balance<'_, #scalar>,
                change: ::lamc_runtime::Change<'_, #scalar>,
                forces: &mut [#scalar], closure: &mut [#scalar],
            ) -> ::core::result::Result<(), ::lamc_runtime::Error> {
                use ::lamc_runtime::plumbing::{exactly, exactly_mut};
                self.#tangent(
                    #balance, change.t, exactly(change.q)?, exactly(change.u)?,
                    exactly(change.parameters)?, exactly(change.inputs)?, exactly_mut(forces)?,
                    exactly_mut(closure)?,
                );
                Ok(())
            }
        });
    }
    functions
}

/// Returns the method that visits each driven joint once.
fn drives(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let driven = program.interface.driven();
    if driven.is_empty() {
        return TokenStream::new();
    }
    let length = number(4 * driven.len());
    let drives = method(FunctionKind::Drives);
    let visits = driven.iter().enumerate().map(|(index, joint)| {
        let joint = number(joint.index());
        let [position, speed, acceleration, jerk] = [0, 1, 2, 3].map(|k| number(4 * index + k));
        quote! {
            visit(::lamc_runtime::plumbing::Drive {
                joint: #joint, position: drives[#position], speed: drives[#speed],
                acceleration: drives[#acceleration], jerk: drives[#jerk],
            });
        }
    });
    quote! {
        fn drives(
            &self, t: #scalar, mut visit: impl FnMut(::lamc_runtime::plumbing::Drive<#scalar>),
        ) {
            let drives = &mut [#zero; #length];
            self.#drives(t, drives);
            #(#visits)*
        }
    }
}

/// Returns the implementation of `Batch` for a module that is generic over the number type.
pub fn batch(program: &Program, choice: ScalarChoice, fields: &FieldNames) -> TokenStream {
    if choice != ScalarChoice::Generic {
        return TokenStream::new();
    }
    let (model, interface) = (model(program), &program.interface);
    let [nq, n] = [interface.coordinates(), interface.speeds()].map(number);
    let residuals = number(9 * interface.loops.len());
    let of_lane = |of: &str, fields: &[Ident]| {
        let of = format_ident!("{of}");
        quote!(#(#fields: self.#of.#fields.lane(lane)),*)
    };
    let parameters = of_lane("params", &fields.parameters);
    let inputs = of_lane("inputs", &fields.inputs);
    let bare = match interface.drawn {
        0 => needs_marker(program, choice).then(|| quote!(, scalar: ::core::marker::PhantomData)),
        _ => Some(quote!(, drawing: self.drawing.map(|number| number.lane(lane)))),
    };
    let functions = batch_functions(program);
    let allowances = allowances();
    quote! {
        #allowances
        impl<S: ::lamc_runtime::Lanes> ::lamc_runtime::Batch<S> for #model<S> {
            type Lane = #model<S::Number>;
            type Coordinates = [S; #nq];
            type Speeds = [S; #n];
            type Residual = [S; #residuals];

            fn lane(&self, lane: usize) -> Self::Lane {
                #model { params: Params { #parameters }, inputs: Inputs { #inputs } #bare }
            }
            fn zeros(&self) -> ::lamc_runtime::StatesOf<Self, S> {
                ::lamc_runtime::State { t: S::ZERO, q: [S::ZERO; #nq], u: [S::ZERO; #n] }
            }
            fn residual(&self) -> Self::Residual { [S::ZERO; #residuals] }
            #functions
        }
    }
}

/// Returns the methods of `Batch` for which the program has functions.
fn batch_functions(program: &Program) -> TokenStream {
    let mut functions = writers(program, &quote!(S), &quote!(S::ZERO));
    functions.extend(steps(program, &quote!(S), true));
    functions
}
