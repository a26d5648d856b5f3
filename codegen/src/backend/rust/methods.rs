//! The methods of the mechanism's type. They take and return arrays, and users need not import a trait.

use proc_macro2::TokenStream;
use quote::quote;

use super::control;
use super::items::{Syntax, model, number, state, unused};
use super::straight_line::{has, method};
use crate::program::{FunctionKind, Program};

/// Returns all methods.
pub fn methods(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { generic, bound, .. } = syntax;
    let (model, unused) = (model(program), unused());
    let (algorithms, solutions) = (algorithms(program, syntax), solutions(program, syntax));
    let (evaluations, optional) = (evaluations(program, syntax), optional(program, syntax));
    let (momentum, control) = (momentum(program, syntax), control::methods(program, syntax));
    quote! {
        #unused
        #[allow(clippy::type_complexity, reason = "a state and what was found")]
        impl #bound #model #generic { #algorithms #solutions #evaluations #momentum #control #optional }
    }
}

/// Returns the methods that run an algorithm of the runtime: assembly, equilibrium, projection, steps
/// and the acceleration.
fn algorithms(program: &Program, syntax: &Syntax) -> TokenStream {
    let scalar = &syntax.scalar;
    let [nq, n] = [program.interface.coordinates(), program.interface.speeds()].map(number);
    let state = state(program, scalar);
    let error = quote!(::lamc_runtime::Error);
    let settled = has(program, FunctionKind::Tangent).then(|| settled(&state, scalar));
    quote! {
        /// The initial state with closed loops: assembled from the model's guess, the joints whose
        /// angles the model states pinned, and with speeds that the closure allows.
        ///
        /// # Errors
        ///
        /// As [`assemble`](::lamc_runtime::assemble) and [`project`](fn@::lamc_runtime::project).
        pub fn assembled(&self) -> ::core::result::Result<#state, #error> {
            ::lamc_runtime::Mechanism::assembled(self)
        }

        #settled

        /// Moves a state onto the closure, by the least change weighted with the mass matrix.
        ///
        /// # Errors
        ///
        /// As [`project`](fn@::lamc_runtime::project); the state may then have moved.
        pub fn project(&self, state: &mut #state) -> ::core::result::Result<(), #error> {
            ::lamc_runtime::Mechanism::project(self, state)
        }

        /// Advances a state by `dt` (s): Runge-Kutta of order 4, with projection. For more than a step,
        /// an [`Rk4`](::lamc_runtime::Rk4) of one's own keeps its storage.
        ///
        /// # Errors
        ///
        /// As [`Rk4::step`](::lamc_runtime::Rk4::step); the state is then unchanged.
        pub fn step(&self, state: &mut #state, dt: #scalar) -> ::core::result::Result<(), #error> {
            ::lamc_runtime::Mechanism::step(self, state, dt)
        }

        /// du/dt, rad/s^2, with closed loops.
        ///
        /// # Errors
        ///
        /// As [`acceleration`](fn@::lamc_runtime::acceleration).
        pub fn acceleration(
            &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
        ) -> ::core::result::Result<[#scalar; #n], #error> {
            ::lamc_runtime::Mechanism::acceleration(self, t, q, u)
        }
    }
}

/// Returns the method that finds the state of rest, which needs derivatives.
fn settled(state: &TokenStream, scalar: &TokenStream) -> TokenStream {
    let error = quote!(::lamc_runtime::Error);
    quote! {
        /// The state of rest downhill from [`assembled`](Self::assembled), at t = 0: gravity, springs,
        /// torques and forces in balance on closed loops.
        ///
        /// # Errors
        ///
        /// As [`assemble`](::lamc_runtime::assemble) and
        /// [`equilibrium`](fn@::lamc_runtime::equilibrium).
        pub fn settled(
            &self,
        ) -> ::core::result::Result<(#state, ::lamc_runtime::Equilibrium<#scalar>), #error> {
            ::lamc_runtime::Mechanism::settled(self)
        }
    }
}

