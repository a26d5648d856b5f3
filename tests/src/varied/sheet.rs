//! Sheets: a grid of vertices, none of them where it should be, whose quadrilaterals are cut into triangles.
//! All edges inside are hinges, so that every vertex inside closes a spherical loop.

use super::{Drawing, Facet};
use crate::random::{Hinge, Random};

/// Columns and rows of quadrilaterals at most.
const MOST: [usize; 2] = [3, 2];

/// Length of an edge before vertices are moved, m, and the share by which they are.
const EDGE: f64 = 0.05;
const JITTER: f64 = 0.25;

/// A sheet; the first triangle is the ground.
pub fn triangulated(random: &mut Random) -> Drawing {
    let [drawn, rows] = MOST.map(|most| 1 + random.below(most));
    let columns = drawn.max(2);
    let vertices: Vec<[f64; 2]> = (0..(columns + 1) * (rows + 1))
        .map(|index| {
            let grid = [index % (columns + 1), index / (columns + 1)];
            grid.map(|place| EDGE * (place as f64 + random.range(-JITTER, JITTER)))
        })
        .collect();
    let mut triangles: Vec<[usize; 3]> = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let a = row * (columns + 1) + column;
            let (b, c) = (a + 1, a + columns + 1);
            let d = c + 1;
            match random.chance(0.5) {
                true => triangles.extend([[a, b, d], [a, d, c]]),
                false => triangles.extend([[a, b, c], [b, d, c]]),
            }
        }
    }
    let mut hinges = Vec::new();
    for (first, triangle) in triangles.iter().enumerate() {
        for (second, other) in triangles.iter().enumerate().skip(first + 1) {
            let shared: Vec<usize> =
                triangle.iter().copied().filter(|vertex| other.contains(vertex)).collect();
            if let [from, to] = shared[..] {
                let bodies = if random.chance(0.5) { [first, second] } else { [second, first] };
                hinges.push(Hinge { bodies, axis: [vertices[from], vertices[to]], z: 0.0 });
            }
        }
    }
    let facet = |triangle: &[usize; 3]| -> Facet { triangle.map(|vertex| vertices[vertex]) };
    let facets: Vec<Facet> = triangles.iter().map(facet).collect();
    Drawing { fixed: 1, bodies: facets.len(), hinges, facets }
}
