//! The pieces of a layer: the union of its plates, across hinges.

use geo::orient::{Direction, Orient};
use geo::{Coord, LineString, Polygon, unary_union};

use super::edges::{Group, Hinge, Joint, Plate, Track};
use super::{Line, MM, Piece, Pieces, Ring};
use lamc::source::{Body, Shape, SourceModel};

/// How far a strip across a gap reaches into the plates on both sides, as a share of the extent of the
/// layer: more than the rounding of the union, which has 2^30 steps, and less than any laser resolves.
const OVERLAP: f64 = 1e-7;
/// Digits that are kept of a coordinate: a billionth of a metre.
const STEPS_PER_MM: f64 = 1e6;

/// The plates of a layer, by the number of the layer from 0.
pub fn plates(model: &SourceModel, layer: usize) -> Vec<Plate> {
    let mut plates = Vec::new();
    for (index, body) in model.bodies.iter().enumerate() {
        let Shape::Plates(layers) = &body.shape else { continue };
        for plate in layers.get(layer).into_iter().flatten() {
            let holes = plate.holes.iter().map(|hole| ring(&hole.value)).collect();
            let polygon = Polygon::new(ring(&plate.outline.value), holes);
            plates.push(Plate {
                group: Group::of(model, index),
                polygon: polygon.orient(Direction::Default),
            });
        }
    }
    plates
}

/// The slits of the bodies that have plates in a layer, by the number of the layer from 0.
pub fn slits(model: &SourceModel, layer: usize) -> impl Iterator<Item = Line> {
    let has_plates = move |body: &&Body| match &body.shape {
        Shape::Plates(layers) => layers.get(layer).is_some_and(|plates| !plates.is_empty()),
        Shape::None | Shape::Rigid { .. } => false,
    };
    let slits = model.bodies.iter().filter(has_plates).flat_map(|body| &body.slits);
    slits.map(|slit| slit.map(|end| end.map(|x| x * MM)))
}

/// A closed line in millimetres, of points in metres.
fn ring(points: &[[f64; 2]]) -> LineString<f64> {
    points.iter().map(|&[x, y]| Coord { x: x * MM, y: y * MM }).collect()
}

/// Joins plates that touch, and fills the gaps at hinges.
pub fn join(plates: &[Plate], bridged: &[(&Joint, &Hinge)]) -> Pieces {
    let corners = plates.iter().flat_map(|plate| plate.polygon.exterior().coords());
    let overlap = OVERLAP * corners.fold(0.0_f64, |most, c| most.max(c.x.abs()).max(c.y.abs()));
    let mut parts: Vec<Polygon<f64>> = plates.iter().map(|plate| plate.polygon.clone()).collect();
    for (joint, hinge) in bridged {
        let Some(track) = Track::new(joint.line) else { continue };
        let half = hinge.offset + overlap;
        for &[from, to] in &hinge.shared {
            let corners = [[from, -half], [to, -half], [to, half], [from, half]];
            let corners = corners.map(|[along, left]| track.at(along, left));
            let strip: LineString<f64> = corners.iter().map(|&[x, y]| Coord { x, y }).collect();
            parts.push(Polygon::new(strip, Vec::new()).orient(Direction::Default));
        }
    }
    unary_union(&parts)
}

/// A piece with its coordinates rounded.
pub fn piece(polygon: Polygon<f64>) -> Piece {
    let polygon = polygon.orient(Direction::Default);
    let ring = |line: &LineString<f64>| -> Ring {
        let rounded = |x: f64| (x * STEPS_PER_MM).round() / STEPS_PER_MM;
        let mut ring: Ring = line.coords().map(|c| [rounded(c.x), rounded(c.y)]).collect();
        ring.dedup();
        if ring.len() > 1 && ring.first() == ring.last() {
            ring.pop();
        }
        ring
    };
    Piece {
        outline: ring(polygon.exterior()),
        holes: polygon.interiors().iter().map(ring).collect(),
    }
}
