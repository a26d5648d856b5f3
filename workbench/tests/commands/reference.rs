//! `lamc schema` and `lamc explain`.

use super::common::{json, run, text};

#[test]
fn the_schema_is_printed_as_json() {
    let schema = json(&run(&["schema"]));
    assert_eq!(schema["$schema"], "https://json-schema.org/draft/2020-12/schema");
    assert_eq!(schema["additionalProperties"], false);
    // A free body alone is a model: `joints` may be absent.
    let either =
        serde_json::json!({ "anyOf": [{ "required": ["bodies"] }, { "required": ["pattern"] }] });
    assert_eq!(schema["allOf"], serde_json::json!([either]));
}

#[test]
fn codes_are_explained() {
    for code in ["unknown-key", "error[unknown-key]"] {
        let answer = run(&["explain", code]);
        assert!(answer.status.success(), "{}", text(&answer.stderr));
        let entry = text(&answer.stdout);
        assert!(entry.starts_with("unknown-key\n\nA mapping has a key"), "{entry}");
        assert!(entry.contains("error[unknown-key]: ") && entry.contains("What to do"), "{entry}");
    }
    let all = text(&run(&["explain"]).stdout);
    assert!(all.lines().any(|code| code == "far-hinge"), "{all}");
}

#[test]
fn unknown_codes_are_refused() {
    let answer = run(&["explain", "unkown-key"]);
    assert_eq!(answer.status.code(), Some(2));
    assert!(
        text(&answer.stderr).contains("did you mean `unknown-key`?"),
        "{}",
        text(&answer.stderr)
    );
}
