//! Registration holes: pins through them hold all layers in place.

use geo::Rect;

/// A round hole, mm.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hole {
    /// Its centre, in the coordinates of the model.
    pub center: [f64; 2],
    /// The diameter of the line that the laser follows.
    pub diameter: f64,
}

/// The distance of the centres from the box around all pieces, in x and in y, in diameters.
const DISTANCE: f64 = 2.0;

/// The number of corners of a hole in formats without circles. The polygon is inside the circle by at
/// most 0.12 % of the diameter: 1 - cos(pi / 64).
const CORNERS: usize = 64;

/// Holes at the four corners of a frame around all pieces, counterclockwise from the lower left.
pub fn holes(pieces: Rect<f64>, diameter: f64, kerf: f64) -> Vec<Hole> {
    let away = DISTANCE * diameter;
    let [left, right] = [pieces.min().x - away, pieces.max().x + away];
    let [low, high] = [pieces.min().y - away, pieces.max().y + away];
    let corners = [[left, low], [right, low], [right, high], [left, high]];
    corners.map(|center| Hole { center, diameter: diameter - kerf }).to_vec()
}

impl Hole {
    /// The hole as a polygon.
    pub fn ring(&self) -> super::Ring {
        let corner = |number: usize| {
            let (sine, cosine) = (std::f64::consts::TAU * number as f64 / CORNERS as f64).sin_cos();
            let [x, y] = self.center;
            [x + self.diameter / 2.0 * cosine, y + self.diameter / 2.0 * sine]
        };
        (0..CORNERS).map(corner).collect()
    }
}
