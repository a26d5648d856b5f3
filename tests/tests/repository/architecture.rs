//! Allowed imports between crates and between folders of a crate, as defined in ARCHITECTURE.md.

use std::fs;
use std::path::Path;

use lamc_tests::workspace;

use crate::source::{entries, imports, is_test, rust_files};

/// A crate's folder, and which crates of the workspace it may depend on.
const CRATES: [(&str, &[&str]); 10] = [
    ("tables", &[]),
    ("macros", &["lamc-tables"]),
    ("runtime", &["lamc-tables", "lamc-runtime-macros"]),
    ("templates", &[]),
    ("drawings", &[]),
    ("codegen", &["lamc-runtime", "lamc-tables", "lamc-templates", "lamc-drawings"]),
    ("workbench", &["lamc-runtime", "lamc-templates", "lamc-drawings", "lamc"]),
    ("generated", &["lamc-runtime"]),
    (
        "tests",
        &[
            "lamc-runtime",
            "lamc-templates",
            "lamc-drawings",
            "lamc",
            "lamc-workbench",
            "lamc-generated",
        ],
    ),
    ("xtask", &[]),
];

/// Folders that are workspaces of their own or hold no crate.
const OTHER_FOLDERS: [&str; 4] = ["docs", "examples", "python", "target"];

/// The sources of a crate: each file and folder in them, and what of the crate it may import.
struct Floors {
    folder: &'static str,
    entries: &'static [(&'static str, &'static [&'static str])],
    /// Whether all files of the crate's root are listed. Where its root exports what they hold under
    /// shorter names, only the folders are.
    files_too: bool,
}

const FLOORS: [Floors; 5] = [
    Floors {
        folder: "codegen/src",
        entries: &[
            ("arithmetic", &[]),
            ("sealed", &[]),
            ("source", &["arithmetic"]),
            ("laminate", &["arithmetic", "source"]),
            ("topology", &["arithmetic", "source", "laminate"]),
            ("program", &["arithmetic", "sealed", "source", "topology"]),
            ("symbolic", &[]),
            ("kane", &["source", "laminate", "topology", "program", "symbolic"]),
            // What leaves the algebra is plain data, and its type lives in `symbolic`.
            ("lowering", &["arithmetic", "source", "topology", "program", "symbolic", "kane"]),
            ("backend", &["arithmetic", "source", "program"]),
            (
                "pipeline",
                &[
                    "sealed", "source", "laminate", "topology", "program", "symbolic", "kane",
                    "lowering", "backend",
                ],
            ),
            ("files", &[]),
            ("config", &["source", "program", "backend", "pipeline", "files"]),
        ],
        files_too: true,
    },
    Floors {
        folder: "workbench/src",
        entries: &[
            ("archive", &[]),
            ("cache", &[]),
            ("cut", &[]),
            ("execution", &[]),
            ("reading", &[]),
            ("identify", &["execution", "reading"]),
            ("inertia", &[]),
            ("linear", &["execution"]),
            ("rest", &["execution", "linear"]),
            ("mocap", &["reading", "identify"]),
            ("motion", &[]),
            ("simulation", &["execution", "inertia", "motion"]),
            ("adjoint", &["execution", "simulation"]),
            ("sweep", &["execution", "reading", "rest", "simulation"]),
            ("check", &["execution", "inertia", "linear", "simulation"]),
            ("verify", &["execution", "motion", "simulation"]),
            ("scene", &["motion"]),
            ("folding", &["motion", "scene"]),
            (
                "optimise",
                &[
                    "adjoint",
                    "execution",
                    "folding",
                    "motion",
                    "reading",
                    "rest",
                    "simulation",
                    "sweep",
                ],
            ),
            ("picture", &["motion", "scene"]),
            ("export", &["motion", "scene"]),
            ("page", &["motion", "scene", "picture"]),
            ("reference", &["optimise", "sweep"]),
            ("main", &["cli"]),
            // The commands are of the binary; they see the library by its name, `lamc_workbench`.
            ("cli", &[]),
        ],
        files_too: true,
    },
    Floors {
        folder: "runtime/src",
        entries: &[
            ("sin_cos", &[]),
            ("linear", &[]),
            ("reduction", &["linear"]),
            ("projection", &["linear", "reduction"]),
            ("assembly", &["linear", "projection"]),
            ("unilateral", &["linear"]),
            ("integrate", &["linear", "projection", "unilateral"]),
            ("stops", &["linear", "projection", "integrate"]),
        ],
        files_too: false,
    },
    Floors { folder: "templates/src", entries: &[], files_too: true },
    Floors { folder: "xtask/src", entries: &[("main", &[])], files_too: true },
];

/// Symbolica and its parts, as crates and as they are named in Rust.
const ENGINE: [&str; 3] = ["symbolica", "numerica", "graphica"];

