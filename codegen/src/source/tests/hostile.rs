//! Texts that are out to break the reader: each must end in a diagnostic, soon and without panic.

use std::fmt::Write;
use std::time::{Duration, Instant};

use super::*;
use crate::source::model::MAX_VERTICES;
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

/// Aliases copy keys, and anchors copy what they name: a megabyte must not become gigabytes.
#[test]
fn copies_are_counted() {
    let key = "k".repeat(1 << 16);
    let long = format!("a: &a\n  ? {key}\n  : 1\nb: [{}]\n", vec!["*a"; 10_000].join(", "));
    assert_eq!(code(&long), "too-large");
    let anchors: String = (0..60).map(|level| format!("&a{level} [")).collect();
    let nested = format!("a: {anchors}{}{}", "x, ".repeat(100_000), "]".repeat(60));
    assert_eq!(code(&nested), "too-large");
}

/// A report shows a hundred mistakes, so similar names are sought for a hundred.
#[test]
fn many_mistakes_are_found_in_linear_time() {
    const COUNT: usize = 20_000;
    let mut text = String::from("units: { angle: deg }\nparameters:\n");
    let mut add = |line: String| writeln!(text, "  {line}").unwrap();
    (0..COUNT).for_each(|i| add(format!("parameter{i}: 1")));
    add("x: 1\nbodies:\n  base: { fixed: true }".into());
    (0..COUNT).for_each(|i| add(format!("body{i}: {{ mas{i}: 1 }}")));
    add("x: {}\njoints:".into());
    (0..COUNT).for_each(|i| {
        add(format!(
            "j{i}: {{ bodies: [bodi{i}, x], torque: paramter{i} + q.k{i}, rest: {i} rod }}"
        ));
    });
    let begin = Instant::now();
    let file = file(&text);
    let errors = parse(&file).unwrap_err();
    assert!(errors.0.len() > 5 * COUNT, "{} mistakes", errors.0.len());
    assert!(errors.render(&file, false).contains("did you mean"));
    assert!(begin.elapsed() < Duration::from_secs(20), "{:?}", begin.elapsed());
    // The time of a comparison grows as the product of the lengths.
    let begin = Instant::now();
    assert_eq!(code(&format!("? {}\n: 1", "bodys".repeat(1 << 20))), "unknown-key");
    assert!(begin.elapsed() < Duration::from_secs(5), "{:?}", begin.elapsed());
}

#[test]
fn outlines_are_bounded() {
    let model = |vertices: usize| {
        let point = |k: usize| {
            let angle = 2.0 * PI * k as f64 / vertices as f64;
            format!("[{}, {}]", angle.cos(), angle.sin())
        };
        let outline: Vec<_> = (0..vertices).map(point).collect();
        format!(
            "name: disc\nmaterials: {{ card: {{ density: 700, thickness: 1 mm }} }}\nlayup: [card]
bodies: {{ base: {{ fixed: true }}, arm: {{ outline: [{}] }} }}
joints: {{ j: {{ bodies: [base, arm], axis: [[0, 0], [0, 1]] }} }}",
            outline.join(", ")
        )
    };
    read(&model(MAX_VERTICES));
    let faults = faults(&model(MAX_VERTICES + 1));
    assert_eq!((faults[0].0, faults.len()), ("too-many-vertices", 1));
    let drawn = (0..=MAX_VERTICES).map(|k| format!("{k} {}", k * k)).collect::<Vec<_>>().join(", ");
    let popupcad = include_str!("two_plates.joints");
    let drawn = popupcad.replacen("0 0, 0.1 0, 0.1 0.1, 0 0.1, 0 0", &drawn, 1);
    assert_eq!(code(&drawn), "too-many-vertices");
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
        ("!!python/tuple [1, 2]", "wrong-length"),
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
    const FILES: [&str; 3] =
        [EVERYTHING, include_str!("two_plates.joints"), include_str!("two_plates_older.joints")];
    let junk = [
        "", "[", "}", "'", "\"", ": ", "\u{feff}", "é", "&a ", "*a", "1e999", "-", "!!x ", "\r",
        "\0", "^^", "<<: *a", "<<: {",
    ];
    let mut numbers = Random::new(1);
    let mut random = |bound: usize| numbers.below(bound);
    let mut models = 0;
    for round in 0..6000 {
        let mut text = FILES[round % FILES.len()].to_owned();
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
