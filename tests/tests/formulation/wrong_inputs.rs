//! What a wrong model is answered with, pinned as text.
//!
//! `wrong/<name>.yaml` is the input, `wrong/<name>.stderr` what the user reads. `LAMC_BLESS=1`
//! rewrites the answers: read every one that changed.

use std::fs;
use std::path::{Path, PathBuf};

use lamc::pipeline::{CompileError, compile};
use lamc::source::SourceFile;
use similar::TextDiff;

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("wrong")
}

/// All that is said about the model at `path`, errors and warnings.
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
fn answers_are_as_pinned() {
    let bless = std::env::var_os("LAMC_BLESS").is_some_and(|value| value == "1");
    let mut inputs: Vec<_> = fs::read_dir(folder())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "yaml"))
        .collect();
    inputs.sort();
    assert!(inputs.len() >= 30, "only {} wrong inputs", inputs.len());
    let mut wrong = Vec::new();
    for input in inputs {
        let pinned = input.with_extension("stderr");
        let answer = check(&input);
        assert!(answer.contains("error["), "{} is not wrong:\n{answer}", input.display());
        if bless {
            fs::write(&pinned, &answer).unwrap();
        }
        let expected = fs::read_to_string(&pinned).unwrap_or_default();
        if answer != expected {
            let diff = TextDiff::from_lines(&expected, &answer);
            let diff = diff.unified_diff().header("pinned", "answer").to_string();
            println!("{}:\n{diff}", pinned.display());
            wrong.push(pinned);
        }
    }
    assert!(wrong.is_empty(), "{} answers differ; LAMC_BLESS=1 rewrites them", wrong.len());
}

#[test]
fn every_answer_has_its_input() {
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
