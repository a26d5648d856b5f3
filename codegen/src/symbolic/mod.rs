//! The symbolic algebra, behind a door small enough that another engine could stand there.
//!
//! Only this folder names the engine, and none of its types leave: what leaves is a [`Tree`].

mod tree;

pub use tree::{Function, Tree};
