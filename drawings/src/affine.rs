//! Affine maps of the plane.

use crate::curve::Point;

/// The map `p -> x px + y py + o`, with the columns `x`, `y`, `o`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Affine {
    /// The image of the vector (1, 0).
    pub x: Point,
    /// The image of the vector (0, 1).
    pub y: Point,
    /// The image of the origin.
    pub o: Point,
}

impl Affine {
    pub(crate) const IDENTITY: Affine = Affine { x: [1.0, 0.0], y: [0.0, 1.0], o: [0.0, 0.0] };

    /// Moves by `o`.
    pub(crate) fn translation(o: Point) -> Affine {
        Affine { o, ..Affine::IDENTITY }
    }

    /// Scales about the origin.
    pub(crate) fn scaling(x: f64, y: f64) -> Affine {
        Affine { x: [x, 0.0], y: [0.0, y], o: [0.0, 0.0] }
    }

    /// Turns about the origin by an angle in degrees. Quarter turns are exact.
    pub(crate) fn rotation(degrees: f64) -> Affine {
        let (sine, cosine) = sine_cosine(degrees);
        Affine { x: [cosine, sine], y: [-sine, cosine], o: [0.0, 0.0] }
    }

    /// Returns the map that applies `inner` first, then `self`.
    pub(crate) fn after(&self, inner: &Affine) -> Affine {
        Affine { x: self.vector(inner.x), y: self.vector(inner.y), o: self.point(inner.o) }
    }

    /// Maps a point. The identity keeps its bits, so that coordinates of a drawing stay as they are written.
    pub(crate) fn point(&self, p: Point) -> Point {
        if *self == Affine::IDENTITY {
            return p;
        }
        let v = self.vector(p);
        [v[0] + self.o[0], v[1] + self.o[1]]
    }

    /// Maps a vector.
    pub(crate) fn vector(&self, v: Point) -> Point {
        [self.x[0] * v[0] + self.y[0] * v[1], self.x[1] * v[0] + self.y[1] * v[1]]
    }
}

/// Sine and cosine of an angle in degrees, exact at quarter turns.
pub(crate) fn sine_cosine(degrees: f64) -> (f64, f64) {
    let within = degrees % 360.0;
    let turned = if within < 0.0 { within + 360.0 } else { within };
    match turned {
        0.0 | 360.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => libm::sincos(turned.to_radians()),
    }
}
