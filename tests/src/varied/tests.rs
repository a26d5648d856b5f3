use std::collections::BTreeSet;

use lamc::source::schema::MAPPINGS;

use super::mechanism;

/// Models that are looked at.
const MODELS: u64 = 400;

#[test]
fn models_have_every_key_of_the_schema() {
    let texts: Vec<String> = (0..MODELS).map(mechanism).collect();
    // These models are written without a drawing.
    let is_of_drawings = |text: &str| text.starts_with("pattern");
    let keys: BTreeSet<&str> = MAPPINGS
        .iter()
        .filter(|mapping| !is_of_drawings(mapping.path))
        .flat_map(|mapping| mapping.keys.iter().map(|key| key.name))
        .filter(|key| !is_of_drawings(key))
        .collect();
    assert!(keys.len() > 40);
    for key in keys {
        let written = [format!("{key}: "), format!("{key}:\n")];
        let is_used = |text: &String| written.iter().any(|written| text.contains(written.as_str()));
        assert!(texts.iter().any(is_used), "no model has `{key}`");
    }
}

#[test]
fn models_are_read() {
    for seed in 0..MODELS {
        let text = mechanism(seed);
        let file = lamc::source::SourceFile { path: "varied.yaml".into(), text };
        if let Err(problems) = lamc::source::parse(&file) {
            panic!("seed {seed}:\n{}", problems.render(&file, false));
        }
    }
}
