//! The shrinker of `differential`.

use lamc_tests::random::{Lines, Recipe, model};
use lamc_tests::shrink::shrunk;

#[test]
fn what_does_not_matter_is_left_out() {
    let text = model(7, Recipe { branches: 9, loops: 0, lines: Lines::Any });
    let fails = |text: &str| text.contains("motor*t") && text.contains("b3: {");
    assert!(fails(&text));
    let shortest = shrunk(&text, &fails);
    assert!(fails(&shortest), "{shortest}");
    assert!(shortest.len() < 100, "{shortest}");
}

#[test]
fn a_text_that_needs_all_of_itself_stays() {
    let text = "a, b\nc, d\n";
    assert_eq!(shrunk(text, &|candidate| candidate == text), text);
    assert_eq!(shrunk("", &|_| true), "");
}
