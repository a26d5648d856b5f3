//! Generated modules of random mechanisms, with parameters, inputs, torques, forces, a driven joint
//! and several loops, compiled by rustc in a package of their own, against the interpreter.

use lamc_tests::compare::{keep_largest, largest};
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use lamc::backend::identifiers::type_name;
use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc::program::Interpreter;
use lamc_runtime::plumbing::Balance;
use lamc_runtime::{JacobianMut, Mechanism, State, acceleration_and_forces, jacobian};
use lamc_tests::random::{Lines, Random, Recipe, closed_state, driven, model};
use lamc_tests::{compile_text, relative_error, workspace};

/// Of the last, functions are so long that they come in parts.
const RECIPES: [(u64, Recipe); 7] = [
    (7, Recipe { branches: 9, loops: 0, lines: Lines::Any }),
    (8, Recipe { branches: 2, loops: 1, lines: Lines::Parallel }),
    (9, Recipe { branches: 1, loops: 3, lines: Lines::Parallel }),
    (10, Recipe { branches: 0, loops: 2, lines: Lines::Concurrent }),
    (11, Recipe { branches: 1, loops: 3, lines: Lines::Concurrent }),
    (12, Recipe { branches: 1, loops: 2, lines: Lines::Any }),
    (13, Recipe { branches: 60, loops: 1, lines: Lines::Any }),
];

/// Functions that the recipes' own laws leave out.
const LAW: &str = "1e-4*(atan2(q.j1, u.j2) + asin(sin(q.j1)/2) + acos(cos(q.j2)/2) + atan(u.j1) \
                   + log(2 + t) + sign(u.j1)*step(q.j2))";

/// Contacts of both points, which are always behind the plane.
const CONTACTS: &str = "
contacts:
  ground:
    plane: { point: [0, 0, 1 m], normal: [0.1, -0.2, 1] }
    points: [p0, p1]
    stiffness: \"1e-3 + k*1e-2\"
    dissipation: 1e-4
    friction: 0.4
    slip_speed: 0.1
";

/// Whether the runtime in this process fuses products. The interpreter and a module without the feature
/// `std` never do.
const FUSES: bool = cfg!(any(target_feature = "fma", target_arch = "aarch64"));

#[test]
fn compiled_modules_agree_with_the_interpreter() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("src");
    fs::create_dir_all(&source).unwrap();
    let mut main = "//! Prints what each module says about one state.\n".to_owned();
    let mut body = String::new();
    let mut expected = Vec::new();
    for (seed, recipe) in RECIPES {
        let mut text = driven(&model(seed, recipe));
        if seed == RECIPES[0].0 {
            assert!(text.contains("torque: \"0\""), "no joint for the law");
            text = text.replacen("torque: \"0\"", &format!("torque: \"{LAW}\""), 1);
        }
        text.push_str(CONTACTS);
        let compiled = compile_text(&text);
        let mut system = Interpreter::new(&compiled.program);
        let mut random = Random::new(seed);
        let motor = random.range(-2e-3, 2e-3);
        let k = random.range(0.005, 0.02);
        system.set_input("motor", motor).unwrap();
        system.set_parameter("k", k).unwrap();
        let state = closed_state(&system, &mut random);
        expected.push(answers(&system, &state));

        let name = type_name(&compiled.program.interface.name);
        let text = rust_module(&compiled, &Options::default()).unwrap();
        for long in ["equations_part_3", "tangent_part_3"] {
            assert!(recipe.branches < 60 || text.contains(long), "seed {seed}: {long}");
        }
        fs::write(source.join(format!("m{seed}.rs")), text).unwrap();
        writeln!(main, "mod m{seed};").unwrap();
        let State { t, q, u } = state;
        writeln!(
            body,
            "    {{
        let mut model = m{seed}::{name}::<f64>::default();
        model.inputs.motor = {motor:?};
        model.params.k = {k:?};
        print::<{{ m{seed}::C }}, _, _>(&model, {t:?}, &{q:?}, &{u:?});
    }}"
        )
        .unwrap();
    }
    main.push_str(PRINT);
    write!(main, "\nfn main() {{\n{body}}}\n").unwrap();
    fs::write(source.join("main.rs"), main).unwrap();
    let output = build_and_run(folder.path());
    let mut lines = output.lines();
    for ((seed, _), expected) in RECIPES.iter().zip(expected) {
        let found: Vec<f64> =
            lines.next().unwrap().split(' ').map(|word| word.parse().unwrap()).collect();
        for ((what, expected), found) in expected.iter().zip(parts(&found, &expected)) {
            let error = relative_error(found, expected);
            let derived = what.starts_with("da/") || matches!(*what, "reactions" | "motor torques");
            let tolerance = if derived { 1e-9 } else { 1e-10 };
            assert!(error <= tolerance, "seed {seed}: {what} off by {error:e}");
            // Only energies and contacts come from functions of the program without the runtime's algorithms.
            if !FUSES || matches!(*what, "energy" | "contacts") {
                let bits =
                    |numbers: &[f64]| numbers.iter().map(|x| x.to_bits()).collect::<Vec<_>>();
                assert_eq!(bits(found), bits(expected), "seed {seed}: bits of {what}");
            }
        }
    }
}

