//! Models to try the schema with: for every key of every mapping one with its example, and several with a
//! mistake at this key; the models of the repository; the wrong ones.

use std::fs;
use std::path::{Path, PathBuf};

use lamc::source::schema::{Key, MAPPINGS, Mapping, Presence, Range, TIME, Value as Kind};
use serde_json::{Map, Value, json};

use crate::workspace;

/// A model and the verdict on it.
pub struct Case {
    /// What is special about it.
    pub what: String,
    /// The model as JSON, which is YAML too.
    pub model: Value,
    /// Whether it is accepted.
    pub is_sound: bool,
}

/// A model with every mapping of the schema.
const WHOLE: &str = "\
name: whole
units: { length: mm, angle: deg }
materials:
  card: { density: 700, thickness: 0.4 }
  film: { density: 1380, thickness: 0.05, youngs_modulus: 4383 MPa }
layup: [card, film, card]
parameters: { k: 11.4 mN*m/rad, width: { value: 40 mm, range: [30 mm, 60 mm] } }
inputs: [motor]
bodies:
  base: { fixed: true }
  wall:
    fixed: true
    point_masses: [{ mass: 1, at: [0, 0, 0] }, { mass: 1, at: [9, 0, 0] }, { mass: 1, at: [0, 9, 0] }]
  hull: { free: true, mass: 2 g, com: [0, 0, 9], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
  arm: { outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }
  hand: { outline: [[40, 0], [60, 0], [60, 20], [40, 20]] }
  foot:
    layers: [[{ outline: [[0, 0], [40, 0], [40, 20], [0, 20]] }], [], []]
    point_masses: [{ mass: 1 g, at: [20, 10, 0] }]
  toe: { mass: 1.5 g, com: [50, 10, 0], inertia: [[1e-7, 0, 0], [0, 1e-7, 0], [0, 0, 1e-7]] }
joints:
  knee: { bodies: [base, arm], axis: [[0, 0], [0, 20]], fold: 1 rad, friction: { torque: 1e-4, speed: 2 } }
  wrist:
    bodies: [arm, hand]
    axis: [[40, 0], [40, 20]]
    hinge: { model: beam, material: film, length: 1 mm, width: 20 mm }
  ankle:
    bodies: [base, foot]
    axis: [[0, 0], [0, 20]]
    hinge: { model: sharifzadeh2018, length: 1 mm, width: 50 mm }
  tip:
    bodies: [foot, toe]
    axis: [[40, 0], [40, 20]]
    hinge: { model: tape, length: 1 mm, width: 40 mm }
pattern:
  file: miura_sheet.svg
  scale: 1 mm
  crease: { width: 1 mm, hinge: { model: beam, material: film } }
  fold: { mountain: -170 deg }
  joints: { crease_48_m50: { friction: { torque: 1e-4, speed: 2 } } }
  layers: { cut: OUTLINE }
initial: { q: { knee: 20 }, bodies: { hull: { position: [0, 0, 50], turn: [0, 30, 0] } } }
points:
  tip: { body: arm, at: [40, 10, 0.5] }
  guide: { body: hand, at: [50, 10, 0] }
  hook: { body: base, at: [-10, 10, 0] }
forces: { pull: { point: tip, force: [0, 0, 0.01] } }
springs:
  rubber: { from: tip, to: hook, stiffness: 20, damping: 0.01, rest_length: 10, tension_only: true }
  torsion: { bodies: [base, hand], axis: [[0, 0], [0, 20]], stiffness: 2e-3 }
tendons: { flexor: { through: [hook, guide, tip], stiffness: 200, damping: 0.01 } }
motors: { wheel: { joint: wrist, torque_constant: 5e-3, resistance: 8, gear: 50, voltage: 3, max_current: 1 } }
contacts: { ground: { plane: { point: [0, 0, -20], normal: [0, 0, 1], body: hand }, stiffness: 2000, friction: 0.6 } }
controllers:
  servo:
    sample: 5 ms
    memory: { i: { next: i + q.knee } }
    inputs: { motor: k*q.knee }
    pwm: { period: 1 ms, levels: [-6, 6] }
air: { density: 1.2, drag: 1.2 }
hinge_models:
  tape: { stiffness: [[0.02, 0, 0, 0]], damping: [[2e-5, 0, 0, 0]], specimens: [[1e-3, 0.03, 0]] }
";

/// Numbers at a key of a joint, and whether it takes them.
const NUMBERS: [(&str, &[&str], &[&str]); 4] = [
    (
        "z",
        &[
            "1",
            "-1.5e-3",
            ".5 mm",
            "5. mm",
            "+2mm",
            "127 µm",
            "1e3 um",
            " 3 mm ",
            "2 in",
            "4 m^2/m",
            "4 m²/mm",
            "1 m^3 mm^-2",
            "1 m^2m^-1",
            "- 1",
            "width/2",
        ],
        &["3 deg", "3 s", "5 mmm", "5 m^", "5 m//m", "1 m 2", "1e", "1,5 mm", "1 m^0", ""],
    ),
    (
        "stiffness",
        &[
            "11.4 mN*m/rad",
            "1 N m / rad",
            "1 Nm/rad",
            "1 kg m^2 s^-2 rad^-1",
            "k",
            "2*k",
            "1/2",
            "sin(t) + 0.1",
        ],
        &["1 N", "1 W", "1 furlong", "2 k", "1 N*·m", "50 %", "k & k"],
    ),
    ("fold", &["30 deg", "-180°", "0.5 rev", "-1"], &["50 %", "2*k", "1 m"]),
    ("rest", &["30 deg", "30°", "0.1 rev", "0.5"], &["30 mm", "1 rad^0", "30 degrees"]),
];

/// Every spelling of truth that the reader knows, and some that it does not.
const TRUTHS: [(&str, bool); 8] = [
    ("yes", true),
    ("On", true),
    ("TRUE", true),
    ("y", true),
    ("Y", true),
    ("yEs", false),
    ("1", false),
    ("maybe", false),
];

/// Mistakes that the schema finds.
const OF_THE_SCHEMA: &[&str] = &[
    "bad-name",
    "driven-torque",
    "empty-layup",
    "few-points",
    "fixed-and-free",
    "missing-key",
    "mixed-shape",
    "no-value",
    "not-a-number",
    "too-many-layers",
    "two-orientations",
    "two-springs",
    "two-tensions",
    "unknown-coefficients",
    "unknown-key",
    "unknown-tunable",
    "unknown-unit",
    "wrong-type",
];
/// Mistakes that the schema finds in some places only, and the models where it does. It sees a bare number
/// out of range, but not one with a unit; the length of a list, but not of one that must be as long as
/// another; a unit of its own, but not the dimension of a product.
const IN_PART: &[(&str, &[&str])] = &[
    ("bad-expression", &["unit_in_expression"]),
    ("bad-unit", &["bad_unit", "several_errors"]),
    ("negative-damping", &["negative_damping", "impossible_physics"]),
    ("negative-drag", &["negative_laws"]),
    ("negative-element", &["negative_element", "negative_elements"]),
    ("not-positive", &["negative_laws", "impossible_physics"]),
    ("reserved-name", &["reserved_names", "several_errors"]),
    ("short-outline", &["outlines", "several_errors"]),
    ("wrong-dimension", &["crlf", "radians", "wrong_dimension"]),
    ("wrong-length", &["axis", "joint_bodies", "merged_mistake", "outlines"]),
];
/// Mistakes that leave no value for a schema to judge.
const NOT_YAML: &[&str] = &[
    "bad-key",
    "bad-merge",
    "duplicate-key",
    "self-alias",
    "several-documents",
    "too-deep",
    "too-large",
    "unexpected-tag",
    "unknown-alias",
    "yaml-syntax",
];

/// A YAML text as an editor sees it: aliases and merge keys followed, scalars by YAML 1.2.
pub fn as_json(text: &str) -> Value {
    serde_saphyr::from_str(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

/// Models on which the reader and the schema must have the same verdict.
pub fn changed_models() -> Vec<Case> {
    let mut cases =
        Cases(vec![Case { what: "the whole model".into(), model: as_json(WHOLE), is_sound: true }]);
    for mapping in MAPPINGS {
        let unknown = changed(mapping, |entries| drop(entries.insert("lenght".into(), json!(1))));
        cases.add(format!("an unknown key of {}", mapping.name), unknown, false);
        cases.choices(mapping);
        for key in mapping.keys {
            let what = format!("`{}` of {}", key.name, mapping.name);
            cases.add(format!("the example of {what}"), with(mapping, key, example(key)), true);
            cases.presence(mapping, key, &what);
            cases.values(mapping, key, &what);
            cases.range(mapping, key, &what);
        }
    }
    cases.texts();
    cases.0
}

struct Cases(Vec<Case>);

impl Cases {
    fn add(&mut self, what: String, model: Value, is_sound: bool) {
        self.0.push(Case { what, model, is_sound });
    }

    /// Ways that exclude each other.
    fn choices(&mut self, mapping: &'static Mapping) {
        for choice in mapping.choices {
            for (index, way) in choice.iter().enumerate() {
                for other in &choice[index + 1..] {
                    let keys = way.iter().chain(*other).filter_map(|key| mapping.key(key));
                    let both = changed(mapping, |entries| {
                        entries.extend(keys.map(|key| (key.name.to_owned(), example(key))));
                    });
                    self.add(format!("{way:?} beside {other:?}"), both, false);
                }
            }
        }
    }

    /// The key left out.
    fn presence(&mut self, mapping: &'static Mapping, key: &Key, what: &str) {
        let without = changed(mapping, |entries| drop(entries.remove(key.name)));
        match key.presence {
            Presence::Required => self.add(format!("no {what}"), without, false),
            // The rest of the whole model refers to what these keys declare.
            Presence::Without(_) => {}
            Presence::Together => {
                for other in mapping.beside(key.name).filter_map(|other| mapping.key(other)) {
                    let mut model = with(mapping, other, example(other));
                    entries_of(mapping, &mut model).remove(key.name);
                    self.add(format!("`{}` without {what}", other.name), model, false);
                }
            }
            // Entries of the whole model are referred to, and a body that moves needs a joint.
            _ if mapping.name == "model" || key.name == "fixed" => {}
            // The hinge of the whole model is a beam, which needs both.
            _ if key.name == "material" || (mapping.name == "crease" && key.name == "width") => {}
            Presence::Default(_) | Presence::Optional(_) => {
                self.add(format!("no {what}"), without, true);
            }
        }
    }

    /// Values of other types.
    fn values(&mut self, mapping: &'static Mapping, key: &Key, what: &str) {
        self.add(format!("{what} without value"), with(mapping, key, Value::Null), false);
        let odd = match key.value {
            Kind::Mapping(_) | Kind::Named(..) | Kind::Per(..) | Kind::OneOf { .. } => {
                json!([1])
            }
            _ => json!({ "lenght": 1 }),
        };
        let mut model = with(mapping, key, example(key));
        entries_of(mapping, &mut model).insert(key.name.into(), odd);
        self.add(format!("{what} of another type"), model, false);
        let other = match key.value {
            Kind::Number(quantity) if *quantity == TIME => Some("3 m"),
            Kind::Number(_) | Kind::Formula(..) | Kind::Unit(_) => Some("3 s"),
            _ => None,
        };
        if let Some(text) = other {
            self.add(format!("{what} of {text}"), with(mapping, key, json!(text)), false);
        }
        if let (Kind::Array { length, .. }, Some(items)) = (key.value, example(key).as_array()) {
            assert_eq!(items.len(), length, "{what}");
            self.add(format!("{what} too short"), with(mapping, key, json!(items[1..])), false);
        }
    }

    /// Numbers out of range.
    fn range(&mut self, mapping: &'static Mapping, key: &Key, what: &str) {
        let least = match key.range {
            Range::Any => return,
            Range::Positive => 0,
            Range::NotNegative => {
                self.add(format!("{what} of 0"), with(mapping, key, json!(0)), true);
                -1
            }
        };
        self.add(format!("{what} of {least}"), with(mapping, key, json!(least)), false);
    }

    /// How numbers, formulas and truth are written.
    fn texts(&mut self) {
        for (key, sound, wrong) in NUMBERS {
            for (texts, is_sound) in [(sound, true), (wrong, false)] {
                for text in texts {
                    let mut model = as_json(WHOLE);
                    model["joints"]["knee"][key] = json!(text);
                    self.add(format!("`{key}: {text}`"), model, is_sound);
                }
            }
        }
        for (text, is_sound) in TRUTHS {
            let mut model = as_json(WHOLE);
            model["bodies"]["wall"]["fixed"] = json!(text);
            self.add(format!("`fixed: {text}`"), model, is_sound);
        }
    }
}

/// Every model of the repository.
pub fn repository_models() -> Vec<Case> {
    let mut files = Vec::new();
    yaml_files(&workspace(), &mut files);
    let models = files.into_iter().filter_map(|path| {
        let model = as_json(&fs::read_to_string(&path).unwrap());
        let is_model = model.get("bodies").or(model.get("pattern")).is_some();
        is_model.then(|| Case { what: path.display().to_string(), model, is_sound: true })
    });
    models.collect()
}

fn yaml_files(folder: &Path, files: &mut Vec<PathBuf>) {
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !["target", "wrong", "node_modules"].contains(&&*name) && !name.starts_with('.') {
                yaml_files(&path, files);
            }
        } else if name.ends_with(".yaml") {
            files.push(path);
        }
    }
}

/// The models of `tests/wrong`: those whose mistake a schema can see are not sound.
pub fn wrong_models() -> Vec<Case> {
    let mut cases = Vec::new();
    for entry in fs::read_dir(workspace().join("tests/wrong")).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let is_model = path.extension().is_some_and(|extension| extension == "yaml");
        // JSON has no infinity; files of popupCAD, plans of sweeps and goals have another schema.
        if !is_model
            || name.ends_with(".plan")
            || name.ends_with(".goals")
            || name == "not_finite"
            || name.starts_with("popupcad")
        {
            continue;
        }
        let snapshot = fs::read_to_string(path.with_extension("stderr")).unwrap();
        let titles = snapshot.lines().filter_map(|line| line.strip_prefix("error["));
        let codes: Vec<&str> = titles.filter_map(|rest| Some(rest.split_once(']')?.0)).collect();
        if codes.iter().any(|code| NOT_YAML.contains(code)) {
            continue;
        }
        let is_seen = |code: &&str| {
            let in_part = IN_PART.iter().find(|(part, _)| part == code);
            OF_THE_SCHEMA.contains(code)
                || in_part.is_some_and(|(_, files)| files.contains(&&*name))
        };
        // The same anchors and merge keys as in an editor; an empty file is no mapping.
        let is_empty = codes.contains(&"empty-file") || codes.contains(&"no-model");
        let is_sound = !(is_empty || codes.iter().any(is_seen));
        let model = as_json(&fs::read_to_string(&path).unwrap());
        cases.push(Case { what: format!("tests/wrong/{name}: {codes:?}"), model, is_sound });
    }
    cases
}

