//! Modules of a drawing that depends on parameters: other values give the motion of another drawing, in Rust and C as
//! in the interpreter.

use std::fs;
use std::process::Command;

use lamc::backend::c::{self, Real};
use lamc::program::Interpreter;
use lamc_generated::linkage::{Linkage, Params};
use lamc_runtime::{Mechanism, acceleration};
use lamc_tests::random::{Random, closed_state};
use lamc_tests::{compile, relative_error, workspace};

use super::c::compilers;

const CRANK: f64 = 0.023;
const WIDTH: f64 = 0.013;

/// The linkage with other lengths, a closed state of it in motion, and the accelerations there.
fn changed() -> (Vec<f64>, Vec<f64>, Vec<f64>) {
    let compiled = compile(&workspace().join("examples/linkage.yaml"));
    let mut system = Interpreter::new(&compiled.program);
    system.set_parameter("crank", CRANK).unwrap();
    system.set_parameter("width", WIDTH).unwrap();
    let state = closed_state(&system, &mut Random::new(7));
    let mut rates = vec![0.0; 4];
    acceleration(&system, 0.0, &state.q, &state.u, &mut system.workspace(), &mut rates).unwrap();
    (state.q, state.u, rates)
}

#[test]
fn rust_follows_its_parameters() {
    let (q, u, expected) = changed();
    let [q, u]: [[f64; 4]; 2] = [q, u].map(|it| it.try_into().unwrap());
    let params = Params { crank: CRANK, width: WIDTH, ..Params::default() };
    let rates = |robot: &Linkage<f64>| robot.acceleration(0.0, &q, &u).unwrap();
    let error = relative_error(&rates(&Linkage::with_params(params)), &expected);
    assert!(error < 1e-12, "{error:e}");
    let mut robot = Linkage::default();
    assert!(relative_error(&rates(&robot), &expected) > 1e-2, "the parameters have an effect");
    robot.set_params(params);
    assert_eq!(*robot.params(), params);
    assert_eq!(rates(&robot), rates(&Linkage::with_params(params)));
}

#[test]
fn c_follows_its_parameters() {
    if !compilers().contains(&"gcc") {
        return;
    }
    let (q, u, expected) = changed();
    let folder = tempfile::tempdir().unwrap();
    let compiled = compile(&workspace().join("examples/linkage.yaml"));
    let at = |name: &str| folder.path().join(name);
    fs::write(at("linkage.h"), c::header(&compiled.program, Real::Double)).unwrap();
    fs::write(at("linkage.c"), c::source(&compiled.program, Real::Double, "linkage.h")).unwrap();
    let list =
        |numbers: &[f64]| numbers.iter().map(|it| format!("{it:e}")).collect::<Vec<_>>().join(", ");
    let main = format!(
        "#include <stdio.h>\n#include \"linkage.h\"\nint main(void)\n{{\n\
         const double q[4] = {{ {} }}, u[4] = {{ {} }};\n\
         linkage_params p;\nlinkage_inputs in;\ndouble a[4];\nint i;\n\
         linkage_params_default(&p);\nlinkage_inputs_default(&in);\n\
         p.crank = {CRANK:e};\np.width = {WIDTH:e};\nlinkage_draw(&p);\n\
         if (linkage_acceleration(0, q, u, &p, &in, a) != LINKAGE_OK)\nreturn 1;\n\
         for (i = 0; i < 4; i++)\nprintf(\"%.17g\\n\", a[i]);\nreturn 0;\n}}\n",
        list(&q),
        list(&u)
    );
    fs::write(at("main.c"), main).unwrap();
    let mut gcc = Command::new("gcc");
    gcc.current_dir(folder.path());
    let built = gcc.args(["-std=c99", "-O1", "main.c", "linkage.c", "-o", "main", "-lm"]).output();
    let built = built.unwrap();
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    let answer = Command::new(at("main")).output().unwrap();
    assert!(answer.status.success());
    let text = String::from_utf8(answer.stdout).unwrap();
    let rates: Vec<f64> = text.lines().map(|line| line.parse().unwrap()).collect();
    let error = relative_error(&rates, &expected);
    assert!(error < 1e-12, "{error:e}");
}