/// Returns the methods that solve the equations at a state and return more than the acceleration.
fn solutions(program: &Program, syntax: &Syntax) -> TokenStream {
    let scalar = &syntax.scalar;
    let interface = &program.interface;
    let [nq, n, joints, rows] =
        [interface.coordinates(), interface.speeds(), interface.joints.len(), interface.rows]
            .map(number);
    let error = quote!(::lamc_runtime::Error);
    let mut methods = TokenStream::new();
    if has(program, FunctionKind::Reactions) {
        methods.extend(quote! {
            /// du/dt and what holds the constraints: closure forces, motor torques, and what each hinge
            /// carries.
            ///
            /// # Errors
            ///
            /// As [`acceleration`](fn@::lamc_runtime::acceleration).
            pub fn forces(
                &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
            ) -> ::core::result::Result<::lamc_runtime::Forces<#scalar, #n, #rows, #joints>, #error> {
                ::lamc_runtime::plumbing::forces(self, t, q, u)
            }
        });
    }
    if has(program, FunctionKind::Tangent) || has(program, FunctionKind::Jacobian) {
        methods.extend(quote! {
            /// du/dt and its derivatives by q, u and t.
            ///
            /// # Errors
            ///
            /// As [`jacobian`](fn@::lamc_runtime::jacobian).
            pub fn jacobian(
                &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
            ) -> ::core::result::Result<::lamc_runtime::Jacobian<#scalar, #n>, #error> {
                ::lamc_runtime::plumbing::jacobian(self, t, q, u)
            }
        });
    }
    if has(program, FunctionKind::JacobianParams) {
        let [parameters, inputs] = [interface.parameters.len(), interface.inputs.len()].map(number);
        methods.extend(quote! {
            /// du/dt and its derivative by the parameters, in their order.
            ///
            /// # Errors
            ///
            /// As [`derivatives_along`](fn@::lamc_runtime::derivatives_along).
            pub fn jacobian_params(
                &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
            ) -> ::core::result::Result<
                ::lamc_runtime::JacobianParams<#scalar, #n, #parameters>, #error
            > {
                ::lamc_runtime::plumbing::jacobian_params::<_, #n, #parameters, #inputs>(self, t, q, u)
            }
        });
    }
    methods
}

