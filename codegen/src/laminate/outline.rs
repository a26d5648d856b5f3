//! Validity of plates: simple outlines, holes inside them, no overlapping plates.

use geo::algorithm::validation::{InvalidPolygon, RingRole};
use geo::{
    Area, BooleanOps, BoundingRect, ConvexHull, Coord, Intersects, LineString, Polygon, Validation,
    unary_union,
};

use crate::arithmetic::{exp2, hypot, log2};
use crate::source::codes::{self, Code};
use crate::source::{Diagnostic, Diagnostics, Drawn, Plate, Span};

/// Areas below this fraction of the plate's area are rounding errors.
const NEGLIGIBLE: f64 = 1e-9;

/// Returns the area that valid plates of all layers cover together, as plates that do not overlap.
pub fn silhouette(layers: &[Vec<Plate>]) -> Vec<Plate> {
    let scale = layers.iter().map(|plates| scale(plates)).fold(f64::INFINITY, f64::min);
    let polygons: Vec<_> = layers.iter().flatten().map(|plate| polygon(plate, scale)).collect();
    let bare = |ring: &LineString<f64>| {
        let value = ring.coords().map(|c| [c.x / scale, c.y / scale]).collect();
        Drawn { value, ..Drawn::default() }
    };
    let plate = |polygon: &Polygon<f64>| Plate {
        outline: bare(polygon.exterior()),
        holes: polygon.interiors().iter().map(bare).collect(),
    };
    unary_union(&polygons).iter().map(plate).collect()
}

/// Largest number of overlaps in a layer of a body that are reported: to find all of a thousand plates takes minutes.
const MOST_OVERLAPS: usize = 20;

/// Checks the plates of one layer of one body.
pub fn check(plates: &[Plate], found: &mut Diagnostics) {
    let scale = scale(plates);
    let mut sound = Vec::new();
    for plate in plates {
        let polygon = polygon(plate, scale);
        if let Some(error) = degenerate_ring(plate, &polygon) {
            found.push(error);
            continue;
        }
        let errors = invalidities(plate, &polygon);
        if errors.is_empty() {
            sound.push((plate, polygon));
        }
        for error in errors {
            found.push(error);
        }
    }
    let mut reported = 0;
    for (i, (plate, polygon)) in sound.iter().enumerate() {
        for (other, neighbour) in &sound[..i] {
            if reported == MOST_OVERLAPS {
                return;
            }
            if let Some(area) = overlap(polygon, neighbour) {
                reported += 1;
                let area = area / (scale * scale) * 1e6;
                let line = "the overlapping area counts twice in the mass";
                found.push(
                    Diagnostic::warning(
                        codes::OVERLAPPING_PLATES,
                        plate.outline.span,
                        format!("two plates of one layer overlap by {area:.4} mm^2: {line}"),
                    )
                    .label(if other.outline.span == plate.outline.span {
                        "overlaps its neighbour"
                    } else {
                        "overlaps an earlier plate"
                    })
                    .hint("cut one of them back, or draw both as one outline"),
                );
            }
        }
    }
}

/// Returns a power of two that scales coordinates to about 1. It causes no rounding, and predicates
/// with products of coordinates neither overflow nor underflow.
fn scale(plates: &[Plate]) -> f64 {
    let vertices = plates.iter().flat_map(|plate| &plate.outline.value).flatten();
    let largest = vertices.fold(0.0_f64, |largest, x| largest.max(x.abs()));
    if largest > 0.0 && largest.is_finite() {
        exp2((-log2(largest).floor()).clamp(-1000.0, 1000.0))
    } else {
        1.0
    }
}

/// A plate, its lengths multiplied by `scale`.
pub fn polygon(plate: &Plate, scale: f64) -> Polygon<f64> {
    let holes = plate.holes.iter().map(|hole| ring(&hole.value, scale)).collect();
    Polygon::new(ring(&plate.outline.value, scale), holes)
}

fn ring(vertices: &[[f64; 2]], scale: f64) -> LineString<f64> {
    vertices.iter().map(|[x, y]| Coord { x: x * scale, y: y * scale }).collect()
}

