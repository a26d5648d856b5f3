//! Derivatives of the acceleration by the parameters: of programs, of Rust modules and of C modules against dual numbers.

use std::fs;
use std::process::Command;

use lamc::backend::c::{self, Real};
use lamc::backend::rust::Options;
use lamc::pipeline::Compiled;
use lamc::program::{FunctionKind, Interpreter, Selection};
use lamc_generated::linkage::Linkage;
use lamc_runtime::{Mechanism as _, acceleration};
use lamc_tests::dual::{Dual, DualSystem};
use lamc_tests::package::Package;
use lamc_tests::random::{Random, closed_state};
use lamc_tests::{compile, compile_text, relative_error, workspace};

use super::c::{STRICT, compilers, successful};

/// A free body with contacts, whose friction and stiffness are parameters, and an arm.
const ROBOT: &str = "
units: { length: mm }
parameters: { k: 2e-4, grip: 0.5, m: 2 g, rise: 1e-3 }
inputs: [motor]
materials: { card: { density: 700, thickness: 0.4 } }
layup: [card]
bodies:
  hull: { free: true, outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  arm: { mass: m, com: [0.05, 0.01, 0], inertia: [[2e-7, 0, 0], [0, 3e-7, 0], [0, 0, 4e-7]] }
joints:
  hip: { bodies: [hull, arm], axis: [[40, 0], [40, 20]], stiffness: k, damping: 1e-6, torque: \"motor*rise\" }
contacts: { ground: { plane: { point: [0, 0, -1], normal: [0, 0, 1] }, bodies: [hull], friction: grip, stiffness: 500 N/m } }
initial: { bodies: { hull: { position: [0, 0, -1.1] } } }
";

/// du/dt at a closed state, and its derivative by each parameter in dual numbers, row-major.
fn expected(compiled: &Compiled, q: &[f64], u: &[f64]) -> (Vec<f64>, Vec<f64>) {
    let system = Interpreter::new(&compiled.program);
    let lift = |values: &[f64]| values.iter().map(|x| Dual(*x, 0.0)).collect::<Vec<_>>();
    let (n, parameters) = (u.len(), system.parameters().len());
    let mut rates = vec![0.0; n];
    let mut slopes = vec![0.0; n * parameters];
    for parameter in 0..parameters {
        let mut values = lift(system.parameters());
        values[parameter].1 = 1.0;
        let dual = DualSystem::new(&compiled.program, values, lift(system.inputs()));
        let mut out = vec![Dual::default(); n];
        let (q, u) = (lift(q), lift(u));
        acceleration(&dual, Dual::default(), &q, &u, &mut dual.workspace(), &mut out).unwrap();
        for (row, value) in out.iter().enumerate() {
            rates[row] = value.0;
            slopes[row * parameters + parameter] = value.1;
        }
    }
    (rates, slopes)
}

fn models() -> [(&'static str, Compiled); 3] {
    [
        ("linkage", compile(&workspace().join("examples/linkage.yaml"))),
        ("robot", compile_text(ROBOT)),
        ("markers", compile(&workspace().join("examples/sixbar_markers.yaml"))),
    ]
}

#[test]
fn programs_have_the_derivatives_of_dual_numbers() {
    for (name, compiled) in models() {
        let system = Interpreter::new(&compiled.program);
        assert!(system.has(FunctionKind::JacobianParams), "{name}");
        let mut random = Random::new(5);
        for _ in 0..10 {
            let state = closed_state(&system, &mut random);
            let (rates, slopes) = expected(&compiled, &state.q, &state.u);
            let (mut a, mut dp) = (vec![0.0; rates.len()], vec![0.0; slopes.len()]);
            system
                .write_jacobian_params(0.0, &state.q, &state.u, &mut a, &mut dp)
                .unwrap()
                .unwrap();
            assert!(relative_error(&a, &rates) < 1e-10, "{name}");
            // Each parameter by itself: they have different units.
            let count = system.parameters().len();
            for parameter in 0..count {
                let of = |all: &[f64]| -> Vec<f64> {
                    all.iter().skip(parameter).step_by(count).copied().collect()
                };
                let error = relative_error(&of(&dp), &of(&slopes));
                assert!(error < 1e-9, "{name}, {parameter}: {error:e}");
            }
        }
    }
}

/// Only who asks for it has the function, and only then are the numbers of the drawing that it reads in the table.
#[test]
fn modules_have_it_on_request_only() {
    let compiled = compile(&workspace().join("examples/linkage.yaml"));
    let plain = compiled.program.only(Selection::default());
    assert!(plain.function_of(FunctionKind::JacobianParams).outputs.is_empty());
    let asked =
        compiled.program.only(Selection::named(["acceleration", "jacobian_params"]).unwrap());
    let bare = compiled.program.only(Selection::named(["acceleration"]).unwrap());
    assert!(asked.interface.drawn > bare.interface.drawn);
    for program in [plain, asked, bare] {
        assert_eq!(lamc::program::verify(&program), Ok(()));
        let (whole, part) = (Interpreter::new(&compiled.program), Interpreter::new(&program));
        let state = closed_state(&whole, &mut Random::new(2));
        let rates = |system: &Interpreter| {
            let mut out = vec![0.0; 4];
            let workspace = &mut system.workspace();
            acceleration(system, 0.0, &state.q, &state.u, workspace, &mut out).unwrap();
            out
        };
        assert_eq!(rates(&whole), rates(&part));
    }
}

/// The derivatives that a C module computes.
#[test]
fn c_modules_have_them() {
    if !compilers().contains(&"gcc") {
        return;
    }
    let mut compiled = compile(&workspace().join("examples/linkage.yaml"));
    let state = closed_state(&Interpreter::new(&compiled.program), &mut Random::new(7));
    let (rates, slopes) = expected(&compiled, &state.q, &state.u);
    compiled.program = compiled.program.only(Selection::named(["jacobian_params"]).unwrap());
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    fs::write(at("linkage.h"), c::header(&compiled.program, Real::Double)).unwrap();
    fs::write(at("linkage.c"), c::source(&compiled.program, Real::Double, "linkage.h")).unwrap();
    let list =
        |numbers: &[f64]| numbers.iter().map(|it| format!("{it:e}")).collect::<Vec<_>>().join(", ");
    let main = format!(
        "#include <stdio.h>\n#include \"linkage.h\"\nint main(void)\n{{\n\
         const double q[4] = {{ {} }}, u[4] = {{ {} }};\n\
         linkage_params p;\nlinkage_inputs in;\ndouble a[4], dp[4][4], margin[3];\nint i, k;\n\
         linkage_params_default(&p);\nlinkage_inputs_default(&in);\nlinkage_draw(&p);\n\
         linkage_jacobian_params(0, q, u, &p, &in, a, dp, margin);\n\
         if (!(margin[0] > 0 && margin[1] > 0))\nreturn 1;\n\
         for (i = 0; i < 4; i++)\nprintf(\"%.17g\\n\", a[i]);\n\
         for (i = 0; i < 4; i++)\nfor (k = 0; k < 4; k++)\nprintf(\"%.17g\\n\", dp[i][k]);\nreturn 0;\n}}\n",
        list(&state.q),
        list(&state.u)
    );
    fs::write(at("main.c"), main).unwrap();
    let mut gcc = Command::new("gcc");
    gcc.current_dir(folder.path()).args(STRICT);
    successful(gcc.args(["main.c", "linkage.c", "-o", "main", "-lm"]), "the linkage");
    let answer = Command::new(at("main")).output().unwrap();
    assert!(answer.status.success());
    let text = String::from_utf8(answer.stdout).unwrap();
    let found: Vec<f64> = text.lines().map(|line| line.parse().unwrap()).collect();
    assert!(relative_error(&found[..4], &rates) < 1e-12);
    assert!(relative_error(&found[4..], &slopes) < 1e-10);
}

/// A Rust module with the function, and one without, which is differentiated along one parameter after the other.
#[test]
fn rust_modules_have_them() {
    let compiled = compile(&workspace().join("examples/linkage.yaml"));
    let state = closed_state(&Interpreter::new(&compiled.program), &mut Random::new(3));
    let (rates, slopes) = expected(&compiled, &state.q, &state.u);
    let wanted = [rates, slopes].concat();
    let mut package = Package::new();
    let functions = Selection::named(["acceleration", "energy", "jacobian_params"]).unwrap();
    package.add_with("linkage", &compiled, &Options { functions, ..Options::default() });
    package.ask("linkage", "parameters", &[&state.q, &state.u]);
    let found = package.answers().next().unwrap();
    assert!(relative_error(&found, &wanted) < 1e-10);
    let plain = Linkage::<f64>::default();
    let [q, u]: [[f64; 4]; 2] = [state.q, state.u].map(|it| it.try_into().unwrap());
    let along = lamc_runtime::plumbing::jacobian_params::<_, 4, 4, 0>(&plain, 0.0, &q, &u).unwrap();
    let found = [along.acceleration.as_slice(), along.dp.as_flattened()].concat();
    assert!(relative_error(&found, &wanted) < 1e-10);
}
