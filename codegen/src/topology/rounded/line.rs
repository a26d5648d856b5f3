//! A hinge line as drawn, with the tolerance of its ends.

use nalgebra::Vector2;

use crate::laminate::Joint;

/// Lines whose direction is more uncertain than this, rad, have no usable direction.
const VAGUE: f64 = 0.1;

/// A hinge line in the plane of the sheet. Its ends move perpendicular to it only, because moving
/// them along it does not change the line.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Drawn ends, m.
    pub ends: [Vector2<f64>; 2],
    /// Unit normal.
    pub normal: Vector2<f64>,
    /// Length, m.
    pub length: f64,
    /// Tolerance of each end perpendicular to the line, m, from the tolerance of both coordinates.
    pub slack: f64,
    /// Height, m.
    pub z: f64,
}

impl Line {
    /// Creates the line of a joint in a drawing with this tolerance.
    pub fn new(joint: &Joint, tolerance: f64) -> Self {
        let (from, along) = (joint.point.xy(), joint.direction.xy());
        let normal = Vector2::new(-along.y, along.x);
        Self {
            ends: [from, from + along * joint.length],
            normal,
            length: joint.length,
            slack: tolerance * (normal.x.abs() + normal.y.abs()),
            z: joint.point.z,
        }
    }

    /// Returns the tolerance of its direction, rad.
    pub fn angle_slack(&self) -> f64 {
        2.0 * self.slack / self.length
    }

    /// Returns whether its direction is known in spite of rounding.
    pub fn is_certain(&self) -> bool {
        self.angle_slack() <= VAGUE
    }

    /// Returns the tolerance of the line at a point on it, m: it is larger beyond the ends.
    pub fn slack_at(&self, point: &Vector2<f64>) -> f64 {
        let along = Vector2::new(self.normal.y, -self.normal.x);
        let share = (point - self.ends[0]).dot(&along) / self.length;
        self.slack * (2.0 * share - 1.0).abs().max(1.0)
    }

    /// Returns the vector from the first to the second end after the ends are moved perpendicular
    /// to the line by these lengths.
    pub fn moved(&self, [first, second]: [f64; 2]) -> (Vector2<f64>, Vector2<f64>) {
        let from = self.ends[0] + self.normal * first;
        (from, self.ends[1] - self.ends[0] + self.normal * (second - first))
    }

    /// Returns the distance of a point from the moved line, with its derivatives by the movements of both
    /// ends and by the point.
    pub fn through(&self, moves: [f64; 2], point: &Vector2<f64>) -> ([f64; 2], Vector2<f64>, f64) {
        let (from, along) = self.moved(moves);
        let arm = point - from;
        let turn = cross(&self.normal, &arm) / self.length;
        let shift = cross(&along, &self.normal) / self.length;
        let by_point = Vector2::new(-along.y, along.x) / self.length;
        ([-turn - shift, turn], by_point, cross(&along, &arm) / self.length)
    }

    /// Returns the distance of a point from the line as drawn, m.
    pub fn distance(&self, point: &Vector2<f64>) -> f64 {
        (point - self.ends[0]).dot(&self.normal).abs()
    }

    /// Returns the sine of the angle to another line, whatever their sense.
    pub fn sine(&self, other: &Self) -> f64 {
        cross(&self.normal, &other.normal).abs()
    }
}

/// Returns the z component of the cross product.
pub fn cross(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}
