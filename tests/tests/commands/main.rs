//! What the commands of the workbench compute and print: fits, angles of motion capture, recorded
//! motions, the reference of the model file and of diagnostics.

mod errors;
mod identify;
mod mocap;
mod motion;
mod schema;
