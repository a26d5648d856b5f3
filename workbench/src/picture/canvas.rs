//! The canvas: linear light per pixel, blended lines, ground and sky.

use nalgebra::{Vector3, Vector4};

use super::{Camera, Picture};
use crate::scene::{Rgb, round_up};

/// Red, green and blue light, 0 to 1 and linear; the fourth number is unused.
pub type Linear = Vector4<f32>;

/// Light of a colour on the screen (sRGB's curve taken as a power of 2.2).
pub fn linear(color: Rgb) -> Linear {
    let [r, g, b] = color.map(|part| (f32::from(part) / 255.0).powf(2.2));
    Linear::new(r, g, b, 0.0)
}

/// A picture while it is drawn.
pub struct Canvas {
    width: usize,
    height: usize,
    /// Pixels by rows, from the top.
    pub pixels: Vec<Linear>,
}

impl Canvas {
    /// Creates a black canvas.
    pub fn new(width: usize, height: usize) -> Self {
        Self { width, height, pixels: vec![Linear::zeros(); width * height] }
    }

    /// Pixels of one unit: lengths are given for pictures 600 pixels high.
    pub fn unit(&self) -> f64 {
        self.width.min(self.height) as f64 / 600.0
    }

    /// Blends in a line with round ends between two places (x, y, nearness), as far as `shown`
    /// says (0 to 1) of each of its pixels.
    pub fn line(
        &mut self,
        [a, b]: [[f64; 3]; 2],
        thickness: f64,
        color: Linear,
        shown: impl Fn(&[f64; 3]) -> f32,
    ) {
        let half = (thickness * self.unit()).max(1.0) / 2.0;
        let along: [f64; 3] = std::array::from_fn(|index| b[index] - a[index]);
        let length = along[0] * along[0] + along[1] * along[1];
        let range = |axis: usize, most: usize| {
            let low = a[axis].min(b[axis]) - half - 1.0;
            let high = a[axis].max(b[axis]) + half + 1.0;
            // Casts saturate.
            (low as usize)..(high as usize + 1).min(most)
        };
        for row in range(1, self.height) {
            for column in range(0, self.width) {
                let [x, y] = [column as f64 + 0.5, row as f64 + 0.5];
                let share = ((x - a[0]) * along[0] + (y - a[1]) * along[1]) / length;
                let share = if length > 0.0 { share.clamp(0.0, 1.0) } else { 0.0 };
                let [dx, dy] = [x - a[0] - share * along[0], y - a[1] - share * along[1]];
                let covered = (half + 0.5 - dx.hypot(dy)).clamp(0.0, 1.0) as f32;
                if covered > 0.0 {
                    let weight = covered * shown(&[x, y, a[2] + share * along[2]]);
                    let pixel = &mut self.pixels[row * self.width + column];
                    *pixel = *pixel * (1.0 - weight) + color * weight;
                }
            }
        }
    }

    /// The directions of the base frame's axes, in the lower left corner.
    pub fn axes(&mut self, camera: &Camera) {
        /// Strokes of the letters x, y, z in a square from -1 to 1, y upwards.
        const LETTERS: [&[[f64; 4]]; 3] = [
            &[[-0.8, -1.0, 0.8, 1.0], [-0.8, 1.0, 0.8, -1.0]],
            &[[-0.8, 1.0, 0.0, 0.0], [0.8, 1.0, 0.0, 0.0], [0.0, 0.0, 0.0, -1.0]],
            &[[-0.8, 1.0, 0.8, 1.0], [0.8, 1.0, -0.8, -1.0], [-0.8, -1.0, 0.8, -1.0]],
        ];
        const COLORS: [Rgb; 3] = [[200, 45, 45], [40, 140, 60], [45, 85, 200]];
        let unit = self.unit();
        let origin = [62.0 * unit, self.height as f64 - 62.0 * unit, 0.0];
        let mut axes = [0, 1, 2];
        // Axes that point away from the camera are drawn first.
        axes.sort_by(|a, b| camera.back[*a].total_cmp(&camera.back[*b]));
        for axis in axes {
            let color = linear(COLORS[axis]);
            let [x, y] = [camera.right[axis], -camera.up[axis]];
            let tip =
                |length: f64| [origin[0] + length * unit * x, origin[1] + length * unit * y, 0.0];
            self.line([origin, tip(36.0)], 2.4, color, |_| 1.0);
            // An axis that points at the camera has no room for its letter.
            if x.hypot(y) < 0.25 {
                continue;
            }
            let middle = tip(48.0);
            for [x0, y0, x1, y1] in LETTERS[axis] {
                let place =
                    |x: f64, y: f64| [middle[0] + 5.0 * unit * x, middle[1] - 5.0 * unit * y, 0.0];
                self.line([place(*x0, *y0), place(*x1, *y1)], 1.5, color, |_| 1.0);
            }
        }
    }

