//! Whether a model keeps its structure over the ranges of its parameters.
//!
//! The equations are derived for the loops, ranks and freedoms at the defaults of the parameters. Where parameters
//! change the drawing, these are compared at many other values, and so is whether the drawing is possible: at each end
//! of each range, at its corners, and between.

use super::{Topology, build};
use crate::laminate;
use crate::source::codes;
use crate::source::{Diagnostic, Diagnostics, Severity, SourceModel, Span};

/// Most corners of the ranges that are looked at.
const CORNERS: usize = 16;

/// Values between the ends that are looked at.
const BETWEEN: usize = 24;

/// Share of its default by which a parameter without a range is changed.
const NEAR: f64 = 1e-3;

/// Halvings with which the value is found at which the structure changes.
const HALVINGS: usize = 40;

/// Why a model is not what it is at the defaults of its parameters.
enum Change {
    /// The model has errors.
    Impossible(Box<Diagnostic>),
    /// The loops differ.
    Structure(String),
}

/// Runs the stages laminate and topology: the topology, and the warnings of both.
///
/// # Errors
/// Returns the errors of the first stage that has some.
pub fn analysed(model: &SourceModel) -> Result<(Topology, Diagnostics), Diagnostics> {
    let mut warnings = Diagnostics::default();
    let mechanism = laminate::build(model, &mut warnings)?;
    let topology = build(mechanism)?;
    warnings.extend(topology.warnings.0.iter().cloned());
    Ok((topology, warnings))
}

/// Compares the structure of a model over the ranges of its parameters with that at their defaults.
///
/// # Errors
/// Returns an error that names the parameters and values where it changes.
pub fn check(model: &SourceModel, topology: &Topology) -> Result<(), Diagnostics> {
    let used = model.drawn_by();
    let free: Vec<usize> = (0..used.len()).filter(|index| used[*index]).collect();
    let defaults: Vec<f64> = model.parameters.iter().map(|parameter| parameter.value).collect();
    for shares in samples(free.len()) {
        let mut values = defaults.clone();
        for (index, share) in free.iter().zip(shares) {
            let [low, high] = range(model, *index);
            values[*index] = low + share * (high - low);
        }
        if change(model, topology, &values).is_some() {
            return Err(located(model, topology, &defaults, values).into());
        }
    }
    Ok(())
}

/// Returns the topology of a model at values of its parameters.
///
/// # Errors
/// Returns an error if the model is not possible there, or differs in structure from `topology`.
pub fn at(
    model: &SourceModel,
    topology: &Topology,
    values: &[f64],
) -> Result<Topology, Diagnostics> {
    for (parameter, value) in model.parameters.iter().zip(values) {
        if let Some(range) = &parameter.range
            && !(range.value[0]..=range.value[1]).contains(value)
        {
            let message = format!("`{}` = {value} is not in its range", parameter.name.value);
            let error = Diagnostic::error(codes::OUTSIDE_RANGE, range.span, message);
            return Err(error.hint("widen the range, or choose another value").into());
        }
    }
    let (found, _) = analysed(&model.at(values))?;
    match topology.difference(&found) {
        None => Ok(found),
        Some(_) => {
            let defaults: Vec<f64> = model.parameters.iter().map(|it| it.value).collect();
            Err(located(model, topology, &defaults, values.to_vec()).into())
        }
    }
}

/// Returns where in the ranges of `count` parameters the structure is compared: shares from 0 to 1.
fn samples(count: usize) -> Vec<Vec<f64>> {
    if count == 0 {
        return Vec::new();
    }
    let ends = (0..count).flat_map(|index| {
        [0.0, 1.0].map(|end| (0..count).map(|it| if it == index { end } else { 0.5 }).collect())
    });
    // All corners of few parameters; of many, corners without an order.
    let corners = 0..CORNERS.min(1 << count.min(usize::BITS as usize - 1));
    let corner = |number: usize| -> Vec<f64> {
        let bit = |index: usize| match count <= CORNERS.ilog2() as usize {
            true => number >> index & 1 == 1,
            false => share(number * count + index) < 0.5,
        };
        (0..count).map(|index| f64::from(u8::from(bit(index)))).collect()
    };
    let between =
        (0..BETWEEN).map(|number| (0..count).map(|index| share(number * count + index)).collect());
    ends.chain(corners.map(corner)).chain(between).collect()
}