/// Where each mapping stands in [`WHOLE`], as a JSON pointer.
fn pointer(mapping: &Mapping) -> &'static str {
    match mapping.name {
        "model" => "",
        "units" => "/units",
        "parameter with a range" => "/parameters/width",
        "material" => "/materials/card",
        "body" => "/bodies/wall",
        "plate" => "/bodies/foot/layers/0/0",
        "point mass" => "/bodies/foot/point_masses/0",
        "joint" => "/joints/knee",
        "friction" => "/joints/knee/friction",
        "beam" => "/joints/wrist/hinge",
        "sharifzadeh2018" => "/joints/ankle/hinge",
        "family" => "/joints/tip/hinge",
        "pattern" => "/pattern",
        "crease" => "/pattern/crease",
        "crease hinge" => "/pattern/crease/hinge",
        "fold" => "/pattern/fold",
        "crease joint" => "/pattern/joints/crease_48_m50",
        "layers" => "/pattern/layers",
        "initial" => "/initial",
        "state of a free body" => "/initial/bodies/hull",
        "point" => "/points/tip",
        "force" => "/forces/pull",
        "band" => "/springs/rubber",
        "twist" => "/springs/torsion",
        "tendon" => "/tendons/flexor",
        "motor" => "/motors/wheel",
        "contact" => "/contacts/ground",
        "plane" => "/contacts/ground/plane",
        "controller" => "/controllers/servo",
        "memory" => "/controllers/servo/memory/i",
        "PWM" => "/controllers/servo/pwm",
        "air" => "/air",
        "hinge model" => "/hinge_models/tape",
        other => panic!("{other} has no place in the model"),
    }
}

