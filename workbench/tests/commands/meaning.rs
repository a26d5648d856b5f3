//! What numbers on the command line mean, and what is said where a result could mislead.

use std::fs;
use std::path::Path;

use tempfile::TempDir;

/// A folder with models, and what `lamc` says about them.
struct Bench(TempDir);

/// What a command answered.
struct Answer {
    code: Option<i32>,
    out: String,
    told: String,
}

impl Bench {
    fn new(files: &[(&str, &str)]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        Self(folder)
    }

    fn path(&self, name: &str) -> std::path::PathBuf {
        self.0.path().join(name)
    }

    fn run(&self, command: &str) -> Answer {
        let output = super::common::lamc()
            .args(command.split(' '))
            .current_dir(self.0.path())
            .output()
            .unwrap();
        let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
        Answer { code: output.status.code(), out: text(&output.stdout), told: text(&output.stderr) }
    }

    /// What succeeds.
    fn done(&self, command: &str) -> Answer {
        let answer = self.run(command);
        assert_eq!(answer.code, Some(0), "{command}: {}", answer.told);
        answer
    }

    /// What is refused with this exit code and these words.
    fn refused(&self, command: &str, code: i32, says: &str) {
        let answer = self.run(command);
        assert_eq!(answer.code, Some(code), "{command}: {}", answer.told);
        assert!(answer.told.contains(says), "{command}: {}", answer.told);
        assert_eq!(answer.out, "", "{command}");
    }

    /// The first angles of a motion, rad.
    fn start(&self, command: &str) -> Vec<f64> {
        let answer = self.done(&format!("simulate --csv - --duration 1e-3 --rate 1000 {command}"));
        let cells = answer.out.lines().nth(1).unwrap_or_default().split(',').skip(1);
        cells.map(|cell| cell.parse().unwrap()).collect()
    }

    fn json(&self, command: &str) -> serde_json::Value {
        serde_json::from_str(&self.done(command).out).unwrap()
    }
}

