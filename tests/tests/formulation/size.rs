//! Growth: the length of a chain's module grows no faster than the square of the number of hinges.

use std::time::Instant;

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc::program::FunctionKind;
use lamc_tests::chain::chain;
use lamc_tests::{compile_text, workspace};

#[test]
fn modules_grow_as_the_square_of_the_hinges() {
    let size = |hinges| {
        let begin = Instant::now();
        let compiled = compile_text(&chain(hinges));
        let module = rust_module(&compiled, &Options::default()).unwrap();
        let operations = compiled.program.functions[0].cost().total();
        println!(
            "{hinges} hinges: {operations} operations, {} kB, {:.2} s",
            module.len() / 1000,
            begin.elapsed().as_secs_f64()
        );
        (operations, module.len())
    };
    let sizes = [15, 30, 60].map(size);
    for pair in sizes.windows(2) {
        assert!(pair[1].0 <= 4 * pair[0].0, "{sizes:?}");
        // Names grow by a digit, too.
        assert!(pair[1].1 <= 4 * pair[0].1 + pair[0].1 / 4, "{sizes:?}");
    }
}

/// A free base costs at most two and a half times the operations of a fixed one.
#[test]
fn a_free_six_bar_costs_little_more_than_twice_a_fixed_one() {
    let path = workspace().join("examples/sixbar.yaml");
    let text = std::fs::read_to_string(path).unwrap();
    let operations = |text: &str| {
        let program = compile_text(text).program;
        let acceleration = program.function_of(FunctionKind::Acceleration);
        let operations = acceleration.cost().total();
        println!("{operations} operations, critical path {}", acceleration.critical_path());
        assert!(operations > 0);
        operations
    };
    let fixed = operations(&text);
    let free = operations(&text.replacen("fixed: true", "free: true", 1));
    assert!(2 * free <= 5 * fixed, "{free} {fixed}");
}
