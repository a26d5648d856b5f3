//! Models read, evaluated, at rest and about it.

use std::fs;
use std::io::Write;
use std::process::Stdio;

use super::common::{SWING, example, folder, json, lamc, run, text};
use super::compare::largest;

#[test]
fn eval_answers_in_the_stated_keys_and_names_the_wrong_state() {
    let ask = |states: &str| {
        let mut child = lamc()
            .args(["eval", &example("pendulum.yaml"), "--states", "-"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap_or_else(|error| panic!("{error}"));
        if let Some(mut stdin) = child.stdin.take() {
            stdin.write_all(states.as_bytes()).ok();
        }
        child.wait_with_output().unwrap_or_else(|error| panic!("{error}"))
    };
    let good = ask(r#"{"states": [{"q": [0.1]}, {"q": [0.2], "u": [1.0], "t": 3}]}"#);
    assert_eq!(good.status.code(), Some(0), "{}", text(&good.stderr));
    let answer: serde_json::Value = serde_json::from_slice(&good.stdout).unwrap_or_default();
    assert_eq!(answer["model"], "pendulum");
    assert_eq!(answer["joints"][0], "hinge");
    let keys: Vec<_> = answer["states"][1].as_object().into_iter().flatten().collect();
    let mut keys: Vec<_> = keys.into_iter().map(|(key, _)| key.as_str()).collect();
    keys.sort_unstable();
    assert_eq!(
        keys,
        [
            "acceleration",
            "closure_residual",
            "constraint_rank",
            "dof",
            "forcing",
            "kinetic_energy",
            "mass_matrix",
            "motor_torques",
            "potential_energy",
            "q",
            "reactions",
            "t",
            "u"
        ]
    );
    for (wrong, problem) in [
        (r#"{"states": [{"q": [0.1]}, {"q": [0.1, 0.2]}]}"#, "state 1: `q` has 2 numbers"),
        (r#"{"states": [{"q": [0.1], "params": {"k": 1}}]}"#, "no parameter or input"),
        (r#"{"states": [{"q": [0.1], "v": [1]}]}"#, "unknown field"),
        ("{", "EOF"),
    ] {
        let output = ask(wrong);
        assert_eq!(output.status.code(), Some(1), "{wrong}");
        assert!(text(&output.stderr).contains(problem), "{}", text(&output.stderr));
        assert!(output.stdout.is_empty());
    }
}

/// The power 0 is 1, also where the base is 0; what is undefined everywhere is an error.
#[test]
fn powers_of_nothing() {
    let (_guard, folder) = folder();
    let model = folder.join("m.yaml").display().to_string();
    let at = |torque: &str| {
        fs::write(&model, SWING.replace("TORQUE", torque)).unwrap();
        run(&["eval", &model])
    };
    let acceleration = |torque: &str| {
        let output = at(torque);
        assert_eq!(output.status.code(), Some(0), "{torque}: {}", text(&output.stderr));
        json(&output)["states"][0]["acceleration"][0].as_f64().unwrap()
    };
    let (none, one) = (acceleration("0"), acceleration("1e-3"));
    for power in
        ["(q.hinge*0)^0", "(t - t)^0", "q.hinge^(t*0)", "0^0", "q.hinge^0", "2^(q.hinge*0)"]
    {
        assert_eq!(acceleration(&format!("1e-3*({power})")), one, "{power}");
    }
    for zero in ["q.hinge*1e200*1e200", "exp(-1e6 + q.hinge*0)", "0^(q.hinge*0 + 2)"] {
        assert_eq!(acceleration(zero), none, "{zero}");
    }
    for undefined in ["q.hinge + 10^10^10", "(q.hinge*0)^-17", "exp(1000 + t*0)", "u.hinge*(0/0)"] {
        let output = at(undefined);
        let said = text(&output.stderr);
        assert_eq!(output.status.code(), Some(1), "{undefined}: {said}");
        assert!(said.contains("error[not-finite]") && said.contains("^"), "{said}");
    }
}

#[test]
fn import_writes_a_model_that_compiles_to_the_same_motion() {
    let (_guard, folder) = folder();
    let copy = folder.join("sixbar.yaml").display().to_string();
    assert_eq!(run(&["import", &example("sixbar.yaml"), "-o", &copy]).status.code(), Some(0));
    let body = |model: &str| {
        let module = text(&run(&[model, "-o", "-"]).stdout);
        module.lines().filter(|line| !line.starts_with("//")).map(str::to_owned).collect::<Vec<_>>()
    };
    let original = body(&example("sixbar.yaml"));
    assert!(!original.is_empty());
    assert_eq!(original, body(&copy));
}

#[test]
fn equilibrium_agrees_with_published_end_states() {
    let model = example("sixbar_markers.yaml");
    let csv = example("../docs/sixbar_published.csv");
    let table = run(&["equilibrium", &model, "--compare", &csv]);
    assert_eq!(table.status.code(), Some(0), "{}", text(&table.stderr));
    assert!(text(&table.stdout).contains("two-step"));
    // Of the authors' simulations that close first; rad, printed to six digits.
    let published = [
        ("0.0102", [0.280474, 0.0579898, 0.431370, -0.470499, -0.199470, -0.235800]),
        ("0.0114", [0.265413, 0.057515, 0.388605, -0.434225, -0.180187, -0.216840]),
        ("0.01315", [0.244296, 0.0552327, 0.339353, -0.389250, -0.157832, -0.193760]),
    ];
    let order = [
        "ground_east",
        "ground_west",
        "south_east_east",
        "west_south_west",
        "south_south_east",
        "south_west_south",
    ];
    for (k, angles) in published {
        let found = json(&run(&["equilibrium", &model, "--set", &format!("k={k}"), "--json"]));
        assert_eq!(found["stable"], true);
        assert!(found["closure_residual"].as_f64().is_some_and(|open| open < 1e-13));
        assert!(found["generalized_force"].as_f64().is_some_and(|force| force < 1e-12));
        let joints = found["joints"].as_array().cloned().unwrap_or_default();
        for (name, angle) in order.iter().zip(angles) {
            let index = joints.iter().position(|joint| joint == name).unwrap_or(99);
            let ours = found["q"][index].as_f64().unwrap_or(f64::NAN);
            assert!((ours - angle).abs() < 3e-5, "k = {k}, {name}: {ours} is not {angle}");
        }
    }
}

#[test]
fn modes_of_a_pendulum_by_hand() {
    let (_guard, folder) = folder();
    let file = folder.join("swing.yaml");
    let model = "
gravity: [0, -9.81, 0]
bodies:
  base: { fixed: true }
  rod: { mass: 2 g, com: [0, -0.02, 0], inertia: [[3e-7, 0, 0], [0, 1e-9, 0], [0, 0, 3e-7]] }
joints: { hinge: { bodies: [base, rod], axis: [[0, 0], [1, 0]], stiffness: 1e-3, damping: 4e-6 } }
";
    fs::write(&file, model).ok();
    let found = json(&run(&["modes", &file.display().to_string(), "--json"]));
    let inertia = 3e-7 + 0.002 * 0.02 * 0.02;
    let omega = f64::sqrt((1e-3 + 0.002 * 9.81 * 0.02) / inertia);
    let mode = &found["modes"][0];
    let near = |key: &str, expected: f64| {
        let value = mode[key].as_f64().unwrap_or(f64::NAN);
        assert!((value - expected).abs() < 1e-9 * expected, "{key}: {value} is not {expected}");
    };
    near("frequency", omega / std::f64::consts::TAU);
    near("damping_ratio", 4e-6 / inertia / (2.0 * omega));
    assert_eq!((&found["stable"], &mode["shape"][0][0]), (&true.into(), &1.0.into()));
}

/// A plate on four springs without friction: it heaves at sqrt(4 k / m), and nothing opposes that it slides.
#[test]
fn modes_of_a_plate_that_stands_by_hand() {
    let (_guard, folder) = folder();
    let file = folder.join("stands.yaml");
    let model = "
units: { length: mm }
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies: { plate: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] } }
contacts: { ground: { plane: { point: [0, 0, -20], normal: [0, 0, 1] }, stiffness: 50 N/m, friction: 0 } }
initial: { bodies: { plate: { position: [0, 0, 5], turn: [0, 20 deg, 0.5] } } }
";
    fs::write(&file, model).ok();
    let path = file.display().to_string();
    let found = json(&run(&["modes", &path, "--json"]));
    assert_eq!(found["free_bodies"], serde_json::json!(["plate"]));
    assert_eq!((&found["stable"], &found["neutral"]), (&false.into(), &true.into()));
    let mass = 700.0 * 0.04 * 0.02 * 0.0004;
    let sunk = mass * 9.81 / 200.0;
    let height = found["q"][2].as_f64().unwrap_or(f64::NAN);
    assert!((height + 0.02 + sunk).abs() < 1e-9, "{height}");
    let heave = f64::sqrt(200.0 / mass) / std::f64::consts::TAU;
    let modes = found["modes"].as_array().cloned().unwrap_or_default();
    let near = |mode: &&serde_json::Value| {
        mode["frequency"].as_f64().is_some_and(|found| (found / heave - 1.0).abs() < 1e-9)
    };
    let mode = modes.iter().find(near).unwrap_or_else(|| panic!("no mode of {heave} Hz: {found}"));
    // It heaves and rocks about two axes; that it slides and turns along the ground is no mode.
    assert_eq!((modes.len(), found["neutral_directions"].as_array().map(Vec::len)), (3, Some(3)));
    assert_eq!(mode["shape"][2][0], 1.0);
    let table = text(&run(&["equilibrium", &path]).stdout);
    assert!(table.contains("statically neutral") && table.contains("plate.z mm"), "{table}");
    // The plate rocks at the root of three times that frequency, hardly damped: RK4 reaches 2 sqrt(2).
    let report = text(&run(&["check", &path]).stdout);
    let step =
        report.lines().find_map(|line| line.strip_prefix("longest stable step of RK4 at rest: "));
    let step: f64 = step.and_then(|step| step.trim_end_matches(" s").parse().ok()).unwrap();
    let reach = step * heave * std::f64::consts::TAU * 3_f64.sqrt();
    assert!((reach / 8_f64.sqrt() - 1.0).abs() < 0.02, "{step}");
}

/// The finger's tendon has the tension of its input, its band that of its length, in `eval` as in the columns of
/// `simulate`.
#[test]
fn tensions_are_written() {
    let finger = example("finger.yaml");
    let found = json(&run(&["eval", &finger, "--input", "pull=0.05"]));
    let found = &found["states"][0]["tensions"];
    assert_eq!(found["tendons.flexor"], 0.05);
    let rubber = found["springs.rubber"].as_f64().unwrap_or(f64::NAN);
    // As drawn, its ends are 90 mm apart.
    assert!((rubber - 3.0 * 0.01).abs() < 1e-12, "{rubber}");
    let csv =
        run(&["simulate", &finger, "--input", "pull=0.05", "--duration", "0.02", "--csv", "-"]);
    let csv = text(&csv.stdout);
    let mut lines = csv.lines();
    let header: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    let first: Vec<&str> = lines.next().unwrap_or_default().split(',').collect();
    assert_eq!(header.len(), first.len());
    assert_eq!(
        header[header.len() - 2..],
        ["springs.rubber.tension [N]", "tendons.flexor.tension [N]"]
    );
    assert_eq!(first[first.len() - 1], "0.05");
    assert_eq!(first[first.len() - 2].parse::<f64>().unwrap_or(f64::NAN), rubber);
}

/// The speeds and the neutral directions of a model, which is said to be neutral.
fn neutral(model: &str) -> (Vec<String>, Vec<Vec<f64>>) {
    let (_guard, folder) = folder();
    let file = folder.join("neutral.yaml");
    fs::write(&file, format!("gravity: [0, 0, 0]\n{model}"))
        .unwrap_or_else(|error| panic!("{error}"));
    let file = file.display().to_string();
    let found = json(&run(&["modes", &file, "--json"]));
    assert_eq!(found["neutral"], true, "{found}");
    let directions: Vec<Vec<f64>> =
        serde_json::from_value(found["neutral_directions"].clone()).unwrap_or_default();
    let table = text(&run(&["modes", &file]).stdout);
    assert!(table.contains(&format!("opposes a displacement: {}\n", directions.len())), "{table}");
    let rows = table.lines().skip(1).take_while(|row| !row.starts_with("frequency"));
    (rows.filter_map(|row| row.split(' ').next().map(str::to_owned)).collect(), directions)
}

const SOLID: &str = "mass: 0.2, inertia: [[1e-3, 0, 0], [0, 2e-3, 0], [0, 0, 2.5e-3]]";

/// A free body has all six, and keeps five where a relaxed spring to the ground holds its point a: those that do
/// not move a along the spring.
#[test]
fn a_free_body_has_six_neutral_directions_and_one_less_on_a_spring() {
    let body = format!(
        "bodies: {{ hull: {{ free: true, {SOLID}, com: [0, 0, 0] }}, base: {{ fixed: true }} }}\n"
    );
    let (_, found) = neutral(&body);
    assert_eq!(
        found,
        (0..6)
            .map(|k| (0..6).map(|i| f64::from(u8::from(i == k))).collect())
            .collect::<Vec<Vec<f64>>>()
    );
    let arm = [0.1, 0.2, 0.3];
    let spring = "points: { a: { body: hull, at: [0.1, 0.2, 0.3] }, g: { body: base, at: [0.1, 0.8, 1.1] } }\n\
                  springs: { b: { from: a, to: g, stiffness: 20 } }\n";
    let (_, found) = neutral(&(body + spring));
    assert_eq!(found.len(), 5);
    for direction in &found {
        let [_, y, z, a, b, c] = direction[..] else { panic!("{direction:?}") };
        // Of a along (0, 0.6, 0.8).
        let along = 0.6 * (y + c * arm[0] - a * arm[2]) + 0.8 * (z + a * arm[1] - b * arm[0]);
        assert!(along.abs() < 1e-12, "{direction:?}: {along:e}");
        assert_eq!(largest(direction), 1.0);
    }
}

/// Its springs hold its joints; it moves and turns as one body.
#[test]
fn a_free_six_bar_has_six_neutral_directions() {
    let model =
        fs::read_to_string(example("sixbar.yaml")).unwrap_or_else(|error| panic!("{error}"));
    let (speeds, found) = neutral(&model.replace("fixed: true", "free: true"));
    assert_eq!((speeds.len(), found.len()), (12, 6), "{speeds:?}");
    for (k, direction) in found.iter().enumerate() {
        assert!(direction[..6].iter().all(|x| x.abs() < 1e-9), "{direction:?}");
        for (i, x) in direction[6..].iter().enumerate() {
            assert!((x - f64::from(u8::from(i == k))).abs() < 1e-9, "{direction:?}");
        }
    }
}

/// A damper opposes no displacement: only the spring of the other joint does.
#[test]
fn a_joint_without_a_spring_is_a_neutral_direction() {
    let model = format!(
        "bodies:\n  base: {{ fixed: true }}\n  one: {{ {SOLID}, com: [0.1, 0, 0] }}\n  two: {{ {SOLID}, com: [0.3, 0, 0] }}\n\
         joints:\n  held: {{ bodies: [base, one], axis: [[0, 0], [0, 1]], stiffness: 0.1 }}\n  \
         loose: {{ bodies: [one, two], axis: [[0.2, 0], [0.2, 1]], damping: 1e-3 }}\n"
    );
    let (speeds, found) = neutral(&model);
    assert_eq!(
        (speeds, found),
        (vec!["held".to_owned(), "loose".to_owned()], vec![vec![0.0, 1.0]])
    );
    // The one that the damper slows down stays where it stops: a decay, and a swing of the other.
    let (_guard, folder) = folder();
    let file = folder.join("loose.yaml");
    fs::write(&file, format!("gravity: [0, 0, 0]\n{model}")).unwrap();
    let found = json(&run(&["modes", &file.display().to_string(), "--json"]));
    let modes = found["modes"].as_array().cloned().unwrap_or_default();
    assert!(modes.iter().all(|mode| mode["damping_ratio"].as_f64() > Some(0.0)), "{modes:?}");
    assert_eq!(modes.len(), 2);
}
