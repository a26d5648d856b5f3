//! Stage 6: [`Program`](crate::program::Program) -> text, or machine code in this process.

pub mod identifiers;
pub mod jit;
pub mod rust;