/// Returns the methods that evaluate functions of a state.
fn evaluations(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let interface = &program.interface;
    let (speeds, c) = (interface.speeds(), interface.rows);
    let [nq, n, rows] = [interface.coordinates(), speeds, c].map(number);
    let (square, rows_by_n) = (number(speeds * speeds), number(c * speeds));
    let equations = method(FunctionKind::Equations);
    quote! {
        /// M, f, J and gamma at a state: M du/dt = f + J^T lambda, J du/dt = -gamma.
        pub fn equations(
            &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
        ) -> ::lamc_runtime::Equations<#scalar, #n, #rows> {
            let (mut mass, mut forcing) = ([#zero; #square], [#zero; #n]);
            let (mut jacobian, mut gamma) = ([#zero; #rows_by_n], [#zero; #rows]);
            self.#equations(t, q, u, &mut mass, &mut forcing, &mut jacobian, &mut gamma);
            ::lamc_runtime::Equations {
                mass: ::lamc_runtime::plumbing::matrix(&mass),
                forcing,
                jacobian: ::lamc_runtime::plumbing::matrix(&jacobian),
                gamma,
            }
        }
    }
}

/// Returns the methods that exist only for some mechanisms and some selections of functions.
fn optional(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let interface = &program.interface;
    let [nq, n] = [interface.coordinates(), interface.speeds()].map(number);
    let mut methods = TokenStream::new();
    if has(program, FunctionKind::Energy) {
        let energy = method(FunctionKind::Energy);
        methods.extend(quote! {
            /// Energies at a state, J.
            pub fn energy(
                &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
            ) -> ::lamc_runtime::Energy<#scalar> {
                let (kinetic, potential) = (&mut [#zero], &mut [#zero]);
                self.#energy(t, q, u, kinetic, potential);
                ::lamc_runtime::Energy { kinetic: kinetic[0], potential: potential[0] }
            }
        });
    }
    if has(program, FunctionKind::Poses) {
        let (bodies, poses) = (interface.bodies.len(), method(FunctionKind::Poses));
        let (length, bodies) = (number(12 * bodies), number(bodies));
        methods.extend(quote! {
            /// The pose of each body: R row-major, then p in m; what is drawn at x lies at R x + p in the
            /// base frame.
            pub fn poses(&self, q: &[#scalar; #nq]) -> [[#scalar; 12]; #bodies] {
                let poses = &mut [#zero; #length];
                self.#poses(q, poses);
                ::lamc_runtime::plumbing::matrix(poses)
            }
        });
    }
    if has(program, FunctionKind::Points) && !interface.points.is_empty() {
        let (count, points) = (interface.points.len(), method(FunctionKind::Points));
        let (length, count) = (number(3 * count), number(count));
        methods.extend(quote! {
            /// The position of each point in the base frame, m.
            pub fn points(&self, q: &[#scalar; #nq]) -> [[#scalar; 3]; #count] {
                let points = &mut [#zero; #length];
                self.#points(q, points);
                ::lamc_runtime::plumbing::matrix(points)
            }
        });
    }
    methods.extend(contacts(program, syntax));
    methods.extend(closure(program, syntax));
    methods
}

/// Returns the method that evaluates contacts, if there are any.
fn contacts(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let [nq, n] = [program.interface.coordinates(), program.interface.speeds()].map(number);
    let count = program.interface.contacts.len();
    if !has(program, FunctionKind::Contacts) || count == 0 {
        return TokenStream::new();
    }
    let contacts = method(FunctionKind::Contacts);
    let (length, count) = (number(6 * count), number(count));
    quote! {
        /// Per contact point its position, m, and the force on its body, N, in the base frame.
        pub fn contacts(
            &self, t: #scalar, q: &[#scalar; #nq], u: &[#scalar; #n],
        ) -> [[#scalar; 6]; #count] {
            let contacts = &mut [#zero; #length];
            self.#contacts(t, q, u, contacts);
            ::lamc_runtime::plumbing::matrix(contacts)
        }
    }
}

/// Returns the method for momenta, if the program has a function for it.
fn momentum(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let [nq, n] = [program.interface.coordinates(), program.interface.speeds()].map(number);
    let mut methods = TokenStream::new();
    if has(program, FunctionKind::Momentum) {
        let momentum = method(FunctionKind::Momentum);
        methods.extend(quote! {
            /// Centre of mass and momenta of all moving bodies together, in the base frame.
            pub fn momentum(
                &self, q: &[#scalar; #nq], u: &[#scalar; #n],
            ) -> ::lamc_runtime::Momentum<#scalar> {
                let momentum = &mut [#zero; 9];
                self.#momentum(q, u, momentum);
                let [centre, linear, angular] = ::lamc_runtime::plumbing::matrix(momentum);
                ::lamc_runtime::Momentum { centre, linear, angular }
            }
        });
    }
    methods
}

/// Returns the method for the closure, if there are loops.
fn closure(program: &Program, syntax: &Syntax) -> TokenStream {
    let Syntax { scalar, zero, .. } = syntax;
    let interface = &program.interface;
    let (speeds, r) = (interface.speeds(), 9 * interface.loops.len());
    let [nq, n] = [interface.coordinates(), speeds].map(number);
    let mut methods = TokenStream::new();
    if r > 0 {
        let (residuals, entries, closure) =
            (number(r), number(r * speeds), method(FunctionKind::Closure));
        methods.extend(quote! {
            /// Nine residuals per loop, m, and their Jacobian.
            pub fn closure(&self, q: &[#scalar; #nq]) -> ::lamc_runtime::Closure<#scalar, #n, #residuals> {
                let (mut residual, mut jacobian) = ([#zero; #residuals], [#zero; #entries]);
                self.#closure(q, &mut residual, &mut jacobian);
                let jacobian = ::lamc_runtime::plumbing::matrix(&jacobian);
                ::lamc_runtime::Closure { residual, jacobian }
            }
        });
    }
    methods
}
