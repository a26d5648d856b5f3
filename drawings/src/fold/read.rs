//! Reads a FOLD file.

use super::angles::angles;
use super::frames::{Frames, Unit};
use super::graph::{Assignment, Edge, Graph, pairs, sorted};
use super::json::{Text, syntax};
use super::unfold::unfold;
use crate::drawing::{Drawing, Ignored, Place, Role, Stroke};
use crate::fault::{Cause, Fault};
use crate::pattern::faces;

/// The largest file that is read, bytes: a pattern with a hundred thousand edges has some ten million.
const LARGEST_FILE: usize = 64_000_000;

/// Reads a crease pattern from the text of a FOLD file.
///
/// Frame 0 is the file itself, frame k the k-th of its `file_frames`; without a number, the first
/// frame of the class `creasePattern` is read, or else the first one. If the file has a `foldedForm`
/// with the same edges, its angles become the `angle` of the strokes. A file that has only a folded
/// form is laid flat along its faces.
///
/// # Errors
///
/// What is no JSON or no FOLD, with the position in the text; a folded form that cannot be laid flat.
pub fn read(text: &str, frame: Option<usize>) -> Result<Drawing, Vec<Fault>> {
    if text.len() > LARGEST_FILE {
        return Err(vec![Fault {
            cause: Cause::Limit,
            message: format!("the file has {} bytes", text.len()),
            place: None,
            at: Vec::new(),
            hint: Some(format!("files of at most {LARGEST_FILE} bytes are read")),
        }]);
    }
    read_frame(text, frame).map_err(|fault| vec![fault])
}

fn read_frame(text: &str, frame: Option<usize>) -> Result<Drawing, Fault> {
    let frames = Frames::of(text)?;
    let chosen = choose(&frames, frame)?;
    let text = Text(text);
    let mut graph = Graph::of(text, &frames, chosen)?;
    let mut ignored = Vec::new();
    let folded = frames.is(chosen, "foldedForm") || !graph.is_flat();
    let (unit, unknown_unit) = match frames.unit(&frames.resolve(chosen)?)? {
        Unit::None => (None, None),
        Unit::Known(length) => (Some(length), None),
        Unit::Unknown(name) => (None, Some(name)),
    };
    let angles = if folded {
        let state = std::mem::take(&mut graph);
        graph = match flat_graph(text, &frames, chosen)? {
            Some(flat) => flat,
            None => {
                let mut flat = Graph::of(text, &frames, chosen)?;
                unfold(&mut flat, frames.place(chosen))?;
                flat
            }
        };
        state_angles(&graph, &state, chosen, &frames, &mut ignored)?
    } else {
        folded_angles(text, &frames, chosen, &graph, &mut ignored)?
    };
    let joins: Vec<&Edge> =
        graph.edges.iter().filter(|edge| edge.assignment == Assignment::Join).collect();
    if let Some(first) = joins.first() {
        let what = "edge of assignment J".to_owned();
        ignored.push(Ignored { what, count: joins.len(), place: first.place });
    }
    let at = |vertex: usize| [graph.vertices[vertex][0], graph.vertices[vertex][1]];
    let strokes = graph.edges.iter().zip(angles).filter_map(|(edge, angle)| {
        let Assignment::Is(role) = edge.assignment else { return None };
        let crease = !matches!(role, Role::Border | Role::Cut);
        Some(Stroke {
            ends: edge.vertices.map(at),
            role,
            fold: signed(role, edge.fold).filter(|_| crease),
            angle: angle.filter(|_| crease),
            place: edge.place,
        })
    });
    Ok(Drawing {
        strokes: strokes.collect(),
        unit,
        unknown_unit,
        areas: areas(&graph),
        ignored,
        doubts: opposite_signs(&graph).into_iter().collect(),
    })
}

/// Returns a doubt about mountains with positive and valleys with negative fold angles.
fn opposite_signs(graph: &Graph) -> Option<Fault> {
    let is_opposite = |edge: &&Edge| match (edge.assignment, edge.fold) {
        (Assignment::Is(Role::Mountain), Some(fold)) => fold > SIGN,
        (Assignment::Is(Role::Valley), Some(fold)) => fold < -SIGN,
        _ => false,
    };
    let opposite: Vec<&Edge> = graph.edges.iter().filter(is_opposite).collect();
    let first = opposite.first()?;
    let middle = |edge: &&Edge| {
        let [a, b] = edge.vertices.map(|vertex| graph.vertices[vertex]);
        [(a[0] + b[0]) / 2.0, (a[1] + b[1]) / 2.0]
    };
    let message = match opposite.len() {
        1 => {
            "the sign of a fold angle contradicts the edge's assignment, which is taken".to_owned()
        }
        count => format!(
            "the signs of {count} fold angles contradict the edges' assignments, which are taken"
        ),
    };
    Some(Fault {
        cause: Cause::Contradiction,
        message,
        place: Some(first.place),
        at: opposite.iter().map(middle).collect(),
        hint: Some(
            "an angle of `edges_foldAngle` is negative for a mountain (M), positive for a valley (V)"
                .to_owned(),
        ),
    })
}

/// A fold angle up to this, rad, has no sign: files have degrees with few digits.
const SIGN: f64 = 1e-6;

/// Returns a fold angle with the sign of its role: some programs write all angles as positive.
fn signed(role: Role, fold: Option<f64>) -> Option<f64> {
    match role {
        Role::Mountain => fold.map(|fold| -fold.abs()),
        Role::Valley => fold.map(f64::abs),
        _ => fold,
    }
}

