//! Edges of the planar graph as creases between two parts: all pieces on one line are one joint.

use std::collections::BTreeMap;

use lamc_drawings::{Edge, Pattern, Place, Role};

use super::names::Grid;
use super::sheet::Part;
use crate::arithmetic::hypot;

/// Distance from a line, relative to its length, of points that are on it but for rounding errors.
const ON_LINE: f64 = 1e-9;
/// Largest number of lines between the same two facets with which a crease is compared. More of them lock
/// the facets anyway.
const MOST_LINES: usize = 64;
/// A crease that becomes a joint: all pieces on one line between the same two parts.
pub(in crate::source) struct Line {
    pub name: String,
    /// Indices into the parts. The second is to the left of the way between the ends.
    pub parts: [usize; 2],
    pub ends: [[f64; 2]; 2],
    /// Length of the pieces together.
    pub length: f64,
    pub role: Role,
    /// The target angle and the angle in the folded state, rad.
    pub fold: Option<f64>,
    pub angle: Option<f64>,
    pub place: Place,
    /// Whether its pieces have different target angles.
    pub is_mixed: bool,
}

/// The middle of a line.
pub(super) fn middle([[ax, ay], [bx, by]]: [[f64; 2]; 2]) -> [f64; 2] {
    [ax + (bx - ax) / 2.0, ay + (by - ay) / 2.0]
}

/// Whether the edge becomes a joint, or a part of one.
pub(super) fn is_crease(edge: &Edge) -> bool {
    match edge.role {
        Role::Mountain | Role::Valley | Role::Hinge | Role::Flat => {
            matches!(edge.facets, [Some(left), Some(right)] if left != right)
        }
        Role::Border | Role::Cut => false,
    }
}

/// The creases with their names, sorted.
pub(super) fn lines(pattern: &Pattern, parts: &[Part]) -> Vec<Line> {
    let mut part_of = vec![0; pattern.facets.len()];
    parts.iter().enumerate().for_each(|(index, part)| part_of[part.facet.index()] = index);
    let mut shared: BTreeMap<[usize; 2], Vec<Line>> = BTreeMap::new();
    for edge in pattern.edges.iter().filter(|edge| is_crease(edge)) {
        let [Some(left), Some(right)] = edge.facets else { continue };
        let piece = piece(pattern, edge, [part_of[right.index()], part_of[left.index()]]);
        shared.entry(piece.parts).or_default().push(piece);
    }
    let mut lines: Vec<Line> = shared.into_values().flat_map(joined).collect();
    let middles: Vec<[f64; 2]> = lines.iter().map(|line| middle(line.ends)).collect();
    let mut sorted = Vec::with_capacity(lines.len());
    let mut unsorted: Vec<Option<Line>> = lines.drain(..).map(Some).collect();
    for (index, name) in Grid::of(&pattern.vertices).names("crease", &middles) {
        sorted.extend(unsorted[index].take().map(|line| Line { name, ..line }));
    }
    sorted
}

/// An edge as a piece of a crease, whose first part has the smaller index.
fn piece(pattern: &Pattern, edge: &Edge, parts: [usize; 2]) -> Line {
    let ends = edge.vertices.map(|vertex| pattern.vertices[vertex.index()]);
    let length = hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]);
    let Edge { role, fold, angle, place, .. } = *edge;
    let mut piece = Line {
        name: String::new(),
        parts,
        ends,
        length,
        role,
        fold,
        angle,
        place,
        is_mixed: false,
    };
    if piece.parts[0] > piece.parts[1] {
        piece.parts.reverse();
        piece.ends.reverse();
    }
    piece
}

/// Joins the pieces between two parts that are on one line.
fn joined(mut pieces: Vec<Line>) -> Vec<Line> {
    if pieces.len() == 1 {
        return pieces;
    }
    let place = |line: &Line| middle(line.ends);
    pieces.sort_by(|a, b| {
        let [[ax, ay], [bx, by]] = [place(a), place(b)];
        b.length.total_cmp(&a.length).then(ay.total_cmp(&by)).then(ax.total_cmp(&bx))
    });
    let mut lines: Vec<Line> = Vec::new();
    for piece in pieces {
        let recent = lines.len().saturating_sub(MOST_LINES);
        match lines[recent..].iter_mut().find(|line| is_on(line, &piece)) {
            Some(line) => extend(line, &piece),
            None => lines.push(piece),
        }
    }
    lines
}

/// Where a point is relative to the line: along it and across it, in units of the drawing.
fn relative(line: &Line, [x, y]: [f64; 2]) -> [f64; 2] {
    let [[ax, ay], [bx, by]] = line.ends;
    let (dx, dy) = (bx - ax, by - ay);
    let across = hypot(dx, dy);
    let (px, py) = (x - ax, y - ay);
    [(px * dx + py * dy) / across, (px * dy - py * dx) / across]
}

fn is_on(line: &Line, piece: &Line) -> bool {
    piece.ends.iter().all(|end| {
        let [along, across] = relative(line, *end);
        // The direction of the line is as exact as its length is long.
        across.abs() <= ON_LINE * along.abs().max(line.length)
    })
}

/// Adds a shorter piece to a line.
fn extend(line: &mut Line, piece: &Line) {
    // If the parts are on the other sides of this piece, it folds the other way.
    let [from, to] = piece.ends.map(|end| relative(line, end)[0]);
    let turned = |angle: Option<f64>| if from > to { angle.map(|angle| -angle) } else { angle };
    let is_same = line.fold == turned(piece.fold) && (line.role == piece.role || from > to);
    line.is_mixed |= !is_same;
    line.angle = line.angle.or(turned(piece.angle));
    let whole = relative(line, line.ends[1])[0];
    let [mut first, mut last] = line.ends;
    for (along, end) in [from, to].into_iter().zip(piece.ends) {
        if along < 0.0 && along <= relative(line, first)[0] {
            first = end;
        }
        if along > whole && along >= relative(line, last)[0] {
            last = end;
        }
    }
    line.ends = [first, last];
    line.length += piece.length;
}