/// An arm on a hinge along y; MORE is what else its joint has.
const ARM: &str = "
gravity: [0, 0, 0]
bodies:
  base: { fixed: true }
  arm: { mass: 1 g, com: [0.01, 0, 0], inertia: [[1e-9, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
joints: { j: { bodies: [base, arm], axis: [[0, 0], [0, 0.02]], MORE } }
";

fn arm(more: &str) -> String {
    ARM.replace("MORE", more)
}

/// Two arms: a spring with parameters, and a joint that an input drives.
const DRIVEN: &str = "
units: { angle: deg }
parameters: { k: 11.4 mN*m/rad, b: 1e-6, at: 0.1, share: 2 }
inputs: [motor, twist]
tunable: [mass]
bodies:
  base: { fixed: true }
  arm: { mass: 1 g, com: [0.01, 0, 0], inertia: [[1e-9, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
  hand: { mass: 1 g, com: [0.03, 0, 0], inertia: [[1e-9, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
joints:
  j: { bodies: [base, arm], axis: [[0, 0], [0, 0.02]], stiffness: k, damping: b, rest: at,
       limits: [-90, 90], torque: \"twist - share*0.001*sin(t)\" }
  wrist: { bodies: [arm, hand], axis: [[0.02, 0], [0.02, 0.02]], drive: motor, limits: [-50, 50] }
";

/// The potential has a minimum, and the motion leaves it.
#[test]
fn static_and_dynamic_stability_are_told_apart() {
    let bench = Bench::new(&[
        ("pushed.yaml", &arm("stiffness: 1, torque: \"0.5*u.j\"")),
        ("damped.yaml", &arm("stiffness: 1, damping: 0.5")),
        ("top.yaml", &arm("stiffness: -1")),
        ("free.yaml", &arm("damping: 0")),
    ]);
    for (model, statically, dynamically) in [
        ("pushed", true, false),
        ("damped", true, true),
        ("top", false, false),
        ("free", false, true),
    ] {
        for command in ["equilibrium", "modes"] {
            let found = bench.json(&format!("{command} {model}.yaml --json"));
            assert_eq!(found["statically_stable"], statically, "{command} {model}");
            assert_eq!(found["dynamically_stable"], dynamically, "{command} {model}");
            assert_eq!(found["stable"], statically && dynamically, "{command} {model}");
            let told = bench.done(&format!("{command} {model}.yaml")).out;
            let word = |stable: bool| if stable { "stable:" } else { "unstable:" };
            // Nothing holds the free joint, and nothing pushes it.
            let is_neutral = model == "free";
            assert_eq!(found["neutral"], is_neutral, "{command} {model}");
            let potential = if is_neutral { "neutral:" } else { word(statically) };
            assert!(told.contains(&format!("statically {potential}")), "{told}");
            assert!(told.contains(&format!("dynamically {}", word(dynamically))), "{told}");
        }
    }
    // (0.5 +- sqrt(0.25 - 4 I)) / (2 I) with I = 1e-7 + 1e-3 * 1e-4 kg m^2.
    let told = bench.done("equilibrium pushed.yaml").out;
    assert!(told.contains("grows by 2499998.0000 1/s") && told.contains("not stable;"), "{told}");
}

/// A follower force: two springs whose potential is least, and an oscillation that grows.
#[test]
fn a_force_without_a_potential_makes_a_minimum_flutter() {
    let two = "
gravity: [0, 0, 0]
bodies:
  base: { fixed: true }
  a: { mass: 1, com: [1, 0, 0], inertia: [[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]] }
  b: { mass: 1, com: [2, 0, 0], inertia: [[1e-3, 0, 0], [0, 1e-3, 0], [0, 0, 1e-3]] }
joints:
  p: { bodies: [base, a], axis: [[0, 0], [0, 1]], stiffness: 1, torque: \"3*q.r\" }
  r: { bodies: [a, b], axis: [[1, 0], [1, 1]], stiffness: 1, torque: \"-3*q.p\" }
";
    let bench = Bench::new(&[("flutter.yaml", two)]);
    let found = bench.json("equilibrium flutter.yaml --json");
    assert_eq!((&found["statically_stable"], &found["stable"]), (&true.into(), &false.into()));
    assert!(bench.done("modes flutter.yaml").out.contains("an oscillation of"));
}

#[test]
fn kinks_and_friction_at_rest_are_reported() {
    let bench = Bench::new(&[
        ("soft.yaml", &arm("stiffness: 1, damping: 1e-3, torque: \"-0.5*abs(q.j)\"")),
        ("lost.yaml", &arm("stiffness: 1, damping: 1e-3, torque: \"-1.5*abs(q.j)\"")),
        ("rate.yaml", &arm("stiffness: 1, damping: 1e-3, torque: \"min(0, 1e-4*u.j)\"")),
        ("smooth.yaml", &arm("stiffness: 1, torque: \"0.5*q.j*abs(q.j)\"")),
        ("rubs.yaml", &arm("stiffness: 1, friction: { torque: 1e-3, speed: 2 deg/s }")),
    ]);
    for (model, stable, by) in
        [("soft", true, "angle"), ("lost", false, "angle"), ("rate", true, "speed")]
    {
        let answer = bench.done(&format!("equilibrium {model}.yaml --json"));
        let found: serde_json::Value = serde_json::from_str(&answer.out).unwrap();
        assert_eq!(found["stable"], stable, "{model}");
        assert_eq!(found["kinks"].as_array().map(Vec::len), Some(1), "{model}: {}", answer.out);
        let says = format!("the torque of `j` has a kink at rest: its derivative by the {by}");
        assert!(answer.told.contains(&says), "{}", answer.told);
        assert_eq!(bench.json(&format!("modes {model}.yaml --json"))["stable"], stable, "{model}");
    }
    let smooth = bench.done("modes smooth.yaml --json");
    assert!(smooth.told.is_empty() && smooth.out.contains("\"kinks\": []"), "{}", smooth.told);
    let rubs = bench.done("equilibrium rubs.yaml").told;
    assert!(rubs.contains("the friction of `j` acts at rest as a damper of 2.865e-2"), "{rubs}");
}

#[test]
fn bare_angles_of_options_are_in_the_unit_of_the_model() {
    let free = "damping: 0, limits: [-10 rad, 10 rad]";
    let degrees = format!("units: {{ angle: deg }}{}", arm("damping: 0"));
    let bench =
        Bench::new(&[("deg.yaml", &degrees), ("rad.yaml", &arm(free)), ("driven.yaml", DRIVEN)]);
    let angle = |command: &str| bench.start(command)[0];
    for command in ["deg.yaml --initial j=30", "deg.yaml --lock j=30", "rad.yaml --initial j=30deg"]
    {
        assert!((angle(command) - 30_f64.to_radians()).abs() < 1e-12, "{command}");
    }
    for command in
        ["rad.yaml --initial j=0.5", "deg.yaml --initial j=0.5rad", "deg.yaml --lock j=0.5rad"]
    {
        assert!((angle(command) - 0.5).abs() < 1e-12, "{command}");
    }
    // Parameters and inputs stay SI and radians.
    assert!((bench.start("driven.yaml --input motor=0.5")[1] - 0.5).abs() < 1e-12);
    let turns = |command: &str| bench.run(command).told.contains("for degrees write");
    assert!(turns("simulate rad.yaml --duration 0.01 --initial j=8"));
    assert!(turns("simulate driven.yaml --duration 0.01 --set at=30"));
    for fine in
        ["rad.yaml --initial j=6.283", "rad.yaml --initial j=400deg", "deg.yaml --initial j=90"]
    {
        assert!(!turns(&format!("simulate --duration 0.01 {fine}")), "{fine}");
    }
}

#[test]
fn units_must_measure_what_is_set() {
    let bench = Bench::new(&[("driven.yaml", DRIVEN)]);
    for (setting, says) in [
        ("--set k=3deg", "expected a rotational stiffness, found an angle"),
        ("--set b=2mm", "expected a rotational damping, found a length"),
        ("--set at=2mm", "expected an angle, found a length"),
        ("--set mass_arm=2mm", "expected a mass, found a length"),
        ("--input motor=1mm", "expected an angle, found a length"),
        ("--input twist=1N", "expected a torque, found a force"),
        ("--set k=1 --set k=2", "`--set` gives `k` twice"),
        ("--input motor=1 --input motor=2", "`--input` gives `motor` twice"),
        ("--initial j=1 --initial j=2", "`--initial` gives `j` twice"),
        ("--lock j=1 --lock j=2", "`--lock` gives `j` twice"),
        ("--lock j=1mm", "is not of the form `--lock j0=30deg`"),
    ] {
        bench.refused(&format!("simulate driven.yaml {setting}"), 2, says);
    }
    bench.start("driven.yaml --set k=2N*m/rad --set b=1e-6 --set share=3mm --input twist=1mN*m");
    // The unit outlives an import.
    let copy = bench.done("import driven.yaml -o -").out;
    assert!(copy.contains("  k: 0.0114 N*m/rad\n") && copy.contains("  b: 1e-6\n"), "{copy}");
}

#[test]
fn parameters_are_judged_as_constants_are() {
    let bench = Bench::new(&[
        ("driven.yaml", DRIVEN),
        ("states.json", r#"{"states": [{"q": [0, 0], "params": {"b": -1}}]}"#),
    ]);
    for (setting, says) in [
        ("--set b=-1", "the damping of `j` is negative"),
        ("--set mass_arm=-1g", "the mass of `arm` is not positive"),
        ("--set mass_hand=0", "the mass of `hand` is not positive"),
        ("--lock wrist=60", "the angle of `wrist` is outside its limits"),
    ] {
        bench.refused(&format!("simulate driven.yaml {setting}"), 1, says);
    }
    bench.refused("eval driven.yaml --states states.json", 1, "the damping of `j` is negative");
    let weak = bench.done("simulate driven.yaml --duration 0.01 --set k=-1e-3").told;
    assert!(weak.contains("warning: the stiffness of `j` is negative"), "{weak}");
    // A drive that is no constant is seen while it moves.
    let far = bench.done("simulate driven.yaml --duration 1 --input motor=2*t").told;
    assert!(
        far.contains("`wrist` is driven beyond its limits: to 50.420 deg at t = 0.440 s"),
        "{far}"
    );
}

#[test]
fn a_guess_that_assembly_moves_far_is_reported() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/fourbar.yaml");
    let model = fs::read_to_string(model).unwrap();
    let bench = Bench::new(&[("fourbar.yaml", &model)]);
    let told =
        |guess: &str| bench.done(&format!("simulate fourbar.yaml --duration 1e-3 {guess}")).told;
    let far = told("--initial rocker_hinge=60 --initial crank_hinge=-60");
    assert!(far.contains("`rocker_hinge` should start at 60.0000 deg but starts at"), "{far}");
    assert!(far.contains("`crank_hinge` should start at -60.0000 deg"), "{far}");
    assert_eq!(told("--initial rocker_hinge=8"), "");
}

#[test]
fn a_joint_that_passes_half_a_turn_is_noted() {
    let bench =
        Bench::new(&[("spin.yaml", &format!("{}initial: {{ u: {{ j: 30 }} }}", arm("z: 0")))]);
    let told = bench.done("simulate spin.yaml --duration 0.2").told;
    assert!(
        told.contains(
            "`j` is turned past 180 deg at t = 0.110 s: plates stop each other only at points"
        ),
        "{told}"
    );
    assert_eq!(bench.done("simulate spin.yaml --duration 0.1").told, "");
}

#[test]
fn a_mistyped_command_is_not_taken_for_a_model() {
    let bench = Bench::new(&[("chek", &arm("stiffness: 1"))]);
    bench.refused("simualte m.yaml", 2, "did you mean `simulate`?");
    bench.refused("equilibrum", 2, "did you mean `equilibrium`?");
    // A file of that name is a model.
    assert!(bench.done("chek -o -").out.contains("pub struct Chek"));
    bench.refused("nowhere.yaml -o -", 1, "nowhere.yaml");
}

/// Of a five-bar with two freedoms one joint is recorded: a guess tells how the rest is folded.
#[test]
fn a_fit_takes_a_guess_of_joints_that_were_not_recorded() {
    let mut model = "
units: { length: mm, angle: deg }
materials: { c: { density: 1000, thickness: 1 } }
layup: [c]
bodies:
  base: { fixed: true }
  a: { outline: [[0,0],[40,0],[40,20],[0,20]] }
  b: { outline: [[40,0],[90,0],[90,20],[40,20]] }
  c: { outline: [[90,0],[130,0],[130,20],[90,20]] }
  d: { outline: [[100,20],[130,20],[130,40],[100,40]] }
joints:
"
    .to_owned();
    for (name, bodies, x, rest) in [
        ("j0", "base, a", 0, -30),
        ("j1", "a, b", 40, 45),
        ("j2", "b, c", 90, -10),
        ("j3", "c, d", 130, -35),
        ("j4", "d, base", 100, 40),
    ] {
        model += &format!(
            "  {name}: {{ bodies: [{bodies}], axis: [[{x}, 0], [{x}, 20]], z: 0.5, rest: {rest}, \
             stiffness: 5e-4, damping: 2e-7 }}\n"
        );
    }
    let bench = Bench::new(&[("five.yaml", &model)]);
    let run =
        "simulate five.yaml --initial j0=-32 --initial j1=43 --duration 0.2 --rate 500 --csv -";
    let rows: Vec<String> = bench.done(run).out.lines().map(str::to_owned).collect();
    let first: Vec<String> =
        rows.iter().map(|row| row.splitn(3, ',').take(2).collect::<Vec<_>>().join(",")).collect();
    fs::write(bench.path("one.csv"), first.join("\n")).unwrap();
    let found = bench.done("fit five.yaml --data one.csv --free damping_j0 --initial j1=45");
    assert!(found.out.contains("2.000000e-7"), "{}", found.out);
    assert_eq!(found.told, "");
    let lost = bench.run("fit five.yaml --data one.csv --free damping_j0");
    assert!(
        lost.told.contains(
            "the first sample does not determine the initial angles of `j1`, `j2`, `j3`, `j4`"
        ),
        "{}",
        lost.told
    );
    let said = "fit five.yaml --data one.csv --free damping_j0 --initial j0=45";
    bench.refused(said, 1, "--initial has no effect on `j0`");
}

/// That a motion cannot be integrated has to do with a flat start only where there is one.
#[test]
fn advice_about_flat_sheets_is_for_flat_sheets() {
    let model = Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples/fourbar.yaml");
    let model = fs::read_to_string(model).unwrap();
    let bench = Bench::new(&[("fourbar.yaml", &model)]);
    for (crank, is_flat) in [("0 --initial rocker_hinge=0", true), ("10", false)] {
        let start = format!("--duration 0.5 --initial crank_hinge={crank}");
        let answer = bench.run(&format!("simulate fourbar.yaml --tolerance 1e-17 {start}"));
        assert_eq!(answer.code, Some(1), "{}", answer.out);
        let ends = ["gave up after", "step became too small"];
        assert!(ends.iter().any(|end| answer.told.contains(end)), "{}", answer.told);
        assert_eq!(answer.told.contains("start a flat sheet"), is_flat, "{}", answer.told);
    }
}
