//! Facets that pass through each other.
//!
//! Facets are taken without thickness, in the plane of their hinges. Two facets pass through each other where an
//! edge of one crosses the inside of the other. Neighbours, which share a hinge, are left out: they meet there.

use std::collections::BTreeSet;

use geo::{Coord, LineString, Polygon, TriangulateEarcut};
use lamc::laminate::{Mechanism, Sheet};
use nalgebra::{Matrix3, Vector3};

use super::gap::gap;
use crate::motion::Pose;
use crate::scene::Placement;

/// Edges that come nearer than this to a facet's plane, or a facet's outline, touch it; over the sheet's size.
const TOUCH: f64 = 1e-4;

/// A triangle in space, m.
pub(super) type Triangle = [Vector3<f64>; 3];

/// The facets of a sheet.
pub struct Facets {
    /// Of each body, in the flat state.
    triangles: Vec<Vec<Triangle>>,
    neighbours: BTreeSet<[usize; 2]>,
    touch: f64,
}

impl Facets {
    /// Returns the facets of a mechanism.
    pub fn new(mechanism: &Mechanism) -> Self {
        let triangles = (0..mechanism.bodies.len()).map(|body| {
            let its = mechanism
                .joints
                .iter()
                .filter(|joint| joint.bodies.iter().any(|b| b.index() == body));
            let heights: Vec<f64> = its.map(|joint| joint.point.z).collect();
            let height = heights.iter().sum::<f64>() / heights.len().max(1) as f64;
            let mut sheets: Vec<&Sheet> = Vec::new();
            for sheet in &mechanism.bodies[body].sheets {
                let same =
                    |other: &&Sheet| other.outline == sheet.outline && other.holes == sheet.holes;
                if !sheets.iter().any(same) {
                    sheets.push(sheet);
                }
            }
            sheets.into_iter().flat_map(|sheet| flat(sheet, height)).collect()
        });
        let pair = |joint: &lamc::laminate::Joint| ordered(joint.bodies.map(|body| body.index()));
        let mut neighbours: BTreeSet<[usize; 2]> = mechanism.joints.iter().map(pair).collect();
        let fixed: Vec<usize> =
            (0..mechanism.bodies.len()).filter(|b| mechanism.bodies[*b].fixed).collect();
        for (index, one) in fixed.iter().enumerate() {
            neighbours.extend(fixed[..index].iter().map(|other| ordered([*one, *other])));
        }
        Self { triangles: triangles.collect(), neighbours, touch: TOUCH * mechanism.size }
    }

    /// Returns the pairs of bodies that pass through each other at these poses.
    pub fn crossing(&self, poses: &[Pose]) -> Vec<[usize; 2]> {
        let placed = self.placed(poses);
        let mut boxes: Vec<(usize, [Vector3<f64>; 2])> = Vec::new();
        for (body, triangles) in placed.iter().enumerate() {
            let mut corners = triangles.iter().flatten();
            let Some(first) = corners.next() else { continue };
            let around = corners.fold([*first; 2], |[low, high], at| [low.inf(at), high.sup(at)]);
            boxes.push((body, around));
        }
        boxes.sort_by(|a, b| a.1[0].x.total_cmp(&b.1[0].x));
        let mut found = Vec::new();
        for (index, (one, [low, high])) in boxes.iter().enumerate() {
            // Sorted by their lower side, later boxes begin beyond this one from some box on.
            let near = boxes[index + 1..].iter().take_while(|(_, [other, _])| other.x < high.x);
            for (other, [least, greatest]) in near {
                let apart =
                    (1..3).any(|axis| least[axis] > high[axis] || greatest[axis] < low[axis]);
                let pair = ordered([*one, *other]);
                if !apart
                    && !self.neighbours.contains(&pair)
                    && self.cross(&placed[*one], &placed[*other])
                {
                    found.push(pair);
                }
            }
        }
        found.sort_unstable();
        found
    }

    /// Returns the least distance of two bodies, or of any two that do not share a hinge, m: negative where they pass through
    /// each other, then minus the way by which two of their triangles come apart. `None` where there are no two.
    pub fn clearance(&self, poses: &[Pose], between: Option<[usize; 2]>) -> Option<f64> {
        let placed = self.placed(poses);
        let count = placed.len();
        let pairs: Vec<[usize; 2]> = match between {
            Some(pair) => vec![pair],
            None => (0..count)
                .flat_map(|one| (one + 1..count).map(move |other| [one, other]))
                .filter(|pair| !self.neighbours.contains(pair))
                .collect(),
        };
        let triangles = pairs.iter().flat_map(|[one, other]| {
            placed[*one].iter().flat_map(|a| placed[*other].iter().map(move |b| gap(a, b)))
        });
        triangles.reduce(f64::min)
    }

    /// The triangles of each body at these poses.
    fn placed(&self, poses: &[Pose]) -> Vec<Vec<Triangle>> {
        let each = self.triangles.iter().enumerate().map(|(body, triangles)| {
            let placement = Placement::of(poses, body);
            let placed = |triangle: &Triangle| triangle.map(|corner| placement.apply(&corner));
            triangles.iter().map(placed).collect()
        });
        each.collect()
    }

    fn cross(&self, one: &[Triangle], other: &[Triangle]) -> bool {
        one.iter().any(|a| other.iter().any(|b| self.pierces(a, b) || self.pierces(b, a)))
    }

    /// Returns whether an edge of `a` crosses the inside of `b`.
    fn pierces(&self, a: &Triangle, b: &Triangle) -> bool {
        let [origin, x, y] = [b[0], b[1] - b[0], b[2] - b[0]];
        let normal = x.cross(&y);
        let Some(unit) = normal.try_normalize(0.0) else { return false };
        let heights = a.map(|corner| unit.dot(&(corner - origin)));
        [[0, 1], [1, 2], [2, 0]].iter().any(|[from, to]| {
            let (h, k) = (heights[*from], heights[*to]);
            if h.abs() <= self.touch || k.abs() <= self.touch || h * k > 0.0 {
                return false;
            }
            let at = a[*from] + (a[*to] - a[*from]) * (h / (h - k)) - origin;
            let Some(inverse) = Matrix3::from_columns(&[x, y, unit]).try_inverse() else {
                return false;
            };
            let share = inverse * at;
            let inside = [share.x, share.y, 1.0 - share.x - share.y];
            // The margin is a distance: a share times a height of the triangle.
            let longest = [x, y, y - x].map(|edge| edge.norm()).into_iter().fold(0.0, f64::max);
            inside.iter().all(|share| share * normal.norm() / longest > self.touch)
        })
    }
}

fn ordered([a, b]: [usize; 2]) -> [usize; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the triangles of a sheet at a height.
fn flat(sheet: &Sheet, height: f64) -> Vec<Triangle> {
    let ring = |points: &[[f64; 2]]| -> LineString<f64> {
        points.iter().map(|&[x, y]| Coord { x, y }).collect()
    };
    let holes = sheet.holes.iter().map(|hole| ring(hole)).collect();
    let polygon = Polygon::new(ring(&sheet.outline), holes);
    let corner = |at: Coord<f64>| Vector3::new(at.x, at.y, height);
    polygon.earcut_triangles().into_iter().map(|t| t.to_array().map(corner)).collect()
}
