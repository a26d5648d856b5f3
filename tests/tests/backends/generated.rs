//! The modules in `generated/` are equal to the output of the compiler, whatever it compiled before.

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc_tests::golden::is_pinned;
use lamc_tests::{MODULES, compile, functions_of, workspace};

#[test]
fn modules_are_what_the_compiler_writes() {
    let mut stale = Vec::new();
    for name in MODULES {
        let text = written(name);
        let path = workspace().join("generated/src").join(format!("{name}.rs"));
        stale.extend((!is_pinned(&path, &text)).then_some(path));
    }
    assert!(stale.is_empty(), "{stale:?} are stale; `cargo xtask bless` writes them anew");
}

#[test]
fn bytes_do_not_depend_on_what_was_compiled_before() {
    let first = written("fourbar");
    written("sixbar");
    assert_eq!(first, written("fourbar"));
}

fn written(name: &str) -> String {
    let compiled = compile(&workspace().join("examples").join(format!("{name}.yaml")));
    let options = Options { functions: functions_of(name), ..Options::default() };
    rust_module(&compiled, &options).unwrap()
}
