//! `lamc schema`: the JSON Schema of the model file.

use lamc_workbench::reference;

use super::{Outcome, fail, output};

/// Prints the schema.
pub fn run() -> Outcome {
    let text = serde_json::to_string_pretty(&reference::json_schema()).map_err(fail)?;
    output::print((text + "\n").as_bytes())
}
