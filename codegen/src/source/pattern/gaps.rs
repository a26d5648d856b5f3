//! Plates less half the width of a gap along the creases around them.
//!
//! Each side of a convex facet that is a crease moves inwards by half the width, and its neighbours are shortened
//! or lengthened to meet it: the plate is the intersection of half-planes. If a side would vanish, and for
//! facets with holes or reflex corners, the strip along the creases is subtracted from the polygon.

use geo::algorithm::buffer::{BufferStyle, LineCap, LineJoin};
use geo::{Area, BooleanOps, Buffer, Euclidean, Length, LineString, MultiLineString, Polygon};
use lamc_drawings::{FacetId, Pattern, VertexId};

use super::outlines::{self, Rings};
use crate::arithmetic::{hypot, log10, powi};

/// Width of the slivers that rounding leaves, relative to half the width of the gap.
const SLIVER: f64 = 1e-3;
/// Decimal digits to which half the width of the gap is exact where polygons are subtracted, which rounds.
const DIGITS: f64 = 4.0;
/// Sine of the angle between sides that are on one line but for rounding errors.
const STRAIGHT: f64 = 1e-9;

/// Returns the plates of a facet less `half` the width of a gap along its creases; None if none of its sides is
/// a crease.
pub(super) fn cut_back(
    pattern: &Pattern,
    facet: FacetId,
    whole: &[Rings],
    is_crease: impl Fn([VertexId; 2]) -> bool,
    half: f64,
) -> Option<Vec<Rings>> {
    let outline = &pattern.facets[facet.index()].outline;
    let sides: Vec<bool> = (0..outline.len()).map(|side| is_crease(ends(outline, side))).collect();
    let lines = creases(pattern, facet, &is_crease);
    if lines.is_empty() {
        return None;
    }
    let simple = match whole {
        [(ring, holes)] if holes.is_empty() && ring.len() == outline.len() => {
            let points: Vec<[f64; 2]> =
                outline.iter().map(|vertex| pattern.vertices[vertex.index()]).collect();
            moved(&points, &sides, half)
        }
        _ => None,
    };
    let plate = |ring| vec![(ring, Vec::new())];
    Some(simple.map_or_else(|| subtracted(whole, lines, half), plate))
}

/// The ends of a side of a closed line.
fn ends<T: Copy>(ring: &[T], side: usize) -> [T; 2] {
    [ring[side % ring.len()], ring[(side + 1) % ring.len()]]
}

/// A side after it was moved: a unit vector along it, and its distance to the left of the origin.
#[derive(Clone, Copy)]
struct Side {
    direction: [f64; 2],
    offset: f64,
}

/// Moves sides of a convex ring inwards; None if it is not convex, or if a side would vanish.
fn moved(ring: &[[f64; 2]], is_crease: &[bool], half: f64) -> Option<Vec<[f64; 2]>> {
    let origin = ring[0];
    let ring: Vec<[f64; 2]> = ring.iter().map(|[x, y]| [x - origin[0], y - origin[1]]).collect();
    let side = |index: usize| {
        let [[ax, ay], [bx, by]] = ends(&ring, index);
        let length = hypot(bx - ax, by - ay);
        let [dx, dy] = [(bx - ax) / length, (by - ay) / length];
        let inwards = if is_crease[index] { half } else { 0.0 };
        Side { direction: [dx, dy], offset: dx * ay - dy * ax + inwards }
    };
    let sides: Vec<Side> = (0..ring.len()).map(side).collect();
    let corner = |index: usize| {
        corner(ring[index], sides[(index + ring.len() - 1) % ring.len()], sides[index])
    };
    let corners: Vec<[[f64; 2]; 2]> = (0..ring.len()).map(corner).collect::<Option<_>>()?;
    let keeps_its_way = |(index, Side { direction: [dx, dy], .. }): (usize, &Side)| {
        let [[_, from], [to, _]] = ends(&corners, index);
        (to[0] - from[0]) * dx + (to[1] - from[1]) * dy > SLIVER * half
    };
    if !sides.iter().enumerate().all(keeps_its_way) {
        return None;
    }
    // Where the line goes straight on, both points are one but for rounding errors.
    let is_one = |[[ax, ay], [bx, by]]: &[[f64; 2]; 2]| hypot(bx - ax, by - ay) <= SLIVER * half;
    let points: Vec<[f64; 2]> = corners
        .iter()
        .flat_map(|pair| if is_one(pair) { &pair[..1] } else { &pair[..] })
        .copied()
        .collect();
    Some(points.iter().map(|[x, y]| [x + origin[0], y + origin[1]]).collect())
}

