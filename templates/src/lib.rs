//! Text templates (tera) that `lamc` fills in. They hold layout, never decisions.

/// Header comment of a generated Rust module.
pub const RUST_HEADER: &str = include_str!("rust_header.tera");

/// Header of a generated C module: also of a Rust module that exports the same functions.
pub const C_HEADER: &str = include_str!("c_header.tera");

/// A generated C module: the runtime's algorithms for fixed sizes, around the mechanism's functions.
pub const C_SOURCE: &str = include_str!("c_source.tera");
