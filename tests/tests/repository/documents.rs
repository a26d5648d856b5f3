//! The documents: their links are valid, their tables are complete, and their quotations agree with
//! the files.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use lamc_tests::workspace;

#[test]
fn links_lead_to_files_and_headings() {
    let mut checked = 0;
    let mut wrong = Vec::new();
    for page in pages() {
        for link in links(&fs::read_to_string(&page).unwrap()) {
            if link.contains("://") {
                continue;
            }
            checked += 1;
            let (file, heading) = link.split_once('#').unwrap_or((&link, ""));
            let target =
                if file.is_empty() { page.clone() } else { page.parent().unwrap().join(file) };
            let leads = target.exists()
                && (heading.is_empty()
                    || headings(&fs::read_to_string(&target).unwrap()).contains(heading));
            if !leads {
                wrong.push(format!("{}: {link}", page.display()));
            }
        }
    }
    assert!(wrong.is_empty(), "these links lead nowhere:\n{}", wrong.join("\n"));
    assert!(checked > 50, "only {checked} links: this test looks in the wrong place");
}

#[test]
fn named_files_exist() {
    let root = workspace();
    let mut checked = 0;
    let mut wrong = Vec::new();
    for page in pages() {
        for line in fs::read_to_string(&page).unwrap().lines() {
            let mut folder = PathBuf::new();
            // Every second piece is within backticks.
            for name in line.split('`').skip(1).step_by(2) {
                let is_path = ["codegen/", "workbench/", "runtime/", "templates/", "tests/"]
                    .iter()
                    .any(|start| name.starts_with(start) && !name.contains([' ', '<', '*']));
                // A file without a folder is in that of the path before, as in `a/b.rs`, `c.rs`.
                let is_next = name.ends_with(".rs") && !name.contains('/');
                if is_path {
                    folder = Path::new(name).parent().unwrap().to_owned();
                } else if !is_next || folder.as_os_str().is_empty() {
                    continue;
                }
                checked += 1;
                let path = if is_path { root.join(name) } else { root.join(&folder).join(name) };
                if !path.exists() {
                    wrong.push(format!("{}: {name}", page.display()));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "these files do not exist:\n{}", wrong.join("\n"));
    assert!(checked > 40, "only {checked} names: this test looks in the wrong place");
}

#[test]
fn every_decision_is_in_the_list() {
    let folder = workspace().join("docs/decisions");
    let list = fs::read_to_string(folder.join("README.md")).unwrap();
    let mut numbers = BTreeSet::new();
    for file in markdown(&folder) {
        let name = file.file_name().unwrap().to_str().unwrap();
        if name == "README.md" {
            continue;
        }
        assert!(list.contains(&format!("]({name})")), "{name} is not in the list");
        assert!(numbers.insert(name[..4].to_owned()), "{name}: the number is taken");
        let text = fs::read_to_string(&file).unwrap();
        for part in ["**Context.**", "**Decision.**", "**Consequences.**"] {
            assert!(text.contains(part), "{name} has no {part}");
        }
    }
    assert!(!numbers.is_empty());
}

#[test]
fn every_dependency_has_its_reason() {
    let page = fs::read_to_string(workspace().join("docs/DEPENDENCIES.md")).unwrap();
    let reasons: String = page.lines().filter(|line| line.starts_with('|')).collect();
    let words: BTreeSet<&str> =
        reasons.split(|c: char| !(c.is_alphanumeric() || "-_".contains(c))).collect();
    let manifest = fs::read_to_string(workspace().join("Cargo.toml")).unwrap();
    let (_, table) = manifest.split_once("[workspace.dependencies]\n").unwrap();
    let mut checked = 0;
    for line in table.lines().take_while(|line| !line.starts_with('[')) {
        let Some((name, value)) = line.split_once(" = ") else { continue };
        if value.contains("path = ") || name.starts_with('#') {
            continue;
        }
        checked += 1;
        // Of one family, the first has the whole name: `cranelift-codegen, -frontend`.
        let short = name.split_once('-').map_or(name, |(family, _)| &name[family.len()..]);
        let known = words.contains(name) || words.contains(short);
        assert!(known, "docs/DEPENDENCIES.md says nothing of `{name}`");
    }
    assert!(checked > 20, "only {checked} dependencies: this test looks in the wrong place");
}

#[test]
fn the_tutorial_quotes_its_files() {
    let page = fs::read_to_string(workspace().join("docs/TUTORIAL.md")).unwrap();
    let folders =
        ["examples/leg", "examples/firmware-build/leg", "examples/firmware-build/leg/src"];
    let files: Vec<String> = folders
        .iter()
        .flat_map(|folder| fs::read_dir(workspace().join(folder)).unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.is_file())
        .map(|path| fs::read_to_string(path).unwrap())
        .collect();
    let mut checked = 0;
    for (language, text) in blocks(&page) {
        if matches!(language, "yaml" | "rust" | "c" | "toml") {
            checked += 1;
            let quoted = files.iter().any(|file| file.contains(text));
            assert!(quoted, "no file of the tutorial contains this:\n{text}");
        }
    }
    assert!(checked > 10, "only {checked} blocks: this test looks in the wrong place");
}

/// The pages in the root, in docs and in docs/decisions.
fn pages() -> Vec<PathBuf> {
    ["", "docs", "docs/decisions"].iter().flat_map(|f| markdown(&workspace().join(f))).collect()
}

fn markdown(folder: &Path) -> Vec<PathBuf> {
    let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "md")).collect()
}

/// Targets of `[text](target)` outside of code.
fn links(page: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut in_code = false;
    for line in page.lines() {
        in_code ^= line.starts_with("```");
        if !in_code {
            let targets = line.split("](").skip(1).filter_map(|rest| rest.split(')').next());
            found.extend(targets.map(str::to_owned));
        }
    }
    found
}

/// The anchors of a page's headings: small letters, hyphens for blanks.
fn headings(page: &str) -> BTreeSet<String> {
    let anchor = |title: &str| {
        let kept = |c: &char| c.is_alphanumeric() || " -_".contains(*c);
        title.to_lowercase().chars().filter(kept).collect::<String>().replace(' ', "-")
    };
    let titles = page.lines().filter(|line| line.starts_with('#'));
    titles.map(|line| anchor(line.trim_start_matches('#').trim())).collect()
}

/// Blocks of code: language and text.
fn blocks(page: &str) -> Vec<(&str, &str)> {
    // Every second piece is within a block.
    let pieces = page.split("```").skip(1).step_by(2);
    pieces.filter_map(|piece| piece.split_once('\n')).collect()
}
