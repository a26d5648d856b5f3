//! Growth: the module of a chain grows no faster than the square of its hinges.

use std::fmt::Write;
use std::time::Instant;

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc_tests::compile_text;

/// A chain of plates whose hinge lines point every which way.
fn chain(hinges: usize) -> String {
    let mut text = "materials: { card: { density: 700, thickness: 0.4 mm } }
layup: [card]
units: { length: mm }
bodies:
  b0: { fixed: true }
"
    .to_owned();
    let mut joints = "joints:\n".to_owned();
    for k in 1..=hinges {
        let x = 20.0 * k as f64;
        let outline = format!("[[{x}, 0], [{}, 3], [{}, 24], [{x}, 20]]", x + 20.0, x + 19.0);
        let _ = writeln!(text, "  b{k}: {{ outline: {outline} }}");
        let angle = 0.9 + 0.37 * k as f64;
        let axis = format!("[[{x}, 5], [{}, {}]]", x + angle.cos(), 5.0 + angle.sin());
        let springs = "stiffness: 0.01, damping: 1.0e-5";
        let _ = writeln!(
            joints,
            "  j{k}: {{ bodies: [b{}, b{k}], axis: {axis}, z: 0.2, {springs} }}",
            k - 1
        );
    }
    text.push_str(&joints);
    text
}

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
