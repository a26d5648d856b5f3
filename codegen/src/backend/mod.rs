//! Stage 6: [`Program`](crate::program::Program) -> text.

pub mod identifiers;
pub mod rust;
