//! The module's items: sizes, names, parameters, inputs, and the type of the mechanism.

use proc_macro2::{Ident, Literal, Span, TokenStream};
use quote::{format_ident, quote};

use super::body::{Bodies, constant};
use super::control::controlled;
use super::exports::exports;
use super::implementation::{batch, mechanism};
use super::mechanism::model_item;
use super::methods::methods;
use super::reduction;
use super::sizes::sizes;
use super::straight_line::straight_line;
use super::{Options, ScalarChoice};
use crate::backend::identifiers::{Names, type_name};
use crate::program::{Interface, Program};

/// The names of the fields that hold parameters and inputs.
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

/// The parts of the syntax that depend on the number type.
pub struct Syntax {
    /// The number type: `S`, `f64` or `f32`.
    pub scalar: TokenStream,
    /// The generic argument `<S>`, or nothing.
    pub generic: TokenStream,
    /// The bound `<S: ::lamc_runtime::Scalar>`, or nothing.
    pub bound: TokenStream,
    /// The bound `<S: ::lamc_runtime::Arithmetic>`, or nothing.
    pub arithmetic: TokenStream,
    /// The statement `let c = S::from_f64;`, or nothing.
    pub constants: TokenStream,
    /// Zero: `S::ZERO` or `0.0`.
    pub zero: TokenStream,
    /// The statements that define what function bodies call: `constants` and
    /// `let mul_add = S::mul_add;`.
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
            zero: quote!(0.0),
        };
        match choice {
            ScalarChoice::Generic => Self {
                scalar: quote!(S),
                generic: quote!(<S>),
                bound: quote!(<S: ::lamc_runtime::Scalar>),
                arithmetic: quote!(<S: ::lamc_runtime::Arithmetic>),
                constants: quote!(let c = S::from_f64;),
                zero: quote!(S::ZERO),
                locals: quote!(let c = S::from_f64; let mul_add = S::mul_add;),
            },
            ScalarChoice::F64 => concrete(quote!(f64)),
            ScalarChoice::F32 => concrete(quote!(f32)),
        }
    }
}

