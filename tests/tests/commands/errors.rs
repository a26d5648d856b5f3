//! `docs/ERRORS.md` and `lamc explain`: every code, with the smallest model in `tests/wrong` that shows it.

use std::collections::BTreeSet;
use std::fs;

use lamc::source::{Code, codes};
use lamc_tests::golden::assert_pinned;
use lamc_tests::workspace;
use lamc_workbench::reference::{Example, errors_page, explain};

/// The reports of a snapshot, each from its title on.
fn reports(snapshot: &str) -> Vec<String> {
    let mut reports: Vec<String> = Vec::new();
    for line in snapshot.lines() {
        let is_title = ["error[", "warning[", "note["].iter().any(|level| line.starts_with(level));
        if is_title {
            reports.push(String::new());
        }
        if let Some(report) = reports.last_mut() {
            report.push_str(line);
            report.push('\n');
        }
    }
    reports
}

fn code_of(report: &str) -> &str {
    let (_, rest) = report.split_once('[').unwrap();
    rest.split_once(']').unwrap().0
}

/// A file of `tests/wrong`, and the reports on it.
struct Wrong {
    /// The extension of its name.
    language: String,
    text: String,
    reports: Vec<String>,
}

/// Every file in `tests/wrong` beside the reports on it, the shortest together first.
fn wrong_models() -> Vec<Wrong> {
    let mut models = Vec::new();
    for entry in fs::read_dir(workspace().join("tests/wrong")).unwrap() {
        let path = entry.unwrap().path();
        let language = path.extension().unwrap().to_str().unwrap().to_owned();
        if language != "stderr" {
            let snapshot = fs::read_to_string(path.with_extension("stderr")).unwrap();
            let text = fs::read_to_string(&path).unwrap();
            models.push(Wrong { language, text, reports: reports(&snapshot) });
        }
    }
    let size = |Wrong { text, reports, .. }: &Wrong| {
        (text.len() + reports.iter().map(String::len).sum::<usize>(), text.clone())
    };
    models.sort_by_key(size);
    models
}

fn example(models: &[Wrong], code: Code) -> Option<Example> {
    models.iter().find_map(|Wrong { language, text, reports }| {
        let report = reports.iter().find(|report| code_of(report) == code.name)?.clone();
        Some(Example { language: language.clone(), text: text.clone(), report })
    })
}

#[test]
fn the_page_is_what_the_tables_say() {
    let models = wrong_models();
    let page = errors_page(|code| example(&models, code));
    for path in ["docs/ERRORS.md", "workbench/src/reference/ERRORS.md"] {
        assert_pinned(&workspace().join(path), &page);
    }
}

#[test]
fn every_code_has_an_example_or_a_reason() {
    let models = wrong_models();
    let mut names = BTreeSet::new();
    for code in codes::all() {
        assert!(names.insert(code.name), "{code} stands twice");
        assert_eq!(
            example(&models, code).is_some(),
            code.no_example.is_none(),
            "{code}: a model in tests/wrong, or the reason why there is none"
        );
    }
    let shown = models.iter().flat_map(|it| &it.reports).map(|report| code_of(report));
    for name in shown {
        assert!(codes::find(name).is_some(), "{name} is in a snapshot, but not in the table");
    }
}

/// A code that no model shows is at least used.
#[test]
fn no_code_is_stale() {
    let mut text = String::new();
    for crate_of in ["codegen/src", "workbench/src"] {
        read_sources(&workspace().join(crate_of), &mut text);
    }
    for code in codes::all() {
        let constant = format!("codes::{}", code.name.replace('-', "_").to_uppercase());
        let mut uses =
            text.match_indices(&constant).map(|(at, it)| text[at + it.len()..].chars().next());
        let is_used = uses.any(|next| next.is_none_or(|c| !(c.is_alphanumeric() || c == '_')));
        assert!(is_used, "no stage uses {constant}");
    }
}

fn read_sources(path: &std::path::Path, text: &mut String) {
    if path.is_file() {
        if path.extension().is_some_and(|extension| extension == "rs") {
            text.push_str(&fs::read_to_string(path).unwrap());
        }
        return;
    }
    for entry in fs::read_dir(path).unwrap() {
        let path = entry.unwrap().path();
        if path.file_name().is_some_and(|name| name != "codes" && name != "tests") {
            read_sources(&path, text);
        }
    }
}

#[test]
fn each_code_is_explained() {
    for code in codes::all() {
        let entry = explain(code.name).unwrap_or_else(|| panic!("{code} is not explained"));
        assert!(entry.starts_with(code.cause), "{entry}");
        assert!(entry.ends_with(code.cure), "{entry}");
        let has_example = ["yaml", "csv", "json", "svg", "fold"]
            .iter()
            .any(|it| entry.contains(&format!("```{it}")));
        assert_eq!(has_example, code.no_example.is_none(), "{entry}");
    }
    assert!(explain("no-such-code").is_none());
}

/// In snapshots of single reports the code is what is looked up.
#[test]
fn texts_are_whole_sentences() {
    for code in codes::all() {
        for text in [code.cause, code.cure] {
            assert!(text.ends_with('.'), "{code}: {text}");
            assert!(text.starts_with(|c: char| c.is_uppercase() || c == '`'), "{code}: {text}");
            assert!(!text.contains("  "), "{code}: {text}");
        }
    }
}
