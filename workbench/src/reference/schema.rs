//! `docs/SCHEMA.md`: one table for each mapping of the model file.

use std::fmt::Write;

use crate::optimise::goals;
use crate::sweep::plan;
use lamc::source::schema::{
    Key, MAPPINGS, Mapping, Presence, QUANTITIES, Range, Uses, Value, units_of,
};

const BEGINNING: &str = "\
# The keys of the model file

A mechanism is one YAML file. This page lists all keys that it may have. The page is generated from
the tables with which lamc reads files; keys that are not listed here are errors. [MODEL.md](MODEL.md) explains
formulas, and how bodies, masses and YAML's anchors work. [ERRORS.md](ERRORS.md) explains the diagnostics.

The plan of `lamc sweep` and the goals of `lamc optimise` are other files; their keys are at the end.

A number may have a unit, as in `20 mm`. A number without a unit is in SI units and radians, or in the
`units` of the file if it is a length, an angle or an angular speed. *Formula* means that a formula may
replace the number: *of t* means that it may use time, parameters and inputs, *of the motion* that it may
also use `q.<joint>` and `u.<joint>`. Formulas are always in SI units and radians.

`lamc schema` prints the same as a JSON Schema, with which editors complete and check keys while you type
([MODEL.md](MODEL.md#in-an-editor)).
";

const NAMES: &str = "\
## Names

Names of bodies, joints and other things become identifiers of the generated code. They consist of
letters from A to Z in either case, digits and `_`, and do not start with a digit. Keywords of Rust, C,
C++ and Python are reserved, and so are `pi`, `t`, `q`, `u`, `null`, `NULL` and `_`. Parameters and inputs
cannot have the names of functions.
";

const UNITS: &str = "\
## Units of quantities

A unit is a product of powers of the units in this table, such as `mN*m/rad`, `g mm^2` or `kg/m^3`. A `/`
divides by the next unit only. Angle is a separate dimension: `N*m` is a torque, `N*m/rad` a rotational
stiffness.

| quantity | written in, for example | units of this quantity |
|---|---|---|
";

/// The page.
pub fn schema_page() -> String {
    let mut page = String::from(BEGINNING);
    for mapping in MAPPINGS.iter().chain(plan::MAPPINGS).chain(goals::MAPPINGS) {
        section(&mut page, mapping);
    }
    page.push('\n');
    page.push_str(NAMES);
    page.push('\n');
    page.push_str(UNITS);
    for quantity in QUANTITIES {
        let units: Vec<String> =
            units_of(quantity.dimension).iter().map(|unit| format!("`{unit}`")).collect();
        // Writing to a string cannot fail.
        let _ = writeln!(
            page,
            "| {} | {} | {} |",
            without_article(quantity.name),
            quantity.examples,
            units.join(", ")
        );
    }
    page
}

fn section(page: &mut String, mapping: &Mapping) {
    let _ = write!(page, "\n## {}\n\n", mapping.title);
    if !mapping.path.is_empty() {
        let _ = write!(page, "`{}`. ", mapping.path);
    }
    let _ = writeln!(page, "{}", mapping.doc);
    for choice in mapping.choices {
        let ways: Vec<String> = choice.iter().map(|way| quoted(way)).collect();
        let _ = write!(page, "\nOf {}, at most one is given.\n", listed(&ways, "and"));
    }
    page.push_str("\n| key | value | unit | if left out | meaning |\n|---|---|---|---|---|\n");
    for key in mapping.keys {
        let _ = writeln!(
            page,
            "| `{}` | {}{} | {} | {} | {} Example: `{}: {}` |",
            key.name,
            described(&key.value),
            range(key.range),
            unit(&key.value),
            presence(mapping, key),
            key.doc,
            key.name,
            key.example,
        );
    }
}

/// What the value of a key may be, in words.
fn described(value: &Value) -> String {
    match value {
        Value::Name(_) => "a name".into(),
        Value::Reference { to, among } => format!("the name of a {to} in `{among}`"),
        Value::Text => "a text".into(),
        Value::Either(one, other) => format!("{} or {}", described(one), described(other)),
        Value::Boolean => "`true` or `false`".into(),
        Value::Word(words) => {
            let words: Vec<String> = words.iter().map(|word| format!("`{word}`")).collect();
            listed(&words, "or")
        }
        Value::Unit(quantity) => format!("a unit of {}", quantity.name),
        Value::Number(quantity) => quantity.name.into(),
        Value::Formula(quantity, uses) => {
            let of = match uses {
                Uses::Motion => "the motion",
                Uses::Parameters => "the parameters",
                Uses::Constants(_) => "t",
            };
            format!("{}, formula of {of}", quantity.name)
        }
        Value::Parameter => "a number".into(),
        Value::Array { of, length, form } => match (of, form.contains('`')) {
            (Value::Array { .. }, true) => (*form).into(),
            (_, true) => format!("{form}: each {}", described(of)),
            (_, false) => format!("a list of {length}: {form}"),
        },
        Value::List { form, .. } => (*form).into(),
        Value::Mapping(mapping) => format!("a mapping ({})", link(mapping)),
        Value::Named(_, of) => format!("by name: {}", described(of)),
        Value::Per(kind, of) => format!("by {kind}: {}", described(of)),
        Value::OneOf { by, variants } => {
            let links: Vec<String> = variants.iter().map(|(_, mapping)| link(mapping)).collect();
            format!("a mapping that depends on its `{by}`: {}", listed(&links, "or"))
        }
    }
}

/// The units of the numbers in a value.
fn unit(value: &Value) -> String {
    match value.quantity() {
        Some(quantity) => quantity.examples.into(),
        None if matches!(value, Value::Parameter) => "any".into(),
        None => String::new(),
    }
}

fn range(range: Range) -> &'static str {
    match range {
        Range::Any => "",
        Range::Positive => ", more than 0",
        Range::NotNegative => ", 0 or more",
    }
}

fn presence(mapping: &Mapping, key: &Key) -> String {
    match key.presence {
        Presence::Required => "**required**".into(),
        Presence::Without(other) => format!("**required** without `{other}`"),
        Presence::Together => {
            let beside: Vec<&str> = mapping.beside(key.name).collect();
            format!("required with {}", quoted(&beside))
        }
        Presence::Default(value) => format!("`{value}`"),
        Presence::Optional(without) => without.into(),
    }
}

fn quoted(names: &[&str]) -> String {
    let names: Vec<String> = names.iter().map(|name| format!("`{name}`")).collect();
    match names.len() {
        1 => names[0].clone(),
        _ => format!("({})", names.join(", ")),
    }
}

/// `a, b and c`.
fn listed(items: &[String], last: &str) -> String {
    match items {
        [first @ .., end] if !first.is_empty() => format!("{} {last} {end}", first.join(", ")),
        _ => items.concat(),
    }
}

/// A link to the section of a mapping.
fn link(mapping: &Mapping) -> String {
    format!("[{}](#{})", mapping.title, mapping.title.to_lowercase().replace(' ', "-"))
}

fn without_article(name: &str) -> &str {
    name.trim_start_matches("an ").trim_start_matches("a ")
}
