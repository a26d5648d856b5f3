//! The facets of a mechanism: for each body its plates in one layer, that in which most hinges lie on
//! edges of both bodies.

use geo::orient::{Direction, Orient};
use geo::{Area, BooleanOps, BoundingRect, Coord, Intersects, LineString, Polygon};

use super::FoldError;
use lamc::laminate::{Joint, Mechanism, Sheet};

/// The overlap of two facets that is taken for rounding, as a share of the smaller one's area.
const ROUNDED: f64 = 1e-6;

/// A plate.
pub struct Facet {
    /// The index of its body.
    pub body: usize,
    /// Its outer boundary, counterclockwise, m, flat state.
    pub outline: Vec<[f64; 2]>,
    /// The boundaries of its holes, clockwise, m.
    pub holes: Vec<Vec<[f64; 2]>>,
    /// The height of its middle, m.
    pub height: f64,
}

/// Finds the facets.
///
/// # Errors
/// There are none, or two of them overlap.
pub fn facets(mechanism: &Mechanism, reach: f64) -> Result<Vec<Facet>, FoldError> {
    let mut layers: Vec<[f64; 2]> =
        mechanism.bodies.iter().flat_map(|body| &body.sheets).map(|sheet| sheet.z).collect();
    layers.sort_by(|a, b| a[0].total_cmp(&b[0]));
    layers.dedup();
    let bridged = |z: &[f64; 2]| {
        mechanism.joints.iter().filter(|joint| bridges(mechanism, joint, *z, reach)).count()
    };
    // Of equal layers the lowest.
    let best = layers.iter().rev().max_by_key(|z| bridged(z)).copied();
    let Some(best) = best else { return Err(FoldError::NoPlates) };
    let mut facets = Vec::new();
    for (body, source) in mechanism.bodies.iter().enumerate() {
        let of_layer = |z: [f64; 2]| source.sheets.iter().filter(move |sheet| sheet.z == z);
        let own = match of_layer(best).next() {
            Some(_) => Some(best),
            None => source.sheets.first().map(|sheet| sheet.z),
        };
        facets.extend(own.into_iter().flat_map(of_layer).map(|sheet| facet(body, sheet)));
    }
    refuse_overlaps(mechanism, &facets)?;
    Ok(facets)
}

/// Whether plates of both bodies of a joint have an edge on its line in a layer.
fn bridges(mechanism: &Mechanism, joint: &Joint, z: [f64; 2], reach: f64) -> bool {
    joint.bodies.iter().all(|body| {
        let sheets = mechanism.bodies[body.index()].sheets.iter().filter(|sheet| sheet.z == z);
        sheets.flat_map(|sheet| edges(&sheet.outline)).any(|edge| on_line(joint, edge, reach))
    })
}

/// The edges of a closed line.
pub fn edges(ring: &[[f64; 2]]) -> impl Iterator<Item = [[f64; 2]; 2]> {
    ring.iter().zip(ring.iter().cycle().skip(1)).map(|(a, b)| [*a, *b])
}

/// Whether an edge lies on a hinge line, at least for a part of its length.
pub fn on_line(joint: &Joint, edge: [[f64; 2]; 2], reach: f64) -> bool {
    let [a, b] = edge.map(|[x, y]| {
        let [dx, dy] = [x - joint.point.x, y - joint.point.y];
        let (along, aside) = (joint.direction.x, joint.direction.y);
        [dx * along + dy * aside, dy * along - dx * aside]
    });
    let part = a[0].max(b[0]).min(joint.length) - a[0].min(b[0]).max(0.0);
    a[1].abs() <= reach && b[1].abs() <= reach && part > 2.0 * reach
}

fn facet(body: usize, sheet: &Sheet) -> Facet {
    let polygon = polygon(&sheet.outline, &sheet.holes).orient(Direction::Default);
    let ring = |line: &LineString<f64>| {
        let mut ring: Vec<[f64; 2]> = line.coords().map(|c| [c.x, c.y]).collect();
        ring.pop();
        ring.dedup();
        ring
    };
    Facet {
        body,
        outline: ring(polygon.exterior()),
        holes: polygon.interiors().iter().map(ring).collect(),
        height: f64::midpoint(sheet.z[0], sheet.z[1]),
    }
}

fn polygon(outline: &[[f64; 2]], holes: &[Vec<[f64; 2]>]) -> Polygon<f64> {
    let line = |ring: &[[f64; 2]]| -> LineString<f64> {
        ring.iter().map(|&[x, y]| Coord { x, y }).collect()
    };
    Polygon::new(line(outline), holes.iter().map(|hole| line(hole)).collect())
}

fn refuse_overlaps(mechanism: &Mechanism, facets: &[Facet]) -> Result<(), FoldError> {
    let mut shapes: Vec<_> = facets
        .iter()
        .filter_map(|facet| {
            let shape = polygon(&facet.outline, &facet.holes);
            Some((facet.body, shape.bounding_rect()?, shape))
        })
        .collect();
    shapes.sort_by(|(_, a, _), (_, b, _)| a.min().x.total_cmp(&b.min().x));
    for (number, (body, bounds, shape)) in shapes.iter().enumerate() {
        let beside =
            shapes[number + 1..].iter().take_while(|(_, next, _)| next.min().x <= bounds.max().x);
        for (other, _, next) in beside.filter(|(_, next, _)| next.intersects(bounds)) {
            let smaller = shape.unsigned_area().min(next.unsigned_area());
            if shape.intersection(next).unsigned_area() > ROUNDED * smaller {
                let [a, b] = [body, other].map(|body| mechanism.bodies[*body].name.clone());
                return Err(FoldError::Overlap(a, b));
            }
        }
    }
    Ok(())
}
