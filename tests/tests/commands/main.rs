//! Results and output of the workbench commands: fits, angles of motion capture, recorded motions,
//! the reference of the model file and of diagnostics.

mod errors;
mod identify;
mod mocap;
mod motion;
mod schema;
