//! Who may import whom: each stage only the stages before it, the engine only from `symbolic`.

use std::fs;
use std::path::{Path, PathBuf};

use lamc_tests::workspace;

/// A crate's folder and each folder in it with the others it may name.
type Floors = (&'static str, &'static [(&'static str, &'static [&'static str])]);

const CRATES: [Floors; 2] = [
    (
        "codegen/src",
        &[
            ("source", &[]),
            ("laminate", &["source"]),
            ("topology", &["source", "laminate"]),
            ("symbolic", &[]),
            ("kane", &["source", "laminate", "topology", "symbolic"]),
            // What leaves the algebra is plain data, and its type lives in `symbolic`.
            ("program", &["source", "laminate", "topology", "symbolic", "kane"]),
            ("backend", &["source", "laminate", "topology", "symbolic", "kane", "program"]),
        ],
    ),
    (
        "workbench/src",
        &[
            ("execution", &[]),
            ("motion", &[]),
            ("identify", &["execution"]),
            ("mocap", &["identify"]),
            ("scene", &["motion"]),
            ("picture", &["motion", "scene"]),
            ("page", &["motion", "scene", "picture"]),
        ],
    ),
];

#[test]
fn stages_import_only_what_comes_before() {
    for (source, floors) in CRATES {
        for (stage, allowed) in floors {
            check_imports(&workspace().join(source), stage, allowed, floors);
        }
    }
}

fn check_imports(source: &Path, stage: &str, allowed: &[&str], floors: &[(&str, &[&str])]) {
    let folder = source.join(stage);
    let mut looked_at = 0;
    for file in rust_files(&folder) {
        // Tests of a stage may build their input with any other.
        let inside = file.strip_prefix(&folder).unwrap();
        if inside.to_string_lossy().contains("tests") {
            continue;
        }
        looked_at += 1;
        let text = fs::read_to_string(&file).unwrap();
        for name in text.split("crate::").skip(1) {
            let name: String = name.chars().take_while(|c| c.is_alphanumeric()).collect();
            let is_stage = floors.iter().any(|(other, _)| *other == name);
            let is_front = name == "pipeline" || name == "cli";
            assert!(
                !is_front && (!is_stage || name == stage || allowed.contains(&name.as_str())),
                "{} names crate::{name}",
                file.display()
            );
        }
    }
    assert!(looked_at > 0, "no files in {stage}");
}

#[test]
fn only_one_folder_names_the_symbolic_engine() {
    let root = workspace();
    let mut named = 0;
    for folder in ["codegen", "workbench", "runtime", "generated", "tests", "templates"] {
        for file in rust_files(&root.join(folder)) {
            let text = fs::read_to_string(&file).unwrap();
            let imports = ["symbolica", "numerica", "graphica"]
                .iter()
                .any(|engine| text.contains(&format!("{engine}::")));
            let is_home = file.starts_with(root.join("codegen/src/symbolic"));
            named += usize::from(imports);
            assert!(is_home || !imports, "{} names the engine", file.display());
        }
    }
    assert!(named > 0, "the engine is named nowhere: this test looks in the wrong place");
}

fn rust_files(folder: &Path) -> Vec<PathBuf> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder).into_iter().flatten() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            files.extend(rust_files(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs") {
            files.push(path);
        }
    }
    files
}