    /// Writes a force: a text that ends at a place, of the characters that there are strokes for.
    pub fn label(&mut self, text: &str, [right, middle]: [f64; 2], color: Linear) {
        let (unit, mut left) = (self.unit(), right);
        for letter in text.chars().rev() {
            left -= 10.0 * unit;
            for [x0, y0, x1, y1] in strokes(letter) {
                let place =
                    |x: f64, y: f64| [left + (5.0 + 5.0 * x) * unit, middle - 6.0 * unit * y, 0.0];
                self.line([place(*x0, *y0), place(*x1, *y1)], 1.5, color, |_| 1.0);
            }
        }
    }

    /// Converts light to the numbers of a screen (sRGB).
    pub fn picture(&self) -> Picture {
        let curve: Vec<u8> = (0..=4095_u16)
            .map(|light| (255.0 * (f32::from(light) / 4095.0).powf(1.0 / 2.2)).round() as u8)
            .collect();
        let part = |light: f32| curve[(light.clamp(0.0, 1.0) * 4095.0) as usize];
        let rgb = self.pixels.iter().flat_map(|p| [part(p.x), part(p.y), part(p.z)]).collect();
        Picture { width: self.width, height: self.height, rgb }
    }
}

/// Strokes of a character in a square from -1 to 1, y upwards.
fn strokes(letter: char) -> &'static [[f64; 4]] {
    match letter {
        '0' => &[
            [-0.5, -1.0, 0.5, -1.0],
            [0.5, -1.0, 0.5, 1.0],
            [0.5, 1.0, -0.5, 1.0],
            [-0.5, 1.0, -0.5, -1.0],
        ],
        '1' => &[[-0.4, 0.6, 0.1, 1.0], [0.1, 1.0, 0.1, -1.0]],
        '2' => &[
            [-0.5, 1.0, 0.5, 1.0],
            [0.5, 1.0, 0.5, 0.1],
            [0.5, 0.1, -0.5, -1.0],
            [-0.5, -1.0, 0.5, -1.0],
        ],
        '5' => &[
            [0.5, 1.0, -0.4, 1.0],
            [-0.4, 1.0, -0.5, 0.1],
            [-0.5, 0.1, 0.5, 0.1],
            [0.5, 0.1, 0.5, -1.0],
            [0.5, -1.0, -0.5, -1.0],
        ],
        'N' => &[[-0.6, -1.0, -0.6, 1.0], [-0.6, 1.0, 0.6, -1.0], [0.6, -1.0, 0.6, 1.0]],
        'k' => &[[-0.5, -1.0, -0.5, 1.0], [0.5, 0.3, -0.5, -0.3], [-0.2, -0.1, 0.5, -1.0]],
        'm' => &[
            [-0.7, -1.0, -0.7, 0.2],
            [-0.7, 0.2, 0.7, 0.2],
            [0.0, 0.2, 0.0, -1.0],
            [0.7, 0.2, 0.7, -1.0],
        ],
        'n' => &[[-0.5, -1.0, -0.5, 0.2], [-0.5, 0.2, 0.5, 0.2], [0.5, 0.2, 0.5, -1.0]],
        'u' => &[[-0.5, 0.2, -0.5, -1.0], [-0.5, -1.0, 0.5, -1.0], [0.5, -1.0, 0.5, 0.2]],
        _ => &[],
    }
}

/// The point of the ground, at a height, that is seen at a place of the picture.
pub fn on_ground(camera: &Camera, x: f64, y: f64, ground: f64) -> Option<Vector3<f64>> {
    let ray = camera.ray(x, y);
    let depth = (ground - camera.eye.z) / ray.z;
    (depth > 0.0 && ray.z < 0.0).then(|| camera.eye + ray * depth)
}

/// Sky, and the ground with a grid about the shadows that can fall there.
pub fn background(camera: &Camera, shadows: &[Vector3<f64>], ground: f64) -> Vec<Linear> {
    let start = shadows.first().copied().unwrap_or_default();
    let low = shadows.iter().fold(start, |low, point| low.inf(point));
    let high = shadows.iter().fold(start, |high, point| high.sup(point));
    let (middle, reach) = ((low + high) / 2.0, (high - low).norm().max(f64::MIN_POSITIVE));
    let square = round_up(reach / 12.0);
    let [width, height] = camera.size;
    let [paper, line] = [linear([246, 247, 249]), linear([205, 210, 217])];
    let mut pixels = Vec::with_capacity(width * height);
    for row in 0..height {
        let fall = row as f32 / height as f32;
        let sky = paper * (1.0 - 0.10 * fall);
        for column in 0..width {
            // Sixteen samples: the grid is fine far away.
            let mut drawn = 0.0;
            for sample in 0..16 {
                let [x, y] = [
                    column as f64 + 0.125 + f64::from(sample % 4) / 4.0,
                    row as f64 + 0.125 + f64::from(sample / 4) / 4.0,
                ];
                let Some(point) = on_ground(camera, x, y, ground) else { continue };
                let from =
                    |axis: usize| (point[axis] / square - (point[axis] / square).round()).abs();
                let pixel = (point - camera.eye).norm() / camera.focal / square;
                let away = (point - middle).norm() / reach;
                if from(0).min(from(1)) < 0.6 * pixel {
                    drawn += (1.4 - 1.4 * away).clamp(0.0, 1.0) as f32 / 16.0;
                }
            }
            pixels.push(sky * (1.0 - drawn) + line * drawn);
        }
    }
    pixels
}
