//! The JSON Schema (draft 2020-12) of the model file, for editors and other tools.
//!
//! The schema refuses only what the reader refuses too. What a schema cannot express is left to the reader:
//! whether a name is declared, whether the dimension of a product of units fits, whether a formula can be
//! read. Tuples are written as lists of a fixed length, which all versions of language servers support.

use lamc::source::schema::{
    Choice, Key, Kind, MAPPINGS, MODEL, Mapping, Presence, QUANTITIES, Quantity, Range, Value,
    all_units, reserved_names, units_of,
};
use serde_json::{Map, Value as Json, json};

/// The pattern of a number before a unit.
const NUMBER: &str = r"[-+]?([0-9]+\.?[0-9]*|\.[0-9]+)([eE][-+]?[0-9]+)?";
/// A formula has no other characters.
const FORMULA: &str = r"^[A-Za-z0-9_.+\-*/^(),\s]+$";
/// The pattern of a text after a number that the reader takes for a unit or for a decimal comma, not for a
/// part of a formula.
const UNIT: &str = r"([A-Za-z]([A-Za-z0-9 */]|\^-?)*|,.*)";
const IDENTIFIER: &str = "^[A-Za-z_][A-Za-z0-9_]*$";
/// The spellings of true and false in YAML 1.1, which are text in YAML 1.2.
const SPELLINGS: [&str; 8] = ["y", "yes", "true", "on", "n", "no", "false", "off"];

/// Returns the schema.
pub fn json_schema() -> Json {
    let mut definitions = Map::new();
    for mapping in MAPPINGS.iter().filter(|mapping| mapping.name != MODEL.name) {
        definitions.insert(definition(mapping.name), object(mapping));
    }
    for quantity in QUANTITIES {
        definitions.insert(definition(quantity.name), number(quantity));
    }
    let unit = format!("({}|{})", one_of(&all_units()), compound());
    definitions.insert("parameter".into(), number_in(&unit, "A number with any unit or none."));
    definitions.insert(
        "formula".into(),
        json!({
            "type": "string",
            "description": "A formula, in SI units and radians.",
            "pattern": FORMULA,
            "not": { "pattern": format!(r"^\s*{NUMBER}\s*({UNIT})?\s*$") },
        }),
    );
    definitions.insert("boolean".into(), boolean());
    for kind in [Kind::Symbol(""), Kind::Other("")] {
        definitions.insert(
            name_definition(kind).into(),
            json!({
                "type": "string",
                "pattern": IDENTIFIER,
                "not": { "enum": reserved_names(kind) },
            }),
        );
    }
    let mut schema = Map::new();
    schema.insert("$schema".into(), json!("https://json-schema.org/draft/2020-12/schema"));
    schema.insert("title".into(), json!("A mechanism for lamc"));
    let Json::Object(model) = object(&MODEL) else { return Json::Null };
    schema.extend(model);
    schema.insert("$defs".into(), Json::Object(definitions));
    Json::Object(schema)
}

/// A mapping with fixed keys.
fn object(mapping: &Mapping) -> Json {
    let properties: Map<String, Json> =
        mapping.keys.iter().map(|key| (key.name.to_owned(), property(key))).collect();
    let required: Vec<&str> = mapping
        .keys
        .iter()
        .filter(|key| key.presence == Presence::Required)
        .map(|key| key.name)
        .collect();
    let mut object = json!({
        "description": plain(mapping.doc),
        "type": "object",
        "properties": properties,
        "additionalProperties": false,
    });
    if !required.is_empty() {
        object["required"] = json!(required);
    }
    let instead: Vec<Json> = mapping.keys.iter().filter_map(instead).collect();
    if !instead.is_empty() {
        object["allOf"] = json!(instead);
    }
    let together: Map<String, Json> =
        mapping.keys.iter().filter_map(|key| together(mapping, key)).collect();
    if !together.is_empty() {
        object["dependentRequired"] = Json::Object(together);
    }
    let excluded: Vec<Json> = mapping.choices.iter().flat_map(excluded).collect();
    if !excluded.is_empty() {
        object["not"] = json!({ "anyOf": excluded });
    }
    object
}

/// The condition of a key that is required unless another is given.
fn instead(key: &Key) -> Option<Json> {
    let Presence::Without(other) = key.presence else { return None };
    Some(json!({ "anyOf": [{ "required": [key.name] }, { "required": [other] }] }))
}

/// The keys that are required together with a key.
fn together(mapping: &Mapping, key: &Key) -> Option<(String, Json)> {
    let needed: Vec<&str> = mapping
        .beside(key.name)
        .filter(|other| {
            mapping.key(other).is_some_and(|other| other.presence == Presence::Together)
        })
        .collect();
    (!needed.is_empty()).then(|| (key.name.to_owned(), json!(needed)))
}

/// All pairs of keys that exclude each other, because they belong to different alternatives.
fn excluded(choice: &Choice) -> Vec<Json> {
    let mut pairs = Vec::new();
    for (index, way) in choice.iter().enumerate() {
        for other in &choice[index + 1..] {
            for first in *way {
                pairs.extend(other.iter().map(|second| json!({ "required": [first, second] })));
            }
        }
    }
    pairs
}

