//! The modules in `generated/` are what the compiler writes, whatever it compiled before.

use std::fs;

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc_tests::{MODULES, compile, workspace};

#[test]
fn modules_are_what_the_compiler_writes() {
    for name in MODULES {
        let text = written(name);
        let path = workspace().join("generated/src").join(format!("{name}.rs"));
        if std::env::var_os("LAMC_BLESS").is_some() {
            fs::write(&path, &text).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        }
        let old = fs::read_to_string(&path).unwrap_or_default();
        let differs = old.lines().zip(text.lines()).position(|(old, new)| old != new);
        assert!(
            old == text,
            "generated/src/{name}.rs is stale from line {:?}: run with LAMC_BLESS=1",
            differs.map(|line| line + 1)
        );
    }
}

#[test]
fn bytes_do_not_depend_on_what_was_compiled_before() {
    let first = written("fourbar");
    written("sixbar");
    assert_eq!(first, written("fourbar"));
}

fn written(name: &str) -> String {
    let compiled = compile(&workspace().join("examples").join(format!("{name}.yaml")));
    rust_module(&compiled, &Options::default()).unwrap()
}
