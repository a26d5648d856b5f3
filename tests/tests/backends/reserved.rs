//! Reserved names: models that use every one of them compile, and none is reserved without need.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::Command;

use lamc::backend::c::{self, Real};
use lamc::backend::identifiers::{RUST_TYPES, type_name};
use lamc::backend::python;
use lamc::backend::rust::{HELPERS, Options, ScalarChoice};
use lamc::pipeline::{Compiled, rust_module};
use lamc::program::SIGNATURES;
use lamc::source::is_keyword;
use lamc_tests::{compile_text, workspace};

/// Names of numbers and functions in formulas, which no parameter and no input can have.
const FORMULAS: [&str; 12] =
    ["pi", "q", "t", "u", "sin", "cos", "tan", "exp", "tanh", "log", "sqrt", "atan2"];

/// Names that are no symbols of formulas but read by every body of a function.
const STATE: [&str; 3] = ["q", "t", "u"];

/// Names of arguments, outputs and helpers of the functions in Rust and C.
fn reserved() -> BTreeSet<&'static str> {
    let arguments = SIGNATURES.iter().flat_map(|signature| signature.inputs);
    let outputs = SIGNATURES.iter().flat_map(|signature| signature.outputs);
    let mut names: BTreeSet<_> = arguments.map(|argument| argument.name()).collect();
    names.extend(outputs.map(|output| output.name));
    names.extend(HELPERS);
    names.extend(c::helpers());
    names
}

/// A model whose bodies, joints and points have all of these names, and its parameters and inputs those
/// that formulas do not use: one loop, the other bodies beside it. Its formulas have every function.
fn model(
    name: &str,
    names: &[&str],
    symbols: [&[&str]; 2],
    is_driven: bool,
    terms: usize,
) -> String {
    let mut text = format!("name: {name}\nbodies:\n  base: {{ fixed: true }}\n");
    let mut joints = String::from("joints:\n");
    let mut points = String::from("points:\n");
    for (index, &body) in names.iter().enumerate() {
        let (x, parent) = match index {
            0 => (0.0, "base"),
            1 | 2 => (0.05 * index as f64, names[index - 1]),
            _ => (0.0, "base"),
        };
        let end = x + 0.05;
        writeln!(
            text,
            "  {body}: {{ outline: [[{x}, 0], [{end}, 0], [{end}, 0.02], [{x}, 0.02]] }}"
        )
        .unwrap();
        let first = |law: &str| if index == 0 { law.to_owned() } else { String::new() };
        let law = first(&format!(", torque: \"{}\"", torque(names[0], symbols, terms)));
        let drive = match is_driven && index + 1 == names.len() {
            true => ", drive: \"0.1*sin(3*t)\"",
            false => "",
        };
        writeln!(
            joints,
            "  {body}: {{ bodies: [{parent}, {body}], axis: [[{x}, 0], [{x}, 0.02]]{law}{drive} }}"
        )
        .unwrap();
        writeln!(points, "  {body}: {{ body: {body}, at: [{end}, 0.01, 0] }}").unwrap();
    }
    writeln!(
        joints,
        "  closing: {{ bodies: [{}, base], axis: [[0.15, 0], [0.15, 0.02]] }}",
        names[2]
    )
    .unwrap();
    text.push_str(&joints);
    text.push_str(&points);
    text.push_str("materials: { card: { density: 700, thickness: 0.0004 } }\nlayup: [card]\n");
    let parameters: Vec<_> = symbols[0].iter().map(|name| format!("{name}: 0.5")).collect();
    writeln!(text, "parameters: {{ {} }}", parameters.join(", ")).unwrap();
    writeln!(text, "inputs: [{}]", symbols[1].join(", ")).unwrap();
    text
}

/// A formula of every function, parameter and input, and of so many terms more.
fn torque(joint: &str, [parameters, inputs]: [&[&str]; 2], terms: usize) -> String {
    let (q, u) = (format!("q.{joint}"), format!("u.{joint}"));
    let mut law = format!(
        "exp(-t)*sqrt(abs({q}) + 1) + (2 + {q})^0.3 + tan({q}/3) + atan2({q}, {u} - t) + log(2 + {q}^2) \
         + tanh({u}) + min({q}, {u}) + max({q}, {u}) + step({q}) + cos({u})"
    );
    parameters.iter().chain(inputs).for_each(|name| write!(law, " + {name}*{u}").unwrap());
    (1..=terms).for_each(|k| write!(law, " + sin({k}*t + {q})*{u}").unwrap());
    format!("1e-5*({law})")
}

