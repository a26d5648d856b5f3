//! The constants of a module: its sizes, and the names of what it has.

use proc_macro2::TokenStream;
use quote::quote;

use super::control;
use super::items::{number, unused};
use crate::program::Program;

/// Returns the constants.
pub fn sizes(program: &Program) -> TokenStream {
    let interface = &program.interface;
    let (n, rows) = (number(interface.joints.len()), number(interface.rows));
    let (nq, nu) = (number(interface.coordinates()), number(interface.speeds()));
    let (loops, bodies) = (number(interface.loops.len()), number(interface.bodies.len()));
    let points = number(interface.points.len());
    let joint_names = interface.joints.iter().map(|joint| &joint.name);
    let body_names = interface.bodies.iter().map(|body| &body.name);
    let point_names = &interface.points;
    let (unused, control) = (unused(), control::names(program));
    let [coordinates, speeds] = docs(interface.free.is_empty());
    let free_names = interface.free.iter().map(|body| &body.name);
    let count = number(interface.free.len());
    let free = (!interface.free.is_empty()).then(|| {
        quote! {
            /// Free bodies, in the order of q and u.
            #unused
            pub const FREE_BODIES: [&str; #count] = [#(#free_names),*];
        }
    });
    let contacts = (!interface.contacts.is_empty()).then(|| {
        let (names, count) = (&interface.contacts, number(interface.contacts.len()));
        quote! {
            /// Contact points: the contact, then the point or the body and its corner.
            #unused
            pub const CONTACTS: [&str; #count] = [#(#names),*];
        }
    });
    quote! {
        #[doc = #coordinates]
        #unused
        pub const NQ: usize = #nq;
        #[doc = #speeds]
        #unused
        pub const NU: usize = #nu;
        /// Closure rows of the acceleration.
        #unused
        pub const C: usize = #rows;
        /// Closed loops: nine closure residuals each.
        #unused
        pub const LOOPS: usize = #loops;
        /// Joints, in the order of q and u.
        #unused
        pub const JOINTS: [&str; #n] = [#(#joint_names),*];
        #free
        /// Bodies, in the order of the poses.
        #unused
        pub const BODIES: [&str; #bodies] = [#(#body_names),*];
        /// Output points.
        #unused
        pub const POINTS: [&str; #points] = [#(#point_names),*];
        #contacts
        #control
    }
}

/// Returns the documentation of NQ and NU.
fn docs(joints_only: bool) -> [&'static str; 2] {
    match joints_only {
        true => [" NQ: coordinates, one angle per joint.", " NU: speeds, as many as coordinates."],
        false => [
            " NQ: coordinates: one angle per joint; then per free body its displacement (m) and its unit \
             quaternion w x y z.",
            " NU: speeds: one per joint; then per free body its velocity (m/s) in the base frame and its \
             angular velocity (rad/s) in its own.",
        ],
    }
}
