//! Functions of long mechanisms as tables: the kinds of rows, and the text that generated modules hold.
//!
//! The compiler writes rows as text ([`encode`]), the macro `tables` of the runtime reads them while a module is compiled
//! ([`decode`]), and both make of them the words that the runtime evaluates ([`words`]).

#![cfg_attr(not(feature = "coding"), no_std)]

#[cfg(feature = "coding")]
mod arithmetic_code;
#[cfg(feature = "coding")]
mod cells;
pub mod kind;
#[cfg(feature = "coding")]
mod order;
#[cfg(feature = "coding")]
mod prediction;
#[cfg(feature = "coding")]
mod rows;
#[cfg(feature = "coding")]
mod text;

#[cfg(feature = "coding")]
pub use cells::{Run, Words, words};
#[cfg(feature = "coding")]
pub use rows::{COSINE, Row, Rows};
#[cfg(feature = "coding")]
pub use text::{NotATable, decode, encode};
