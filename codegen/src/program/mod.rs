//! Stage 5: [`Equations`](crate::kane::Equations) -> [`Program`]: straight-line code in SSA form.

mod ir;

pub use ir::*;
