//! Stage 6: [`Program`](crate::program::Program) -> text.

pub mod c;
mod constants;
pub mod fmu;
pub mod identifiers;
pub mod literal;
pub mod loops;
mod naming;
pub mod python;
pub mod rust;
pub mod statements;
pub mod tables;
mod text;
