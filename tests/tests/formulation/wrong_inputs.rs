//! Snapshots of the diagnostics for invalid or odd models: `wrong/<name>.yaml` is the model, and
//! `wrong/<name>.stderr` is what the user reads ([`golden`](lamc_tests::golden) says how to change them).
//! The examples in `docs/ERRORS.md` are the smallest of these models.

use std::fs;
use std::path::{Path, PathBuf};

use lamc::pipeline::{CompileError, compile};
use lamc::source::SourceFile;
use lamc_tests::golden::is_pinned;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("wrong")
}

/// The rendered errors and warnings about the model at `path`.
fn check(path: &Path) -> String {
    let mut file = SourceFile::read(path.to_str().expect("a fixture's path is UTF-8")).unwrap();
    // The same text wherever the project lies.
    file.path = format!("wrong/{}", path.file_name().unwrap().to_str().unwrap());
    let diagnostics = match compile(&file) {
        Ok(compiled) => compiled.warnings,
        Err(CompileError::Model(errors)) => errors,
        Err(error) => panic!("{error}"),
    };
    diagnostics.render(&file, false)
}

#[test]
fn diagnostics_are_as_pinned() {
    let mut inputs: Vec<_> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "yaml"))
        .collect();
    inputs.sort();
    assert!(inputs.len() >= 30, "only {} invalid models", inputs.len());
    let mut wrong = Vec::new();
    for input in inputs {
        let pinned = input.with_extension("stderr");
        let answer = check(&input);
        let is_reported = ["error[", "warning[", "note["].iter().any(|it| answer.starts_with(it));
        assert!(is_reported, "nothing is reported about {}:\n{answer}", input.display());
        wrong.extend((!is_pinned(&pinned, &answer)).then_some(pinned));
    }
    assert!(wrong.is_empty(), "{wrong:?} differ; `cargo xtask bless` rewrites them");
}

#[test]
fn every_snapshot_has_its_model() {
    for entry in fs::read_dir(folder()).unwrap() {
        let path = entry.unwrap().path();
        assert!(path.with_extension("yaml").is_file(), "{} is left over", path.display());
    }
}

#[test]
fn text_that_is_not_utf8_is_located() {
    let file = tempfile::NamedTempFile::new().unwrap();
    fs::write(file.path(), b"name: fine\nbodies: { b\xe4se: {} }\n").unwrap();
    let error = SourceFile::read(file.path().to_str().unwrap()).unwrap_err().to_string();
    assert!(
        error.ends_with(":2:12: not UTF-8 text (byte 0xe4); save the file as UTF-8"),
        "{error}"
    );
}
