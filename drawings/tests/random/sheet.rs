//! Random sheets of known content.

use std::collections::BTreeMap;
use std::f64::consts::{PI, TAU};

use lamc_drawings::{Drawing, Place, Role, Stroke};
use rand::Rng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;

/// The tolerance of drawings, and how far their ends are off at most.
pub const TOLERANCE: f64 = 0.05;
const NOISE: f64 = 0.3 * TOLERANCE;

/// What is not the same is at least this far apart.
const CLEAR: f64 = 12.0 * TOLERANCE;

/// The smallest sine of the angle between lines that cross.
const STEEP: f64 = 0.35;

type Point = [f64; 2];

/// A straight line of the sheet from one vertex to another, with the vertices on it.
struct Segment {
    ends: [Point; 2],
    role: Role,
    fold: Option<f64>,
    /// Positions from 0 to 1 of the vertices between its ends.
    vertices: Vec<f64>,
}

/// A rectangle with chords, holes and slits.
pub struct Sheet {
    size: Point,
    segments: Vec<Segment>,
    pub facets: usize,
    /// Polygons.
    pub holes: Vec<(Vec<Point>, Role)>,
    pub slits: Vec<[Point; 2]>,
}

impl Sheet {
    /// Makes a sheet. Each chord goes from a line that exists to another one, and adds a facet for itself
    /// and for each line that it crosses.
    pub fn random(rng: &mut ChaCha8Rng) -> Self {
        let [w, h] = [rng.random_range(20.0..60.0), rng.random_range(20.0..60.0)];
        let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
        let border = |index: usize| Segment {
            ends: [corners[index], corners[(index + 1) % 4]],
            role: Role::Border,
            fold: None,
            vertices: Vec::new(),
        };
        let segments = (0..4).map(border).collect();
        let mut sheet =
            Self { size: [w, h], segments, facets: 1, holes: Vec::new(), slits: Vec::new() };
        // Each is tried: those that come too close to others are left out.
        for _ in 0..rng.random_range(4..25) {
            sheet.add_chord(rng);
        }
        for _ in 0..rng.random_range(0..6) {
            sheet.add_hole(rng);
        }
        for _ in 0..rng.random_range(0..6) {
            sheet.add_slit(rng);
        }
        sheet
    }

    /// Returns the number of vertices.
    pub fn vertices(&self) -> usize {
        // Each vertex of the chords is on a second line as an end, or on two in between.
        let inner: usize = self.segments.iter().map(|segment| segment.vertices.len()).sum();
        let chords = self.segments.len() - 4;
        let junctions = 2 * chords;
        let crossings = (inner - junctions) / 2;
        let holes: usize = self.holes.iter().map(|(hole, _)| hole.len()).sum();
        4 + junctions + crossings + holes + 2 * self.slits.len()
    }

    /// Returns the number of edges of each role.
    pub fn edges(&self) -> BTreeMap<Role, usize> {
        let mut edges = BTreeMap::new();
        for segment in &self.segments {
            *edges.entry(segment.role).or_default() += segment.vertices.len() + 1;
        }
        for (hole, role) in &self.holes {
            *edges.entry(*role).or_default() += hole.len();
        }
        if !self.slits.is_empty() {
            *edges.entry(Role::Cut).or_default() += self.slits.len();
        }
        edges
    }

    /// Returns the area of the sheet less its holes.
    pub fn area(&self) -> f64 {
        self.size[0] * self.size[1] - self.holes.iter().map(|(hole, _)| area(hole)).sum::<f64>()
    }

    /// Returns the length of the outline and of the holes.
    pub fn perimeter(&self) -> f64 {
        let holes = self.holes.iter().map(|(hole, _)| {
            (0..hole.len()).map(|k| distance(hole[k], hole[(k + 1) % hole.len()])).sum::<f64>()
        });
        2.0 * (self.size[0] + self.size[1]) + holes.sum::<f64>()
    }

