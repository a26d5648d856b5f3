//! The functions of formulas: their values in a motion, arguments for which they are undefined, and formulas of the
//! largest allowed length.

use lamc::pipeline::compile;
use lamc::program::{FunctionKind, Interpreter};
use lamc::source::SourceFile;
use lamc_runtime::{Error, JacobianMut, Mechanism, acceleration, jacobian};
use lamc_tests::compile_text;
use lamc_workbench::execution::Jit;
use lamc_workbench::verify::Values;

/// A disc of 1 kg m^2 about its hinge, on which nothing acts but this torque.
fn disc(torque: &str) -> String {
    format!(
        "
gravity: [0, 0, 0]
parameters: {{ p: 0.7 }}
bodies:
  base: {{ fixed: true }}
  disc: {{ mass: 1, com: [0, 0, 0], inertia: [[1, 0, 0], [0, 1, 0], [0, 0, 1]] }}
joints:
  j: {{ bodies: [base, disc], axis: [[0, 0], [1, 0]], torque: \"{torque}\" }}
"
    )
}

fn accelerated<Y: Mechanism<Scalar = f64>>(system: &Y, q: f64, u: f64) -> Result<f64, Error> {
    let mut out = [0.0];
    let mut workspace = system.workspace();
    acceleration(system, 0.3, &[q], &[u], workspace.as_mut(), &mut out).map(|_| out[0])
}

#[test]
fn values_are_those_of_the_standard_library() {
    for torque in [
        "sign(q.j)",
        "step(q.j)",
        "sign(-q.j) + 2*step(-q.j)",
        "atan(q.j*3)",
        "atan2(q.j, u.j)",
        "atan2(u.j, q.j)",
        "atan2(-1, q.j)",
        "asin(0.99*sin(q.j))",
        "acos(0.99*cos(u.j))",
        "asin(q.j/2) + acos(u.j/3)",
        "log(p + q.j^2)",
        "log(t)*sign(u.j)*step(p - q.j)",
    ] {
        let compiled = compile_text(&disc(torque));
        let (plain, machine) = (Interpreter::new(&compiled.program), Jit::new(&compiled.program));
        assert!(machine.engine().compile(&FunctionKind::ALL));
        for (q, u) in [(0.0, 0.0), (-0.0, 1.0), (0.4, -1.3), (-0.4, 2.9), (1.999, -2.999)] {
            let values =
                Values { parameters: vec![0.7], inputs: vec![], t: 0.3, q: vec![q], u: vec![u] };
            let expected = values.of(&compiled.topology.mechanism.joints[0].torque);
            let got = accelerated(&plain, q, u).unwrap();
            // The inverse sine and cosine are found another way than the standard library's.
            let error = (got - expected).abs();
            assert!(error <= 2.0 * f64::EPSILON, "{torque} at {q}, {u}: {got} is not {expected}");
            let compiled = accelerated(&machine, q, u).unwrap();
            assert_eq!(compiled.to_bits(), got.to_bits(), "{torque} at {q}, {u}");
        }
    }
}

#[test]
fn steps_have_no_slope() {
    for torque in ["sign(q.j)", "step(q.j)", "sign(u.j) - step(u.j + t)"] {
        let system = Interpreter::new(&compile_text(&disc(torque)).program);
        for at in [-0.5, 0.0, 0.5] {
            let (mut a, mut dq, mut du, mut dt) = ([1.0], [1.0], [1.0], [1.0]);
            let out = JacobianMut { acceleration: &mut a, dq: &mut dq, du: &mut du, dt: &mut dt };
            jacobian(&system, 0.3, &[at], &[at], &mut system.workspace(), out).unwrap();
            assert_eq!([dq[0], du[0], dt[0]], [0.0; 3], "{torque} at {at}");
        }
    }
}

/// Where a function has no value the motion ends with an error, whatever the value goes through.
#[test]
fn no_value_is_an_error() {
    for torque in [
        "log(-1 - q.j^2)",
        "log(q.j*u.j)",
        "asin(1 + u.j^2 + p)",
        "acos(-1 - p)",
        "max(0, log(-p))",
        "min(log(-p), 0)",
        "step(log(-p))",
        "sign(log(-p))",
        "abs(asin(2*p))",
        "atan2(1, log(-p))",
        "tanh(acos(2*p))",
    ] {
        let compiled = compile_text(&disc(torque));
        let (plain, machine) = (Interpreter::new(&compiled.program), Jit::new(&compiled.program));
        assert!(machine.engine().compile(&FunctionKind::ALL));
        let (plain, machine) = (accelerated(&plain, -0.5, 0.5), accelerated(&machine, -0.5, 0.5));
        assert!(plain.is_err() && plain == machine, "{torque}: {plain:?}, {machine:?}");
    }
}

/// As many summands as one expression may have.
#[test]
fn a_long_sum() {
    const TERMS: usize = 10_000;
    let sum: Vec<String> = (1..=TERMS).map(|k| format!("{k}e-6*sin({k}*t + q.j)*u.j")).collect();
    let compiled = compile_text(&disc(&sum.join(" - ")));
    let system = Interpreter::new(&compiled.program);
    let term = |k: usize| k as f64 * 1e-6 * f64::sin(k as f64 * 0.3 + 0.2) * 0.9;
    let expected = (2..=TERMS).fold(term(1), |sum, k| sum - term(k));
    let size: f64 = (1..=TERMS).map(|k| term(k).abs()).sum();
    let got = accelerated(&system, 0.2, 0.9).unwrap();
    assert!((got - expected).abs() < 1e-14 * size, "{got} is not {expected}");
}

#[test]
fn a_long_product() {
    const FACTORS: usize = 10_000;
    let product = vec!["(1 + 1e-4*u.j)"; FACTORS].join("*");
    let compiled = compile_text(&disc(&product));
    let got = accelerated(&Interpreter::new(&compiled.program), 0.2, 0.9).unwrap();
    let expected = (1.0 + 0.9e-4_f64).powf(FACTORS as f64);
    assert!((got - expected).abs() < 1e-11 * expected, "{got} is not {expected}");
}

#[test]
fn reserved_as_all_functions_are() {
    for name in ["sign", "step", "log", "asin", "acos", "atan", "atan2"] {
        let text = disc("0").replace("{ p: 0.7 }", &format!("{{ {name}: 1 }}"));
        let file = SourceFile { path: "model.yaml".into(), text };
        let error = compile(&file).unwrap_err().to_string();
        assert!(error.contains(&format!("`{name}` cannot be the name of a parameter")), "{error}");
    }
}
