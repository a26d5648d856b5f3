//! The symbolic algebra, behind an interface small enough that another engine could replace it.
//!
//! Only this folder uses the engine, and none of its types are visible outside: a [`session`] works
//! with [`Expr`]s and returns [`Tree`]s.
//!
//! Numbers other than -1, 0 and 1 enter as symbols ([`Algebra::number`]), so the algebra is exact: it
//! never rounds, never overflows, and never mistakes a small number for zero.
//!
//! The engine orders terms by the age of their symbols. Only `session` creates symbols, and it does so
//! in a way that gives the same output for the same input, whatever was derived before.

mod expr;
mod session;
mod tree;

#[cfg(test)]
mod tests;

pub use expr::Expr;
pub use session::{Algebra, SessionError, patience, session};
pub use tree::{Function, Tree};
