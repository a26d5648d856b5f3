//! What users measured or chose, as text: tables (CSV) and states (JSON), with the place of each mistake.
//!
//! ```text
//! CSV -> Table (columns by name) -> rows of numbers -> the readers of `identify` and `mocap`, configurations
//! JSON -> states
//! YAML beside a model -> Terms (numbers and words) -> plans of `sweep`, goals of `optimise`
//! ```
//!
//! What is read is limited, so that a file of another kind ends in an error and not in all memory: the size of
//! the file, its rows, its states.

mod configurations;
mod states;
mod table;
mod terms;
#[cfg(test)]
mod tests;

pub use configurations::{Configuration, configurations};
pub use states::{MAX_STATES, StateInput, states};
pub use table::{MAX_ROWS, MAX_TABLE_BYTES, Row, Table};
pub use terms::Terms;