/// As [`answers`], for a generated module.
const PRINT: &str = "
use lamc_runtime::Mechanism;
use lamc_runtime::plumbing::{forces, jacobian};

fn print<const C: usize, M, const N: usize>(model: &M, t: f64, q: &[f64; N], u: &[f64; N])
where
    M: Mechanism<Scalar = f64, Coordinates = [f64; N], Speeds = [f64; N]>,
{
    let energy = model.energy(t, q, u).unwrap();
    let forces = forces::<M, N, C, N>(model, t, q, u).unwrap();
    let slopes = jacobian::<M, N>(model, t, q, u).unwrap();
    let mut numbers = forces.acceleration.to_vec();
    numbers.extend([energy.kinetic, energy.potential]);
    numbers.extend(forces.motor);
    numbers.extend(forces.reactions.as_flattened());
    numbers.extend(slopes.dq.as_flattened());
    numbers.extend(slopes.du.as_flattened());
    numbers.extend(slopes.dt);
    let mut contacts = vec![0.0; 6 * model.dimensions().contacts];
    model.write_contacts(t, q, u, &mut contacts).unwrap();
    numbers.extend(contacts);
    let words: Vec<String> = numbers.iter().map(|x| format!(\"{x:?}\")).collect();
    println!(\"{}\", words.join(\" \"));
}
";

type Answers = Vec<(&'static str, Vec<f64>)>;

/// What the interpreter says about a state.
fn answers(system: &Interpreter, State { t, q, u }: &State<Vec<f64>, f64>) -> Answers {
    let (n, d) = (q.len(), system.dimensions());
    let mut workspace = system.workspace();
    let (mut a, mut lambda) = (vec![0.0; n], vec![0.0; d.rows + d.drives]);
    acceleration_and_forces(system, *t, q, u, &mut workspace, &mut a, &mut lambda).unwrap();
    let energy = system.energy(*t, q, u).unwrap();
    let mut motor = vec![0.0; n];
    motor[0] = lambda[d.rows];
    let mut reactions = vec![0.0; 6 * n];
    let multipliers = &lambda[..d.rows];
    let at = Balance { t: *t, q, u, acceleration: &a, multipliers };
    system.write_reactions(at, &mut reactions).unwrap();
    let (mut rates, mut dt) = (vec![0.0; n], vec![0.0; n]);
    let (mut dq, mut du) = (vec![0.0; n * n], vec![0.0; n * n]);
    let out = JacobianMut { acceleration: &mut rates, dq: &mut dq, du: &mut du, dt: &mut dt };
    jacobian(system, *t, q, u, &mut workspace, out).unwrap();
    let mut contacts = vec![0.0; 6 * d.contacts];
    system.write_contacts(*t, q, u, &mut contacts).unwrap();
    assert!(contacts.chunks(6).all(|row| row[3..] != [0.0; 3]), "{contacts:?}");
    // The drive's second derivative is what it does, but for a direction next to the cut in rank.
    let s = 0.2 * -9.0 * f64::sin(3.0 * t) + 0.6 * t;
    let scale = keep_largest(1.0, largest(&a));
    assert!((a[0] - s).abs() < 1e-8 * scale, "{} is not {s} of {scale:e}", a[0]);
    vec![
        ("acceleration", a),
        ("energy", vec![energy.kinetic, energy.potential]),
        ("motor torques", motor),
        ("reactions", reactions),
        ("da/dq", dq),
        ("da/du", du),
        ("da/dt", dt),
        ("contacts", contacts),
    ]
}

/// Numbers cut as the answers are.
fn parts<'a>(mut numbers: &'a [f64], like: &Answers) -> Vec<&'a [f64]> {
    let mut parts = Vec::new();
    for (_, values) in like {
        let (part, rest) = numbers.split_at(values.len());
        parts.push(part);
        numbers = rest;
    }
    assert!(numbers.is_empty());
    parts
}

fn build_and_run(folder: &Path) -> String {
    let runtime = workspace().join("runtime").canonicalize().unwrap();
    let manifest = format!(
        "[package]\nname = \"compiled\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
         [dependencies]\nlamc-runtime = {{ path = {runtime:?} }}\n\n\
         [lints.rust]\nwarnings = \"deny\"\n\n\
         [workspace]\n"
    );
    fs::write(folder.join("Cargo.toml"), manifest).unwrap();
    let output = Command::new(env!("CARGO"))
        .args(["run", "--quiet", "--offline"])
        .current_dir(folder)
        .env("CARGO_TARGET_DIR", folder.join("target"))
        .output()
        .unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).unwrap()
}
