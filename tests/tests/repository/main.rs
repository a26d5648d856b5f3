//! Rules that hold for the sources and the documents themselves.

mod architecture;
mod sizes;
mod source;
