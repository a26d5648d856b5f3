//! Text templates (tera) that `lamc` fills in. They hold layout, never decisions.

/// Header comment of a generated Rust module.
pub const RUST_HEADER: &str = include_str!("rust_header.tera");