fn property(key: &Key) -> Json {
    let mut property = value(&key.value);
    let default = match key.presence {
        Presence::Default(default) => format!(" Default: `{default}`."),
        Presence::Optional(without) => format!(" If it is left out, {without}."),
        Presence::Without(other) => format!(" Required without `{other}`."),
        Presence::Required | Presence::Together => String::new(),
    };
    let units = match key.value.quantity() {
        Some(quantity) if quantity.examples.contains('`') => {
            format!(" Units: {}.", quantity.examples)
        }
        _ => String::new(),
    };
    property["description"] = json!(format!(
        "{}{units}{default} Example: `{}: {}`",
        plain(key.doc),
        key.name,
        key.example
    ));
    match key.range {
        Range::Any => {}
        Range::Positive => property["exclusiveMinimum"] = json!(0),
        Range::NotNegative => property["minimum"] = json!(0),
    }
    property
}

fn value(value: &Value) -> Json {
    match value {
        Value::Name(kind) => reference(name_definition(*kind)),
        // Only the reader can check whether it is declared.
        Value::Reference { .. } => json!({ "type": "string", "pattern": IDENTIFIER }),
        // A number is read as the text that it is written as.
        Value::Text => json!({ "type": ["string", "number"] }),
        Value::Either(one, other) => {
            json!({ "anyOf": [self::value(one), self::value(other)] })
        }
        Value::Boolean => reference("boolean"),
        Value::Word(words) => json!({ "enum": words }),
        Value::Unit(quantity) => json!({ "enum": units_of(quantity.dimension) }),
        Value::Number(quantity) => reference(quantity.name),
        Value::Formula(quantity, _) => {
            json!({ "anyOf": [reference(quantity.name), reference("formula")] })
        }
        Value::Parameter => reference("parameter"),
        Value::Array { of, length, .. } => json!({
            "type": "array",
            "items": self::value(of),
            "minItems": length,
            "maxItems": length,
        }),
        Value::List { of, items: [least, most], .. } => {
            let mut list = json!({ "type": "array", "items": self::value(of) });
            if *least > 0 {
                list["minItems"] = json!(least);
            }
            if *most < usize::MAX {
                list["maxItems"] = json!(most);
            }
            list
        }
        Value::Mapping(mapping) => reference(mapping.name),
        Value::Named(kind, of) => json!({
            "type": "object",
            "propertyNames": reference(name_definition(*kind)),
            "additionalProperties": self::value(of),
        }),
        Value::Per(_, of) => json!({
            "type": "object",
            "propertyNames": { "pattern": IDENTIFIER },
            "additionalProperties": self::value(of),
        }),
        Value::OneOf { by, variants } => {
            let named: Vec<&str> = variants.iter().filter_map(|(name, _)| *name).collect();
            let variants = variants.iter().map(|(name, mapping)| {
                let mut variant = reference(mapping.name);
                if name.is_none() {
                    variant["properties"] = json!({ (*by): { "not": { "enum": named } } });
                }
                variant
            });
            json!({ "type": "object", "anyOf": variants.collect::<Vec<_>>() })
        }
    }
}

/// A number, or a number with a unit: one unit of the quantity, or any product of units.
fn number(quantity: &Quantity) -> Json {
    let own = units_of(quantity.dimension);
    let unit = match own.is_empty() {
        true => compound(),
        false => format!("({}|{})", one_of(&own), compound()),
    };
    number_in(&unit, &format!("{}, with or without a unit.", capitalised(quantity.name)))
}

fn number_in(unit: &str, description: &str) -> Json {
    json!({
        "description": description,
        "type": ["number", "string"],
        "pattern": format!(r"^\s*{NUMBER}(\s*{unit})?\s*$"),
    })
}

fn one_of(units: &[&str]) -> String {
    let mut units = units.to_vec();
    // The longest come first, because some engines take the first alternative that fits.
    units.sort_by_key(|unit| std::cmp::Reverse(unit.len()));
    format!("({})", units.join("|"))
}

/// A power of a unit, or a product of units with and without powers.
fn compound() -> String {
    const POWER: &str = r"(\^-?0*[1-9]|²|³)";
    const TIMES: &str = r"(\s*[*/·]\s*|\s+)";
    let unit = one_of(&all_units());
    format!("{unit}({POWER}|(({POWER}{TIMES}?|{TIMES}){unit})+{POWER}?)")
}

fn boolean() -> Json {
    let mut spellings: Vec<Json> = vec![json!(true), json!(false)];
    for word in SPELLINGS {
        let capital = word[..1].to_uppercase() + &word[1..];
        let mut spelt = vec![word.to_owned(), capital, word.to_uppercase()];
        spelt.dedup();
        spellings.extend(spelt.into_iter().map(Json::String));
    }
    json!({ "description": "`true` or `false`.", "enum": spellings })
}

fn reference(name: &str) -> Json {
    json!({ "$ref": format!("#/$defs/{}", definition(name)) })
}

fn definition(name: &str) -> String {
    name.replace(' ', "_")
}

fn name_definition(kind: Kind) -> &'static str {
    match kind {
        Kind::Symbol(_) => "name_in_formulas",
        Kind::Other(_) => "name",
    }
}

fn capitalised(text: &str) -> String {
    text[..1].to_uppercase() + &text[1..]
}

/// Removes links, because their targets are pages of the repository.
fn plain(text: &str) -> String {
    let mut plain = String::new();
    let mut rest = text;
    while let Some((before, after)) = rest.split_once("](") {
        let (_, after) = after.split_once(')').unwrap_or(("", after));
        let (text, link) = before.rsplit_once('[').unwrap_or((before, ""));
        plain.extend([text, link]);
        rest = after;
    }
    plain + rest
}
