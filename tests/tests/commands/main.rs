//! What the commands of the workbench compute: fits, angles of motion capture, recorded motions.

mod identify;
mod mocap;
mod motion;
