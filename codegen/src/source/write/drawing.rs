//! Numbers of the drawing, and bodies, in our schema.

use super::{WIDTH, expression, line, list, number};
use crate::source::drawn::Drawn;
use crate::source::model::{Body, Plate, Shape, SourceModel};

/// Writes a body.
pub fn body(out: &mut String, body: &Body, model: &SourceModel) {
    let is_bare =
        matches!(body.shape, Shape::None) && body.point_masses.is_empty() && body.slits.is_empty();
    if is_bare {
        let mark = match (body.fixed, body.free) {
            (true, _) => " fixed: true ",
            (_, true) => " free: true ",
            _ => "",
        };
        return line(out, 1, &format!("{}: {{{mark}}}", body.name.value));
    }
    line(out, 1, &format!("{}:", body.name.value));
    if body.fixed {
        line(out, 2, "fixed: true");
    }
    if body.free {
        line(out, 2, "free: true");
    }
    match &body.shape {
        Shape::None => {}
        Shape::Plates(layers) => plates(out, &body.name.value, layers, model),
        Shape::Rigid { mass, com, inertia } => {
            line(out, 2, &format!("mass: {}", measure(mass, model)));
            line(out, 2, &format!("com: {}", drawn(com, model)));
            line(out, 2, "inertia:");
            inertia.value.iter().for_each(|row| line(out, 3, &format!("- {}", list(row))));
        }
    }
    if !body.slits.is_empty() {
        line(out, 2, "slits:");
        body.slits.iter().for_each(|slit| ring(out, 3, "- ", slit.iter().map(|end| list(end))));
    }
    if !body.point_masses.is_empty() {
        line(out, 2, "point_masses:");
        for point in &body.point_masses {
            let [mass, at] = [measure(&point.mass, model), drawn(&point.at, model)];
            line(out, 3, &format!("- {{ mass: {mass}, at: {at} }}"));
        }
    }
}

/// Writes plates; equal layers are written once.
fn plates(out: &mut String, name: &str, layers: &[Vec<Plate>], model: &SourceModel) {
    let same = |a: &[Plate], b: &[Plate]| {
        a.len() == b.len()
            && a.iter().zip(b).all(|(a, b)| {
                let rings = |plate: &'_ Plate| {
                    let rings = [&plate.outline].into_iter().chain(&plate.holes);
                    rings.map(|ring| vertices(ring, model).collect()).collect::<Vec<Vec<_>>>()
                };
                rings(a) == rings(b)
            })
    };
    if let [first, rest @ ..] = layers
        && let [plate] = first.as_slice()
        && rest.iter().all(|layer| same(layer, first))
    {
        return plate_fields(out, 2, plate, "", model);
    }
    line(out, 2, "layers:");
    for (i, layer) in layers.iter().enumerate() {
        if layer.is_empty() {
            line(out, 3, "- []");
            continue;
        }
        if let Some(earlier) = layers[..i].iter().position(|other| same(other, layer)) {
            line(out, 3, &format!("- *{name}_layer_{earlier}"));
            continue;
        }
        match layers[i + 1..].iter().any(|other| same(other, layer)) {
            true => line(out, 3, &format!("- &{name}_layer_{i}")),
            false => line(out, 3, "-"),
        }
        for plate in layer {
            plate_fields(out, 4, plate, "- ", model);
        }
    }
}

/// Writes `outline` and `holes`; `mark` starts the first line.
fn plate_fields(out: &mut String, indent: usize, plate: &Plate, mark: &str, model: &SourceModel) {
    ring(out, indent, &format!("{mark}outline: "), vertices(&plate.outline, model));
    if !plate.holes.is_empty() {
        let inner = indent + mark.len() / 2;
        line(out, inner, "holes:");
        plate.holes.iter().for_each(|hole| ring(out, inner + 1, "- ", vertices(hole, model)));
    }
}

/// Writes a list of vertices, as many on each line as fit.
fn ring(out: &mut String, indent: usize, key: &str, vertices: impl Iterator<Item = String>) {
    let mut text = format!("{key}[");
    let hanging = indent + 1 + usize::from(key.starts_with("- o"));
    let mut indent = indent;
    let mut vertices = vertices.peekable();
    while let Some(vertex) = vertices.next() {
        let item = format!("{vertex}{}", if vertices.peek().is_none() { "]" } else { "," });
        if 2 * indent + text.len() + 1 + item.len() > WIDTH {
            line(out, indent, text.trim_end());
            (text, indent) = (String::new(), hanging);
        }
        if !(text.is_empty() || text.ends_with('[')) {
            text.push(' ');
        }
        text.push_str(&item);
    }
    line(out, indent, &text);
}

/// Writes a number of the drawing.
pub fn measure(given: &Drawn<f64>, model: &SourceModel) -> String {
    given.formula(0).map_or_else(|| number(given.value), |formula| expression(formula, model))
}

/// Writes a list of numbers of the drawing.
pub fn drawn<const K: usize>(given: &Drawn<[f64; K]>, model: &SourceModel) -> String {
    row(given, 0, &given.value, model)
}

/// Writes one row of numbers of the drawing.
pub fn row<T>(given: &Drawn<T>, row: usize, values: &[f64], model: &SourceModel) -> String {
    let texts = values.iter().enumerate().map(|(column, value)| {
        let formula = given.formula(row * values.len() + column);
        formula.map_or_else(|| number(*value), |formula| expression(formula, model))
    });
    format!("[{}]", texts.collect::<Vec<_>>().join(", "))
}

fn vertices<'d>(
    ring: &'d Drawn<Vec<[f64; 2]>>,
    model: &'d SourceModel,
) -> impl Iterator<Item = String> + 'd {
    ring.value.iter().enumerate().map(move |(index, vertex)| row(ring, index, vertex, model))
}
