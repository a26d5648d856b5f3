//! The functions of the C header, exported by the Rust module.

use proc_macro2::TokenStream;
use quote::{format_ident, quote};

use super::Options;
use super::items::{Syntax, is_bare, number_types};
use crate::program::Program;

/// The exported functions, around the module's type.
pub fn exports(program: &Program, options: &Options, syntax: &Syntax) -> TokenStream {
    let interface = &program.interface;
    let model = super::items::model(program);
    let real = format_ident!("{}", if options.c_real().bytes() == 4 { "f32" } else { "f64" });
    let generic = if syntax.generic.is_empty() { quote!() } else { quote!(<#real>) };
    let [params, inputs] = number_types(program, &generic);
    let robot = quote!(#model #generic);
    let (bodies, points) = (interface.bodies.len(), interface.points.len());
    let turbofish = if syntax.generic.is_empty() { quote!() } else { quote!(::<#real>) };
    let constants = quote!(p: *const #params, inputs: *const #inputs);
    let motion = quote!(t: #real, q: *const [#real; NQ], u: *const [#real; NU], #constants);
    let export = |suffix: &str, arguments: TokenStream, returns: TokenStream, body: TokenStream| {
        let name = format_ident!("{}_{suffix}", interface.name);
        let doc = format!(" `{name}` of the C header.");
        quote! {
            #[doc = #doc]
            ///
            /// # Safety
            ///
            /// Pointers are as the header declares them: valid, and not overlapping.
            #[allow(unsafe_code, reason = "the C interface")]
            #[unsafe(no_mangle)]
            pub unsafe extern "C" fn #name(#arguments) #returns {
                // SAFETY: what is asked of the caller.
                unsafe { #body }
            }
        }
    };
    let status = quote!(-> i32);
    let none = || quote!();
    let bare =
        is_bare(program, options.scalar).then(|| quote!(, scalar: ::core::marker::PhantomData));
    let with_robot = quote!(let robot = #model #turbofish { params: *p, inputs: *inputs #bare };);
    let mut functions = vec![
        export(
            "params_default",
            quote!(p: *mut #params),
            none(),
            quote!(*p = ::core::default::Default::default();),
        ),
        export(
            "inputs_default",
            quote!(inputs: *mut #inputs),
            none(),
            quote!(*inputs = ::core::default::Default::default();),
        ),
        export(
            "initial",
            quote!(q: *mut [#real; NQ], u: *mut [#real; NU], #constants),
            status.clone(),
            quote! {
                #with_robot
                status(robot.assembled().map(|state| {
                    *q = state.q;
                    *u = state.u;
                }))
            },
        ),
        export(
            "assemble",
            quote!(t: #real, q: *mut [#real; NQ], pinned: *const [u8; NU], #constants),
            status.clone(),
            quote! {
                #with_robot
                let pinned = match pinned.is_null() {
                    true => [false; NU],
                    false => (*pinned).map(|entry| entry != 0),
                };
                let mut workspace = ::lamc_runtime::Mechanism::workspace(&robot);
                let found =
                    ::lamc_runtime::assemble(&robot, t, &mut *q, &pinned, &mut workspace);
                status(found.map(|_| ()))
            },
        ),
        export(
            "project",
            quote!(t: #real, q: *mut [#real; NQ], u: *mut [#real; NU], #constants),
            status.clone(),
            quote! {
                #with_robot
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
        ),
        export(
            "acceleration",
            quote!(#motion, qdd: *mut [#real; NU]),
            status.clone(),
            quote! {
                #with_robot
                let found = robot.acceleration(t, &*q, &*u);
                status(found.map(|acceleration| *qdd = acceleration))
            },
        ),
        export(
            "step_rk4",
            quote! {
                t: *mut #real, q: *mut [#real; NQ], u: *mut [#real; NU], dt: #real, #constants
            },
            status.clone(),
            quote! {
                #with_robot
                let mut state = ::lamc_runtime::State { t: *t, q: *q, u: *u };
                let stepped = ::lamc_runtime::Rk4::new(&robot).step(&robot, &mut state, dt);
                status(stepped.map(|()| {
                    *t = state.t;
                    *q = state.q;
                    *u = state.u;
                }))
            },
        ),
    ];
    let (closure_arguments, closure_results) = match interface.rows {
        0 => (none(), none()),
        _ => (
            quote!(, jacobian: *mut [[#real; NU]; C], gamma: *mut [#real; C]),
            quote!(*jacobian = found.jacobian; *gamma = found.gamma;),
        ),
    };
    functions.push(export(
        "equations",
        quote! {
            #motion, mass: *mut [[#real; NU]; NU], forcing: *mut [#real; NU] #closure_arguments
        },
        none(),
        quote! {
            #with_robot
            let found = robot.equations(t, &*q, &*u);
            *mass = found.mass;
            *forcing = found.forcing;
            #closure_results
        },
    ));
    let still = quote! { let robot = <#robot as ::core::default::Default>::default(); };
    if !interface.loops.is_empty() {
        functions.push(export(
            "closure",
            quote! {
                q: *const [#real; NQ], residual: *mut [#real; 9 * LOOPS],
                jacobian: *mut [[#real; NU]; 9 * LOOPS]
            },
            none(),
            quote! {
                #still
                let found = robot.closure(&*q);
                *residual = found.residual;
                *jacobian = found.jacobian;
            },
        ));
    }
    functions.push(export(
        "poses",
        quote!(q: *const [#real; NQ], poses: *mut [[#real; 12]; #bodies]),
        none(),
        quote! {
            #still
            *poses = robot.poses(&*q);
        },
    ));
    if points > 0 {
        functions.push(export(
            "points",
            quote!(q: *const [#real; NQ], points: *mut [[#real; 3]; #points]),
            none(),
            quote! {
                #still
                *points = robot.points(&*q);
            },
        ));
    }
    functions.push(export(
        "energy",
        quote!(#motion, kinetic: *mut #real, potential: *mut #real),
        none(),
        quote! {
            #with_robot
            let energy = robot.energy(t, &*q, &*u);
            *kinetic = energy.kinetic;
            *potential = energy.potential;
        },
    ));
    if !interface.driven().is_empty() {
        functions.push(export(
            "motor_torques",
            quote!(#motion, torque: *mut [#real; NU]),
            status,
            quote! {
                #with_robot
                let found = robot.forces(t, &*q, &*u);
                status(found.map(|forces| *torque = forces.motor))
            },
        ));
    }
    quote! {
        #(#functions)*

        fn status(result: ::core::result::Result<(), ::lamc_runtime::Error>) -> i32 {
            match result {
                Ok(()) => 0,
                Err(error) => error.code(),
            }
        }
    }
}
