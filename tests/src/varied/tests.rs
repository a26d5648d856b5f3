use std::collections::BTreeSet;

use lamc::source::schema::MAPPINGS;

use super::mechanism;

/// Models that are looked at.
const MODELS: u64 = 400;

#[test]
fn models_have_every_key_of_the_schema() {
    let texts: Vec<String> = (0..MODELS).map(mechanism).collect();
    // Bodies and joints that come from drawings are those of other models.
    let is_drawn = |name: &str| name.starts_with("pattern");
    // Controllers have tests of their own (`formulation/controllers.rs`), because FMUs refuse them.
    let is_control = |name: &str| name.starts_with("controllers");
    let is_elsewhere = |name: &str| is_drawn(name) || is_control(name);
    let described = MAPPINGS.iter().filter(|it| !is_elsewhere(it.path));
    let keys: BTreeSet<&str> = described
        .flat_map(|mapping| mapping.keys)
        .map(|key| key.name)
        .filter(|name| !is_elsewhere(name))
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
