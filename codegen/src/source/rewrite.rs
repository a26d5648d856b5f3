//! The text of a model with other values of its parameters: comments, units and order stay as they are.

use super::model::SourceModel;
use super::units;
use super::yaml::{self, Node};
use super::{SourceFile, Span, parse, to_yaml};

/// Two values are the same up to this share: the unit of the text may cost a rounding error.
const ROUNDING: f64 = 4.0 * f64::EPSILON;

/// Returns the text of a file with these values of the parameters, SI, in the units that the file gives them in.
/// `model` is what [`parse`] reads from the file, and `path` is where the text is to be read from.
///
/// `None` if the text that would result is not the same model with these values, because the file is not in this
/// schema, names other files that are not found from `path`, or gives two parameters in one place.
pub fn with_parameters(
    file: &SourceFile,
    model: &SourceModel,
    values: &[f64],
    path: &str,
) -> Option<String> {
    let (root, _) = yaml::parse(&file.text).ok()?;
    let entries = entry(&root, "parameters")?;
    let mut places: Vec<(Span, String)> = Vec::new();
    for (parameter, &value) in model.parameters.iter().zip(values) {
        if value == parameter.value {
            continue;
        }
        let given = entry(entries, &parameter.name.value)?;
        let given = entry(given, "value").unwrap_or(given);
        places.push((given.span, written(given.scalar()?.text.trim(), value)?));
    }
    places.sort_by_key(|(span, _)| span.start);
    let mut text = file.text.clone();
    for (span, value) in places.iter().rev() {
        text.replace_range(span.start..span.end, value);
    }
    let written = SourceFile { path: path.into(), text };
    let (mut found, _) = parse(&written).ok()?;
    let values_are_kept = found
        .parameters
        .iter()
        .zip(values)
        .all(|(parameter, value)| (parameter.value - value).abs() <= ROUNDING * value.abs());
    // Without a name of its own a model has that of its file.
    found.name = model.name.clone();
    let is_same = to_yaml(&found.at(values)) == to_yaml(&model.at(values));
    (values_are_kept && is_same).then_some(written.text)
}

/// The value of a key of a mapping.
fn entry<'n>(node: &'n Node, key: &str) -> Option<&'n Node> {
    let yaml::Content::Mapping(entries) = &node.content else { return None };
    let found = entries.iter().find(|entry| entry.object.is_none() && entry.key.value == key);
    found.map(|entry| &entry.value)
}

/// A value, SI, in the unit in which a text gives another one.
fn written(text: &str, value: f64) -> Option<String> {
    let (_, unit) = units::split_quantity(text)?;
    let unit = unit.trim_end();
    let size = match unit {
        "" => 1.0,
        unit => units::parse_unit(unit).ok()?.to_si("1"),
    };
    let number = format!("{:?}", value / size);
    let number = number.strip_suffix(".0").unwrap_or(&number);
    Some(format!("{number} {unit}").trim_end().to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    const REST: &str = "gravity: [0, 0, 0]\nbodies:\n  base: { fixed: true }\n  \
        arm: { mass: \"m\", com: [0, \"l\", 0], inertia: [[1e-6,0,0],[0,1e-6,0],[0,0,1e-6]] }\n\
        joints:\n  hip: { bodies: [base, arm], axis: [[0,0],[0,1]], stiffness: k, damping: d }\n";

    fn rewritten(parameters: &str, values: [f64; 4]) -> Option<String> {
        let file = SourceFile { path: "arm.yaml".into(), text: format!("{parameters}{REST}") };
        let (model, _) = parse(&file).unwrap();
        let text = with_parameters(&file, &model, &values, "other.yaml")?;
        Some(text.strip_suffix(REST).unwrap().to_owned())
    }

    #[test]
    fn comments_and_units_stay() {
        let parameters = "# An arm.\nparameters:\n  m: 3 g   # as weighed\n  l: { range: [1 mm, 9 cm], value: 20 mm }\n  \
                          k: \"11.4 mN*m/rad\"\n  d: 1e-6\n";
        let values = [0.0025, 0.03, 0.0114, 2e-6];
        let expected = "# An arm.\nparameters:\n  m: 2.5 g   # as weighed\n  l: { range: [1 mm, 9 cm], value: 30 mm }\n  \
                        k: \"11.4 mN*m/rad\"\n  d: 2e-6\n";
        assert_eq!(rewritten(parameters, values).as_deref(), Some(expected));
        let expected = expected.replace("\"11.4 mN*m/rad\"", "12.5 mN*m/rad");
        let values = [0.0025, 0.03, 0.0125, 2e-6];
        assert_eq!(rewritten(parameters, values).as_deref(), Some(&*expected));
    }

    /// Two parameters that an alias gives one value have one place in the text.
    #[test]
    fn what_cannot_be_rewritten_is_not() {
        let parameters =
            "parameters: { m: 3 g, l: &one { value: 20 mm }, k: 0.01, d: &two 0.02 }\n";
        let shared = parameters.replace("k: 0.01, d: &two 0.02", "d: &two 0.02, k: *two");
        let values = [0.003, 0.02, 0.01, 0.02];
        assert_eq!(rewritten(parameters, values).as_deref(), Some(parameters));
        assert_eq!(rewritten(&shared, [0.003, 0.02, 0.01, 0.02]), None);
    }

    #[test]
    fn a_text_that_would_be_another_model_is_none() {
        let text = format!("parameters: {{ m: 3 g, l: 20 mm, k: 0.01, d: 0 }}\n{REST}");
        let file = SourceFile { path: "arm.yaml".into(), text };
        let (mut model, _) = parse(&file).unwrap();
        assert!(with_parameters(&file, &model, &[1.0, 0.02, 0.01, 0.0], "x.yaml").is_some());
        // As if the text, read from there, had another joint.
        model.joints[0].name.value = "knee".into();
        assert_eq!(with_parameters(&file, &model, &[1.0, 0.02, 0.01, 0.0], "x.yaml"), None);
    }
}