/// Returns the whole module, in which `__body!(index);` is a placeholder for a text, and these texts.
pub fn module(program: &Program, options: &Options) -> (TokenStream, Vec<String>) {
    let choice = options.scalar;
    let syntax = Syntax::of(choice);
    let fields = FieldNames::of(program);
    let mut bodies = Bodies::new(program, choice, &syntax, &fields);
    let sizes = sizes(program);
    let layout = if options.extern_c { quote!(#[repr(C)]) } else { quote!() };
    let parameters = parameters(program, choice, &syntax, &fields, &layout);
    let inputs = inputs(program, choice, &syntax, &fields, &layout);
    let names = names(program);
    let model = model_item(program, choice, &syntax);
    let methods = methods(program, &syntax);
    let mechanism = mechanism(program, choice, &syntax);
    let reduction = reduction::parts(program, &syntax);
    let straight_line = straight_line(program, &syntax, &mut bodies);
    let controlled = controlled(program, choice, &syntax, &fields);
    let batch = batch(program, choice, &fields);
    let exports = if options.extern_c { exports(program, options, &syntax) } else { quote!() };
    let table = bodies.table();
    let loops = bodies.loops();
    let tables = bodies.tables();
    let (parts, texts) = bodies.finish();
    let parts = parts_of(program, &syntax, &parts);
    let tokens = quote! {
        #sizes #names #table #tables #loops #parameters #inputs #model #methods #mechanism #reduction #controlled #straight_line #parts #batch #exports
    };
    (tokens, texts)
}

/// Returns a count as a literal without a type suffix.
pub fn number(value: usize) -> Literal {
    Literal::usize_unsuffixed(value)
}

/// Returns the attribute that silences the warning about items that a program does not use.
pub fn unused() -> TokenStream {
    quote!(#[allow(dead_code, reason = "a program uses what it needs")])
}

/// Returns a module of typed indices for each kind of named item that the mechanism has.
fn names(program: &Program) -> TokenStream {
    let interface = &program.interface;
    let joint = |joint: &crate::program::JointInfo| {
        let [first, second] = &joint.bodies;
        (
            joint.name.clone(),
            format!(" Joint `{}`: turns `{second}` against `{first}`.", joint.name),
        )
    };
    let plain = |kind: &str, name: &String| (name.clone(), format!(" {kind} `{name}`."));
    let parameters = interface.parameters.iter().map(|p| plain("Parameter", &p.name));
    let modules = [
        ("joint", "Joint", "Joints", interface.joints.iter().map(joint).collect::<Vec<_>>()),
        (
            "body",
            "Body",
            "Bodies",
            interface.bodies.iter().map(|b| plain("Body", &b.name)).collect(),
        ),
        ("point", "Point", "Points", interface.points.iter().map(|p| plain("Point", p)).collect()),
        ("parameter", "Parameter", "Parameters", parameters.collect()),
        ("input", "Input", "Inputs", interface.inputs.iter().map(|i| plain("Input", i)).collect()),
    ];
    let modules = modules.into_iter().filter(|(.., names)| !names.is_empty());
    let modules = modules.map(|(module, ty, what, names)| {
        let (module, ty) = (format_ident!("{module}"), format_ident!("{ty}"));
        let doc = format!(" {what}: indices of arrays and slices.");
        let mut given = Names::default();
        let constants = names.iter().enumerate().map(|(index, (name, doc))| {
            let (index, ident) = (number(index), given.give(name).to_ascii_uppercase());
            let alias = (ident != *name).then(|| quote!(#[doc(alias = #name)]));
            let ident = format_ident!("{ident}");
            quote! {
                #[doc = #doc]
                #alias
                pub const #ident: ::lamc_runtime::#ty = ::lamc_runtime::#ty::new(#index);
            }
        });
        let (constants, unused) = (constants.collect::<TokenStream>(), unused());
        quote! { #[doc = #doc] #unused pub mod #module { #constants } }
    });
    modules.collect()
}

/// Returns a field for each name, with its documentation, and with a doc alias if the spelling had to
/// change.
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

/// A struct of numbers and its default values.
struct Numbers<'a> {
    name: &'a str,
    doc: &'a str,
    members: Vec<TokenStream>,
    fields: &'a [Ident],
    values: Vec<TokenStream>,
    layout: &'a TokenStream,
}

impl Numbers<'_> {
    /// Returns the struct. If it has no members, it has no type parameter either.
    fn write(self, syntax: &Syntax) -> TokenStream {
        let Syntax { generic, arithmetic, constants, .. } = syntax;
        let Self { name, doc, members, fields, values, layout } = self;
        let (name, unused) = (format_ident!("{name}"), unused());
        let doc = format!(" {doc}");
        if members.is_empty() {
            return quote! {
                #[doc = #doc]
                ///
                /// There are none.
                #[derive(Clone, Copy, Debug, Default, PartialEq)]
                #unused
                #layout
                pub struct #name {}
            };
        }
        quote! {
            #[doc = #doc]
            #[derive(Clone, Copy, Debug, PartialEq)]
            #unused
            #layout
            pub struct #name #generic { #(#members,)* }

            impl #arithmetic ::core::default::Default for #name #generic {
                fn default() -> Self {
                    #constants
                    Self { #(#fields: #values,)* }
                }
            }
        }
    }
}

fn parameters(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    fields: &FieldNames,
    layout: &TokenStream,
) -> TokenStream {
    let list = &program.interface.parameters;
    let names: Vec<_> = list.iter().map(|p| p.name.clone()).collect();
    let docs: Vec<_> = list.iter().map(|p| format!("{} Default: {:?}.", p.doc, p.value)).collect();
    Numbers {
        name: "Params",
        doc: "Numbers that can be changed at run time, SI.",
        members: declarations(&names, &docs, &fields.parameters, &syntax.scalar).collect(),
        fields: &fields.parameters,
        values: list.iter().map(|p| constant(choice, p.value)).collect(),
        layout,
    }
    .write(syntax)
}

fn inputs(
    program: &Program,
    choice: ScalarChoice,
    syntax: &Syntax,
    fields: &FieldNames,
    layout: &TokenStream,
) -> TokenStream {
    let names = &program.interface.inputs;
    let docs: Vec<_> = names.iter().map(|name| format!("Input `{name}`, SI.")).collect();
    Numbers {
        name: "Inputs",
        doc: "Numbers set by the caller at every step, SI; zero at first.",
        members: declarations(names, &docs, &fields.inputs, &syntax.scalar).collect(),
        fields: &fields.inputs,
        values: names.iter().map(|_| constant(choice, 0.0)).collect(),
        layout,
    }
    .write(syntax)
}

/// Returns the types of the parameter struct and the input struct for this number type.
pub fn number_types(program: &Program, generic: &TokenStream) -> [TokenStream; 2] {
    let Interface { parameters, inputs, .. } = &program.interface;
    let ty = |name: TokenStream, is_empty: bool| match is_empty {
        true => name,
        false => quote!(#name #generic),
    };
    [ty(quote!(Params), parameters.is_empty()), ty(quote!(Inputs), inputs.is_empty())]
}

/// Returns whether the number type occurs in no public field, so that a private marker field must hold
/// it.
pub fn needs_marker(program: &Program, choice: ScalarChoice) -> bool {
    let Interface { parameters, inputs, .. } = &program.interface;
    choice == ScalarChoice::Generic && parameters.is_empty() && inputs.is_empty()
}

/// Returns the name of the mechanism's type.
pub fn model(program: &Program) -> Ident {
    format_ident!("{}", type_name(&program.interface.name))
}

/// Returns the attributes that silence lints in functions with many statements.
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

/// Returns the functions into which long bodies are split.
fn parts_of(program: &Program, syntax: &Syntax, parts: &TokenStream) -> TokenStream {
    if parts.is_empty() {
        return TokenStream::new();
    }
    let Syntax { generic, arithmetic, .. } = syntax;
    let (model, allowances) = (model(program), allowances());
    quote! { #allowances impl #arithmetic #model #generic { #parts } }
}

/// Returns the type of a state.
pub fn state(program: &Program, scalar: &TokenStream) -> TokenStream {
    let Interface { free, .. } = &program.interface;
    let [nq, nu] = [program.interface.coordinates(), program.interface.speeds()].map(number);
    match free.is_empty() {
        true => quote!(::lamc_runtime::State<[#scalar; #nq], #scalar>),
        false => quote!(::lamc_runtime::State<[#scalar; #nq], #scalar, [#scalar; #nu]>),
    }
}