    fn add_chord(&mut self, rng: &mut ChaCha8Rng) {
        let start = rng.random_range(0..self.segments.len());
        let position = rng.random_range(0.0..1.0);
        let a = along(self.segments[start].ends, position);
        let direction = rng.random_range(0.0..TAU);
        let far = [a[0] + 100.0 * direction.cos(), a[1] + 100.0 * direction.sin()];
        let mut hits: Vec<(f64, usize, f64)> = (0..self.segments.len())
            .filter(|&index| index != start)
            .filter_map(|index| {
                let (here, there) = crossing([a, far], self.segments[index].ends)?;
                Some((here, index, there))
            })
            .collect();
        hits.sort_by(|x, y| x.0.total_cmp(&y.0));
        if hits.is_empty() {
            return;
        }
        hits.truncate(rng.random_range(0..hits.len()) + 1);
        let (end, last, there) = hits.pop().expect("at least one is left");
        let b = along([a, far], end);
        // Not through the outline: a chord that starts on it and leaves the sheet hits nothing.
        let new: Vec<Point> =
            [a, b].into_iter().chain(hits.iter().map(|hit| along([a, far], hit.0))).collect();
        let touched = [start, last].into_iter().chain(hits.iter().map(|hit| hit.1));
        let steep =
            touched.into_iter().all(|index| sine([a, b], self.segments[index].ends) > STEEP);
        let apart = (0..new.len()).all(|i| (0..i).all(|j| distance(new[i], new[j]) > CLEAR));
        let old = self.points();
        let clear = old.iter().all(|&point| {
            away(point, [a, b]) > CLEAR && new.iter().all(|&other| distance(other, point) > CLEAR)
        });
        // What the chord does not touch it does not come close to either.
        let beside = new.iter().all(|&point| {
            let near = |segment: &&Segment| away(point, segment.ends) < CLEAR;
            self.segments.iter().filter(near).count() == 1
        });
        if !(steep && apart && clear && beside) {
            return;
        }
        self.segments[start].vertices.push(position);
        self.segments[last].vertices.push(there);
        for hit in &hits {
            self.segments[hit.1].vertices.push(hit.2);
        }
        self.facets += 1 + hits.len();
        let vertices = hits.iter().map(|hit| hit.0 / end).collect();
        let role = match rng.random_range(0..10) {
            0..3 => Role::Mountain,
            3..6 => Role::Valley,
            6 => Role::Flat,
            7 => Role::Hinge,
            _ => Role::Cut,
        };
        let sign = if role == Role::Mountain { -1.0 } else { 1.0 };
        let fold =
            matches!(role, Role::Mountain | Role::Valley).then(|| sign * rng.random_range(0.1..PI));
        self.segments.push(Segment { ends: [a, b], role, fold, vertices });
    }

    fn add_hole(&mut self, rng: &mut ChaCha8Rng) {
        let corners = rng.random_range(3..9);
        let radius = rng.random_range(1.5..3.0);
        let center = [rng.random_range(0.0..self.size[0]), rng.random_range(0.0..self.size[1])];
        let turn = rng.random_range(0.0..TAU);
        let corner = |index: usize| {
            let angle = turn + TAU * index as f64 / corners as f64;
            [center[0] + radius * angle.cos(), center[1] + radius * angle.sin()]
        };
        if self.is_clear(center, radius) {
            let role = if rng.random() { Role::Border } else { Role::Cut };
            self.holes.push(((0..corners).map(corner).collect(), role));
        }
    }

    fn add_slit(&mut self, rng: &mut ChaCha8Rng) {
        let center = [rng.random_range(0.0..self.size[0]), rng.random_range(0.0..self.size[1])];
        let half = rng.random_range(1.0..3.0);
        let angle = rng.random_range(0.0..PI);
        let tip = |side: f64| {
            [center[0] + side * half * angle.cos(), center[1] + side * half * angle.sin()]
        };
        if self.is_clear(center, half) {
            self.slits.push([tip(-1.0), tip(1.0)]);
        }
    }

    /// Whether a circle touches no line.
    fn is_clear(&self, center: Point, radius: f64) -> bool {
        let reach = radius + CLEAR;
        let far = |ends: [Point; 2]| away(center, ends) > reach;
        let holes = self.holes.iter().all(|(hole, _)| {
            (0..hole.len()).all(|k| far([hole[k], hole[(k + 1) % hole.len()]]))
                && distance(center, middle(hole)) > reach
        });
        holes
            && self.segments.iter().all(|segment| far(segment.ends))
            && self.slits.iter().all(|&slit| far(slit))
    }

    fn points(&self) -> Vec<Point> {
        let on = |segment: &Segment| {
            let ends = segment.ends;
            let inner: Vec<Point> =
                segment.vertices.iter().map(|&position| along(ends, position)).collect();
            ends.into_iter().chain(inner)
        };
        self.segments.iter().flat_map(on).collect()
    }

