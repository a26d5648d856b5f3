//! The graph of one frame: vertices, edges and faces, checked.

use std::collections::HashMap;

use super::frames::{Frame, Frames};
use super::json::{Bounded, Text, syntax};
use crate::drawing::{Place, Role};
use crate::fault::{Cause, Fault};
use crate::pattern::LARGEST_COORDINATE;

/// What `edges_assignment` says of an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Assignment {
    /// An edge with a role.
    Is(Role),
    /// An edge that only divides a face for the file's sake: both sides are one facet.
    Join,
}

/// An edge of a frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge {
    pub(super) vertices: [usize; 2],
    pub(super) assignment: Assignment,
    /// The fold angle, rad.
    pub(super) fold: Option<f64>,
    pub(super) place: Place,
}

/// The graph of a frame.
#[derive(Debug, Default)]
pub(super) struct Graph {
    pub(super) vertices: Vec<[f64; 3]>,
    pub(super) edges: Vec<Edge>,
    pub(super) faces: Vec<Vec<usize>>,
}

impl Graph {
    /// Reads and checks the graph of a frame.
    pub(super) fn of(text: Text<'_>, frames: &Frames<'_>, frame: usize) -> Result<Self, Fault> {
        let place = frames.place(frame);
        let frame = frames.resolve(frame)?;
        if frame.vertices_coords.is_none() && frame.edges_vertices.is_some() {
            let message = "the frame has edges, but no `vertices_coords`".to_owned();
            return Err(syntax(message, place));
        }
        let vertices = vertices(text, &frame)?;
        let faces = text.list::<Bounded<usize>>("faces_vertices", frame.faces_vertices)?;
        let faces: Vec<(Vec<usize>, Place)> =
            faces.into_iter().map(|(Bounded(face), place)| (face, place)).collect();
        check_indices("faces_vertices", &faces, vertices.len())?;
        let edges = text.list::<[usize; 2]>("edges_vertices", frame.edges_vertices)?;
        check_indices("edges_vertices", &edges, vertices.len())?;
        let sides = sides(&faces);
        let edges = if frame.edges_vertices.is_some() { edges } else { edges_of(&faces) };
        if edges.is_empty() {
            return Err(Fault {
                cause: Cause::Empty,
                message: "the frame has no edges".to_owned(),
                place: Some(place),
                at: Vec::new(),
                hint: Some("`edges_vertices` lists the edges of a crease pattern".to_owned()),
            });
        }
        let folds = folds(text, &frame, edges.len())?;
        let assignments = assignments(text, &frame, edges.len())?;
        let edges = edges.into_iter().enumerate().map(|(index, (vertices, place))| {
            let fold = folds.get(index).copied().flatten();
            let assignment = assignments.get(index).copied().unwrap_or_else(|| {
                let sides = sides.get(&sorted(vertices)).copied().unwrap_or(0);
                Assignment::Is(role_without_assignment(sides, fold))
            });
            Edge { vertices, assignment, fold, place }
        });
        let (edges, faces) = (edges.collect(), faces.into_iter().map(|(face, _)| face).collect());
        Ok(Self { vertices, edges, faces })
    }

