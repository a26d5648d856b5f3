//! Judges models by the JSON Schema of the model file. Reads `{ schema, cases: [{ what, model, is_sound }] }`
//! from standard input, and fails when a verdict is another than expected.

use std::io;
use std::process::ExitCode;

use serde_json::Value;

fn main() -> ExitCode {
    let input: Value = match serde_json::from_reader(io::stdin().lock()) {
        Ok(input) => input,
        Err(error) => return failed(&format!("standard input: {error}")),
    };
    let schema = &input["schema"];
    if let Err(error) = jsonschema::draft202012::meta::validate(schema) {
        return failed(&format!("the schema is not one of draft 2020-12: {error}"));
    }
    let validator = match jsonschema::draft202012::new(schema) {
        Ok(validator) => validator,
        Err(error) => return failed(&format!("the schema: {error}")),
    };
    let cases = input["cases"].as_array().map_or(&[][..], Vec::as_slice);
    let (mut sound, mut wrong) = (0, 0);
    for case in cases {
        let errors: Vec<String> = validator
            .iter_errors(&case["model"])
            .map(|error| format!("  {}: {error}", error.instance_path()))
            .collect();
        let (what, is_sound) = (&case["what"], case["is_sound"] == true);
        if is_sound != errors.is_empty() {
            let found = errors.join("\n");
            eprintln!("{what} is {}:\n{found}", if is_sound { "refused" } else { "accepted" });
            wrong += 1;
        }
        sound += usize::from(is_sound);
    }
    println!(
        "{} models: {sound} sound, {} not; {wrong} judged wrongly",
        cases.len(),
        cases.len() - sound
    );
    // So that an empty list does not pass.
    ExitCode::from(u8::from(wrong > 0 || sound < 100 || cases.len() - sound < 300))
}

fn failed(message: &str) -> ExitCode {
    eprintln!("{message}");
    ExitCode::FAILURE
}
