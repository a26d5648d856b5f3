//! The constants that the runtime and generated C modules share.
//!
//! That the two cannot drift apart is shown in three ways: a constant that is changed in the runtime's table
//! changes what both do; generated C defines each constant with the runtime's bits; and neither the C files
//! nor the runtime's files that they repeat contain numbers of their own.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use lamc::backend::c::{self, Real};
use lamc::backend::rust::{Options, ScalarChoice};
use lamc::pipeline::{self, Compiled};
use lamc_runtime::constants::{ALL, Constant, Tolerance, Value};
use lamc_tests::sheets::miura;
use lamc_tests::{compile, compile_text, workspace};

use super::c::{Answer, ask, build_driver, compilers, successful};
use super::c_algorithms::{algorithms_folder, c_files};
use super::c_free::free_sixbar;

/// The numbers that algorithms may contain: any other is a constant with a name.
const PLAIN: [&str; 6] = ["0", "1", "2", "0.5", "0.0", "1.0"];

/// Numbers that C and the runtime do not share as tolerances, by file: Runge-Kutta's weights and stages, de l'Hospital's third; the
/// numbers of a quaternion, coordinates and speeds; what C has not; how many columns or rows fit the registers; a line of the cache.
const OTHERS: [(&str, &[&str]); 11] = [
    ("free_bodies.c", &["3", "4", "6", "7"]),
    ("free_body.rs", &["2.0", "3", "4", "6", "7"]),
    ("runge_kutta.c", &["3", "4", "6"]),
    ("passage.c", &["3"]),
    ("passage.rs", &["3.0"]),
    ("rank.rs", &["10.0"]),
    ("independent.rs", &["16", "4"]),
    ("cholesky.rs", &["4"]),
    ("blocks.rs", &["4", "8", "16", "64"]),
    ("elimination.rs", &["4"]),
    ("fixed.rs", &["4.0"]),
];

/// The files of the runtime that C repeats, where every number that decides must come from the table.
const REPEATED: [&str; 21] = [
    "acceleration.rs",
    "assembly/mod.rs",
    "assembly/steps.rs",
    "closure_rows.rs",
    "decomposition.rs",
    "free_body.rs",
    "integrate/fixed.rs",
    "linear/cholesky.rs",
    "linear/independent.rs",
    "linear/mod.rs",
    "linear/pseudoinverse.rs",
    "noise.rs",
    "passage.rs",
    "projection/gauss_newton.rs",
    "projection/mod.rs",
    "rank.rs",
    "reduction/blocks.rs",
    "reduction/elimination.rs",
    "reduction/inertia/mod.rs",
    "reduction/mod.rs",
    "trust.rs",
];

fn sixbar() -> Compiled {
    compile(&workspace().join("examples/sixbar.yaml"))
}

/// A sheet with independent speeds in loops of the runtime.
fn driven_sheet() -> Compiled {
    compile_text(&miura(3, 3).replacen("stiffness:", "drive: 0.8 + 0.3*sin(2*t), stiffness:", 1))
}

/// What a generated module defines a constant as.
fn definition<'a>(source: &'a str, name: &str) -> &'a str {
    let start = format!("#define {name} ");
    let mut values = source.lines().filter_map(|line| line.strip_prefix(&*start));
    let value = values.next().unwrap_or_else(|| panic!("{name} is not defined"));
    assert_eq!(values.next(), None, "{name} is defined twice");
    value
}

