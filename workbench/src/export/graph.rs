//! The planar graph of the facets: vertices that hinged facets share, and edges between them.
//!
//! ```text
//! corners -> points (equal positions) -> vertices (corners of facets that hold together there)
//! ```
//!
//! On both sides of a slit the vertices are different ones, because they move apart.

use std::collections::{BTreeMap, HashMap};

use super::facets::{Facet, edges, on_line};
use lamc::laminate::{Joint, Mechanism};

/// What an edge is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// The edge of the sheet or of a hole.
    Border,
    /// One side of a cut between two facets.
    Slit,
    /// Both facets belong to the same body, or to the ground.
    Flat,
    /// A hinge: the index of its joint, and 1 if a positive q is a valley, -1 if it is a mountain.
    Hinge(usize, f64),
}

/// An edge.
#[derive(Clone, Copy, Debug)]
pub struct Edge {
    /// The indices of its vertices.
    pub vertices: [usize; 2],
    pub kind: Kind,
}

/// A vertex.
#[derive(Clone, Copy, Debug)]
pub struct Vertex {
    /// Flat state, m. Its height is that of a hinge line.
    pub at: [f64; 3],
    /// The index of a body that it moves with.
    pub body: usize,
}

/// The graph.
pub struct Graph {
    pub vertices: Vec<Vertex>,
    pub edges: Vec<Edge>,
    /// The vertices of each facet's outline, counterclockwise.
    pub faces: Vec<Vec<usize>>,
}

/// A corner of a facet: the facet and the point where it is.
type Corner = (usize, usize);

/// Finds the graph; points closer than `reach` are one.
pub fn graph(mechanism: &Mechanism, facets: &[Facet], reach: f64) -> Graph {
    let mut points = Points { reach, cells: HashMap::new(), at: Vec::new() };
    let ends = mechanism.joints.iter().flat_map(|joint| {
        let end = joint.point + joint.direction * joint.length;
        [[joint.point.x, joint.point.y], [end.x, end.y]]
    });
    let mut all: Vec<[f64; 2]> =
        facets.iter().flat_map(|facet| rings(facet).flatten().copied()).collect();
    all.extend(ends);
    all.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let rings: Vec<Vec<Vec<usize>>> = facets
        .iter()
        .map(|facet| rings(facet).map(|ring| points.ring(ring, &all)).collect())
        .collect();
    let Joined { classes, heights, edges } = joined(mechanism, facets, &points, &rings);
    let mut numbers = Numbers {
        mechanism,
        facets,
        points: &points,
        classes,
        of_root: HashMap::new(),
        vertices: Vec::new(),
    };
    let mut faces: Vec<Vec<usize>> = Vec::with_capacity(rings.len());
    for (facet, rings) in rings.iter().enumerate() {
        let outline = rings.first().into_iter().flatten();
        faces.push(outline.map(|point| numbers.number((facet, *point))).collect());
    }
    for (corner, height) in heights {
        let vertex = numbers.number(corner);
        numbers.vertices[vertex].at[2] = height;
    }
    let edge = |(ends, facet, kind): ([usize; 2], usize, Kind)| Edge {
        vertices: ends.map(|point| numbers.number((facet, point))),
        kind,
    };
    let edges = edges.into_iter().map(edge).collect();
    Graph { vertices: numbers.vertices, edges, faces }
}

/// All boundaries of a facet, its outline first.
fn rings(facet: &Facet) -> impl Iterator<Item = &Vec<[f64; 2]>> {
    std::iter::once(&facet.outline).chain(&facet.holes)
}

/// Positions; those within `reach` of each other are one point.
struct Points {
    reach: f64,
    cells: HashMap<[i64; 2], Vec<usize>>,
    at: Vec<[f64; 2]>,
}

impl Points {
    /// The index of the point at a position.
    fn index(&mut self, at: [f64; 2]) -> usize {
        let cell = at.map(|x| (x / self.reach).round() as i64);
        let near = (-1..=1).flat_map(|i| (-1..=1).map(move |j| [cell[0] + i, cell[1] + j]));
        let mut found = near.filter_map(|cell| self.cells.get(&cell)).flatten();
        let is_near = |point: &&usize| distance(self.at[**point], at) <= self.reach;
        if let Some(point) = found.find(is_near) {
            return *point;
        }
        self.at.push(at);
        self.cells.entry(cell).or_default().push(self.at.len() - 1);
        self.at.len() - 1
    }

    /// The points of a ring, also those of `all` (in ascending order of x) that lie on its edges.
    fn ring(&mut self, ring: &[[f64; 2]], all: &[[f64; 2]]) -> Vec<usize> {
        let mut points = Vec::new();
        for [from, to] in edges(ring) {
            points.push(self.index(from));
            let (low, high) = (from[0].min(to[0]) - self.reach, from[0].max(to[0]) + self.reach);
            let first = all.partition_point(|point| point[0] < low);
            let length = distance(from, to);
            let direction = [0, 1].map(|axis| (to[axis] - from[axis]) / length);
            let mut between: Vec<(f64, [f64; 2])> = Vec::new();
            for point in all[first..].iter().take_while(|point| point[0] <= high) {
                let [dx, dy] = [point[0] - from[0], point[1] - from[1]];
                let along = dx * direction[0] + dy * direction[1];
                let aside = dy * direction[0] - dx * direction[1];
                if aside.abs() <= self.reach && along > self.reach && along < length - self.reach {
                    between.push((along, *point));
                }
            }
            between.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            points.extend(between.into_iter().map(|(_, point)| self.index(point)));
        }
        points.dedup();
        if points.len() > 1 && points.first() == points.last() {
            points.pop();
        }
        points
    }
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Corners that are one vertex.
#[derive(Default)]
struct Classes(HashMap<Corner, Corner>);

impl Classes {
    fn root(&self, mut corner: Corner) -> Corner {
        while let Some(next) = self.0.get(&corner) {
            corner = *next;
        }
        corner
    }

