//! The sun: its direction, and the points that it reaches. A grid perpendicular to its rays holds the heights
//! of the first surfaces it hits; points below them are in shadow.

use nalgebra::Vector3;

use super::raster::Raster;

/// Samples across the grid.
const SAMPLES: usize = 1024;

/// Samples across the penumbra.
const SOFT: usize = 4;

/// Parallel light and its shadows.
#[derive(Clone, Debug)]
pub struct Light {
    /// Unit vector towards the sun, base frame.
    pub direction: Vector3<f64>,
    axes: [Vector3<f64>; 2],
    /// Lower corner of the grid along the axes and the direction, m.
    corner: Vector3<f64>,
    /// Samples per metre.
    scale: f64,
    hit: Raster,
}

impl Light {
    /// Light from a direction, rad, on everything among `points`.
    pub fn new(azimuth: f64, elevation: f64, points: &[Vector3<f64>]) -> Self {
        let (sa, ca) = azimuth.sin_cos();
        let (se, ce) = elevation.sin_cos();
        let direction = Vector3::new(ce * ca, ce * sa, se);
        let axes = [Vector3::new(-sa, ca, 0.0), Vector3::new(-se * ca, -se * sa, ce)];
        let place = |point: &Vector3<f64>| {
            Vector3::new(axes[0].dot(point), axes[1].dot(point), direction.dot(point))
        };
        let first = points.first().map_or_else(Vector3::zeros, place);
        let low = points.iter().fold(first, |low, point| low.inf(&place(point)));
        let high = points.iter().fold(first, |high, point| high.sup(&place(point)));
        let across = (high - low).max().max(f64::MIN_POSITIVE);
        // A margin, so that penumbras end within the grid and no height is 0.
        let corner = low - Vector3::repeat(0.02 * across);
        let scale = SAMPLES as f64 / (1.04 * across);
        Self { direction, axes, corner, scale, hit: Raster::new(SAMPLES, SAMPLES) }
    }

    /// A point on the grid: column, row, and height above its lower corner, m.
    fn place(&self, point: &Vector3<f64>) -> [f64; 3] {
        let from = |axis: &Vector3<f64>, index: usize| axis.dot(point) - self.corner[index];
        let [column, row] = [0, 1].map(|axis| from(&self.axes[axis], axis) * self.scale);
        [column, row, from(&self.direction, 2)]
    }

    /// Forgets all shadows.
    pub fn clear(&mut self) {
        self.hit.clear();
    }

    /// Adds the shadow of a triangle.
    pub fn cast(&mut self, corners: &[Vector3<f64>; 3]) {
        self.hit.triangle(&[0, 1, 2].map(|corner| self.place(&corners[corner])), 0);
    }

    /// The share of the light that reaches a point, 0 to 1. `facing` is the cosine of the angle
    /// between the light and the normal of the surface there.
    pub fn reaches(&self, point: &Vector3<f64>, facing: f32) -> f32 {
        let [column, row, height] = self.place(point);
        let half = SOFT as f64 / 2.0;
        let inside = |at: f64| at > half && at < SAMPLES as f64 - half;
        if !(inside(column) && inside(row)) {
            return 1.0;
        }
        let corner = |at: f64| (at - half) as usize;
        let (column, row) = (corner(column), corner(row));
        if !self.hit.may_hold([column, row], SOFT) {
            return 1.0;
        }
        // A slanted surface is no obstacle to itself: within the samples looked at it rises so far.
        let slope = f64::from((1.0 - facing * facing).max(0.0).sqrt() / facing.max(0.05));
        let height = (height + (0.75 * SOFT as f64 * slope + 0.5) / self.scale).max(0.0) as f32;
        let mut reached = 0;
        for row in row..row + SOFT {
            let hits = &self.hit.near[row * SAMPLES + column..][..SOFT];
            reached += hits.iter().map(|hit| i32::from(*hit <= height)).sum::<i32>();
        }
        reached as f32 / (SOFT * SOFT) as f32
    }
}
