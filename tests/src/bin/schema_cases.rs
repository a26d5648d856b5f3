//! Writes the JSON Schema of the model file and the models to try it with, for `tests/schema/run`.

use lamc_tests::schema_cases::{changed_models, repository_models, wrong_models};
use lamc_workbench::reference::json_schema;
use serde_json::json;

fn main() {
    let cases = changed_models().into_iter().chain(repository_models()).chain(wrong_models());
    let cases: Vec<_> = cases
        .map(|case| json!({ "what": case.what, "model": case.model, "is_sound": case.is_sound }))
        .collect();
    println!("{}", json!({ "schema": json_schema(), "cases": cases }));
}
