//! Generated modules of random mechanisms, with parameters, inputs, torques, forces and several
//! loops, compiled by rustc in a package of their own, against the interpreter.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use lamc::backend::identifiers::type_name;
use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc::program::Interpreter;
use lamc_runtime::{State, System, acceleration, assemble, project};
use lamc_tests::random::{Lines, Random, Recipe, model};
use lamc_tests::{compile_text, relative_error, workspace};

const RECIPES: [(u64, Recipe); 6] = [
    (7, Recipe { branches: 9, loops: 0, lines: Lines::Any }),
    (8, Recipe { branches: 2, loops: 1, lines: Lines::Parallel }),
    (9, Recipe { branches: 1, loops: 3, lines: Lines::Parallel }),
    (10, Recipe { branches: 0, loops: 2, lines: Lines::Concurrent }),
    (11, Recipe { branches: 1, loops: 3, lines: Lines::Concurrent }),
    (12, Recipe { branches: 1, loops: 2, lines: Lines::Any }),
];

#[test]
fn compiled_modules_agree_with_the_interpreter() {
    let folder = tempfile::tempdir().unwrap();
    let source = folder.path().join("src");
    fs::create_dir_all(&source).unwrap();
    let mut main = "//! Prints what each module says about one state.\n".to_owned();
    let mut body = String::new();
    let mut expected = Vec::new();
    for (seed, recipe) in RECIPES {
        let compiled = compile_text(&model(seed, recipe));
        let mut system = Interpreter::new(&compiled.program);
        let mut random = Random::new(seed);
        let motor = random.range(-2e-3, 2e-3);
        let k = random.range(0.005, 0.02);
        system.set_input("motor", motor).unwrap();
        system.set_parameter("k", k).unwrap();
        let state = closed_state(&system, &mut random);
        expected.push(answers(&system, &state));

        let name = type_name(&compiled.program.interface.name);
        fs::write(source.join(format!("m{seed}.rs")), rust_module(&compiled, &Options::default()))
            .unwrap();
        writeln!(main, "mod m{seed};").unwrap();
        let State { t, q, u } = state;
        writeln!(
            body,
            "    {{
        let mut model = m{seed}::{name}::<f64>::default();
        model.inputs.motor = {motor:?};
        model.params.k = {k:?};
        print(&model, {t:?}, &{q:?}, &{u:?});
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
        let n = expected.len() - 2;
        for (what, range) in [("acceleration", 0..n), ("energy", n..n + 2)] {
            let error = relative_error(&found[range.clone()], &expected[range]);
            assert!(error <= 1e-10, "seed {seed}: {what} off by {error:e}");
        }
    }
}

/// As [`answers`], for a generated module.
const PRINT: &str = "
use lamc_runtime::{Mechanism, System};

fn print<M, const N: usize, const C: usize>(model: &M, t: f64, q: &[f64; N], u: &[f64; N])
where
    M: Mechanism<f64, N, C>,
{
    let energy = model.energy(t, q, u);
    let rates = model.acceleration(t, q, u).unwrap();
    let numbers = rates.into_iter().chain([energy.kinetic, energy.potential]);
    let words: Vec<String> = numbers.map(|x| format!(\"{x:?}\")).collect();
    println!(\"{}\", words.join(\" \"));
}
";

/// Accelerations, then kinetic and potential energy.
fn answers(system: &Interpreter, State { t, q, u }: &State<Vec<f64>, f64>) -> Vec<f64> {
    let mut answers = system.vector();
    acceleration(system, *t, q, u, &mut system.workspace(), &mut answers).unwrap();
    let energy = system.energy(*t, q, u);
    answers.extend([energy.kinetic, energy.potential]);
    answers
}

fn closed_state(system: &Interpreter, random: &mut Random) -> State<Vec<f64>, f64> {
    let n = system.dimensions().coordinates;
    let mut workspace = system.workspace();
    for _ in 0..30 {
        let t = random.range(0.0, 1.0);
        let mut q: Vec<f64> = (0..n).map(|_| random.range(-1.2, 1.2)).collect();
        let mut u: Vec<f64> = (0..n).map(|_| random.range(-3.0, 3.0)).collect();
        if assemble(system, 0.0, &mut q, &vec![false; n], &mut workspace).is_ok()
            && project(system, t, &mut q, &mut u, &mut workspace).is_ok()
        {
            return State { t, q, u };
        }
    }
    panic!("no closed configuration found");
}

fn build_and_run(folder: &Path) -> String {
    let runtime = workspace().join("runtime").canonicalize().unwrap();
    let manifest = format!(
        "[package]\nname = \"compiled\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
         [dependencies]\nlamc-runtime = {{ path = {runtime:?} }}\n\n\
         [lints.rust]\nwarnings = \"deny\"\nunused_imports = \"allow\"\ndead_code = \"allow\"\n\n\
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