#[test]
fn generated_c_defines_each_constant_with_the_bits_of_the_runtime() {
    // Together they have everything: a free body, and independent speeds in loops.
    let modules = [free_sixbar().compiled, driven_sheet()];
    for real in [Real::Double, Real::Float] {
        let texts =
            modules.each_ref().map(|compiled| c::source(&compiled.program, real, "module.h"));
        // The bits of a number as C reads it.
        let bits = |written: &str| match real {
            Real::Double => written.parse::<f64>().unwrap().to_bits(),
            Real::Float => {
                let digits = written.strip_suffix('f').unwrap_or_else(|| panic!("{written}"));
                digits.parse::<f32>().unwrap().to_bits().into()
            }
        };
        let due = |number: f64| match real {
            Real::Double => number.to_bits(),
            Real::Float => u64::from((number as f32).to_bits()),
        };
        for constant in ALL {
            let name = constant.name;
            let has = |text: &&String| text.contains(&format!("#define {name} "));
            let text = texts.iter().find(has).unwrap_or(&texts[0]);
            let written = definition(text, name);
            match constant.value {
                Value::Count(count) => assert_eq!(written.parse(), Ok(count), "{name}"),
                Value::Number(number) => assert_eq!(bits(written), due(number), "{name}"),
                Value::Bits(pattern) => {
                    let digits = written.strip_prefix("0x").and_then(|hex| hex.strip_suffix("ULL"));
                    assert_eq!(u64::from_str_radix(digits.unwrap(), 16), Ok(pattern), "{name}");
                }
                Value::Tolerance(Tolerance { constant, epsilons }) => {
                    let inside =
                        written.strip_prefix("tolerance(").and_then(|x| x.strip_suffix(')'));
                    let (first, second) = inside.unwrap().split_once(", ").unwrap();
                    let found = [bits(first), bits(second)];
                    assert_eq!(found, [constant, epsilons].map(due), "{name}");
                }
            }
        }
    }
}

/// A text without comments, and of Rust without its tests.
fn code(path: &Path) -> String {
    let text = fs::read_to_string(path).unwrap();
    let text = text.split("\n#[cfg(test)]\n").next().unwrap();
    let mut code = String::new();
    let mut rest = text;
    while let Some(begin) = rest.find("/*") {
        code.push_str(&rest[..begin]);
        rest = &rest[begin..];
        rest = &rest[rest.find("*/").unwrap() + 2..];
    }
    code.push_str(rest);
    let line = |line: &str| line.split("//").next().unwrap_or_default().to_owned();
    code.lines().filter(|line| !line.starts_with('#')).map(line).collect::<Vec<_>>().join("\n")
}

/// The words of a code that begin as numbers do, with their fractions, exponents and suffixes.
fn numbers(code: &str) -> Vec<String> {
    let mut numbers = Vec::new();
    let bytes: Vec<char> = code.chars().collect();
    let mut at = 0;
    while at < bytes.len() {
        let begin = at;
        let is_word = |c: char| c.is_ascii_alphanumeric() || c == '_';
        while at < bytes.len() {
            let exponent = at > begin && matches!(bytes[at - 1], 'e' | 'E');
            let signed =
                exponent && bytes[begin].is_ascii_digit() && matches!(bytes[at], '+' | '-');
            let fraction = bytes[at] == '.'
                && bytes[begin].is_ascii_digit()
                && bytes.get(at + 1).is_some_and(char::is_ascii_digit);
            if !is_word(bytes[at]) && !signed && !fraction {
                break;
            }
            at += 1;
        }
        if at > begin && bytes[begin].is_ascii_digit() {
            let word: String = bytes[begin..at].iter().collect();
            numbers.push(word.trim_end_matches("_u64").to_owned());
        }
        at = usize::max(begin + 1, at);
    }
    numbers
}

#[test]
fn algorithms_contain_no_numbers_of_their_own() {
    let runtime = workspace().join("runtime/src");
    let mut seen = 0;
    for path in c_files().into_iter().chain(REPEATED.map(|name| runtime.join(name))) {
        let name = path.file_name().unwrap().to_str().unwrap();
        let is_rust = name.ends_with(".rs");
        let others = OTHERS.iter().filter(|(file, _)| *file == name);
        let allowed: Vec<_> = PLAIN.iter().chain(others.flat_map(|(_, list)| *list)).collect();
        for number in numbers(&code(&path)) {
            seen += 1;
            // Nine residuals of a loop, in Rust: a size.
            let is_size = is_rust && number == "9";
            assert!(
                is_size || allowed.iter().any(|allowed| **allowed == number),
                "{} contains {number}: name it in runtime/src/constants.rs",
                path.display()
            );
        }
    }
    assert!(seen > 100, "only {seen} numbers seen");
    assert_eq!(numbers("x1 + 1e-9*2.5f - 0x1fULL[3]"), ["1e-9", "2.5f", "0x1fULL", "3"]);
}

/// The identifiers in a text.
fn identifiers(text: &str) -> BTreeSet<String> {
    let words = text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_');
    words.map(str::to_owned).collect()
}