    /// Draws the sheet: turned and moved, each line in pieces that end at some of its vertices and some
    /// of them twice, with noise at each end, in any order and direction.
    pub fn draw(&self, rng: &mut ChaCha8Rng) -> Drawing {
        let mut pieces: Vec<([Point; 2], Role, Option<f64>)> = Vec::new();
        for segment in &self.segments {
            let mut vertices = segment.vertices.clone();
            vertices.extend([0.0, 1.0]);
            vertices.sort_by(f64::total_cmp);
            let mut from = 0;
            for to in 1..vertices.len() {
                if to == vertices.len() - 1 || rng.random_bool(0.4) {
                    pieces.push((piece(segment, &vertices, from, to), segment.role, segment.fold));
                    from = to;
                }
            }
            if rng.random_bool(0.3) {
                let from = rng.random_range(0..vertices.len() - 1);
                let to = rng.random_range(from + 1..vertices.len());
                // A flat line counts less than all others.
                let flat = rng.random_bool(0.3);
                let (role, fold) =
                    if flat { (Role::Flat, None) } else { (segment.role, segment.fold) };
                pieces.push((piece(segment, &vertices, from, to), role, fold));
            }
        }
        for (hole, role) in &self.holes {
            pieces.extend(
                (0..hole.len()).map(|k| ([hole[k], hole[(k + 1) % hole.len()]], *role, None)),
            );
        }
        pieces.extend(self.slits.iter().map(|&slit| (slit, Role::Cut, None)));
        pieces.shuffle(rng);
        let (turn, shift) =
            (rng.random_range(0.0..TAU), [0; 2].map(|_| rng.random_range(-50.0..50.0)));
        let (sin, cos) = turn.sin_cos();
        let mut strokes = Vec::new();
        for (index, (mut ends, role, fold)) in pieces.into_iter().enumerate() {
            if rng.random() {
                ends.reverse();
            }
            let ends = ends.map(|[x, y]| {
                let radius = rng.random_range(0.0..NOISE);
                let angle = rng.random_range(0.0..TAU);
                [
                    cos * x - sin * y + shift[0] + radius * angle.cos(),
                    sin * x + cos * y + shift[1] + radius * angle.sin(),
                ]
            });
            let place = Place { start: index, end: index + 1 };
            strokes.push(Stroke { ends, role, fold, angle: None, place });
        }
        Drawing { strokes, ..Drawing::default() }
    }
}

fn piece(segment: &Segment, vertices: &[f64], from: usize, to: usize) -> [Point; 2] {
    [along(segment.ends, vertices[from]), along(segment.ends, vertices[to])]
}

fn along([a, b]: [Point; 2], position: f64) -> Point {
    [a[0] + position * (b[0] - a[0]), a[1] + position * (b[1] - a[1])]
}

fn distance(a: Point, b: Point) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Returns the distance of a point from a line between two points.
fn away(point: Point, [a, b]: [Point; 2]) -> f64 {
    let length = distance(a, b);
    let position =
        ((point[0] - a[0]) * (b[0] - a[0]) + (point[1] - a[1]) * (b[1] - a[1])) / (length * length);
    distance(point, along([a, b], position.clamp(0.0, 1.0)))
}

fn cross(a: Point, b: Point) -> f64 {
    a[0] * b[1] - a[1] * b[0]
}

fn minus(a: Point, b: Point) -> Point {
    [a[0] - b[0], a[1] - b[1]]
}

fn sine([a, b]: [Point; 2], [c, d]: [Point; 2]) -> f64 {
    cross(minus(b, a), minus(d, c)).abs() / (distance(a, b) * distance(c, d))
}

/// Returns the positions along both lines at which they cross.
fn crossing([a, b]: [Point; 2], [c, d]: [Point; 2]) -> Option<(f64, f64)> {
    let turn = cross(minus(b, a), minus(d, c));
    let here = cross(minus(c, a), minus(d, c)) / turn;
    let there = cross(minus(c, a), minus(b, a)) / turn;
    let inside = |position: f64| (0.0..1.0).contains(&position);
    (inside(here) && inside(there)).then_some((here, there))
}

fn middle(polygon: &[Point]) -> Point {
    let sum = polygon.iter().fold([0.0; 2], |sum, point| [sum[0] + point[0], sum[1] + point[1]]);
    sum.map(|value| value / polygon.len() as f64)
}

fn area(polygon: &[Point]) -> f64 {
    (0..polygon.len()).map(|k| 0.5 * cross(polygon[k], polygon[(k + 1) % polygon.len()])).sum()
}
