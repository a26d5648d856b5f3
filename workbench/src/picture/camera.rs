//! The pinhole camera.
//!
//! With unit vectors r (right), u (up), b (back, from the target to the eye e), a point p is seen at
//!
//! ```text
//! d = -b . (p - e),   x = w/2 + f r . (p - e) / d,   y = h/2 - f u . (p - e) / d
//! ```
//!
//! pixels from the upper left corner of a picture w wide and h high, f the focal length in pixels.

use std::str::FromStr;

use nalgebra::Vector3;

/// Half the angle of view across the shorter side at zoom 1, rad.
const HALF_ANGLE: f64 = 0.22;

/// The share of the picture that the framed points fill at zoom 1.
const FILLED: f64 = 0.9;

/// The view: from where the camera looks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// The direction in which the camera stands, rad from x towards y.
    pub azimuth: f64,
    /// Its height above the horizon, rad.
    pub elevation: f64,
    /// 1 shows everything; a larger number shows less, from closer.
    pub zoom: f64,
}

impl Default for View {
    fn default() -> Self {
        Self { azimuth: (-60.0_f64).to_radians(), elevation: 30.0_f64.to_radians(), zoom: 1.0 }
    }
}

impl FromStr for View {
    type Err = String;

    /// `azimuth,elevation[,zoom]`, in degrees.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|number| number.trim().parse().ok()).collect();
        let (azimuth, elevation, zoom) = match numbers.as_deref() {
            Some(&[azimuth, elevation]) => (azimuth, elevation, 1.0),
            Some(&[azimuth, elevation, zoom]) => (azimuth, elevation, zoom),
            _ => return Err("not of the form `azimuth,elevation` or with `,zoom`".to_owned()),
        };
        if !(azimuth.abs() <= 360.0 && elevation.abs() <= 90.0) {
            return Err("azimuth is in -360..360 and elevation in -90..90 degrees".to_owned());
        }
        if !(0.05..=50.0).contains(&zoom) {
            return Err("zoom is between 0.05 and 50".to_owned());
        }
        Ok(Self { azimuth: azimuth.to_radians(), elevation: elevation.to_radians(), zoom })
    }
}

/// A camera that stands still.
#[derive(Clone, Debug)]
pub struct Camera {
    /// Unit vector to the right of the picture, base frame.
    pub right: Vector3<f64>,
    /// Unit vector to its upper edge.
    pub up: Vector3<f64>,
    /// Unit vector from the target to the eye.
    pub back: Vector3<f64>,
    /// m.
    pub eye: Vector3<f64>,
    /// Focal length, pixels.
    pub focal: f64,
    /// Width and height of the picture, pixels.
    pub size: [usize; 2],
}

impl Camera {
    /// A camera that sees all of `points` (base frame, m).
    pub fn framing(points: &[Vector3<f64>], view: View, size: [usize; 2]) -> Self {
        let (sa, ca) = view.azimuth.sin_cos();
        let (se, ce) = view.elevation.sin_cos();
        let right = Vector3::new(-sa, ca, 0.0);
        let up = Vector3::new(-se * ca, -se * sa, ce);
        let back = Vector3::new(ce * ca, ce * sa, se);
        let [width, height] = size.map(|pixels| pixels as f64);
        let focal = width.min(height) / 2.0 / HALF_ANGLE.tan();
        // Half the width and height of what the picture shows at distance 1.
        let [across, along] = [width, height].map(|pixels| FILLED * pixels / 2.0 / focal);

        let mut low = Vector3::repeat(f64::INFINITY);
        let mut high = -low;
        for point in points {
            let seen = Vector3::new(right.dot(point), up.dot(point), back.dot(point));
            (low, high) = (low.inf(&seen), high.sup(&seen));
        }
        if points.is_empty() {
            (low, high) = (Vector3::repeat(-1.0), Vector3::repeat(1.0));
        }
        // Near things look larger, so the middle of the picture is found by iteration.
        let mut middle = (low + high) / 2.0;
        let mut distance = (high - low).norm().max(f64::MIN_POSITIVE);
        for _ in 0..8 {
            distance = (high.z - middle.z) + 1e-3 * distance;
            let [mut left, mut right_most, mut lowest, mut highest] = [0.0_f64; 4];
            for point in points {
                let x = right.dot(point) - middle.x;
                let y = up.dot(point) - middle.y;
                let nearer = back.dot(point) - middle.z;
                distance = distance.max(nearer + x.abs() / across).max(nearer + y.abs() / along);
            }
            for point in points {
                let depth = distance - (back.dot(point) - middle.z);
                let x = (right.dot(point) - middle.x) / depth;
                let y = (up.dot(point) - middle.y) / depth;
                (left, right_most) = (left.min(x), right_most.max(x));
                (lowest, highest) = (lowest.min(y), highest.max(y));
            }
            middle.x += (left + right_most) / 2.0 * distance;
            middle.y += (lowest + highest) / 2.0 * distance;
        }
        let target = right * middle.x + up * middle.y + back * middle.z;
        let eye = target + back * distance;
        Self { right, up, back, eye, focal: focal * view.zoom, size }
    }

    /// The place of a point in the picture: x and y in pixels from the upper left corner, and its depth, m.
    pub fn project(&self, point: &Vector3<f64>) -> [f64; 3] {
        let from_eye = point - self.eye;
        let depth = -self.back.dot(&from_eye);
        let [width, height] = self.size.map(|pixels| pixels as f64);
        [
            width / 2.0 + self.focal * self.right.dot(&from_eye) / depth,
            height / 2.0 - self.focal * self.up.dot(&from_eye) / depth,
            depth,
        ]
    }

    /// The direction that is seen at a place of the picture, at depth 1.
    pub fn ray(&self, x: f64, y: f64) -> Vector3<f64> {
        let [width, height] = self.size.map(|pixels| pixels as f64);
        self.right * ((x - width / 2.0) / self.focal) + self.up * ((height / 2.0 - y) / self.focal)
            - self.back
    }
}