#[test]
fn each_constant_is_named_by_the_runtime_and_by_c() {
    let runtime = workspace().join("runtime/src");
    let rust: BTreeSet<String> =
        REPEATED.iter().flat_map(|name| identifiers(&code(&runtime.join(name)))).collect();
    let c: BTreeSet<String> = c_files().iter().flat_map(|path| identifiers(&code(path))).collect();
    for constant in ALL {
        assert!(rust.contains(constant.name), "the runtime does not use {}", constant.name);
        assert!(c.contains(constant.name), "C does not use {}", constant.name);
    }
}

/// A generated header defines names of the form `MODEL_WHAT` and `model_what`, whatever the model's name.
#[test]
fn no_name_of_the_algorithms_can_be_a_name_of_a_header() {
    let ends = [
        "_params",
        "_inputs",
        "_params_default",
        "_inputs_default",
        "_initial",
        "_assemble",
        "_project",
        "_acceleration",
        "_step_rk4",
        "_equations",
        "_closure",
        "_poses",
        "_points",
        "_energy",
        "_contacts",
        "_momentum",
        "_motor_torques",
        "_H",
        "_N",
        "_NQ",
        "_NU",
        "_JOINTS",
        "_FREE_BODIES",
        "_C",
        "_LOOPS",
        "_BODIES",
        "_POINTS",
        "_CONTACTS",
        "_DRIVES",
    ];
    let inside = ["_JOINT_", "_BODY_", "_POINT_", "_CONTACT_", "_size_of_"];
    let header = fs::read_to_string(algorithms_folder().join("types.h")).unwrap();
    let texts = c_files().into_iter().map(|path| code(&path)).chain([header]);
    let mut names: BTreeSet<String> = texts.flat_map(|text| identifiers(&text)).collect();
    names.extend(ALL.iter().map(|constant| constant.name.to_owned()));
    assert!(names.len() > 300);
    for name in &names {
        let status = c::STATUS.iter().any(|status| name.ends_with(&format!("_{}", status.name)));
        let clash = ends.iter().any(|end| name.ends_with(end))
            || inside.iter().any(|part| name.contains(part));
        assert!(!clash && !status, "{name} is what a header of some model defines");
    }
}

