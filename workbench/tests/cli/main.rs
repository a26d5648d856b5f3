//! The command `lamc` as a user meets it.

mod broken;
mod common;
mod compile;
mod files;
mod measured;
mod simulate;
mod states;
mod waiting;
