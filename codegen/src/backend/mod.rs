//! Stage 6: [`Program`](crate::program::Program) -> text.
