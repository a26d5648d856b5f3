//! Tools for a workstation around the compiler [`lamc`]: just-in-time compilation, simulation and
//! its records, identification from measurements, pictures, videos and pages. The command `lamc` is
//! the binary of this crate.

pub mod adjoint;
pub mod archive;
#[cfg(feature = "derive")]
pub mod cache;
pub mod check;
#[cfg(test)]
#[allow(dead_code, reason = "a part of it serves here")]
#[path = "../../tests/src/compare.rs"]
mod compare;
pub mod cut;
pub mod execution;
pub mod export;
pub mod folding;
pub mod identify;
mod inertia;
pub mod linear;
pub mod mocap;
pub mod motion;
pub mod optimise;
pub mod page;
pub mod picture;
pub mod reading;
pub mod reference;
pub mod rest;
pub mod scene;
pub mod simulation;
pub mod sweep;
pub mod verify;
