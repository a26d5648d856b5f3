//! The symbolic algebra, behind a door small enough that another engine could stand there.
//!
//! Only this folder names the engine, and none of its types leave: inside a [`session`] there are
//! [`Expr`]s, what leaves is a [`Tree`].
//!
//! Numbers that are not -1, 0 or 1 enter as symbols, so the algebra is exact: it never rounds, and
//! never mistakes a small number for none.

mod expr;
mod session;
mod tree;

pub use expr::Expr;
pub use session::{Algebra, SessionError, session};
pub use tree::{Function, Tree};
