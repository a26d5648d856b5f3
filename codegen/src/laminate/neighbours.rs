//! Warnings about a drawing: plates of different bodies that overlap, and hinge lines far from the
//! plates they join.

use std::collections::BTreeMap;

use geo::{
    Area, BooleanOps, BoundingRect, Coord, Distance, Euclidean, Intersects, Length, Line, Polygon,
    Rect,
};

use super::outline::polygon;
use super::plate;
use crate::arithmetic::{exp2, hypot, log2};
use crate::source::codes;
use crate::source::{BodyId, Diagnostic, Diagnostics, Plate, Shape, SourceModel};

/// Depth of an overlap, relative to the diagonal of the smaller plate, below which it is rounding
/// of the drawing, such as that of a common edge in hundredths of a millimetre.
const SHALLOW: f64 = 2e-3;
/// Largest number of pairs of bodies that are reported.
const MOST_PAIRS: usize = 20;
/// Distance of a hinge line from the plates it joins, relative to the mechanism's size, above which
/// it is reported.
const FAR: f64 = 0.05;

/// Warns of plates of different bodies that overlap in one layer, and of hinge lines far from their
/// plates; all plates are valid. `size` is the mechanism's size, m.
pub fn check(model: &SourceModel, size: f64, found: &mut Diagnostics) {
    let drawing = Drawing::new(model, size);
    drawing.overlaps(found);
    drawing.far_hinges(found);
}

/// A plate of a body in a layer.
struct Piece<'m> {
    body: usize,
    layer: usize,
    plate: &'m Plate,
    polygon: Polygon<f64>,
    bounds: Rect<f64>,
    /// Heights of its lower and upper face, times the scale.
    z: [f64; 2],
}

struct Drawing<'m> {
    model: &'m SourceModel,
    /// Scale of lengths, a power of two.
    scale: f64,
    /// The mechanism's size times the scale.
    far: f64,
    pieces: Vec<Piece<'m>>,
}

/// Overlap of two bodies in a layer.
struct Overlap<'m> {
    layer: usize,
    /// Area, m^2, times the scale squared.
    area: f64,
    plates: [&'m Plate; 2],
}

impl<'m> Drawing<'m> {
    fn new(model: &'m SourceModel, size: f64) -> Self {
        let scale = exp2(-log2(size).floor());
        let mut pieces = Vec::new();
        for (body, source) in model.bodies.iter().enumerate() {
            let Shape::Plates(layers) = &source.shape else { continue };
            for ((layer, plates), sheet) in layers.iter().enumerate().zip(plate::stack(model)) {
                let z = [sheet.bottom, sheet.bottom + sheet.thickness].map(|z| z * scale);
                for plate in plates {
                    let polygon = polygon(plate, scale);
                    let Some(bounds) = polygon.bounding_rect() else { continue };
                    pieces.push(Piece { body, layer, plate, polygon, bounds, z });
                }
            }
        }
        Self { model, scale, far: FAR * size * scale, pieces }
    }

