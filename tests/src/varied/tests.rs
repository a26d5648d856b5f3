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
    // Free bodies have random models of their own (`formulation/free.rs`), because C knows none yet.
    let is_free = |name: &str| name == "free" || name.starts_with("initial.bodies");
    let described = MAPPINGS.iter().filter(|it| !is_drawn(it.path) && !is_free(it.path));
    let keys: BTreeSet<&str> = described
        .flat_map(|mapping| mapping.keys)
        .map(|key| key.name)
        .filter(|name| !is_drawn(name) && !is_free(name))
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