/// Reports an outline or hole that encloses no area or passes twice through a point, because later
/// checks cannot handle it.
fn degenerate_ring(plate: &Plate, polygon: &Polygon<f64>) -> Option<Diagnostic> {
    let lines = std::iter::once(&plate.outline).chain(&plate.holes);
    let rings = std::iter::once(polygon.exterior()).chain(polygon.interiors());
    for (line, ring) in lines.zip(rings) {
        if !ring.0.iter().all(|c| c.x.is_finite() && c.y.is_finite()) {
            return Some(at(line, codes::NOT_FINITE, "a vertex is not a finite number"));
        }
        let extent = ring.bounding_rect().map_or(0.0, |r| hypot(r.width(), r.height()));
        // The convex hull is used, because the two halves of a figure eight would cancel.
        if ring.convex_hull().unsigned_area() <= 1e-14 * extent * extent {
            return Some(
                at(line, codes::ZERO_AREA, "the outline encloses no area")
                    .hint("give at least three vertices that are not on one line"),
            );
        }
        let mut vertices = line.value.clone();
        vertices.sort_by(|a, b| a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1])));
        if let Some(pair) = vertices.windows(2).find(|pair| pair[0] == pair[1]) {
            let [x, y] = pair[0].map(|x| x * 1e3);
            let message = format!("the outline passes twice through ({x} mm, {y} mm)");
            return Some(
                at(line, codes::SELF_CROSSING_OUTLINE, &message)
                    .hint("the vertices must go once around; draw parts that touch as two plates"),
            );
        }
    }
    None
}

/// Translates the validation errors of `geo` into diagnostics.
fn invalidities(plate: &Plate, polygon: &Polygon<f64>) -> Vec<Diagnostic> {
    let line = |role: RingRole| match role {
        RingRole::Exterior => &plate.outline,
        RingRole::Interior(hole) => &plate.holes[hole],
    };
    let mut errors = Vec::new();
    for error in polygon.validation_errors() {
        errors.push(match error {
            InvalidPolygon::SelfIntersection(role) => {
                let hint = "the vertices must go once around, in order; look for two that are \
                            swapped";
                match role {
                    RingRole::Exterior => {
                        at(line(role), codes::SELF_CROSSING_OUTLINE, "the outline crosses itself")
                    }
                    RingRole::Interior(_) => at(
                        line(role),
                        codes::SELF_CROSSING_HOLE,
                        "the hole's outline crosses itself",
                    ),
                }
                .hint(hint)
            }
            InvalidPolygon::InteriorRingNotContainedInExteriorRing(role) => {
                at(line(role), codes::HOLE_OUTSIDE, "the hole is not within the outline")
                    .hint("a cut-out at the edge belongs to the outline itself")
            }
            InvalidPolygon::IntersectingRingsOnAnArea(_, role) => {
                at(line(role), codes::OVERLAPPING_HOLES, "the hole overlaps another one")
                    .hint("draw both as one hole: the common area would be subtracted twice")
            }
            InvalidPolygon::TooFewPointsInRing(role) => {
                at(line(role), codes::SHORT_OUTLINE, "an outline needs at least three vertices")
            }
            InvalidPolygon::NonFiniteCoord(role, _) => {
                at(line(role), codes::NOT_FINITE, "a vertex is not a finite number")
            }
            // A hole that touches an edge is allowed: it removes its area like any other hole.
            InvalidPolygon::IntersectingRingsOnALine(..) => continue,
        });
    }
    // One mistake may violate several rules; the first error is enough.
    errors.dedup_by_key(|error: &mut Diagnostic| error.span);
    errors
}

fn at(line: &Drawn<Vec<[f64; 2]>>, code: Code, message: &str) -> Diagnostic {
    let span: Span = line.span;
    Diagnostic::error(code, span, message)
}

/// Returns the common area of two valid plates, if it is more than rounding.
fn overlap(a: &Polygon<f64>, b: &Polygon<f64>) -> Option<f64> {
    let (Some(box_a), Some(box_b)) = (a.bounding_rect(), b.bounding_rect()) else { return None };
    if !box_a.intersects(&box_b) {
        return None;
    }
    let area = a.intersection(b).unsigned_area();
    (area > NEGLIGIBLE * a.unsigned_area().min(b.unsigned_area())).then_some(area)
}
