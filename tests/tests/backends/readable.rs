//! Generated modules are readable: the name of every value says what it is, and the statements of
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

/// The table of constants of a module: names and numbers.
fn constants(module: &str) -> Vec<(&str, f64)> {
    let declared = module.lines().filter_map(|line| line.strip_prefix("    pub const "));
    declared
        .filter_map(|line| {
            let (name, value) = line.strip_suffix(';')?.split_once(": f64 = ")?;
            Some((name, value.parse().unwrap()))
        })
        .collect()
}

/// Numbers of the model stand once, under names that say what they are.
#[test]
fn numbers_of_the_model_have_names() {
    let path = workspace().join("examples/sixbar.yaml");
    let compiled = compile(&path);
    let module = module("sixbar");
    let constants = constants(&module);
    let value = |name: &str| {
        let found = constants.iter().find(|(known, _)| *known == name);
        found.unwrap_or_else(|| panic!("no constant {name}")).1
    };
    assert_eq!(value("GRAVITY_Z"), 9.81);
    let mechanism = &compiled.topology.mechanism;
    let south_west = mechanism.bodies.iter().find(|body| body.name == "south_west").unwrap();
    assert_eq!(value("MASS_SOUTH_WEST"), south_west.mass_properties.mass);
    let [cos, sin] = ["COS", "SIN"].map(|turn| value(&format!("HINGE_SOUTH_WEST_{turn}")));
    assert!((cos * cos + sin * sin - 1.0).abs() < 1e-15);
    let product = value("MASS_WEST_TIMES_GRAVITY_Z");
    let west = mechanism.bodies.iter().find(|body| body.name == "west").unwrap();
    assert!((product / (west.mass_properties.mass * 9.81) - 1.0).abs() < 1e-15);
    let mut names = HashSet::new();
    for (name, value) in &constants {
        assert!(names.insert(name), "{name} stands twice");
        assert!(
            *value > 0.0
                && module.contains(&format!("c({name})")) | module.contains(&format!("c(-{name})")),
            "{name}"
        );
    }
    // What a statement shows as digits stands there alone.
    let mut seen = HashSet::new();
    for (_, lines) in functions(&module).iter().filter(|(name, _)| name.ends_with("_into")) {
        for number in lines.iter().flat_map(|line| line.split("c(").skip(1)) {
            let digits = number.split(')').next().unwrap_or_default().trim_start_matches('-');
            let plain = digits.parse::<f64>().is_ok_and(|number| (4.0 * number).fract() == 0.0);
            if digits.starts_with(|c: char| c.is_ascii_digit()) && !plain {
                assert!(seen.insert(digits.to_owned()), "{digits} stands twice");
            }
        }
    }
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
    // What is needed for simulation with Runge and Kutta's method: 70 kB and the table of constants.
    let table =
        least.split("/// Numbers of the model").nth(1).and_then(|rest| rest.split("\n}\n").next());
    assert!(least.len() - table.unwrap().len() <= 70_000, "{} bytes", least.len());
}
