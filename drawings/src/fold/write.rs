//! Writes a pattern as FOLD 1.2.

use std::fmt::Write;

use crate::drawing::Role;
use crate::pattern::{Facet, Pattern, VertexId};

/// Returns a pattern as a FOLD file, which [`read`](super::read) reads to the same pattern; angles,
/// which FOLD has in degrees, change by rounding.
///
/// The unit is the length of one unit of the drawing, m; FOLD has names for some lengths only, and
/// coordinates in other units are written in metres. None: a unit without a length.
///
/// Vertices, edges and facets keep their order. A facet with holes is one face in
/// `faces_vertices` only if edges join its boundaries, so for patterns with such facets no faces are
/// written: readers find them from the edges.
pub fn write(pattern: &Pattern, unit: Option<f64>) -> String {
    let (name, scale) = unit.map_or(("unit", 1.0), named);
    let coordinates = pattern.vertices.iter().map(|vertex| {
        let [x, y] = vertex.map(|value| value * scale);
        format!("[{x:?},{y:?}]")
    });
    let edges = pattern.edges.iter().map(|edge| {
        let [a, b] = edge.vertices.map(VertexId::index);
        format!("[{a},{b}]")
    });
    let assignment = pattern.edges.iter().map(|edge| format!("\"{}\"", letter(edge.role)));
    let mut text = String::from("{\n");
    let mut put = |key: &str, value: &str| _ = writeln!(text, "  \"{key}\": {value},");
    put("file_spec", "1.2");
    put("file_creator", "\"lamc\"");
    put("file_classes", "[\"singleModel\"]");
    put("frame_classes", "[\"creasePattern\"]");
    put("frame_attributes", "[\"2D\"]");
    put("frame_unit", &format!("\"{name}\""));
    put("vertices_coords", &list(coordinates));
    put("edges_vertices", &list(edges));
    put("edges_assignment", &list(assignment));
    if pattern.edges.iter().any(|edge| edge.fold.is_some()) {
        let fold = pattern.edges.iter().map(|edge| match edge.fold {
            Some(fold) => format!("{:?}", fold.to_degrees()),
            None => "null".to_owned(),
        });
        put("edges_foldAngle", &list(fold));
    }
    if pattern.facets.iter().all(|facet| facet.holes.is_empty()) {
        put("faces_vertices", &list(pattern.facets.iter().map(face)));
    }
    text.truncate(text.len() - ",\n".len());
    text.push_str("\n}\n");
    text
}

fn face(facet: &Facet) -> String {
    list_in_line(facet.outline.iter().map(|vertex| vertex.index().to_string()))
}

fn list_in_line(elements: impl Iterator<Item = String>) -> String {
    format!("[{}]", elements.collect::<Vec<_>>().join(","))
}

/// Returns a list with one element on each line.
fn list(elements: impl Iterator<Item = String>) -> String {
    let elements: Vec<String> = elements.map(|element| format!("\n    {element}")).collect();
    format!("[{}\n  ]", elements.join(","))
}

/// Returns the name of a unit of this length, m, and the length of a unit of the drawing in it.
fn named(unit: f64) -> (&'static str, f64) {
    let same = |(_, length): &&(&str, f64)| (unit / length - 1.0).abs() < 1e-12;
    match super::frames::UNITS.iter().find(same) {
        Some((name, _)) => (name, 1.0),
        None => ("m", unit),
    }
}

fn letter(role: Role) -> char {
    match role {
        Role::Border => 'B',
        Role::Mountain => 'M',
        Role::Valley => 'V',
        Role::Flat => 'F',
        Role::Hinge => 'U',
        Role::Cut => 'C',
    }
}