    /// Whether all vertices are in one plane z = constant, but for rounding errors.
    pub(super) fn is_flat(&self) -> bool {
        // Exporters compute in single precision at worst, with errors of 1e-7.
        const ROUNDING: f64 = 1e-6;
        let extent = |axis: usize| {
            let values = || self.vertices.iter().map(|vertex| vertex[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        };
        self.vertices.is_empty() || extent(2) <= ROUNDING * extent(0).max(extent(1))
    }
}

/// Returns two indices, the smaller one first.
pub(super) fn sorted([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the role of an edge to which the file assigns none: by its fold angle; an edge of a single
/// face is border.
fn role_without_assignment(faces: usize, fold: Option<f64>) -> Role {
    match fold {
        _ if faces == 1 => Role::Border,
        Some(fold) if fold > 0.0 => Role::Valley,
        Some(fold) if fold < 0.0 => Role::Mountain,
        Some(_) => Role::Flat,
        None => Role::Hinge,
    }
}

fn vertices(text: Text<'_>, frame: &Frame<'_>) -> Result<Vec<[f64; 3]>, Fault> {
    const NAME: &str = "vertices_coords";
    let list = text.list::<Vec<f64>>(NAME, frame.vertices_coords)?;
    let vertices = list.into_iter().enumerate().map(|(index, (coordinates, place))| {
        if let Some(large) = coordinates.iter().find(|value| value.abs() > LARGEST_COORDINATE) {
            return Err(number(
                format!("{NAME}[{index}]: the coordinate {large:e} is too large"),
                format!("coordinates are at most {LARGEST_COORDINATE:e}"),
                place,
            ));
        }
        match coordinates[..] {
            [x, y] => Ok([x, y, 0.0]),
            [x, y, z] => Ok([x, y, z]),
            _ => Err(syntax(
                format!("{NAME}[{index}] has {} coordinates, not two or three", coordinates.len()),
                place,
            )),
        }
    });
    vertices.collect()
}

fn check_indices<T: AsRef<[usize]>>(
    name: &str,
    list: &[(T, Place)],
    vertices: usize,
) -> Result<(), Fault> {
    for (index, (indices, place)) in list.iter().enumerate() {
        if let Some(wrong) = indices.as_ref().iter().find(|&&vertex| vertex >= vertices) {
            return Err(syntax(
                format!(
                    "{name}[{index}] names vertex {wrong}, and the frame has {vertices} vertices"
                ),
                *place,
            ));
        }
    }
    Ok(())
}

/// Returns how many faces each edge has, by its vertices in ascending order.
fn sides(faces: &[(Vec<usize>, Place)]) -> HashMap<[usize; 2], usize> {
    let mut sides = HashMap::new();
    for (face, _) in faces {
        for pair in pairs(face) {
            *sides.entry(sorted(pair)).or_default() += 1;
        }
    }
    sides
}

/// Returns the edges of faces, for files that list faces only.
fn edges_of(faces: &[(Vec<usize>, Place)]) -> Vec<([usize; 2], Place)> {
    let mut seen = std::collections::HashSet::new();
    let all = faces.iter().flat_map(|(face, place)| pairs(face).map(|pair| (pair, *place)));
    all.filter(|(pair, _)| seen.insert(sorted(*pair))).collect()
}

/// Returns the directed edges of a face.
pub(super) fn pairs(face: &[usize]) -> impl Iterator<Item = [usize; 2]> + '_ {
    (0..face.len()).map(|index| [face[index], face[(index + 1) % face.len()]])
}

fn folds(text: Text<'_>, frame: &Frame<'_>, edges: usize) -> Result<Vec<Option<f64>>, Fault> {
    const NAME: &str = "edges_foldAngle";
    // Files have degrees with few digits: 180.00000000001 is 180.
    const MOST: f64 = 180.0 + 1e-6;
    let list = text.list::<Option<f64>>(NAME, frame.edges_fold_angle)?;
    check_length(text, NAME, frame.edges_fold_angle, list.len(), edges)?;
    let folds = list.into_iter().enumerate().map(|(index, (degrees, place))| match degrees {
        Some(degrees) if degrees.abs() > MOST => Err(number(
            format!("{NAME}[{index}] is {degrees} degrees"),
            "a fold angle is from -180 (mountain) to 180 (valley) degrees".to_owned(),
            place,
        )),
        degrees => Ok(degrees.map(|degrees| degrees.clamp(-180.0, 180.0).to_radians())),
    });
    folds.collect()
}

fn assignments(text: Text<'_>, frame: &Frame<'_>, edges: usize) -> Result<Vec<Assignment>, Fault> {
    const NAME: &str = "edges_assignment";
    let list = text.list::<String>(NAME, frame.edges_assignment)?;
    check_length(text, NAME, frame.edges_assignment, list.len(), edges)?;
    let assignments = list.into_iter().enumerate().map(|(index, (letter, place))| {
        Ok(match letter.as_str() {
            "B" | "b" => Assignment::Is(Role::Border),
            "M" | "m" => Assignment::Is(Role::Mountain),
            "V" | "v" => Assignment::Is(Role::Valley),
            "F" | "f" => Assignment::Is(Role::Flat),
            "U" | "u" => Assignment::Is(Role::Hinge),
            "C" | "c" => Assignment::Is(Role::Cut),
            "J" | "j" => Assignment::Join,
            _ => {
                let message = format!("{NAME}[{index}] is {letter:?}, not one of B M V F U C J");
                return Err(syntax(message, place));
            }
        })
    });
    assignments.collect()
}

/// Checks that a list for edges has one element for each, if the file has it.
fn check_length(
    text: Text<'_>,
    name: &str,
    raw: Option<&serde_json::value::RawValue>,
    length: usize,
    edges: usize,
) -> Result<(), Fault> {
    match raw {
        Some(raw) if length != edges => Err(syntax(
            format!("{name} has {length} elements, and edges_vertices has {edges}"),
            text.place(raw),
        )),
        _ => Ok(()),
    }
}

fn number(message: String, hint: String, place: Place) -> Fault {
    Fault { cause: Cause::Number, message, place: Some(place), at: Vec::new(), hint: Some(hint) }
}
