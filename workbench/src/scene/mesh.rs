//! Closed surfaces of flat triangles: prisms over polygons, boxes, ellipsoids.

use std::f64::consts::PI;

use geo::orient::{Direction, Orient};
use geo::{Coord, LineString, Polygon, TriangulateEarcut};
use nalgebra::{Matrix3, Vector3};

use super::palette::Rgb;
use lamc::laminate::Sheet;

/// Sides that meet at an angle below this, rad, form one curved wall without an edge between them.
const SMOOTH: f64 = 30.0 * PI / 180.0;

/// The number of meridians of an ellipsoid; it has half as many circles of latitude.
const MERIDIANS: usize = 32;

/// A closed surface, flat coordinates, m.
#[derive(Clone, Debug, Default)]
pub struct Mesh {
    /// Corners of the triangles.
    pub vertices: Vec<Vector3<f64>>,
    /// The triangles; their corners are counter-clockwise if seen from outside.
    pub triangles: Vec<Triangle>,
}

/// A flat triangle of the surface.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Indices of its vertices.
    pub corners: [usize; 3],
    /// Outward unit normal.
    pub normal: Vector3<f64>,
    /// Its colour.
    pub color: Rgb,
    /// The index of its face: edges are drawn between faces, not between triangles of one face.
    pub face: usize,
}

impl Mesh {
    /// Number of faces.
    pub fn faces(&self) -> usize {
        self.triangles.last().map_or(0, |triangle| triangle.face + 1)
    }

    /// Adds a triangle. A triangle without area has no normal and is left out.
    fn push(&mut self, corners: [usize; 3], color: Rgb, face: usize) {
        let [a, b, c] = corners.map(|corner| self.vertices[corner]);
        if let Some(normal) = (b - a).cross(&(c - a)).try_normalize(0.0) {
            self.triangles.push(Triangle { corners, normal, color, face });
        }
    }

    /// Adds a sheet as a prism.
    pub fn add_sheet(&mut self, sheet: &Sheet, color: Rgb) {
        let ring = |points: &[[f64; 2]]| -> LineString<f64> {
            points.iter().map(|&[x, y]| Coord { x, y }).collect()
        };
        let holes = sheet.holes.iter().map(|hole| ring(hole)).collect();
        let polygon = Polygon::new(ring(&sheet.outline), holes).orient(Direction::Default);
        let flat = polygon.earcut_triangles_raw();
        let [bottom, top] = sheet.z;
        for (z, up) in [(bottom, false), (top, true)] {
            let (first, face) = (self.vertices.len(), self.faces());
            self.vertices.extend(flat.vertices.iter().map(|[x, y]| Vector3::new(*x, *y, z)));
            for corners in flat.triangle_indices.as_chunks::<3>().0 {
                let [a, b, c] = corners.map(|corner| flat.vertices[corner]);
                let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
                let [a, b, c] = corners.map(|corner| first + corner);
                self.push(if (area > 0.0) == up { [a, b, c] } else { [a, c, b] }, color, face);
            }
        }
        for ring in std::iter::once(polygon.exterior()).chain(polygon.interiors()) {
            self.add_walls(ring, sheet.z, color);
        }
    }

    /// Adds the sides over a closed ring that has the inside on its left.
    fn add_walls(&mut self, ring: &LineString<f64>, [bottom, top]: [f64; 2], color: Rgb) {
        let mut before: Option<Vector3<f64>> = None;
        for side in ring.lines() {
            let along = Vector3::new(side.dx(), side.dy(), 0.0);
            let turns = before.is_some_and(|before| before.angle(&along) < SMOOTH);
            let face = if turns { self.faces() - 1 } else { self.faces() };
            let first = self.vertices.len();
            for (at, z) in
                [(side.start, bottom), (side.end, bottom), (side.end, top), (side.start, top)]
            {
                self.vertices.push(Vector3::new(at.x, at.y, z));
            }
            self.push([first, first + 1, first + 2], color, face);
            self.push([first, first + 2, first + 3], color, face);
            before = Some(along);
        }
    }

    /// Adds a rod of square section between two points.
    pub fn add_rod(&mut self, from: &Vector3<f64>, to: &Vector3<f64>, width: f64, color: Rgb) {
        let Some(along) = (to - from).try_normalize(0.0) else { return };
        let aside = along.cross(&Vector3::z()).try_normalize(1e-6).unwrap_or(Vector3::x());
        let (aside, above) = (aside * (width / 2.0), along.cross(&aside) * (width / 2.0));
        let first = self.vertices.len();
        for end in [from, to] {
            for (a, b) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)] {
                self.vertices.push(end + aside * a + above * b);
            }
        }
        for quad in
            [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]]
        {
            let [a, b, c, d] = quad.map(|corner| first + corner);
            let face = self.faces();
            self.push([a, b, c], color, face);
            self.push([a, c, d], color, face);
        }
    }

    /// Adds an ellipsoid: the columns of `axes` are its half axes, m, right-handed.
    pub fn add_ellipsoid(&mut self, center: &Vector3<f64>, axes: &Matrix3<f64>, color: Rgb) {
        let (first, face) = (self.vertices.len(), self.faces());
        let circles = MERIDIANS / 2;
        for circle in 0..=circles {
            let (s, c) = (PI * circle as f64 / circles as f64).sin_cos();
            for meridian in 0..MERIDIANS {
                let (y, x) = (2.0 * PI * meridian as f64 / MERIDIANS as f64).sin_cos();
                self.vertices.push(center + axes * Vector3::new(s * x, s * y, c));
            }
        }
        let at = |circle: usize, meridian: usize| first + circle * MERIDIANS + meridian % MERIDIANS;
        for circle in 0..circles {
            for meridian in 0..MERIDIANS {
                let (a, b) = (at(circle, meridian), at(circle + 1, meridian));
                let (c, d) = (at(circle + 1, meridian + 1), at(circle, meridian + 1));
                // At a pole one of the two has no area.
                if circle + 1 < circles {
                    self.push([a, b, c], color, face);
                }
                if circle > 0 {
                    self.push([a, c, d], color, face);
                }
            }
        }
    }
}
