//! Stage 6: [`Program`](crate::program::Program) -> text.

pub mod c;
pub mod identifiers;
pub mod literal;
pub mod rust;
pub mod statements;
mod text;