fn entries_of<'m>(mapping: &Mapping, model: &'m mut Value) -> &'m mut Map<String, Value> {
    let place = model.pointer_mut(pointer(mapping)).and_then(Value::as_object_mut);
    place.unwrap_or_else(|| panic!("the model has no {}", mapping.name))
}

/// The whole model with a change in one mapping.
fn changed(mapping: &Mapping, change: impl FnOnce(&mut Map<String, Value>)) -> Value {
    let mut model = as_json(WHOLE);
    change(entries_of(mapping, &mut model));
    model
}

/// The whole model with this value of a key, and with what the key needs beside it.
pub fn with(mapping: &Mapping, key: &Key, value: Value) -> Value {
    changed(mapping, |entries| {
        // A controller drives an input: without inputs there is none.
        if mapping.name == "model" && key.name == "inputs" {
            entries.remove("controllers");
        }
        for choice in
            mapping.choices.iter().filter(|choice| choice.iter().any(|way| way.contains(&key.name)))
        {
            let others = choice.iter().filter(|way| !way.contains(&key.name)).copied().flatten();
            others.for_each(|other| drop(entries.remove(*other)));
        }
        for other in mapping.beside(key.name).filter_map(|other| mapping.key(other)) {
            if other.presence == Presence::Together {
                entries.insert(other.name.into(), example(other));
            }
        }
        match (entries.get_mut(key.name), value) {
            // Entries that the rest of the model refers to stay beside those of the example.
            (Some(Value::Object(there)), Value::Object(more))
                if matches!(key.value, Kind::Named(..)) =>
            {
                there.extend(more);
            }
            (_, value) => drop(entries.insert(key.name.into(), value)),
        }
    })
}

/// The model without this key.
pub fn without(mapping: &Mapping, key: &Key, mut model: Value) -> Value {
    entries_of(mapping, &mut model).remove(key.name);
    model
}

fn example(key: &Key) -> Value {
    as_json(key.example)
}
