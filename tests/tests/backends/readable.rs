//! Generated modules are there to be read: every value is named for what it is, and the statements of
//! a body and phase stand together under one heading with the equation.

use std::collections::HashSet;

use lamc::backend::rust::Options;
use lamc::pipeline::rust_module;
use lamc::program::Selection;
use lamc_tests::{MODULES, compile, workspace};

fn module(name: &str) -> String {
    let compiled = compile(&workspace().join("examples").join(format!("{name}.yaml")));
    rust_module(&compiled, &Options::default()).unwrap()
}

/// The lines of each function of a module, by its name.
fn functions(module: &str) -> Vec<(&str, Vec<&str>)> {
    let mut functions = Vec::new();
    for line in module.lines() {
        if let Some(head) = line.trim_start().strip_prefix("fn ") {
            let end = head.find(|c: char| !c.is_alphanumeric() && c != '_').unwrap_or(head.len());
            functions.push((&head[..end], Vec::new()));
        }
        if let Some((_, lines)) = functions.last_mut() {
            lines.push(line.trim_start());
        }
    }
    functions
}

#[test]
fn no_value_is_called_a_part() {
    for name in MODULES {
        for line in module(name).lines() {
            let local =
                line.trim_start().strip_prefix("let ").and_then(|rest| rest.split(' ').next());
            let local = local.unwrap_or_default();
            assert!(!local.split('_').any(|word| word == "part"), "{name}: {line}");
        }
    }
}

#[test]
fn every_section_stands_once() {
    let mut headings = 0;
    for name in MODULES {
        let module = module(name);
        for (function, lines) in functions(&module) {
            let mut seen = HashSet::new();
            for heading in lines.iter().filter_map(|line| line.strip_prefix("// ")) {
                assert!(seen.insert(heading), "{name}, {function}: twice {heading}");
                headings += 1;
            }
        }
    }
    assert!(headings > 300, "{headings}");
}

/// The statements under a heading of a function.
fn section<'a>(module: &'a str, function: &str, heading: &str) -> Vec<&'a str> {
    let functions = functions(module);
    let (_, lines) = functions.iter().find(|(name, _)| *name == function).unwrap();
    let start = lines.iter().position(|line| line.strip_prefix("// ") == Some(heading));
    let rest = &lines[start.unwrap_or_else(|| panic!("no section {heading}")) + 1..];
    let end = rest.iter().position(|line| line.starts_with("// ")).unwrap_or(rest.len());
    rest[..end].to_vec()
}

#[test]
fn values_of_the_closure_are_named_by_loop_and_row() {
    let module = module("sixbar");
    let factor = section(
        &module,
        "acceleration_into",
        "mechanism: factor of the closure: S = Y D^-1 Y^T = L_S D_S L_S^T",
    );
    let names: Vec<&str> = factor
        .iter()
        .filter_map(|line| line.strip_prefix("let ")?.split_once(" =").map(|(name, _)| name))
        .collect();
    for name in ["s_loop0_0_0", "s_loop0_2_0", "l_loop0_1_0", "inverse_pivot_loop0_2"] {
        assert!(names.contains(&name), "{name} is not in {names:?}");
    }
    for name in ["let lambda0_1 = ", "let acceleration_ground_east = "] {
        assert!(module.contains(name), "{name}");
    }
}

#[test]
fn a_section_reads_like_its_equation() {
    let module = module("triple_pendulum");
    let velocity =
        section(&module, "equations_into", "middle: angular velocity: w = R^T w_parent + u e_x");
    assert_eq!(velocity, ["let omega_middle_x = u[0] + u[1];"]);
}

/// A module has the functions that were asked for: without those that solve it is short.
#[test]
fn functions_are_written_on_request() {
    let compiled = compile(&workspace().join("examples/sixbar.yaml"));
    let module = |names: &[&str]| {
        let functions = Selection::named(names).unwrap();
        rust_module(&compiled, &Options { functions, ..Options::default() }).unwrap()
    };
    let (all, usual, least) =
        (module(&["all"]), module(&["acceleration", "projection"]), module(&["none"]));
    assert!(all.contains("fn jacobian_into") && all.contains("--functions poses,points,energy"));
    assert!(usual.contains("fn acceleration_into") && usual.contains("fn projection_into"));
    for absent in ["jacobian_into", "energy", "poses", "points", "reactions", "tangent", "settled"]
    {
        assert!(!usual.contains(&format!("fn {absent}")), "{absent}");
    }
    assert!(!least.contains("fn acceleration_into") && !least.contains("//   acceleration:"));
    // The aim of a module for simulation with Runge and Kutta's method.
    assert!(least.len() <= 70_000, "{} bytes", least.len());
}
