//! Where loops are cut changes the equations, not the motion.

use lamc::pipeline::{Compiled, compile_edited};
use lamc::program::{FunctionKind, Interpreter};
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

/// A loop of six plates that hangs in the air, cut where an acceleration takes the fewest operations: so it says, so it is, and so it stays
/// where a parameter draws it differently. A module does not say that this was asked for.
#[test]
fn loops_are_cut_where_it_costs_least() {
    let mut text = "units: { length: mm, angle: deg }
parameters: { width: { value: 40 mm, range: [39 mm, 41 mm] } }
bodies:
  base: { free: true, mass: 5 g, com: [20, 5, 0], inertia: [[1e-6, 0, 0], [0, 1e-6, 0], [0, 0, 1e-6]] }
"
    .to_owned();
    for k in 0..5 {
        text += &format!(
            "  plate{k}: {{ mass: {} g, com: [{}, {}, {}], inertia: [[{}e-7, 0, 0], [0, 6e-7, 0], [0, 0, 6e-7]] }}\n",
            k + 1,
            10 * k,
            5 + k,
            10 + 3 * k,
            k + 1
        );
    }
    text += "joints:
  hinge5: { bodies: [plate4, base], axis: [[width, 0], [width, 10]], z: 0 }
  hinge4: { bodies: [plate3, plate4], axis: [[width + 10, 0], [width + 10, 10]], z: 20 }
  hinge3: { bodies: [plate2, plate3], axis: [[width + 5, 0], [width + 5, 10]], z: 40 }
  hinge2: { bodies: [plate1, plate2], axis: [[width/2, 0], [width/2, 10]], z: 40 }
  hinge1: { bodies: [plate0, plate1], axis: [[0, 0], [0, 10]], z: 20 }
  hinge0: { bodies: [base, plate0], axis: [[0, 0], [0, 10]], z: 0 }
";
    let cost = |compiled: &Compiled| {
        let acceleration = compiled.program.function_of(FunctionKind::Acceleration);
        (compiled.topology.loops[0].joint, acceleration.cost().total())
    };
    let chosen = compile_text(&text);
    let comparison = chosen.topology.comparison.unwrap();
    let (joint, least) = cost(&chosen);
    assert!(comparison.chosen == least && least < comparison.plain, "{comparison:?}, {least}");
    assert!(chosen.program.interface.cuts.is_empty());
    assert_eq!(chosen.topology_at(&[0.0405]).unwrap().loops[0].joint, joint);
    let file = SourceFile { path: "model.yaml".into(), text };
    let costs = ["hinge0", "hinge1", "hinge2", "hinge3", "hinge4", "hinge5"].map(|hinge| {
        let asked = compile_edited(&file, |model| model.cut(hinge)).unwrap();
        assert_eq!(asked.program.interface.cuts, [hinge]);
        cost(&asked)
    });
    assert!(costs.contains(&(joint, least)), "{costs:?}");
    assert!(costs.iter().any(|(_, cost)| *cost == comparison.plain), "{costs:?}");
}