    fn join(&mut self, a: Corner, b: Corner) {
        let (a, b) = (self.root(a), self.root(b));
        if a != b {
            self.0.insert(a.max(b), a.min(b));
        }
    }
}

/// An edge between two points, and the facets that have it: on its left and on its right.
#[derive(Default)]
struct Sides {
    left: Vec<usize>,
    right: Vec<usize>,
}

/// The edges of all rings, by their ends in ascending order.
fn sides(rings: &[Vec<Vec<usize>>]) -> BTreeMap<[usize; 2], Sides> {
    let mut sides: BTreeMap<[usize; 2], Sides> = BTreeMap::new();
    for (facet, rings) in rings.iter().enumerate() {
        for ring in rings {
            for (&a, &b) in ring.iter().zip(ring.iter().cycle().skip(1)) {
                let side = sides.entry([a.min(b), a.max(b)]).or_default();
                if a < b { side.left.push(facet) } else { side.right.push(facet) }
            }
        }
    }
    sides
}

/// The joints between each pair of bodies, by their indices in ascending order.
fn joints_of_pairs(mechanism: &Mechanism) -> HashMap<[usize; 2], Vec<usize>> {
    let mut of_pair: HashMap<[usize; 2], Vec<usize>> = HashMap::new();
    for (index, joint) in mechanism.joints.iter().enumerate() {
        let [a, b] = joint.bodies.map(|body| body.index());
        of_pair.entry([a.min(b), a.max(b)]).or_default().push(index);
    }
    of_pair
}

/// What is known of the edges before vertices have numbers.
#[derive(Default)]
struct Joined {
    classes: Classes,
    /// Heights of hinge lines, m.
    heights: BTreeMap<Corner, f64>,
    /// Both points of each edge, a facet that has it, and what it is.
    edges: Vec<([usize; 2], usize, Kind)>,
}

/// Determines which facets hold together at their edges.
fn joined(
    mechanism: &Mechanism,
    facets: &[Facet],
    points: &Points,
    rings: &[Vec<Vec<usize>>],
) -> Joined {
    let of_pair = joints_of_pairs(mechanism);
    let mut joined = Joined::default();
    for (ends, sides) in sides(rings) {
        let at = ends.map(|point| points.at[point]);
        let kind = match (sides.left.as_slice(), sides.right.as_slice()) {
            ([left], [right]) => {
                let bodies = [*left, *right].map(|facet| facets[facet].body);
                between(mechanism, &of_pair, bodies, at, points.reach)
            }
            _ => None,
        };
        let touching = !sides.left.is_empty() && !sides.right.is_empty();
        let Some(kind) = kind else {
            let kind = if touching { Kind::Slit } else { Kind::Border };
            let all = sides.left.iter().chain(&sides.right);
            joined.edges.extend(all.map(|facet| (ends, *facet, kind)));
            continue;
        };
        for point in ends {
            joined.classes.join((sides.left[0], point), (sides.right[0], point));
            if let Kind::Hinge(joint, _) = kind {
                joined.heights.insert((sides.left[0], point), mechanism.joints[joint].point.z);
            }
        }
        joined.edges.push((ends, sides.left[0], kind));
    }
    joined
}

/// What holds two bodies together at an edge; None if nothing does. The first body is to the left of it.
fn between(
    mechanism: &Mechanism,
    of_pair: &HashMap<[usize; 2], Vec<usize>>,
    [left, right]: [usize; 2],
    at: [[f64; 2]; 2],
    reach: f64,
) -> Option<Kind> {
    let [a, b] = [left, right].map(|body| &mechanism.bodies[body]);
    if left == right || (a.fixed && b.fixed) {
        return Some(Kind::Flat);
    }
    let joints = of_pair.get(&[left.min(right), left.max(right)])?;
    let lies_on = |joint: &&usize| on_line(&mechanism.joints[**joint], at, reach);
    let index = *joints.iter().find(lies_on)?;
    let joint: &Joint = &mechanism.joints[index];
    let [dx, dy] = [at[1][0] - at[0][0], at[1][1] - at[0][1]];
    let forwards = dx * joint.direction.x + dy * joint.direction.y > 0.0;
    // With the second body to the left of the hinge line, a positive angle lifts it towards the viewer.
    let second_is_left = (joint.bodies[1].index() == left) == forwards;
    Some(Kind::Hinge(index, if second_is_left { 1.0 } else { -1.0 }))
}

/// Vertices in the order in which faces name them.
struct Numbers<'a> {
    mechanism: &'a Mechanism,
    facets: &'a [Facet],
    points: &'a Points,
    classes: Classes,
    of_root: HashMap<Corner, usize>,
    vertices: Vec<Vertex>,
}

impl Numbers<'_> {
    fn number(&mut self, corner: Corner) -> usize {
        let root = self.classes.root(corner);
        if let Some(number) = self.of_root.get(&root) {
            return *number;
        }
        let facet = &self.facets[corner.0];
        let has = |joint: &&Joint| joint.bodies.iter().any(|body| body.index() == facet.body);
        let height =
            self.mechanism.joints.iter().find(has).map_or(facet.height, |joint| joint.point.z);
        let [x, y] = self.points.at[corner.1];
        self.of_root.insert(root, self.vertices.len());
        self.vertices.push(Vertex { at: [x, y, height], body: facet.body });
        self.vertices.len() - 1
    }
}