/// A constant of the table with another value.
struct Alteration {
    name: &'static str,
    /// Its line in the table, and the line instead.
    lines: [&'static str; 2],
    value: Value,
}

const ALTERATIONS: [Alteration; 2] = [
    Alteration {
        name: "CLOSED",
        lines: [
            "CLOSED: Tolerance = Tolerance::new(1e-12, 16.0);",
            "CLOSED: Tolerance = Tolerance::new(1e-2, 16.0);",
        ],
        value: Value::Tolerance(Tolerance { constant: 1e-2, epsilons: 16.0 }),
    },
    Alteration {
        name: "PROJECTION_STEPS",
        lines: ["PROJECTION_STEPS: usize = 16;", "PROJECTION_STEPS: usize = 0;"],
        value: Value::Count(0),
    },
];

/// The six-bar in C and in Rust behind the same header: programs that answer alike.
fn build_both(folder: &Path, compiled: &Compiled, alteration: Option<&Alteration>) -> [PathBuf; 2] {
    let header = pipeline::c_header(compiled, Real::Double);
    fs::write(folder.join("sixbar.h"), header).unwrap();
    let altered = |constant: &Constant| match alteration {
        Some(alteration) if alteration.name == constant.name => {
            Constant { value: alteration.value, ..*constant }
        }
        _ => *constant,
    };
    let constants: Vec<Constant> = ALL.iter().map(altered).collect();
    let source = folder.join("sixbar.c");
    let text = c::source_with(&compiled.program, Real::Double, "sixbar.h", &constants);
    fs::write(&source, text).unwrap();
    let archive = build_rust(folder, compiled, alteration);
    let modules =
        [vec![source.to_str().unwrap()], vec![archive.to_str().unwrap(), "-lpthread", "-ldl"]];
    ["c", "rust"].map(|language| {
        let module = &modules[usize::from(language == "rust")];
        let program = build_driver(folder, "sixbar", Real::Double, module);
        let named = folder.join(language);
        fs::rename(program, &named).unwrap();
        named
    })
}

/// A library of the Rust module over a copy of the runtime with an alteration.
fn build_rust(folder: &Path, compiled: &Compiled, alteration: Option<&Alteration>) -> PathBuf {
    let (runtime, library) = (folder.join("runtime"), folder.join("library"));
    copy_folder(&workspace().join("runtime/src"), &runtime.join("src"));
    if let Some(Alteration { lines: [line, instead], .. }) = alteration {
        let table = runtime.join("src/constants.rs");
        let text = fs::read_to_string(&table).unwrap();
        assert_eq!(text.matches(line).count(), 1, "the table has no line {line}");
        fs::write(table, text.replace(line, instead)).unwrap();
    }
    let package = |name: &str, rest: &str| {
        format!("[package]\nname = \"{name}\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n{rest}")
    };
    let root = workspace().canonicalize().unwrap();
    let [tables, macros] = ["tables", "macros"].map(|folder| root.join(folder));
    let features = format!(
        "[features]\nstd = []\nsimd = []\n\n[dependencies]\nlibm = \"0.2\"\n\
         lamc-tables = {{ path = {tables:?} }}\nlamc-runtime-macros = {{ path = {macros:?} }}\n"
    );
    fs::write(runtime.join("Cargo.toml"), package("lamc-runtime", &features)).unwrap();
    let rest = "[lib]\ncrate-type = [\"staticlib\"]\n\n[dependencies]\n\
                lamc-runtime = { path = \"../runtime\" }\n\n[workspace]\n";
    fs::create_dir_all(library.join("src")).unwrap();
    fs::write(library.join("Cargo.toml"), package("altered", rest)).unwrap();
    let options = Options { scalar: ScalarChoice::F64, extern_c: true, ..Options::default() };
    let module = pipeline::rust_module(compiled, &options).unwrap();
    fs::write(library.join("src/sixbar.rs"), module).unwrap();
    fs::write(library.join("src/lib.rs"), "//! Altered.\npub mod sixbar;\n").unwrap();
    let target = folder.join("target");
    let mut cargo = Command::new(env!("CARGO"));
    cargo
        .args(["build", "--quiet", "--offline"])
        .current_dir(&library)
        .env("CARGO_TARGET_DIR", &target);
    successful(&mut cargo, "the module over a copy of the runtime");
    target.join("debug/libaltered.a")
}

fn copy_folder(from: &Path, to: &Path) {
    fs::create_dir_all(to).unwrap();
    for entry in fs::read_dir(from).unwrap() {
        let path = entry.unwrap().path();
        let copy = to.join(path.file_name().unwrap());
        if path.is_dir() {
            copy_folder(&path, &copy);
        } else {
            fs::copy(&path, copy).unwrap();
        }
    }
}

/// The projection of a state that is open by some 1e-5 m, by each of two programs: status and coordinates.
fn project_nudged(programs: &[PathBuf; 2], nudged: &[f64]) -> [Answer; 2] {
    let numbers: Vec<String> =
        nudged.iter().chain(&vec![0.0; nudged.len()]).map(|number| format!("{number:?}")).collect();
    let question = format!("p 0 {}\n", numbers.join(" "));
    programs.each_ref().map(|program| ask(program, &question).remove(0))
}

#[test]
fn rust_and_c_follow_a_constant_that_changes() {
    if !compilers().contains(&"gcc") {
        return;
    }
    let compiled = sixbar();
    let folder = tempfile::tempdir().unwrap();
    let programs = build_both(folder.path(), &compiled, None);
    let (_, status, closed) = ask(&programs[0], "i\n").remove(0);
    assert_eq!(status, 0);
    let nudged: Vec<f64> =
        closed.iter().enumerate().map(|(joint, q)| q + 1e-4 * (1.0 + joint as f64).sin()).collect();
    for (_, status, q) in project_nudged(&programs, &nudged) {
        let moved = q.iter().zip(&nudged).any(|(q, nudged)| (q - nudged).abs() > 1e-5);
        assert!(status == 0 && moved, "{status}: {q:?} from {nudged:?}");
    }
    // Loops that count as closed when they are open by a hundredth stay where they are.
    let programs = build_both(folder.path(), &compiled, Some(&ALTERATIONS[0]));
    for (_, status, q) in project_nudged(&programs, &nudged) {
        assert_eq!((status, &q), (0, &nudged));
    }
    // Without a step no loop is closed.
    let programs = build_both(folder.path(), &compiled, Some(&ALTERATIONS[1]));
    for (_, status, _) in project_nudged(&programs, &nudged) {
        assert_eq!(status, 3);
    }
}
