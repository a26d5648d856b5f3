//! The module's items: constants, parameters, inputs, the mechanism and its implementations.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{format_ident, quote};

use super::body::{Bodies, constant};
use super::exports::exports;
use super::solutions::{batch, straight_line};
use super::{Options, ScalarChoice};
use crate::backend::identifiers::{Names, type_name};
use crate::program::{Function, FunctionKind, Program};

/// The fields that hold parameters and inputs.
pub struct FieldNames {
    pub parameters: Vec<Ident>,
    pub inputs: Vec<Ident>,
}

impl FieldNames {
    fn of(program: &Program) -> Self {
        let fields = |names: Vec<&String>| {
            let mut given = Names::default();
            let ident = |name: &String| Ident::new(&given.give(name), Span::call_site());
            names.into_iter().map(ident).collect()
        };
        Self {
            parameters: fields(program.interface.parameters.iter().map(|p| &p.name).collect()),
            inputs: fields(program.interface.inputs.iter().collect()),
        }
    }
}

/// The pieces of syntax that depend on the number type.
pub struct Syntax {
    /// `S`, `f64` or `f32`.
    pub scalar: TokenStream,
    /// `<S>` or nothing.
    pub generic: TokenStream,
    /// `<S: ::lamc_runtime::Scalar>` or nothing.
    bound: TokenStream,
    /// `<S: ::lamc_runtime::Arithmetic>` or nothing.
    pub arithmetic: TokenStream,
    /// `let c = S::from_f64;` or nothing.
    constants: TokenStream,
    /// What function bodies call: that and `let mul_add = S::mul_add;`.
    pub locals: TokenStream,
}

