//! The symbolic algebra, behind an interface small enough that another engine could replace it.
//!
//! Only this folder names the engine, and none of its types leave: inside a [`session`] there are
//! [`Expr`]s, what leaves is a [`Tree`].
//!
//! Numbers other than -1, 0 and 1 enter as symbols ([`Algebra::number`]), so the algebra is exact: it
//! never rounds, never overflows, and never mistakes a small number for zero.
//!
//! The engine orders terms by the age of their symbols. How symbols are made, so that equal input
//! gives equal output whatever was derived before, is decided in `session` only.

mod expr;
mod session;
mod tree;

#[cfg(test)]
mod tests;

pub use expr::Expr;
pub use session::{Algebra, SessionError, session};
pub use tree::{Function, Tree};
