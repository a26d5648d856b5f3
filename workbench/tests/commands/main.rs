//! The command `lamc` as a user meets it, and what its commands are made of.

mod broken;
mod cache;
mod common;
#[allow(dead_code, reason = "a part of it serves here")]
#[path = "../../../tests/src/compare.rs"]
mod compare;
mod compile;
mod cut;
mod designs;
mod figures;
mod files;
mod fold;
mod infinitesimal;
mod meaning;
mod measured;
mod nearly_singular;
#[path = "../../../tests/src/not_checked.rs"]
mod not_checked;
mod pictures;
mod reference;
mod refused;
mod rigid;
mod round_trip;
mod rounded;
mod simulate;
mod states;
mod sweep;
mod waiting;