impl Syntax {
    fn of(choice: ScalarChoice) -> Self {
        let concrete = |scalar: TokenStream| Self {
            locals: quote!(let mul_add = <#scalar as ::lamc_runtime::Arithmetic>::mul_add;),
            scalar,
            generic: TokenStream::new(),
            bound: TokenStream::new(),
            arithmetic: TokenStream::new(),
            constants: TokenStream::new(),
        };
        match choice {
            ScalarChoice::Generic => Self {
                scalar: quote!(S),
                generic: quote!(<S>),
                bound: quote!(<S: ::lamc_runtime::Scalar>),
                arithmetic: quote!(<S: ::lamc_runtime::Arithmetic>),
                constants: quote!(let c = S::from_f64;),
                locals: quote!(let c = S::from_f64; let mul_add = S::mul_add;),
            },
            ScalarChoice::F64 => concrete(quote!(f64)),
            ScalarChoice::F32 => concrete(quote!(f32)),
        }
    }
}

/// The whole module, where `__body!(index);` stands for a text, and the texts.
pub fn module(program: &Program, options: &Options) -> (TokenStream, Vec<String>) {
    let choice = options.scalar;
    let syntax = Syntax::of(choice);
    let fields = FieldNames::of(program);
    let mut bodies = Bodies::new(program, choice, &syntax, &fields);
    let constants = constants(program);
    let layout = if options.extern_c { quote!(#[repr(C)]) } else { quote!() };
    let parameters = parameters(program, choice, &syntax, &fields, &layout);
    let inputs = inputs(program, choice, &syntax, &fields, &layout);
    let mechanism = mechanism(program, &syntax);
    let system = system(program, choice, &syntax, &mut bodies);
    let straight_line = straight_line(program, choice, &syntax, &mut bodies);
    let front = front(program, &syntax);
    let batch = batch(program, choice, &fields);
    let exports = if options.extern_c { exports(program, options, &syntax) } else { quote!() };
    let (parts, texts) = bodies.finish();
    let parts = parts_of(program, &syntax, &parts);
    let tokens = quote! {
        #constants #parameters #inputs #mechanism #system #straight_line #front #batch #parts #exports
    };
    (tokens, texts)
}

/// A count without a suffix.
pub fn number(value: usize) -> Literal {
    Literal::usize_unsuffixed(value)
}

fn constants(program: &Program) -> TokenStream {
    let interface = &program.interface;
    let (n, rows) = (number(interface.joints.len()), number(interface.rows));
    let (loops, bodies) = (number(interface.loops.len()), number(interface.bodies.len()));
    let points = number(interface.points.len());
    let joint_names = interface.joints.iter().map(|joint| &joint.name);
    let body_names = interface.bodies.iter().map(|body| &body.name);
    let point_names = &interface.points;
    quote! {
        /// Coordinates: one angle per joint.
        pub const N: usize = #n;
        /// Closure rows of the acceleration.
        pub const C: usize = #rows;
        /// Closed loops: nine closure residuals each.
        pub const LOOPS: usize = #loops;
        /// Joints, in the order of q and u.
        pub const JOINTS: [&str; N] = [#(#joint_names),*];
        /// Bodies, in the order of the poses.
        pub const BODIES: [&str; #bodies] = [#(#body_names),*];
        /// Output points.
        pub const POINTS: [&str; #points] = [#(#point_names),*];
    }
}

/// A field for each name, its documentation, and the alias where its spelling changed.
fn declarations<'a>(
    names: &'a [String],
    docs: &'a [String],
    fields: &'a [Ident],
    scalar: &'a TokenStream,
) -> impl Iterator<Item = TokenStream> + 'a {
    names.iter().zip(docs).zip(fields).map(move |((name, doc), field)| {
        let doc = format!(" {doc}");
        let alias = (field != name.as_str()).then(|| quote!(#[doc(alias = #name)]));
        quote! { #[doc = #doc] #alias pub #field: #scalar }
    })
}

/// What stands for the members of a struct without any.
fn marker(is_empty: bool, generic: bool) -> [TokenStream; 2] {
    if is_empty && generic {
        [
            quote! {
                /// Without members.
                pub marker: ::core::marker::PhantomData<S>,
            },
            quote!(marker: ::core::marker::PhantomData,),
        ]
    } else {
        Default::default()
    }
}

fn parameters(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    fields: &FieldNames,
    layout: &TokenStream,
) -> TokenStream {
    let Syntax { scalar, generic, arithmetic, constants, .. } = syntax;
    let list = &program.interface.parameters;
    let names: Vec<_> = list.iter().map(|p| p.name.clone()).collect();
    let docs: Vec<_> = list.iter().map(|p| format!("{} Default: {:?}.", p.doc, p.value)).collect();
    let members = declarations(&names, &docs, &fields.parameters, scalar);
    let [marker, marker_value] = marker(list.is_empty(), choice == ScalarChoice::Generic);
    let idents = &fields.parameters;
    let values = list.iter().map(|p| constant(choice, p.value));
    let constants = if list.is_empty() { &TokenStream::new() } else { constants };
    quote! {
        /// Numbers that can be changed at run time, SI.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #layout
        pub struct Params #generic { #(#members,)* #marker }

        impl #arithmetic ::core::default::Default for Params #generic {
            fn default() -> Self {
                #constants
                Self { #(#idents: #values,)* #marker_value }
            }
        }
    }
}

fn inputs(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    fields: &FieldNames,
    layout: &TokenStream,
) -> TokenStream {
    let Syntax { scalar, generic, arithmetic, constants, .. } = syntax;
    let names = &program.interface.inputs;
    let docs: Vec<_> = names.iter().map(|name| format!("Input `{name}`, SI.")).collect();
    let members = declarations(names, &docs, &fields.inputs, scalar);
    let [marker, marker_value] = marker(names.is_empty(), choice == ScalarChoice::Generic);
    let idents = &fields.inputs;
    let values = names.iter().map(|_| constant(choice, 0.0));
    let constants = if names.is_empty() { &TokenStream::new() } else { constants };
    quote! {
        /// Numbers set by the caller at every step, SI; zero at first.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #layout
        pub struct Inputs #generic { #(#members,)* #marker }

        impl #arithmetic ::core::default::Default for Inputs #generic {
            fn default() -> Self {
                #constants
                Self { #(#idents: #values,)* #marker_value }
            }
        }
    }
}

/// The type's name.
pub fn model(program: &Program) -> Ident {
    format_ident!("{}", type_name(&program.interface.name))
}

fn mechanism(program: &Program, syntax: &Syntax) -> TokenStream {
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
    docs.push(String::new());
    docs.push(format!(
        " Mobility {}; {} closed loop(s).",
        interface.mobility,
        interface.loops.len()
    ));
    quote! {
        #(#[doc = #docs])*
        #[derive(Clone, Copy, Debug, PartialEq)]
        pub struct #model #generic {
            /// Parameters.
            pub params: Params #generic,
            /// Inputs.
            pub inputs: Inputs #generic,
        }

        impl #arithmetic ::core::default::Default for #model #generic {
            fn default() -> Self {
                Self {
                    params: ::core::default::Default::default(),
                    inputs: ::core::default::Default::default(),
                }
            }
        }
    }
}

fn system(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    bodies: &mut Bodies,
) -> TokenStream {
    let Syntax { scalar, generic, bound, constants, locals, .. } = syntax;
    let model = model(program);
    let interface = &program.interface;
    let position = quote!(let Some(q) = q.first_chunk::<N>() else { return };);
    let motion = quote!(#position let Some(u) = u.first_chunk::<N>() else { return };);
    let balance = quote! {
        let t = at.t;
        let Some(q) = at.q.first_chunk::<N>() else { return };
        let Some(u) = at.u.first_chunk::<N>() else { return };
        let Some(a) = at.acceleration.first_chunk::<N>() else { return };
        let Some(lambda) = at.multipliers.first_chunk::<C>() else { return };
    };
    let (parameter_count, input_count) =
        (number(interface.parameters.len()), number(interface.inputs.len()));
    let directed = quote! {
        #balance
        let dt = change.t;
        let Some(dq) = change.q.first_chunk::<N>() else { return };
        let Some(du) = change.u.first_chunk::<N>() else { return };
        let Some(dp) = change.parameters.first_chunk::<#parameter_count>() else { return };
        let Some(di) = change.inputs.first_chunk::<#input_count>() else { return };
    };
    let mut filled = |kind, places: &[&str], given: &TokenStream| {
        filled(program.function_of(kind), syntax, places, given, bodies, &TokenStream::new())
    };
    let equations_body = filled(
        FunctionKind::Equations,
        &["out.mass", "out.forcing", "out.jacobian", "out.gamma"],
        &motion,
    );
    let closure_body = filled(FunctionKind::Closure, &["residual", "jacobian"], &position);
    let poses_body = filled(FunctionKind::Poses, &["out"], &position);
    let points_body = filled(FunctionKind::Points, &["out"], &position);
    let reactions_body = filled(FunctionKind::Reactions, &["out"], &balance);
    let tangent_body = filled(FunctionKind::Tangent, &["forces", "closure"], &directed);
    let energy_body = bodies.write(program.function_of(FunctionKind::Energy));
    let drives_body = drive_visits(program, choice, syntax, bodies);
    let allowances = allowances();
    let nan = constant(choice, f64::NAN);
    let zero = constant(choice, 0.0);
    let table = |f: &dyn Fn(&crate::program::JointInfo) -> f64| {
        let entries: Vec<_> = interface.joints.iter().map(|j| constant(choice, f(j))).collect();
        quote!([#(#entries),*])
    };
    let least = table(&|joint| joint.limits[0]);
    let greatest = table(&|joint| joint.limits[1]);
    let positions = table(&|joint| joint.initial_q);
    let speeds = table(&|joint| joint.initial_u);
    let given = interface.joints.iter().map(|joint| joint.initial_given);
    let size = constant(choice, interface.size);
    let (infinity, minus_infinity) =
        (constant(choice, f64::INFINITY), constant(choice, f64::NEG_INFINITY));
    quote! {
        #allowances
        impl #bound ::lamc_runtime::System for #model #generic {
            type Scalar = #scalar;
            type Vector = [#scalar; N];
            type Matrix = [#scalar; N * N];
            type Workspace = [#scalar; ::lamc_runtime::workspace_len(DIMENSIONS)];

            fn dimensions(&self) -> ::lamc_runtime::Dimensions { DIMENSIONS }
            fn vector(&self) -> Self::Vector { #constants [#zero; N] }
            fn matrix(&self) -> Self::Matrix { #constants [#zero; N * N] }
            fn workspace(&self) -> Self::Workspace {
                #constants
                [#zero; ::lamc_runtime::workspace_len(DIMENSIONS)]
            }
            fn size(&self) -> #scalar { #constants #size }
            fn limits(&self, joint: usize) -> [#scalar; 2] {
                #constants
                let (least, greatest) = (#least, #greatest);
                match (least.get(joint), greatest.get(joint)) {
                    (Some(&least), Some(&greatest)) => [least, greatest],
                    _ => [#minus_infinity, #infinity],
                }
            }
            fn initial_position(&self, joint: usize) -> #scalar {
                #constants
                #positions.get(joint).copied().unwrap_or(#zero)
            }
            fn initial_speed(&self, joint: usize) -> #scalar {
                #constants
                #speeds.get(joint).copied().unwrap_or(#zero)
            }
            fn is_pinned(&self, joint: usize) -> bool {
                [#(#given),*].get(joint).copied().unwrap_or(false)
            }
            fn write_equations(
                &self, t: #scalar, q: &[#scalar], u: &[#scalar],
                out: ::lamc_runtime::EquationsMut<'_, #scalar>,
            ) { #equations_body }
            fn write_closure(
                &self, q: &[#scalar], residual: &mut [#scalar], jacobian: &mut [#scalar],
            ) { #closure_body }
            fn write_poses(&self, q: &[#scalar], out: &mut [#scalar]) { #poses_body }
            fn write_points(&self, q: &[#scalar], out: &mut [#scalar]) { #points_body }
            fn energy(&self, t: #scalar, q: &[#scalar], u: &[#scalar])
                -> ::lamc_runtime::Energy<#scalar>
            {
                #locals
                let (Some(q), Some(u)) = (q.first_chunk::<N>(), u.first_chunk::<N>()) else {
                    return ::lamc_runtime::Energy { kinetic: #nan, potential: #nan };
                };
                let (kinetic, potential) = (&mut [#zero], &mut [#zero]);
                #energy_body
                ::lamc_runtime::Energy { kinetic: kinetic[0], potential: potential[0] }
            }
            fn drives(&self, t: #scalar, mut visit: impl FnMut(::lamc_runtime::Drive<#scalar>)) {
                #drives_body
            }
            fn write_reactions(
                &self, at: ::lamc_runtime::Balance<'_, #scalar>, out: &mut [#scalar],
            ) { #reactions_body }
            fn write_tangent(
                &self, at: ::lamc_runtime::Balance<'_, #scalar>,
                change: ::lamc_runtime::Change<'_, #scalar>,
                forces: &mut [#scalar], closure: &mut [#scalar],
            ) { #tangent_body }
        }
    }
}

/// What is allowed to functions of many statements.
pub fn allowances() -> TokenStream {
    quote! {
        #[allow(
            clippy::approx_constant, clippy::excessive_precision, clippy::too_many_arguments,
            unused_mut, unused_variables,
            reason = "numbers of the drawing; not every function reads everything it is given"
        )]
        #[rustfmt::skip]
    }
}

/// The functions that parts of long ones are.
fn parts_of(program: &Program, syntax: &Syntax, parts: &TokenStream) -> TokenStream {
    if parts.is_empty() {
        return TokenStream::new();
    }
    let Syntax { generic, arithmetic, .. } = syntax;
    let (model, allowances) = (model(program), allowances());
    quote! { #allowances impl #arithmetic #model #generic { #parts } }
}

/// What is given, then every output assigned to an array of exactly its length, at these places;
/// returns `otherwise` where one is too short.
pub fn filled(
    function: &Function,
    syntax: &Syntax,
    places: &[&str],
    given: &TokenStream,
    bodies: &mut Bodies,
    otherwise: &TokenStream,
) -> TokenStream {
    let mut arrays = TokenStream::new();
    for (output, place) in function.outputs.iter().zip(places) {
        if !output.entries.is_empty() {
            let (name, length) = (format_ident!("{}", output.name), number(output.entries.len()));
            let path = place.split('.').map(|part| format_ident!("{part}"));
            arrays.extend(quote! {
                let Some(#name) = #(#path).*.first_chunk_mut::<#length>() else { return #otherwise };
            });
        }
    }
    if arrays.is_empty() {
        return TokenStream::new();
    }
    let (locals, body) = (&syntax.locals, bodies.write(function));
    quote! { #locals #given #arrays #body }
}

/// One visit per driven joint.
fn drive_visits(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    bodies: &mut Bodies,
) -> TokenStream {
    let driven = program.interface.driven();
    if driven.is_empty() {
        return TokenStream::new();
    }
    let (locals, zero) = (&syntax.locals, constant(choice, 0.0));
    let length = number(4 * driven.len());
    let body = bodies.write(program.function_of(FunctionKind::Drives));
    let visits = driven.iter().enumerate().map(|(index, joint)| {
        let joint = number(joint.index());
        let [position, speed, acceleration, jerk] = [0, 1, 2, 3].map(|k| number(4 * index + k));
        quote! {
            visit(::lamc_runtime::Drive {
                joint: #joint, position: drives[#position], speed: drives[#speed],
                acceleration: drives[#acceleration], jerk: drives[#jerk],
            });
        }
    });
    quote! { #locals let drives = &mut [#zero; #length]; #body #(#visits)* }
}

fn front(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, generic, bound, .. } = syntax;
    let model = model(program);
    let interface = &program.interface;
    let (n, rows) = (number(interface.joints.len()), number(interface.rows));
    let (loops, bodies) = (number(interface.loops.len()), number(interface.bodies.len()));
    let points = number(interface.points.len());
    let [drives, parameters, inputs] =
        [interface.driven().len(), interface.parameters.len(), interface.inputs.len()].map(number);
    quote! {
        const DIMENSIONS: ::lamc_runtime::Dimensions = ::lamc_runtime::Dimensions {
            coordinates: #n, rows: #rows, loops: #loops, bodies: #bodies, points: #points,
            drives: #drives, parameters: #parameters, inputs: #inputs,
        };

        impl #bound ::lamc_runtime::Mechanism<#scalar, N, C> for #model #generic {
            type Residual = [#scalar; 9 * LOOPS];
            type ResidualJacobian = [[#scalar; N]; 9 * LOOPS];
            type Poses = [[#scalar; 12]; #bodies];
            type Points = [[#scalar; 3]; #points];

        }
    }
}
