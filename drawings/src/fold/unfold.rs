//! Lays the faces of a folded state flat, for files that have no crease pattern.

use std::collections::{HashMap, VecDeque};

use super::angles::{cross, dot, minus, normal, unit};
use super::graph::{Graph, pairs};
use super::json::syntax;
use crate::drawing::Place;
use crate::fault::Fault;

/// A vertex that is reached over two faces must come to the same place within this part of the size of
/// the state: files have about six digits.
const AGREES: f64 = 1e-4;

/// Lays all faces of a graph into the plane, each as it is, so that faces with a common edge keep it.
/// The front of each face, from which its vertices run counterclockwise, is on top.
pub(super) fn unfold(graph: &mut Graph, frame: Place) -> Result<(), Fault> {
    let refuse = |message: String| Err(syntax(message, frame));
    if graph.faces.is_empty() {
        return refuse(
            "the file has a folded form and no crease pattern, and no faces to lay flat".to_owned(),
        );
    }
    let size = size(graph);
    let mut face_at = HashMap::new();
    for (index, face) in graph.faces.iter().enumerate() {
        for pair in pairs(face) {
            face_at.insert(pair, index);
        }
    }
    let mut flat: Vec<Option<[f64; 2]>> = vec![None; graph.vertices.len()];
    let mut laid = vec![false; graph.faces.len()];
    let mut queue = VecDeque::from([(0, None)]);
    laid[0] = true;
    while let Some((face, shared)) = queue.pop_front() {
        for (vertex, place) in lay(graph, face, shared, &flat) {
            let [x, y] = *flat[vertex].get_or_insert(place);
            let apart = (place[0] - x).hypot(place[1] - y);
            if apart.is_nan() || apart > AGREES * size {
                return refuse(format!(
                    "the folded form cannot be laid flat: vertex {vertex} comes to two places"
                ));
            }
        }
        for [a, b] in pairs(&graph.faces[face]) {
            if let Some(&next) = face_at.get(&[b, a])
                && !std::mem::replace(&mut laid[next], true)
            {
                queue.push_back((next, Some([a, b])));
            }
        }
    }
    if let Some(face) = laid.iter().position(|laid| !laid) {
        return refuse(format!(
            "the folded form cannot be laid flat: no edges join face {face} to face 0"
        ));
    }
    for (vertex, flat) in graph.vertices.iter_mut().zip(flat) {
        let [x, y] = flat.unwrap_or_default();
        *vertex = [x, y, 0.0];
    }
    Ok(())
}

/// Returns the places of the vertices of a face in the plane. The two vertices that it shares with a
/// face that is laid are where they are.
fn lay(
    graph: &Graph,
    face: usize,
    shared: Option<[usize; 2]>,
    flat: &[Option<[f64; 2]>],
) -> Vec<(usize, [f64; 2])> {
    let vertices = &graph.faces[face];
    let Some(&first) = vertices.first() else { return Vec::new() };
    let [a, b] = shared.unwrap_or([first, vertices[1 % vertices.len()]]);
    let right = unit(minus(graph.vertices[b], graph.vertices[a]));
    let up = cross(normal(&graph.vertices, vertices), right);
    // The way from a to b in the plane.
    let (start, [c, s]) = match (flat[a], flat[b]) {
        (Some(start), Some(end)) if shared.is_some() => {
            let [x, y] = [end[0] - start[0], end[1] - start[1]];
            let length = x.hypot(y);
            (start, [x / length, y / length])
        }
        _ => ([0.0; 2], [1.0, 0.0]),
    };
    let place = |&vertex: &usize| {
        let from = minus(graph.vertices[vertex], graph.vertices[a]);
        let (x, y) = (dot(from, right), dot(from, up));
        (vertex, [start[0] + c * x - s * y, start[1] + s * x + c * y])
    };
    vertices.iter().map(place).collect()
}

/// Returns the largest extent of the state along an axis.
fn size(graph: &Graph) -> f64 {
    (0..3)
        .map(|axis| {
            let values = || graph.vertices.iter().map(|vertex| vertex[axis]);
            values().fold(f64::NEG_INFINITY, f64::max) - values().fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max)
}