    /// Reports overlaps. Only neighbours along x are compared; fixed bodies count as one body.
    fn overlaps(&self, found: &mut Diagnostics) {
        let mut sorted: Vec<&Piece> = self.pieces.iter().collect();
        sorted.sort_by(|a, b| a.bounds.min().x.total_cmp(&b.bounds.min().x));
        let fixed = |piece: &Piece| self.model.bodies[piece.body].fixed;
        let mut pairs: BTreeMap<[usize; 2], Overlap> = BTreeMap::new();
        let mut more = false;
        for (index, one) in sorted.iter().enumerate() {
            let reached = |other: &&&Piece| other.bounds.min().x < one.bounds.max().x;
            for other in sorted[index + 1..].iter().take_while(reached) {
                let apart = one.layer != other.layer || one.body == other.body;
                if apart || (fixed(one) && fixed(other)) || !one.bounds.intersects(&other.bounds) {
                    continue;
                }
                let [first, second] =
                    if one.body < other.body { [one, other] } else { [other, one] };
                let pair = [first.body, second.body];
                let known = pairs.get(&pair).map(|overlap| overlap.layer);
                if known.is_some_and(|layer| layer != one.layer) {
                    continue;
                }
                if known.is_none() && pairs.len() == MOST_PAIRS {
                    more = true;
                    continue;
                }
                let Some(area) = shared(first, second) else { continue };
                let plates = [first.plate, second.plate];
                let overlap = Overlap { layer: one.layer, area: 0.0, plates };
                pairs.entry(pair).or_insert(overlap).area += area;
            }
        }
        let last = pairs.len().saturating_sub(1);
        for (index, (pair, overlap)) in pairs.into_iter().enumerate() {
            let [first, second] = pair.map(|body| &self.model.bodies[body].name.value);
            let Overlap { layer, area, plates: [one, other] } = overlap;
            let square = area / (self.scale * self.scale) * 1e6;
            let layer = layer + 1;
            let message = format!(
                "`{first}` and `{second}` overlap by {square:.4} mm^2 in layer {layer}, counted \
                 from the bottom"
            );
            let mut hint = "the material of a sheet can belong to one body only: cut one of the \
                            plates back"
                .to_owned();
            if more && index == last {
                hint.push_str("; there may be more such pairs");
            }
            found.push(
                Diagnostic::warning(codes::OVERLAPPING_BODIES, other.outline.span, message)
                    .label(format!("overlaps `{first}`"))
                    .also(one.outline.span, format!("`{first}`"))
                    .hint(hint),
            );
        }
    }

    /// A fixed body without outline may be anywhere; the position of a moving body without outline
    /// is not known.
    fn far_hinges(&self, found: &mut Diagnostics) {
        let mut of_body: Vec<Vec<&Piece>> = vec![Vec::new(); self.model.bodies.len()];
        self.pieces.iter().for_each(|piece| of_body[piece.body].push(piece));
        for joint in &self.model.joints {
            let ids = joint.bodies.each_ref().map(|body| body.value);
            let drawn = |id: &BodyId| !of_body[id.index()].is_empty();
            let unknown = |id: &BodyId| !drawn(id) && !self.model.bodies[id.index()].fixed;
            if !ids.iter().any(drawn) || ids.iter().any(unknown) {
                continue;
            }
            let [from, to] =
                joint.axis.value.map(|[x, y]| Coord { x: x * self.scale, y: y * self.scale });
            let line = Line::new(from, to);
            let height = joint.z.value * self.scale;
            let away = |piece: &&Piece| {
                let [bottom, top] = piece.z;
                let above = (height - top).max(bottom - height).max(0.0);
                hypot(Euclidean.distance(&line, &piece.polygon), above)
            };
            let distance =
                |id: &BodyId| of_body[id.index()].iter().map(away).fold(f64::INFINITY, f64::min);
            let distances: Vec<(BodyId, f64)> =
                ids.into_iter().filter(drawn).map(|id| (id, distance(&id))).collect();
            if distances.iter().any(|(_, distance)| *distance <= self.far) {
                continue;
            }
            let each = distances.iter().map(|(id, distance)| {
                let name = &self.model.bodies[id.index()].name.value;
                format!("{:.4} mm from `{name}`", distance / self.scale * 1e3)
            });
            let places = each.collect::<Vec<_>>().join(" and ");
            let name = &joint.name.value;
            found.push(
                Diagnostic::warning(
                    codes::FAR_HINGE,
                    joint.axis.span,
                    format!("the hinge line of `{name}` is {places}"),
                )
                .label("far from the plates it joins")
                .hint("are the points of its `axis` and its height `z` right, and their units?"),
            );
        }
    }
}

/// Returns the common area of two plates, if it is more than the rounding of a drawing.
fn shared(one: &Piece, other: &Piece) -> Option<f64> {
    let common = one.polygon.intersection(&other.polygon);
    let area = common.unsigned_area();
    let rings =
        common.iter().flat_map(|part| std::iter::once(part.exterior()).chain(part.interiors()));
    let around: f64 = rings.map(|ring| Euclidean.length(ring)).sum();
    let diagonal = |piece: &Piece| hypot(piece.bounds.width(), piece.bounds.height());
    // For a strip, the area divided by half the circumference is the width.
    (2.0 * area > SHALLOW * diagonal(one).min(diagonal(other)) * around).then_some(area)
}
