//! What runs on a workstation around the compiler [`lamc`]: machine code in process, simulation and its
//! records, identification from measurements, pictures, videos and pages. The command `lamc` is its binary.

pub mod archive;
pub mod execution;
pub mod identify;
pub mod mocap;
pub mod motion;
pub mod page;
pub mod picture;
pub mod scene;
pub mod simulation;