#[test]
fn crates_depend_only_on_those_below() {
    let names: Vec<&str> = CRATES.iter().map(|(folder, _)| package(folder)).collect();
    for (folder, allowed) in CRATES {
        let manifest = workspace().join(folder).join("Cargo.toml");
        let text = fs::read_to_string(&manifest).unwrap();
        assert!(text.contains(&format!("name = \"{}\"", package(folder))), "{folder}: its name");
        for dependency in dependencies(&text) {
            let ours = names.contains(&dependency);
            assert!(!ours || allowed.contains(&dependency), "{folder} depends on {dependency}");
            let engine = ENGINE.contains(&dependency);
            assert!(!engine || folder == "codegen", "{folder} depends on the engine");
        }
    }
}

#[test]
fn every_folder_of_the_workspace_is_known() {
    for entry in fs::read_dir(workspace()).unwrap() {
        let entry = entry.unwrap();
        let name = entry.file_name().into_string().unwrap();
        if entry.path().is_dir() && !name.starts_with('.') {
            let known = CRATES.iter().any(|(folder, _)| *folder == name)
                || OTHER_FOLDERS.contains(&name.as_str());
            assert!(known, "the folder {name} is in no table of this test");
        }
    }
}

#[test]
fn folders_import_only_those_before() {
    for floors in FLOORS {
        let root = workspace().join(floors.folder);
        for entry in entries(&root) {
            let known = floors.entries.iter().any(|(name, _)| *name == entry.name);
            let needs_no_place = entry.name == "lib" || (!entry.is_folder && !floors.files_too);
            assert!(
                known || needs_no_place,
                "{}/{} is in no table of this test",
                floors.folder,
                entry.name
            );
        }
        for (name, allowed) in floors.entries {
            check_imports(&root, &floors, name, allowed);
        }
    }
}

fn check_imports(root: &Path, floors: &Floors, name: &str, allowed: &[&str]) {
    let mut looked_at = 0;
    let file = root.join(format!("{name}.rs"));
    let files = if file.exists() { vec![file] } else { rust_files(&root.join(name)) };
    // Tests of a stage may build their input with any other.
    for file in files.into_iter().filter(|file| !is_test(file.strip_prefix(root).unwrap())) {
        looked_at += 1;
        for import in imports(root, &file) {
            let known = floors.entries.iter().any(|(entry, _)| *entry == import);
            let passes = import == name
                || allowed.contains(&import.as_str())
                || (!known && !floors.files_too);
            assert!(passes, "{} imports crate::{import}", file.display());
        }
    }
    assert!(looked_at > 0, "no files in {}/{name}", floors.folder);
}

#[test]
fn the_map_shows_every_folder() {
    let map = fs::read_to_string(workspace().join("ARCHITECTURE.md")).unwrap();
    let in_table = |name: &str| map.contains(&format!("\n| `{name}/` |"));
    for (folder, _) in CRATES {
        assert!(in_table(folder), "ARCHITECTURE.md does not show {folder}/");
    }
    for floors in FLOORS.iter().filter(|floors| floors.files_too) {
        for entry in entries(&workspace().join(floors.folder)) {
            let shown = !entry.is_folder || in_table(&entry.name);
            assert!(shown, "ARCHITECTURE.md does not show {}/{}/", floors.folder, entry.name);
        }
    }
}

#[test]
fn only_one_folder_names_the_symbolic_engine() {
    let root = workspace();
    let mut named = 0;
    for (folder, _) in CRATES {
        for file in rust_files(&root.join(folder)) {
            let text = fs::read_to_string(&file).unwrap();
            let imports = ENGINE.iter().any(|engine| text.contains(&format!("{engine}::")));
            let is_home = file.starts_with(root.join("codegen/src/symbolic"));
            named += usize::from(imports);
            assert!(is_home || !imports, "{} names the engine", file.display());
        }
    }
    assert!(named > 0, "the engine is named nowhere: this test looks in the wrong place");
}

/// The name of the package in a folder.
fn package(folder: &str) -> &'static str {
    match folder {
        "tables" => "lamc-tables",
        "macros" => "lamc-runtime-macros",
        "runtime" => "lamc-runtime",
        "templates" => "lamc-templates",
        "drawings" => "lamc-drawings",
        "codegen" => "lamc",
        "workbench" => "lamc-workbench",
        "generated" => "lamc-generated",
        "tests" => "lamc-tests",
        "xtask" => "xtask",
        _ => panic!("{folder} is no crate"),
    }
}

/// Dependencies of a manifest, except those of tests.
fn dependencies(manifest: &str) -> Vec<&str> {
    let mut section = "";
    let mut found = Vec::new();
    for line in manifest.lines() {
        if line.starts_with('[') {
            section = line;
        } else if matches!(section, "[dependencies]" | "[build-dependencies]") {
            found.extend(line.split(['.', ' ', '=']).next().filter(|name| !name.is_empty()));
        }
    }
    found
}