/// Models that carry every reserved name between them.
fn models() -> Vec<Compiled> {
    let reserved = reserved();
    let names: Vec<&str> =
        reserved.into_iter().filter(|name| !is_keyword(name) && !STATE.contains(name)).collect();
    let symbols: Vec<&str> =
        names.iter().copied().filter(|name| !FORMULAS.contains(name)).collect();
    let (first, second) = symbols.split_at(symbols.len() / 2);
    let named = |(index, ty): (usize, &&str)| {
        let (symbols, driven) =
            if index == 0 { ([first, second], true) } else { ([second, first], false) };
        // Of the last, one function is so long that it comes in parts.
        let terms = if index == 2 { 1200 } else { 0 };
        let names = if index < 2 { &names[..] } else { &names[..3] };
        compile_text(&model(&ty.to_lowercase(), names, symbols, driven, terms))
    };
    RUST_TYPES.iter().enumerate().map(named).collect()
}

#[test]
fn models_with_every_reserved_name_compile() {
    let folder = tempfile::tempdir().unwrap();
    let mut package =
        String::from("//! Modules of reserved names.\n#![no_std]\n#![allow(dead_code)]\n");
    fs::create_dir(folder.path().join("src")).unwrap();
    for (index, compiled) in models().iter().enumerate() {
        let program = &compiled.program;
        for scalar in [ScalarChoice::Generic, ScalarChoice::F64] {
            let text = rust_module(compiled, &Options { scalar, ..Options::default() }).unwrap();
            assert!(text.contains(&format!("pub struct {}", type_name(&program.interface.name))));
            let module = format!("m{index}_{scalar:?}").to_lowercase();
            writeln!(package, "pub mod {module};").unwrap();
            fs::write(folder.path().join(format!("src/{module}.rs")), &text).unwrap();
        }
        let text = c::source(program, Real::Double, &format!("m{index}.h"));
        fs::write(folder.path().join(format!("m{index}.c")), &text).unwrap();
        let write = |end: &str, text: String| {
            fs::write(folder.path().join(format!("m{index}.{end}")), text).unwrap();
        };
        write("h", c::header(program, Real::Double));
        write(
            "py",
            python::write(program, Real::Double, &format!("m{index}.c"), &format!("m{index}.h")),
        );
        let c99 = ["-std=c99", "-Wall", "-Wextra", "-Wpedantic", "-Werror", "-fsyntax-only"];
        run("cc", &[&c99[..], &[&format!("m{index}.c")]].concat(), folder.path());
        run("python3", &["-m", "py_compile", &format!("m{index}.py")], folder.path());
    }
    fs::write(folder.path().join("src/lib.rs"), package).unwrap();
    let runtime = workspace().join("runtime").canonicalize().unwrap();
    let manifest = format!(
        "[package]\nname = \"reserved\"\nversion = \"0.0.0\"\nedition = \"2024\"\n\n\
         [dependencies]\nlamc-runtime = {{ path = {runtime:?} }}\n\n\
         [lints.rust]\nwarnings = \"deny\"\ndead_code = \"allow\"\n\n[workspace]\n"
    );
    fs::write(folder.path().join("Cargo.toml"), manifest).unwrap();
    run(env!("CARGO"), &["check", "--quiet", "--offline"], folder.path());
}

#[test]
fn no_name_is_reserved_without_need() {
    let text = model("neutral", &["b1", "b2", "b3", "b4"], [&["k"], &["m"]], true, 1200);
    let compiled = compile_text(&text);
    let words = |text: &str| -> BTreeSet<String> {
        text.split(|c: char| !c.is_alphanumeric() && c != '_').map(str::to_owned).collect()
    };
    let rust = words(&rust_module(&compiled, &Options::default()).unwrap());
    for name in HELPERS.iter().chain(&RUST_TYPES) {
        assert!(rust.contains(*name), "no module uses `{name}`: it need not be reserved in Rust");
    }
    let c = words(&c::source(&compiled.program, Real::Double, "neutral.h"));
    for name in c::helpers().filter(|name| !c::MACROS.contains(name)) {
        assert!(c.contains(name), "no module uses `{name}`: it need not be reserved in C");
    }
}

fn run(command: &str, arguments: &[&str], folder: &Path) {
    let output = Command::new(command).args(arguments).current_dir(folder).output();
    let output = output.unwrap_or_else(|error| panic!("{command}: {error}"));
    let messages = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{command} {arguments:?}: {messages}");
}
