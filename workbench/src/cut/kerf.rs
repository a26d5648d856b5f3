//! The kerf: outlines grow by half of it and holes shrink by half of it, so that what remains has the
//! drawn size.

use geo::algorithm::buffer::{Buffer, BufferStyle, LineJoin};
use geo::{BoundingRect, Centroid, LineString, Polygon};

use super::{CutError, Pieces};

/// Corners sharper than this, rad, are cut off: their tips would be further from the piece than four
/// times half the kerf, since a tip is at d / sin(angle / 2).
const SHARPEST: f64 = 0.5;

/// Offsets all outlines and holes of a layer by half the kerf, mm.
///
/// # Errors
/// The kerf is larger than a piece, than a hole, or than the gap between two pieces.
pub fn grow(pieces: &Pieces, kerf: f64, layer: usize) -> Result<Pieces, CutError> {
    if kerf <= 0.0 {
        return Ok(pieces.clone());
    }
    for piece in pieces {
        let Some(bounds) = piece.bounding_rect() else { continue };
        let width = bounds.width().min(bounds.height());
        if kerf > width {
            let (x, y) = bounds.center().x_y();
            return Err(CutError::KerfOfPiece { kerf, layer, width, x, y });
        }
        for hole in piece.interiors() {
            let [x, y] = middle(hole);
            let outside = Polygon::new(hole.clone(), Vec::new());
            if offset(&outside.into(), -kerf / 2.0).0.is_empty() {
                return Err(CutError::KerfOfHole { kerf, layer, x, y });
            }
        }
    }
    let grown = offset(pieces, kerf / 2.0);
    if grown.0.len() < pieces.0.len() {
        let [x, y] = first_met(pieces, kerf).unwrap_or_default();
        return Err(CutError::KerfOfGap { kerf, layer, x, y });
    }
    Ok(grown)
}

fn offset(pieces: &Pieces, distance: f64) -> Pieces {
    let style = BufferStyle::new(distance).line_join(LineJoin::Miter(SHARPEST));
    pieces.buffer_with_style(style)
}

/// The middle of the first piece that meets another one when it grows.
fn first_met(pieces: &Pieces, kerf: f64) -> Option<[f64; 2]> {
    pieces.iter().enumerate().find_map(|(number, piece)| {
        let box_of = |piece: &Polygon<f64>| piece.bounding_rect();
        let bounds = box_of(piece)?;
        let meets = |other: &&Polygon<f64>| {
            box_of(other).is_some_and(|other| {
                (0..2).all(|axis| {
                    let side = |c: geo::Coord<f64>| if axis == 0 { c.x } else { c.y };
                    side(other.min()) - kerf <= side(bounds.max())
                        && side(bounds.min()) - kerf <= side(other.max())
                })
            })
        };
        pieces.0[number + 1..].iter().filter(meets).find_map(|other| {
            let pair = Pieces::new(vec![piece.clone(), other.clone()]);
            (offset(&pair, kerf / 2.0).0.len() < 2).then(|| middle(piece.exterior()))
        })
    })
}

fn middle(ring: &LineString<f64>) -> [f64; 2] {
    ring.centroid().map_or([0.0; 2], |middle| [middle.x(), middle.y()])
}