/// Returns a number from 0 to 1 that looks random: the same for the same place (SplitMix64; Steele, Lea and Flood, OOPSLA
/// 2014).
fn share(place: usize) -> f64 {
    let mut word = (place as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    word = (word ^ word >> 30).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    word = (word ^ word >> 27).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((word ^ word >> 31) >> 11) as f64 / (1_u64 << 53) as f64
}

/// Returns the range of a parameter, or values near its default.
fn range(model: &SourceModel, index: usize) -> [f64; 2] {
    let parameter = &model.parameters[index];
    parameter.range.as_ref().map_or_else(
        || {
            let near = if parameter.value == 0.0 { NEAR } else { NEAR * parameter.value.abs() };
            [parameter.value - near, parameter.value + near]
        },
        |range| range.value,
    )
}

fn change(model: &SourceModel, topology: &Topology, values: &[f64]) -> Option<Change> {
    match analysed(&model.at(values)) {
        Ok((found, _)) => topology.difference(&found).map(Change::Structure),
        Err(problems) => {
            let error = problems.0.into_iter().find(|it| it.severity == Severity::Error);
            error.map(|error| Change::Impossible(Box::new(error)))
        }
    }
}

/// Describes a change of the structure: the parameters that cause it, and the values nearest to the defaults.
fn located(
    model: &SourceModel,
    topology: &Topology,
    defaults: &[f64],
    mut values: Vec<f64>,
) -> Diagnostic {
    // Parameters that do not matter are as by default.
    for index in 0..values.len() {
        let kept = std::mem::replace(&mut values[index], defaults[index]);
        if change(model, topology, &values).is_none() {
            values[index] = kept;
        }
    }
    let at = |share: f64| -> Vec<f64> {
        defaults.iter().zip(&values).map(|(from, to)| from + share * (to - from)).collect()
    };
    let [mut same, mut other] = [0.0, 1.0];
    for _ in 0..HALVINGS {
        let middle = 0.5 * (same + other);
        match change(model, topology, &at(middle)) {
            None => same = middle,
            Some(_) => other = middle,
        }
    }
    described(model, topology, defaults, &at(other))
}

/// Describes what is different at values of the parameters.
fn described(
    model: &SourceModel,
    topology: &Topology,
    defaults: &[f64],
    values: &[f64],
) -> Diagnostic {
    let moved: Vec<usize> = (0..values.len()).filter(|it| values[*it] != defaults[*it]).collect();
    let shown = |index: &usize| {
        let parameter = &model.parameters[*index];
        let unit = parameter.dimension.map_or(String::new(), |dimension| dimension.si_unit());
        let value = format!("{} {unit}", rounded(values[*index]));
        format!("`{}` = {}", parameter.name.value, value.trim())
    };
    let place = moved.iter().map(shown).collect::<Vec<_>>().join(", ");
    let first = moved.first().map(|index| &model.parameters[*index]);
    let span = first.map_or(Span::default(), |parameter| {
        parameter.range.as_ref().map_or(parameter.name.span, |range| range.span)
    });
    let error = |message| Diagnostic::error(codes::CHANGED_STRUCTURE, span, message);
    let hint = "make the range smaller, or correct the formulas of the drawing";
    match change(model, topology, values) {
        Some(Change::Impossible(why)) => {
            let message = format!("the drawing is impossible at {place}: {}", why.message);
            let error = error(message).hint(hint);
            match why.span {
                Some(there) => error.also(there, why.label),
                None => error,
            }
        }
        Some(Change::Structure(what)) => error(format!("the loops change at {place}: {what}"))
            .hint(format!("the equations hold for one kind of each loop; {hint}")),
        // Rounding: the last value that was looked at.
        None => error(format!("the model changes near {place}")).hint(hint),
    }
}

/// Returns a number with six significant digits.
fn rounded(value: f64) -> f64 {
    format!("{value:.5e}").parse().unwrap_or(value)
}
