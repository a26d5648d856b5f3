//! `docs/SCHEMA.md`, and the reader, which is tested with the tables from which the page is written.
//! `tests/schema/run` judges the same models by the JSON Schema.

use lamc::pipeline::analyse;
use lamc::source::schema::{MAPPINGS, Presence};
use lamc::source::{self, SourceFile};
use lamc_tests::golden::assert_pinned;
use lamc_tests::schema_cases::{as_json, changed_models, with, without};
use lamc_tests::workspace;
use lamc_workbench::reference::schema_page;
use serde_json::Value;

fn file(model: &Value) -> SourceFile {
    // Drawings are beside the model.
    let path = workspace().join("examples/model.yaml").display().to_string();
    SourceFile { path, text: model.to_string() }
}

#[test]
fn the_page_is_what_the_tables_say() {
    assert_pinned(&workspace().join("docs/SCHEMA.md"), &schema_page());
}

#[test]
fn the_reader_does_what_the_tables_say() {
    let cases = changed_models();
    let mut odd = Vec::new();
    for case in &cases {
        let file = file(&case.model);
        match analyse(&file) {
            Ok(_) if !case.is_sound => odd.push(format!("{} is accepted", case.what)),
            Err(errors) if case.is_sound => {
                odd.push(format!("{} is refused:\n{}", case.what, errors.render(&file, false)));
            }
            _ => {}
        }
    }
    assert!(odd.is_empty(), "{}", odd.join("\n"));
    assert!(cases.len() > 400, "only {} models", cases.len());
}

/// A default that is written out changes nothing.
#[test]
fn defaults_are_what_is_taken() {
    let read = |model: &Value| match source::parse(&file(model)) {
        Ok((model, _)) => source::to_yaml(&model),
        Err(errors) => panic!("{errors}"),
    };
    let mut defaults = 0;
    for mapping in MAPPINGS {
        for key in mapping.keys {
            let Presence::Default(default) = key.presence else { continue };
            let written = with(mapping, key, as_json(default));
            let left_out = without(mapping, key, written.clone());
            assert_eq!(read(&written), read(&left_out), "`{}` of {}", key.name, mapping.name);
            defaults += 1;
        }
    }
    assert!(defaults >= 15, "{defaults} defaults");
}
