//! Plates: what makes an outline with holes a piece of sheet.

use geo::{Area, BooleanOps, ConvexHull, Coord, LineString, Polygon, Validation};

use super::moments::AreaMoments;
use crate::source::{Diagnostic, Diagnostics, Plate, Spanned};

/// Overlap of two plates of one layer, relative to the smaller, that is more than rounding.
const OVERLAP: f64 = 1e-6;

/// The moments of a plate about `origin`; what is wrong with it is reported.
pub fn moments(plate: &Plate, origin: [f64; 2], problems: &mut Diagnostics) -> AreaMoments {
    let outline_is_simple = check_simple(&plate.outline, "outline", problems);
    let mut holes_are_simple = true;
    for hole in &plate.holes {
        holes_are_simple &= check_simple(hole, "hole", problems);
    }
    if outline_is_simple && holes_are_simple {
        check_holes(plate, problems);
    }
    let outline = AreaMoments::of(&plate.outline.value, origin);
    plate
        .holes
        .iter()
        .fold(outline, |sum, hole| sum.plus(AreaMoments::of(&hole.value, origin).scaled(-1.0)))
}

/// Reports plates of one layer that lie on each other: their mass would count twice.
pub fn check_overlaps(plates: &[Plate], warnings: &mut Diagnostics) {
    let polygons: Vec<_> = plates.iter().map(polygon).collect();
    for (index, (plate, one)) in plates.iter().zip(&polygons).enumerate() {
        for other in &polygons[..index] {
            let smaller = one.unsigned_area().min(other.unsigned_area());
            let shared = one.intersection(other).unsigned_area();
            if shared > OVERLAP * smaller {
                let share = 100.0 * shared / smaller;
                let message = format!("plates of one layer overlap by {share:.1} % of the smaller");
                let warning =
                    Diagnostic::warning("overlapping-plates", plate.outline.span, message)
                        .hint("the overlap counts twice in the body's mass");
                warnings.push(warning);
            }
        }
    }
}

/// Whether a ring neither crosses nor touches itself and has an area.
fn check_simple(ring: &Spanned<Vec<[f64; 2]>>, what: &str, problems: &mut Diagnostics) -> bool {
    let polygon = Polygon::new(line_string(&ring.value), Vec::new());
    let extent = ring.value.iter().flatten().fold(0.0_f64, |most, x| most.max(x.abs()));
    if polygon.convex_hull().unsigned_area() <= f64::EPSILON * extent * extent {
        let problem = Diagnostic::error("no-area", ring.span, format!("this {what} has no area"))
            .hint("its vertices lie on one line");
        problems.push(problem);
        return false;
    }
    if polygon.is_valid() {
        return true;
    }
    let problem =
        Diagnostic::error("self-crossing", ring.span, format!("this {what} crosses itself"))
            .hint("list the vertices in order around the edge, each once");
    problems.push(problem);
    false
}

/// Whether every hole lies inside the outline and none on another.
fn check_holes(plate: &Plate, problems: &mut Diagnostics) {
    let solid = |ring: &[[f64; 2]]| Polygon::new(line_string(ring), Vec::new());
    let outline = solid(&plate.outline.value);
    for (index, hole) in plate.holes.iter().enumerate() {
        let area = solid(&hole.value).unsigned_area();
        let inside = outline.intersection(&solid(&hole.value)).unsigned_area();
        if inside < area * (1.0 - OVERLAP) {
            let problem =
                Diagnostic::error("hole-outside", hole.span, "this hole is not inside the outline")
                    .also(plate.outline.span, "the outline");
            problems.push(problem);
        }
        for other in &plate.holes[..index] {
            let shared = solid(&hole.value).intersection(&solid(&other.value)).unsigned_area();
            if shared > area * OVERLAP {
                let problem =
                    Diagnostic::error("overlapping-holes", hole.span, "this hole overlaps another")
                        .also(other.span, "this one")
                        .hint("make one hole of the two");
                problems.push(problem);
            }
        }
    }
}

fn polygon(plate: &Plate) -> Polygon {
    let holes = plate.holes.iter().map(|hole| line_string(&hole.value)).collect();
    Polygon::new(line_string(&plate.outline.value), holes)
}

fn line_string(ring: &[[f64; 2]]) -> LineString {
    ring.iter().map(|&[x, y]| Coord { x, y }).collect()
}
