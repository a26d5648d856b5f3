//! Where loops are cut changes the equations, not the motion.

use lamc::pipeline::compile_edited;
use lamc::program::Interpreter;
use lamc::source::SourceFile;
use lamc_runtime::{Mechanism, acceleration};
use lamc_tests::random::{Lines, Random, Recipe, closed_state, model};
use lamc_tests::{compile, compile_text, relative_error, workspace};

fn rates(system: &Interpreter, q: &[f64], u: &[f64]) -> Vec<f64> {
    let mut rates = vec![0.0; q.len()];
    acceleration(system, 0.0, q, u, &mut system.workspace(), &mut rates).unwrap();
    rates
}

/// Every joint of a model as the place of a cut, against the compiler's own choice; how many joints
/// could be one.
fn check(text: &str, seed: u64) -> usize {
    let file = SourceFile { path: "model.yaml".into(), text: text.into() };
    let usual = compile_text(text);
    let system = Interpreter::new(&usual.program);
    let state = closed_state(&system, &mut Random::new(seed));
    let expected = rates(&system, &state.q, &state.u);
    let mut cut = 0;
    for joint in &usual.program.interface.joints {
        let Ok(other) = compile_edited(&file, |model| model.cut(&joint.name)) else { continue };
        assert_eq!(other.program.interface.rank, usual.program.interface.rank);
        let closes =
            other.topology.loops.iter().any(|closed| {
                other.topology.mechanism.joints[closed.joint.index()].name == joint.name
            });
        assert!(closes, "`{}` closes no loop", joint.name);
        let other = rates(&Interpreter::new(&other.program), &state.q, &state.u);
        let error = relative_error(&other, &expected);
        assert!(error < 1e-9, "cut at `{}`: off by {error:e}", joint.name);
        cut += 1;
    }
    cut
}

#[test]
fn accelerations_are_those_of_any_other_cut() {
    let sixbar = std::fs::read_to_string(workspace().join("examples/sixbar.yaml")).unwrap();
    assert_eq!(check(&sixbar, 1), 6, "every joint of its one loop");
    for (seed, loops, lines) in
        [(41, 2, Lines::Parallel), (42, 2, Lines::Concurrent), (43, 1, Lines::Any)]
    {
        let text = model(seed, Recipe { branches: 1, loops, lines });
        assert!(check(&text, seed) > 3, "seed {seed}");
    }
}

#[test]
fn a_joint_that_everything_hangs_on_cannot_be_cut() {
    let path = workspace().join("examples/pendulum.yaml");
    let file = SourceFile::read(&path.display().to_string()).unwrap();
    let error = compile_edited(&file, |model| model.cut("hinge")).unwrap_err();
    let lamc::pipeline::CompileError::Model(problems) = error else { panic!("{error}") };
    let report = problems.render(&file, false);
    assert!(report.contains("error[no-loop]") && report.contains("`arm`"), "{report}");
    assert!(compile_edited(&file, |model| model.cut("hing")).is_err());
    assert!(compile(&path).program.interface.cuts.is_empty());
}
