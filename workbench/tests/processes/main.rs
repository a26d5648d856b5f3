//! What happens to files and to other processes when a command is killed, when another one runs beside it, and when
//! the system has no room, no right to write or no symbolic engine for it.
//!
//! `LAMC_KILLS=200` kills as many processes as docs/RELIABILITY.md reports; the tests alone kill fewer.

mod beside;
#[path = "../commands/common.rs"]
#[allow(dead_code, reason = "a part of it serves here")]
mod common;
mod engine;
mod full;
mod killed;
mod live;
mod outputs;
