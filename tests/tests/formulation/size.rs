//! The length of a chain's module grows no faster than the square of the number of hinges; what free bases and contact
//! points cost.

use std::time::Instant;

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc::program::{FunctionKind, Op, Phase};
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

fn operations(text: &str) -> usize {
    let program = compile_text(text).program;
    let acceleration = program.function_of(FunctionKind::Acceleration);
    let operations = acceleration.cost().total();
    println!("{operations} operations, critical path {}", acceleration.critical_path());
    assert!(operations > 0);
    operations
}

/// A free base costs at most two and a half times the operations of a fixed one.
#[test]
fn a_free_six_bar_costs_little_more_than_twice_a_fixed_one() {
    let path = workspace().join("examples/sixbar.yaml");
    let text = std::fs::read_to_string(path).unwrap();
    let fixed = operations(&text);
    let free = operations(&text.replacen("fixed: true", "free: true", 1));
    assert!(2 * free <= 5 * fixed, "{free} {fixed}");
}

/// The inertia of the independent speeds does not wait for the margin's heading, where its statements would be
/// in the order in which the least pivot needs them: the free six-bar's acceleration took 6 % longer so.
#[test]
fn the_margin_has_comparisons_only() {
    let text = std::fs::read_to_string(workspace().join("examples/sixbar.yaml")).unwrap();
    let program = compile_text(&text.replacen("fixed: true", "free: true", 1)).program;
    for kind in [FunctionKind::Acceleration, FunctionKind::Projection] {
        let instructions = &program.function_of(kind).instructions;
        let of_margin = instructions.iter().filter(|i| i.section.phase == Phase::EliminationMargin);
        let mut comparisons = 0;
        for instruction in of_margin {
            match instruction.op {
                Op::Max(..) => comparisons += 1,
                Op::Add(..) | Op::Sub(..) => panic!("{kind:?}: {:?}", instruction.op),
                _ => {}
            }
        }
        assert!(comparisons > 0, "{kind:?}");
    }
}

/// `tests/peers/run` measures 0.12 ns per operation: 150 ns, which eight contact points may cost, are more than 1000.
const OF_EIGHT_CONTACT_POINTS: usize = 700;

/// Corners of one plate, and points on all bodies of the free six-bar, which have less in common.
#[test]
fn eight_contact_points_cost_a_few_hundred_operations() {
    let read = |path: &str| std::fs::read_to_string(workspace().join(path)).unwrap();
    let sixbar = read("examples/sixbar.yaml").replacen("fixed: true", "free: true", 1);
    let (sixbar, _) = sixbar.split_once("# A rough guess").unwrap();
    let sixbar = format!("{sixbar}{}", read("tests/peers/sixbar_contacts.yaml"));
    let robots = [read("tests/peers/plate.yaml"), sixbar];
    for robot in robots {
        let (bare, _) = robot.split_once("\ncontacts:").unwrap();
        let more = operations(&robot) - operations(&format!("{bare}\n"));
        assert!((8..=OF_EIGHT_CONTACT_POINTS).contains(&more), "{more} operations");
    }
}