/// Returns the frame to read.
fn choose(frames: &Frames<'_>, frame: Option<usize>) -> Result<usize, Fault> {
    let all = 0..frames.count();
    match frame {
        Some(frame) if all.contains(&frame) => Ok(frame),
        Some(frame) => {
            let last = frames.count() - 1;
            let message = format!("the file has no frame {frame}: its last one is {last}");
            Err(syntax(message, Place::default()))
        }
        None => Ok(all.clone().find(|&frame| frames.is(frame, "creasePattern")).unwrap_or(0)),
    }
}

/// Returns the crease pattern that has the edges of a folded state.
fn flat_graph(text: Text<'_>, frames: &Frames<'_>, state: usize) -> Result<Option<Graph>, Fault> {
    for frame in (0..frames.count()).filter(|&frame| frames.is(frame, "creasePattern")) {
        if frame != state && frames.same_edges(frame, state)? {
            let graph = Graph::of(text, frames, frame)?;
            return Ok(Some(graph).filter(Graph::is_flat));
        }
    }
    Ok(None)
}

/// Returns the angles of the first folded form with the edges of the pattern; none without one.
fn folded_angles(
    text: Text<'_>,
    frames: &Frames<'_>,
    chosen: usize,
    graph: &Graph,
    ignored: &mut Vec<Ignored>,
) -> Result<Vec<Option<f64>>, Fault> {
    let forms: Vec<usize> =
        (0..frames.count()).filter(|&frame| frames.is(frame, "foldedForm")).collect();
    for &frame in &forms {
        if frames.same_edges(frame, chosen)? {
            let state = Graph::of(text, frames, frame)?;
            return state_angles(graph, &state, frame, frames, ignored);
        }
    }
    if let Some(&first) = forms.first() {
        let what = "foldedForm with other edges".to_owned();
        ignored.push(Ignored { what, count: forms.len(), place: frames.place(first) });
    }
    Ok(vec![None; graph.edges.len()])
}

/// Returns the angles of a folded state: as the frame itself says, or else between its faces.
fn state_angles(
    flat: &Graph,
    state: &Graph,
    frame: usize,
    frames: &Frames<'_>,
    ignored: &mut Vec<Ignored>,
) -> Result<Vec<Option<f64>>, Fault> {
    let faces = if state.vertices.len() != flat.vertices.len() {
        // A state with other vertices says nothing of the faces.
        Vec::new()
    } else if !flat.faces.is_empty() {
        counterclockwise(flat)
    } else if let Some(faces) = faces_between(flat)? {
        faces
    } else {
        let what = "foldedForm without faces, whose edges cross".to_owned();
        ignored.push(Ignored { what, count: 1, place: frames.place(frame) });
        Vec::new()
    };
    let between = angles(state, &flat.edges, &faces);
    let said = frame != 0 && frames.own(frame).edges_fold_angle.is_some();
    let angle = |(edge, between): (&Edge, Option<f64>)| {
        let said = edge.fold.filter(|_| said);
        said.or(between)
    };
    Ok(state.edges.iter().zip(between).map(angle).collect())
}

/// Returns the faces between the edges of a flat graph that lists none, each counterclockwise seen from above;
/// None if edges cross.
fn faces_between(flat: &Graph) -> Result<Option<Vec<Vec<usize>>>, Fault> {
    let points: Vec<[f64; 2]> = flat.vertices.iter().map(|[x, y, _]| [*x, *y]).collect();
    let edges: Vec<[usize; 2]> = flat.edges.iter().map(|edge| edge.vertices).collect();
    faces(&points, &edges)
}

/// Returns the faces of a flat graph, each counterclockwise seen from above.
fn counterclockwise(flat: &Graph) -> Vec<Vec<usize>> {
    let turned = flat.faces.iter().map(|face| {
        let mut face = face.clone();
        if area(flat, &face) < 0.0 {
            face.reverse();
        }
        face
    });
    turned.collect()
}

/// Returns the area inside a face.
fn area(graph: &Graph, face: &[usize]) -> f64 {
    let Some(&first) = face.first() else { return 0.0 };
    let from = |vertex: usize| {
        let ([x, y, _], [u, v, _]) = (graph.vertices[vertex], graph.vertices[first]);
        [x - u, y - v]
    };
    let twice: f64 = pairs(face)
        .map(|[a, b]| {
            let ([x, y], [u, v]) = (from(a), from(b));
            x * v - u * y
        })
        .sum();
    0.5 * twice
}

/// Returns the areas of the facets that the file lists: of its faces, those that edges of assignment J
/// join taken together.
fn areas(graph: &Graph) -> Vec<f64> {
    let mut group: Vec<usize> = (0..graph.faces.len()).collect();
    fn root(group: &mut [usize], mut face: usize) -> usize {
        while group[face] != face {
            group[face] = group[group[face]];
            face = group[face];
        }
        face
    }
    let joins: std::collections::HashSet<[usize; 2]> = graph
        .edges
        .iter()
        .filter(|edge| edge.assignment == Assignment::Join)
        .map(|edge| sorted(edge.vertices))
        .collect();
    let mut first_at = std::collections::HashMap::new();
    for (face, vertices) in graph.faces.iter().enumerate() {
        for pair in pairs(vertices).map(sorted).filter(|pair| joins.contains(pair)) {
            let other = *first_at.entry(pair).or_insert(face);
            let [a, b] = [face, other].map(|face| root(&mut group, face));
            group[a] = b;
        }
    }
    let mut areas = vec![0.0; graph.faces.len()];
    for (face, vertices) in graph.faces.iter().enumerate() {
        areas[root(&mut group, face)] += area(graph, vertices).abs();
    }
    let roots = (0..graph.faces.len()).filter(|&face| group[face] == face);
    roots.map(|face| areas[face]).collect()
}
