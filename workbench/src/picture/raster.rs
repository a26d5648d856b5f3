//! Rasterisation: the nearest triangle at each sample of a grid.

use std::ops::Range;

/// The nearest triangle at each sample.
#[derive(Clone, Debug)]
pub struct Raster {
    /// Samples per row.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Nearness, by rows: a greater one hides a lesser one; 0 if there is no triangle.
    pub near: Vec<f32>,
    /// The number of the triangle, as given to [`triangle`](Self::triangle); [`NOTHING`] if there is none.
    pub what: Vec<u32>,
    /// Columns and rows; there is no triangle elsewhere.
    drawn: [Range<usize>; 2],
}

/// No triangle.
pub const NOTHING: u32 = u32::MAX;

impl Raster {
    /// An empty grid.
    pub fn new(width: usize, height: usize) -> Self {
        let samples = width * height;
        let (near, what) = (vec![0.0; samples], vec![NOTHING; samples]);
        Self { width, height, near, what, drawn: [width..0, height..0] }
    }

    /// Empties the grid.
    pub fn clear(&mut self) {
        let [columns, rows] = [self.width..0, self.height..0];
        let [columns, rows] = std::mem::replace(&mut self.drawn, [columns, rows]);
        for row in rows {
            let drawn = row * self.width + columns.start..row * self.width + columns.end;
            self.near[drawn.clone()].fill(0.0);
            self.what[drawn].fill(NOTHING);
        }
    }

    /// Whether a triangle may be at one of the samples of a square, whose first column and row these are.
    pub fn may_hold(&self, [column, row]: [usize; 2], side: usize) -> bool {
        let meets = |drawn: &Range<usize>, at: usize| at < drawn.end && at + side > drawn.start;
        meets(&self.drawn[0], column) && meets(&self.drawn[1], row)
    }

    /// Draws a triangle where it is nearest. Corners are (x, y, nearness), sample (i, j) is at
    /// (i + 1/2, j + 1/2), and nearness is linear across the triangle.
    pub fn triangle(&mut self, corners: &[[f64; 3]; 3], what: u32) {
        let [a, b, c] = corners;
        let area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
        if !area.is_normal() {
            return;
        }
        // Nearness = n0 + nx x + ny y.
        let nx = ((b[2] - a[2]) * (c[1] - a[1]) - (c[2] - a[2]) * (b[1] - a[1])) / area;
        let ny = ((c[2] - a[2]) * (b[0] - a[0]) - (b[2] - a[2]) * (c[0] - a[0])) / area;
        let low = a[1].min(b[1]).min(c[1]);
        let high = a[1].max(b[1]).max(c[1]);
        // Casts saturate: what is left of or above the grid begins at 0.
        let first_row = (low - 0.5).ceil() as usize;
        let last_row = ((high - 0.5).floor() + 1.0).min(self.height as f64) as usize;
        for row in first_row..last_row {
            let y = row as f64 + 0.5;
            let (mut left, mut right) = (f64::INFINITY, f64::NEG_INFINITY);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if (from[1] <= y) != (to[1] <= y) {
                    let x = from[0] + (y - from[1]) / (to[1] - from[1]) * (to[0] - from[0]);
                    (left, right) = (left.min(x), right.max(x));
                }
            }
            let first = (left - 0.5).ceil() as usize;
            let last = ((right - 0.5).floor() + 1.0).min(self.width as f64) as usize;
            if first >= last {
                continue;
            }
            let [columns, rows] = &mut self.drawn;
            *columns = columns.start.min(first)..columns.end.max(last);
            *rows = rows.start.min(row)..rows.end.max(row + 1);
            let start = (a[2] + nx * (first as f64 + 0.5 - a[0]) + ny * (y - a[1])) as f32;
            let slope = nx as f32;
            let at = row * self.width;
            let near = &mut self.near[at + first..at + last];
            let held = &mut self.what[at + first..at + last];
            // This has no branch, so that the compiler computes several samples at once.
            for ((near, held), step) in near.iter_mut().zip(held).zip(0_i32..) {
                let here = start + slope * step as f32;
                *held = if here > *near { what } else { *held };
                *near = near.max(here);
            }
        }
    }
}
