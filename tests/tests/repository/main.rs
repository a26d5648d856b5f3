//! Rules that hold for the sources and the documents themselves.

mod architecture;
mod checks;
mod documents;
mod sizes;
mod source;
