//! Builds the pattern from the regions of the sheet, and checks its facets.

use super::limits::Tolerance;
use super::regions::origin;
use super::report::{Report, Sites, number};
use super::sheet::Sheet;
use super::{Edge, Facet, FacetId, Pattern, VertexId};
use crate::drawing::{Drawing, Place};
use crate::fault::Cause;

/// Builds the pattern of a sheet.
pub(super) fn pattern(sheet: &Sheet) -> Pattern {
    let Sheet { network, regions, is_sheet } = sheet;
    let mut pattern = Pattern::default();
    let mut vertex_of: Vec<Option<VertexId>> = vec![None; network.points.len()];
    let mut used = vec![false; network.points.len()];
    for end in network.lines.iter().flat_map(|line| line.ends) {
        used[end] = true;
    }
    for (point, &at) in network.points.iter().enumerate().filter(|(point, _)| used[*point]) {
        vertex_of[point] = Some(VertexId(pattern.vertices.len()));
        pattern.vertices.push(at);
    }
    let vertex = |point: usize| vertex_of[point].expect("the end of a line is used");
    let mut facet_of: Vec<Option<FacetId>> = vec![None; regions.loops.len()];
    for (region, loops) in regions.loops.iter().enumerate().filter(|(region, _)| is_sheet[*region])
    {
        let mut boundaries = loops.iter().map(|half_edges| {
            half_edges.iter().map(|&half_edge| vertex(origin(network, half_edge))).collect()
        });
        if let Some(outline) = boundaries.next() {
            facet_of[region] = Some(FacetId(pattern.facets.len()));
            pattern.facets.push(Facet { outline, holes: boundaries.collect() });
        }
    }
    pattern.edges = network
        .lines
        .iter()
        .enumerate()
        .map(|(index, line)| Edge {
            vertices: line.ends.map(vertex),
            role: line.role,
            fold: line.fold,
            angle: line.angle,
            facets: regions.beside(index).map(|region| facet_of[region]),
            place: line.place,
        })
        .collect();
    pattern
}

/// Returns the area inside a boundary, positive if it runs counterclockwise.
pub(super) fn area(pattern: &Pattern, boundary: &[VertexId]) -> f64 {
    let Some(&first) = boundary.first() else { return 0.0 };
    // From the first vertex: far from the origin, products of coordinates lose digits.
    let [x, y] = pattern.vertices[first.index()];
    let points: Vec<[f64; 2]> =
        pattern.coordinates(boundary).map(|[a, b]| [a - x, b - y]).collect();
    let twice: f64 =
        points.windows(2).map(|pair| pair[0][0] * pair[1][1] - pair[1][0] * pair[0][1]).sum();
    0.5 * twice
}

/// Reports facets that are thinner than the tolerance. A long facet of width w has the area w L and the
/// perimeter 2 L.
pub(super) fn report_thin(pattern: &Pattern, tolerance: Tolerance, report: &mut Report) {
    let mut place_of: Vec<Place> = vec![Place::default(); pattern.facets.len()];
    for edge in &pattern.edges {
        for facet in edge.facets.into_iter().flatten() {
            place_of[facet.index()] = edge.place;
        }
    }
    let mut sites = Sites::default();
    for (facet, &place) in pattern.facets.iter().zip(&place_of) {
        let perimeter: f64 = std::iter::once(&facet.outline)
            .chain(&facet.holes)
            .map(|boundary| perimeter(pattern, boundary))
            .sum();
        if 2.0 * pattern.area(facet) < tolerance.distance * perimeter {
            let count = facet.outline.len() as f64;
            let middle = |axis: usize| {
                pattern.coordinates(&facet.outline).map(|point| point[axis]).sum::<f64>() / count
            };
            sites.note([middle(0), middle(1)], place);
        }
    }
    report.doubt(
        Cause::Thin,
        sites,
        "lines that should lie on each other may be farther apart than the tolerance",
        |sites| {
            let (count, width) = (sites.count("facet"), number(tolerance.distance));
            format!("{count} thinner than the tolerance of {width}")
        },
    );
}

fn perimeter(pattern: &Pattern, boundary: &[VertexId]) -> f64 {
    let points: Vec<[f64; 2]> = pattern.coordinates(boundary).collect();
    (0..points.len())
        .map(|index| {
            let ([x, y], [u, v]) = (points[index], points[(index + 1) % points.len()]);
            (u - x).hypot(v - y)
        })
        .sum()
}

/// Compares the facets with those that the file lists.
pub(super) fn compare(
    pattern: &Pattern,
    drawing: &Drawing,
    tolerance: Tolerance,
    report: &mut Report,
) {
    let Some(first) = drawing.strokes.first().filter(|_| !drawing.areas.is_empty()) else { return };
    let mut listed = drawing.areas.clone();
    let mut found: Vec<(f64, f64)> = pattern
        .facets
        .iter()
        .map(|facet| (pattern.area(facet), perimeter(pattern, &facet.outline)))
        .collect();
    listed.sort_by(f64::total_cmp);
    found.sort_by(|a, b| a.0.total_cmp(&b.0));
    let differs = |(listed, (found, perimeter)): (&f64, &(f64, f64))| {
        (listed - found).abs() > perimeter * tolerance.distance
    };
    let mut sites = Sites::default();
    if listed.len() != found.len() || listed.iter().zip(&found).any(differs) {
        sites.note(first.ends[0], first.place);
    }
    report.doubt(
        Cause::Contradiction,
        sites,
        "`faces_vertices` should list the facets that the edges enclose; the edges count",
        |_| {
            let (listed, found) = (listed.len(), found.len());
            if listed == found {
                format!("the {listed} facets that the file lists have other areas than those of its edges")
            } else {
                format!("the file lists {listed} facets, and its edges enclose {found}")
            }
        },
    );
}
