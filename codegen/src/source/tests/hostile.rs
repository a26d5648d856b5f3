//! Texts that are out to break the reader: each must end in a diagnostic, soon and without panic.

use super::*;
use crate::uniform::Random;

fn code(text: &str) -> &'static str {
    faults(text)[0].0
}

#[test]
fn aliases_do_not_multiply() {
    let mut bomb = String::from("a: &a0 [x, x, x, x, x, x, x, x, x, x]\n");
    for i in 1..12 {
        let aliases = vec![format!("*a{}", i - 1); 10].join(", ");
        bomb += &format!("b{i}: &a{i} [{aliases}]\n");
    }
    assert_eq!(code(&bomb), "too-large");
    assert_eq!(code("a: &a [*a]"), "self-alias");
    assert_eq!(code("a: *nowhere"), "unknown-alias");
}

#[test]
fn nesting_is_bounded() {
    assert_eq!(code(&"[".repeat(100_000)), "too-deep");
    assert_eq!(code(&"a: {".repeat(100_000)), "too-deep");
    let block: String = (0..1000).map(|i| format!("{:1$}k:\n", "", i)).collect();
    assert_eq!(code(&block), "too-deep");
    // Depth built up through aliases.
    let mut text = String::new();
    for i in 0..40 {
        let inner = if i == 0 { "x".into() } else { format!("*a{}", i - 1) };
        text += &format!("k{i}: &a{i} [[[[{inner}]]]]\n");
    }
    assert_eq!(code(&text), "too-deep");
}

#[test]
fn what_is_no_model() {
    for (text, expected) in [
        ("", "empty-file"),
        ("# nothing\n", "empty-file"),
        ("42", "wrong-type"),
        ("- a\n- b", "no-model"),
        ("!!python/tuple [1, 2]", "old-export"),
        ("!!python/object:popupcad.Design {a: 1}", "other-object"),
        ("a: 1\n---\nb: 2", "several-documents"),
        ("? [a, b]\n: c", "bad-key"),
        ("a: [1, 2", "yaml-syntax"),
        ("a: \t- b\n c", "yaml-syntax"),
        ("name: \"\\q\"", "yaml-syntax"),
    ] {
        assert!(faults(text).iter().any(|fault| fault.0 == expected), "{text}: {:?}", faults(text));
    }
}

/// Damaged models: cut anywhere, a byte replaced, pieces swapped. Reading and rendering both have
/// to come to an end; what is still a model must be written and read again.
#[test]
fn damaged_files_do_not_panic() {
    const POPUPCAD: &str = include_str!("two_plates.joints");
    let junk = [
        "", "[", "}", "'", "\"", ": ", "\u{feff}", "é", "&a ", "*a", "1e999", "-", "!!x ", "\r",
        "\0", "^^", "<<: *a", "<<: {",
    ];
    let mut numbers = Random::new(1);
    let mut random = |bound: usize| numbers.below(bound);
    let mut models = 0;
    for round in 0..4000 {
        let mut text = if round % 2 == 0 { EVERYTHING } else { POPUPCAD }.to_owned();
        for _ in 0..1 + random(2) {
            let boundary =
                |text: &str, at: usize| (0..=at).rev().find(|&i| text.is_char_boundary(i));
            let from = boundary(&text, random(text.len() + 1)).unwrap();
            let to = boundary(&text, (from + random(12)).min(text.len())).unwrap().max(from);
            text.replace_range(from..to, junk[random(junk.len())]);
        }
        let file = file(&text);
        match parse(&file) {
            Ok((model, warnings)) => {
                models += 1;
                warnings.render(&file, true);
                assert_round_trip(&model);
            }
            Err(errors) => {
                assert!(errors.has_errors() && !errors.render(&file, true).is_empty());
            }
        }
    }
    assert!(models > 100, "the damage is such that nothing is left to write: {models}");
}
