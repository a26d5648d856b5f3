//! Growth: the length of a chain's module grows no faster than the square of the number of hinges.

use std::time::Instant;

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc_tests::chain::chain;
use lamc_tests::compile_text;

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
