//! Hand-written files have at most 400 lines, functions at most 60.

use std::fs;

use lamc_tests::workspace;

use crate::source::{is_test, rust_files};

const LINES_OF_A_FILE: usize = 400;
const LINES_OF_A_FUNCTION: usize = 60;

#[test]
fn hand_written_files_are_short() {
    let lines = |text: &str| text.lines().count();
    let long = sources().into_iter().filter(|(_, text)| lines(text) > LINES_OF_A_FILE);
    let long: Vec<_> =
        long.map(|(path, text)| format!("{path} has {} lines", lines(&text))).collect();
    assert!(long.is_empty(), "more than {LINES_OF_A_FILE}:\n{}", long.join("\n"));
}

#[test]
fn functions_are_short() {
    let mut long = Vec::new();
    for (path, text) in sources() {
        for (name, lines) in functions(&text) {
            if lines > LINES_OF_A_FUNCTION {
                long.push(format!("{path}: `{name}` has {lines} lines"));
            }
        }
    }
    assert!(long.is_empty(), "more than {LINES_OF_A_FUNCTION}:\n{}", long.join("\n"));
}

/// Paths and texts of the Rust files, and of the C files in the templates, that are neither generated nor tests.
fn sources() -> Vec<(String, String)> {
    let root = workspace();
    let mut found = Vec::new();
    for folder in [
        "codegen/src",
        "workbench/src",
        "runtime/src",
        "macros/src",
        "tables/src",
        "templates/src",
        "xtask/src",
    ] {
        for file in rust_files(&root.join(folder)) {
            let path = file.strip_prefix(&root).unwrap();
            if !is_test(path.strip_prefix(folder).unwrap()) {
                found.push((path.display().to_string(), fs::read_to_string(&file).unwrap()));
            }
        }
    }
    for entry in fs::read_dir(root.join("templates/src/c")).unwrap() {
        let file = entry.unwrap().path();
        let path = file.strip_prefix(&root).unwrap().display().to_string();
        found.push((path, fs::read_to_string(&file).unwrap()));
    }
    assert!(found.len() > 100, "this test looks in the wrong place");
    found
}

/// Functions and their lines, from the one with `fn` to the closing brace, which rustfmt puts under
/// its first letter.
fn functions(text: &str) -> Vec<(&str, usize)> {
    let lines: Vec<&str> = text.lines().collect();
    let mut found = Vec::new();
    for (first, line) in lines.iter().enumerate() {
        let Some(name) = function_name(line) else { continue };
        let indent = &line[..line.len() - line.trim_start().len()];
        let end = format!("{indent}}}");
        let is_whole = line.ends_with(';') || line.ends_with('}');
        let last = if is_whole {
            first
        } else {
            let closes = |line: &&str| line.starts_with(&end) || is_declaration(line, indent);
            first + lines[first..].iter().position(closes).expect("a function has an end")
        };
        found.push((name, last - first + 1));
    }
    found
}

/// The name of the function that begins in this line.
fn function_name(line: &str) -> Option<&str> {
    const BEFORE: [&str; 7] =
        ["pub", "pub(crate)", "pub(super)", "const", "unsafe", "extern", "\"C\""];
    let mut words = line.split_whitespace().skip_while(|word| BEFORE.contains(word));
    (words.next() == Some("fn")).then_some(())?;
    words.next()?.split(['(', '<']).next()
}

/// The end of a signature in several lines without a body.
fn is_declaration(line: &str, indent: &str) -> bool {
    line.strip_prefix(indent).is_some_and(|rest| rest.starts_with(')')) && line.ends_with(';')
}

#[test]
fn lines_of_functions_are_counted() {
    let text = "\
impl A {
    pub(crate) const fn short(&self) -> usize {
        1
    }

    fn declared(
        &self,
    ) -> usize;

    fn one(&self) -> usize { 2 }
}

pub fn outer<T: Fn(usize)>(
    call: T,
) {
    if true {
        call(1);
    }
}
";
    let expected = [("short", 3), ("declared", 3), ("one", 1), ("outer", 7)];
    assert_eq!(functions(text), expected);
}