/// Returns where the side before a corner ends and where that after it begins; None at a reflex corner.
fn corner([x, y]: [f64; 2], before: Side, after: Side) -> Option<[[f64; 2]; 2]> {
    let [[ax, ay], [bx, by]] = [before.direction, after.direction];
    let turn = ax * by - ay * bx;
    if turn > STRAIGHT {
        let meeting = |a: f64, b: f64| (before.offset * b - after.offset * a) / turn;
        return Some([[meeting(ax, bx), meeting(ay, by)]; 2]);
    }
    if turn < -STRAIGHT || ax * bx + ay * by < 0.0 {
        return None;
    }
    // The line goes straight on; a part of it may be a crease.
    Some([before, after].map(|Side { direction: [dx, dy], offset }| {
        let along = x * dx + y * dy;
        [along * dx - offset * dy, along * dy + offset * dx]
    }))
}

/// Returns plates less the strips along these lines.
fn subtracted(whole: &[Rings], lines: Vec<Vec<[f64; 2]>>, half: f64) -> Vec<Rings> {
    let lines = MultiLineString::new(lines.into_iter().map(LineString::from).collect());
    // The strip passes the end of a crease, so that no corner of the plate stays beside it.
    let style = BufferStyle::new(half).line_cap(LineCap::Square).line_join(LineJoin::Bevel);
    let gap = lines.buffer_with_style(style);
    let left = whole.iter().flat_map(|rings| outlines::polygon(rings).difference(&gap).0);
    // For a strip, the area divided by half the circumference is the width.
    let is_plate = |part: &Polygon<f64>| {
        2.0 * part.unsigned_area() > SLIVER * half * Euclidean.length(part.exterior())
    };
    let steps = powi(10.0, (DIGITS - log10(half).floor()) as i32);
    let rings = left.filter(is_plate).flat_map(|part| {
        let (outline, holes) = part.into_inner();
        std::iter::once(outline).chain(holes)
    });
    outlines::plates(rings.flat_map(|ring| {
        let rounded = |value: f64| (value * steps).round() / steps;
        // The last point repeats the first, and rounding may make neighbours equal.
        let mut points: Vec<[f64; 2]> =
            ring.coords().skip(1).map(|c| [rounded(c.x), rounded(c.y)]).collect();
        points.dedup();
        outlines::simple_loops(&points, |point| point.map(f64::to_bits))
    }))
}

/// Returns the creases around a facet as connected lines.
fn creases(
    pattern: &Pattern,
    facet: FacetId,
    is_crease: impl Fn([VertexId; 2]) -> bool,
) -> Vec<Vec<[f64; 2]>> {
    let at = |vertex: VertexId| pattern.vertices[vertex.index()];
    let mut chains = Vec::new();
    for boundary in outlines::boundaries(pattern, facet) {
        let count = boundary.len();
        // Begins after a side that is no crease. If all are, the first corner is passed twice, as all
        // others are passed by a connected line.
        let start = (0..count).find(|side| !is_crease(ends(boundary, *side)));
        let sides = match start {
            Some(start) => start + 1..start + 1 + count,
            None => 0..count + 1,
        };
        let mut chain: Vec<[f64; 2]> = Vec::new();
        for [from, to] in sides.map(|side| ends(boundary, side)) {
            if !is_crease([from, to]) {
                chains.extend((!chain.is_empty()).then(|| std::mem::take(&mut chain)));
                continue;
            }
            if chain.is_empty() {
                chain.push(at(from));
            }
            chain.push(at(to));
        }
        chains.extend((!chain.is_empty()).then_some(chain));
    }
    chains
}
