//! Points and the lines between them: what the stages from strokes to a planar graph hand on.

use std::cmp::Ordering;

use rstar::primitives::{GeomWithData, Rectangle};
use rstar::{AABB, RTree};

use crate::drawing::{Place, Role, Stroke};

/// A point of the plane, in units of the drawing.
pub(super) type Point = [f64; 2];

/// A straight line between two points of a [`Network`], with what its stroke says.
#[derive(Clone, Debug)]
pub(super) struct Line {
    pub(super) ends: [usize; 2],
    pub(super) role: Role,
    pub(super) fold: Option<f64>,
    pub(super) angle: Option<f64>,
    pub(super) place: Place,
}

impl Line {
    /// Creates the line of a stroke between two points.
    pub(super) fn of(stroke: &Stroke, ends: [usize; 2]) -> Self {
        Self {
            ends,
            role: stroke.role,
            fold: stroke.fold,
            angle: stroke.angle,
            place: stroke.place,
        }
    }

    /// Returns the same line between two other points.
    pub(super) fn between(&self, ends: [usize; 2]) -> Self {
        Self { ends, ..self.clone() }
    }

    /// Returns its two points, the smaller index first: equal for lines that are drawn twice.
    pub(super) fn key(&self) -> [usize; 2] {
        let [a, b] = self.ends;
        if a < b { [a, b] } else { [b, a] }
    }
}

/// Points and the lines between them.
#[derive(Clone, Debug, Default)]
pub(super) struct Network {
    pub(super) points: Vec<Point>,
    pub(super) lines: Vec<Line>,
}

impl Network {
    /// Returns the ends of a line.
    pub(super) fn ends(&self, line: &Line) -> [Point; 2] {
        line.ends.map(|end| self.points[end])
    }

    /// Removes points without lines. The others keep their order.
    pub(super) fn compact(&mut self) {
        let mut used = vec![false; self.points.len()];
        for end in self.lines.iter().flat_map(|line| line.ends) {
            used[end] = true;
        }
        let mut index_of = vec![0; self.points.len()];
        let kept = index_of.iter_mut().zip(&used).filter(|(_, used)| **used);
        for (new, (index, _)) in kept.enumerate() {
            *index = new;
        }
        let mut used = used.into_iter();
        self.points.retain(|_| used.next() == Some(true));
        for line in &mut self.lines {
            line.ends = line.ends.map(|end| index_of[end]);
        }
    }

    /// Returns the length of a line, in units of the drawing.
    pub(super) fn length(&self, line: &Line) -> f64 {
        let [a, b] = self.ends(line);
        distance(a, b)
    }
}

/// Returns the distance of two points.
pub(super) fn distance(a: Point, b: Point) -> f64 {
    (b[0] - a[0]).hypot(b[1] - a[1])
}

/// Compares points by x, and equal ones by y.
pub(super) fn lexicographic(a: Point, b: Point) -> Ordering {
    a[0].total_cmp(&b[0]).then(a[1].total_cmp(&b[1]))
}

/// Returns the sign of the area of the triangle a, b, c: positive if it runs counterclockwise. The
/// sign is exact (J. R. Shewchuk, Adaptive precision floating-point arithmetic, 1997).
pub(super) fn orientation(a: Point, b: Point, c: Point) -> f64 {
    let coord = |point: Point| robust::Coord { x: point[0], y: point[1] };
    robust::orient2d(coord(a), coord(b), coord(c))
}

/// Returns the position along the line from a to b (0 to 1) that is nearest to a point, if it lies
/// between the ends, and the distance to it.
pub(super) fn foot(point: Point, [a, b]: [Point; 2]) -> Option<(f64, f64)> {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [point[0] - a[0], point[1] - a[1]];
    let squared = along[0] * along[0] + along[1] * along[1];
    let position = (from[0] * along[0] + from[1] * along[1]) / squared;
    let away = (from[0] * along[1] - from[1] * along[0]).abs() / squared.sqrt();
    (position > 0.0 && position < 1.0).then_some((position, away))
}

/// Returns the point in which the straight lines through two pairs of points meet; not finite if
/// they are parallel.
pub(super) fn meeting([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Point {
    let first = [b[0] - a[0], b[1] - a[1]];
    let second = [d[0] - c[0], d[1] - c[1]];
    let between = [c[0] - a[0], c[1] - a[1]];
    let turn = first[0] * second[1] - first[1] * second[0];
    let position = (between[0] * second[1] - between[1] * second[0]) / turn;
    [a[0] + position * first[0], a[1] + position * first[1]]
}

/// A box around a piece of a line, with the index of the line.
type Piece = GeomWithData<Rectangle<Point>, usize>;

/// Finds the lines near a place.
pub(super) struct Index {
    tree: RTree<Piece>,
}

impl Index {
    /// A line longer than this many mean lengths is indexed as several pieces: the box around a long
    /// oblique line is near everything.
    const LONG: f64 = 4.0;

    /// Builds the index of all lines.
    pub(super) fn new(network: &Network) -> Self {
        let lengths: f64 = network.lines.iter().map(|line| network.length(line)).sum();
        let longest_piece = Self::LONG * lengths / network.lines.len() as f64;
        let mut pieces = Vec::with_capacity(network.lines.len() * 5 / 4);
        for (index, line) in network.lines.iter().enumerate() {
            let [a, b] = network.ends(line);
            // At most n / 4 more pieces than lines, since the lengths sum up to n mean lengths.
            let count = (distance(a, b) / longest_piece).ceil().max(1.0) as usize;
            let at = |step: usize| match step {
                0 => a,
                step if step == count => b,
                step => {
                    let part = step as f64 / count as f64;
                    [a[0] + part * (b[0] - a[0]), a[1] + part * (b[1] - a[1])]
                }
            };
            for step in 0..count {
                let piece = Rectangle::from_corners(at(step), at(step + 1));
                pieces.push(Piece::new(piece, index));
            }
        }
        Self { tree: RTree::bulk_load(pieces) }
    }

    /// Puts the lines that may be nearer than `away` to the box of two corners into `found`, each
    /// once, in ascending order.
    pub(super) fn near(&self, corners: [Point; 2], away: f64, found: &mut Vec<usize>) {
        let [a, b] = corners;
        let low = [a[0].min(b[0]) - away, a[1].min(b[1]) - away];
        let high = [a[0].max(b[0]) + away, a[1].max(b[1]) + away];
        found.clear();
        let boxes = self.tree.locate_in_envelope_intersecting(&AABB::from_corners(low, high));
        found.extend(boxes.map(|piece| piece.data));
        found.sort_unstable();
        found.dedup();
    }
}
