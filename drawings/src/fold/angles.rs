//! The angles at the edges of a folded state.

use std::collections::HashMap;

use super::graph::{Assignment, Edge, Graph, pairs};
use crate::drawing::Role;

/// A point of space.
type Point = [f64; 3];

/// From this angle on, rad, both facets lie on each other in a file of few digits, and the side from
/// which they do is that of the assignment.
const CLOSED: f64 = std::f64::consts::PI - 1e-3;

/// Returns the angle at each edge, rad, positive for a valley: None where it has no two faces.
///
/// With the unit normals l and r of the faces to the left and to the right of the edge, which runs
/// along e, it is atan2((r x l) e, l r).
pub(super) fn angles(state: &Graph, edges: &[Edge], faces: &[Vec<usize>]) -> Vec<Option<f64>> {
    let mut left = HashMap::new();
    for (index, face) in faces.iter().enumerate() {
        for pair in pairs(face) {
            left.insert(pair, index);
        }
    }
    let normals: Vec<Point> = faces.iter().map(|face| normal(&state.vertices, face)).collect();
    let angle = |edge: &Edge| {
        let [a, b] = edge.vertices;
        let [left, right] = [[a, b], [b, a]].map(|pair| left.get(&pair).map(|&face| normals[face]));
        let (left, right) = left.zip(right)?;
        let along = unit(minus(state.vertices[b], state.vertices[a]));
        let angle = dot(cross(right, left), along).atan2(dot(left, right));
        let angle = match edge.assignment {
            Assignment::Is(Role::Mountain) if angle.abs() > CLOSED => -angle.abs(),
            Assignment::Is(Role::Valley) if angle.abs() > CLOSED => angle.abs(),
            _ => angle,
        };
        angle.is_finite().then_some(angle)
    };
    edges.iter().map(angle).collect()
}

/// Returns the unit normal of a polygon (M. Newell's method): not finite if it has no area.
pub(super) fn normal(vertices: &[Point], face: &[usize]) -> Point {
    let Some(&first) = face.first() else { return [f64::NAN; 3] };
    let from = |vertex: usize| minus(vertices[vertex], vertices[first]);
    let sum = pairs(face).fold([0.0; 3], |sum, [a, b]| plus(sum, cross(from(a), from(b))));
    unit(sum)
}

pub(super) fn plus(a: Point, b: Point) -> Point {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

pub(super) fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(super) fn dot(a: Point, b: Point) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(super) fn cross(a: Point, b: Point) -> Point {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

pub(super) fn unit(a: Point) -> Point {
    let length = dot(a, a).sqrt();
    a.map(|value| value / length)
}
