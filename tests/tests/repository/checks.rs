//! There are no checks that cannot fail: a maximum that loses NaN, a tolerance that is infinite, a test
//! that depends on files outside the repository.

use std::fs;
use std::path::PathBuf;

use lamc_tests::compare::{largest, largest_difference, maximum, relative_error};
use lamc_tests::workspace;

use crate::source::{is_test, rust_files};

/// Patterns that no test may contain, with the replacement. The parts are joined here, so that this
/// table does not contain them.
const FORBIDDEN: [([&str; 2], &str); 7] = [
    (["f64", "::max)"], "`compare::largest` or `maximum`: this loses NaN"),
    (["f32", "::max)"], "`compare::largest` or `maximum`: this loses NaN"),
    (["most", ".max("], "`compare::largest` or `maximum`: this loses NaN"),
    ([".am", "ax()"], "`compare::largest(&matrix)`: nalgebra's loses NaN"),
    (["=> f64::", "INFINITY"], "a tolerance that can be exceeded"),
    (["#[", "ignore"], "a test that runs"),
    (["../", "shared"], "data in `tests/data`"),
];

#[test]
fn no_check_loses_nan_or_passes_everything() {
    let files = test_files();
    assert!(files.len() > 60, "only {} files with tests were found", files.len());
    let mut found = Vec::new();
    for file in files {
        let text = fs::read_to_string(&file).unwrap();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !is_comment(line)) {
            let at = format!("{}:{}", file.display(), number + 1);
            for (parts, instead) in FORBIDDEN {
                let pattern = parts.concat();
                if line.contains(&pattern) {
                    found.push(format!("{at}: `{pattern}`: write {instead}"));
                }
            }
            if accumulates(line) {
                found.push(format!(
                    "{at}: write `worst = keep_largest(worst, ..)`, which keeps NaN"
                ));
            }
        }
    }
    assert!(found.is_empty(), "{}", found.join("\n"));
}

/// `x = x.max(..)`: NaN on the right is lost.
fn accumulates(line: &str) -> bool {
    let Some((left, right)) = line.split_once(" = ") else { return false };
    let name = left.trim().trim_start_matches("let ").trim_start_matches("mut ");
    right.strip_prefix(name).is_some_and(|rest| rest.starts_with(".max("))
}

fn is_comment(line: &str) -> bool {
    line.trim_start().starts_with("//")
}

/// The files of tests alone, and those of the crate of the end-to-end tests.
fn test_files() -> Vec<PathBuf> {
    let mut files = rust_files(&workspace().join("tests/src"));
    files.extend(rust_files(&workspace().join("tests/tests")));
    for folder in ["codegen", "workbench", "runtime", "macros", "tables", "generated", "templates"]
    {
        let root = workspace().join(folder);
        let of_crate = rust_files(&root).into_iter();
        files.extend(of_crate.filter(|file| is_test(file.strip_prefix(&root).unwrap())));
    }
    files
}

#[test]
fn comparisons_keep_nan() {
    let numbers = [1.0, f64::NAN, -3.0];
    for k in 0..3 {
        let mut rotated = numbers;
        rotated.rotate_left(k);
        assert!(largest(rotated).is_nan() && maximum(rotated).is_nan(), "{rotated:?}");
        assert!(largest_difference(&rotated, &[0.0; 3]).is_nan());
        assert!(relative_error(&[0.0; 3], &rotated).is_nan());
    }
    assert_eq!((largest([1.0, -3.0]), maximum([-1.0, -3.0])), (3.0, -1.0));
    assert_eq!(relative_error(&[1.0, 2.0], &[1.0, 4.0]), 0.5);
    assert_eq!(relative_error(&[1.0], &[0.0]), f64::INFINITY);
    assert_eq!(relative_error(&[0.0], &[0.0]), 0.0);
}
