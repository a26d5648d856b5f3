//! The outlines of facets as simple rings.
//!
//! The boundary of a facet passes twice through a vertex where a hole touches the outline, and twice along a
//! slit that ends within the facet. Plates have simple rings, so such a boundary is divided into
//! loops: a loop that encloses nothing is a slit, which has no width, and which bodies have besides their plates;
//! a clockwise loop is a hole.

use std::collections::HashMap;
use std::hash::Hash;

use geo::{Contains, Coord, Point, Polygon};
use lamc_drawings::{FacetId, Pattern, VertexId};

/// A closed line, counterclockwise, with its holes, clockwise.
pub(super) type Rings = (Vec<[f64; 2]>, Vec<Vec<[f64; 2]>>);

/// Returns the centroid and the area of a facet.
pub(super) fn centre(pattern: &Pattern, facet: FacetId) -> ([f64; 2], f64) {
    let facet = &pattern.facets[facet.index()];
    let origin = facet.outline.first().map_or([0.0; 2], |first| pattern.vertices[first.index()]);
    let (mut area, mut first) = (0.0, [0.0; 2]);
    for ring in std::iter::once(&facet.outline).chain(&facet.holes) {
        for (index, vertex) in ring.iter().enumerate() {
            let next = ring[(index + 1) % ring.len()];
            let [a, b] = [*vertex, next].map(|vertex| {
                let [x, y] = pattern.vertices[vertex.index()];
                [x - origin[0], y - origin[1]]
            });
            let cross = a[0] * b[1] - b[0] * a[1];
            area += cross / 2.0;
            first[0] += (a[0] + b[0]) * (cross / 6.0);
            first[1] += (a[1] + b[1]) * (cross / 6.0);
        }
    }
    let centre = [origin[0] + first[0] / area, origin[1] + first[1] / area];
    (if centre.iter().all(|x| x.is_finite()) { centre } else { origin }, area.abs())
}

/// Returns whether a point is within a facet.
pub(super) fn contains(pattern: &Pattern, facet: FacetId, [x, y]: [f64; 2]) -> bool {
    whole(pattern, facet).iter().any(|rings| polygon(rings).contains(&Point::new(x, y)))
}

/// Returns the plates of a whole facet.
pub(super) fn whole(pattern: &Pattern, facet: FacetId) -> Vec<Rings> {
    let loops = boundaries(pattern, facet).flat_map(|boundary| simple_loops(boundary, |it| *it));
    let at = |ring: Vec<VertexId>| ring.iter().map(|it| pattern.vertices[it.index()]).collect();
    plates(loops.map(at))
}

pub(super) fn boundaries(
    pattern: &Pattern,
    facet: FacetId,
) -> impl Iterator<Item = &Vec<VertexId>> {
    let facet = &pattern.facets[facet.index()];
    std::iter::once(&facet.outline).chain(&facet.holes)
}

/// Divides a boundary that passes more than once through a point into loops that do not. Ways there and
/// back, which are slits, vanish.
pub(super) fn simple_loops<T: Copy, K: Eq + Hash>(
    boundary: &[T],
    key: impl Fn(&T) -> K,
) -> Vec<Vec<T>> {
    let mut loops = Vec::new();
    let mut open: Vec<T> = Vec::new();
    let mut passed: HashMap<K, usize> = HashMap::new();
    for point in boundary {
        match passed.get(&key(point)) {
            Some(before) => {
                let before = *before;
                for gone in &open[before + 1..] {
                    passed.remove(&key(gone));
                }
                loops.push(open.split_off(before));
                open.push(*point);
            }
            None => {
                passed.insert(key(point), open.len());
                open.push(*point);
            }
        }
    }
    loops.push(open);
    loops.retain(|ring| ring.len() > 2);
    loops
}

/// Makes plates of outlines (counterclockwise) and holes (clockwise).
pub(super) fn plates(rings: impl Iterator<Item = Vec<[f64; 2]>>) -> Vec<Rings> {
    let (outlines, holes): (Vec<_>, Vec<_>) = rings.partition(|ring| twice_area(ring) > 0.0);
    let mut plates: Vec<Rings> =
        outlines.into_iter().map(|outline| (outline, Vec::new())).collect();
    for hole in holes.into_iter().filter(|ring| twice_area(ring) < 0.0) {
        // A point of a hole may be on the outline, but not all of them.
        let is_around = |(outline, _): &Rings| {
            let outline = polygon(&(outline.clone(), Vec::new()));
            hole.iter().any(|[x, y]| outline.contains(&Point::new(*x, *y)))
        };
        let around = match plates.len() {
            1 => Some(0),
            _ => plates.iter().position(is_around),
        };
        if let Some(around) = around {
            plates[around].1.push(hole);
        }
    }
    plates
}

fn twice_area(ring: &[[f64; 2]]) -> f64 {
    let Some([x, y]) = ring.first() else { return 0.0 };
    let from_first = |[px, py]: &[f64; 2]| [px - x, py - y];
    let pairs = ring.iter().zip(ring.iter().cycle().skip(1));
    pairs
        .map(|(a, b)| (from_first(a), from_first(b)))
        .map(|([ax, ay], [bx, by])| ax * by - bx * ay)
        .sum()
}

pub(super) fn polygon((outline, holes): &Rings) -> Polygon<f64> {
    let line = |ring: &Vec<[f64; 2]>| ring.iter().map(|[x, y]| Coord { x: *x, y: *y }).collect();
    Polygon::new(line(outline), holes.iter().map(line).collect())
}
