//! Reference pages: the keys of the model file and the codes of diagnostics.
//!
//! The pages `docs/SCHEMA.md` and `docs/ERRORS.md`, the JSON Schema and the texts of `lamc explain` are
//! written from the tables in `lamc::source::{schema, codes}`, which the reader itself uses.

mod errors;
mod json_schema;
mod schema;

pub use errors::{Example, errors_page, explain};
pub use json_schema::json_schema;
pub use schema::schema_page;
