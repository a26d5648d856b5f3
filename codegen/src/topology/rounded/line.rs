//! A hinge line as it is drawn, and how far its ends may be from where they are meant.

use nalgebra::Vector2;

use crate::laminate::Joint;

/// Lines whose direction is uncertain by more than this, rad, have none to speak of.
const VAGUE: f64 = 0.1;

/// A hinge line in the plane of the sheet. Its ends move across it only: moving them along it
/// leaves the line as it is.
#[derive(Clone, Copy, Debug)]
pub struct Line {
    /// Drawn ends, m.
    pub ends: [Vector2<f64>; 2],
    /// Unit normal.
    pub normal: Vector2<f64>,
    /// m.
    pub length: f64,
    /// How far each end may be off across the line, m: the tolerance of both coordinates.
    pub slack: f64,
    /// Height, m.
    pub z: f64,
}

impl Line {
    /// A joint's line in a drawing of this tolerance.
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

    /// By how much its direction may be off, rad.
    pub fn angle_slack(&self) -> f64 {
        2.0 * self.slack / self.length
    }

    /// Whether rounding leaves it a direction.
    pub fn is_certain(&self) -> bool {
        self.angle_slack() <= VAGUE
    }

    /// How far the line may be off at a point on it, m: more beyond its ends.
    pub fn slack_at(&self, point: &Vector2<f64>) -> f64 {
        let along = Vector2::new(self.normal.y, -self.normal.x);
        let share = (point - self.ends[0]).dot(&along) / self.length;
        self.slack * (2.0 * share - 1.0).abs().max(1.0)
    }

    /// The line with its ends moved across it by these lengths: from its first end to its second.
    pub fn moved(&self, [first, second]: [f64; 2]) -> (Vector2<f64>, Vector2<f64>) {
        let from = self.ends[0] + self.normal * first;
        (from, self.ends[1] - self.ends[0] + self.normal * (second - first))
    }

    /// Distance of a point from the line as drawn, m.
    pub fn distance(&self, point: &Vector2<f64>) -> f64 {
        (point - self.ends[0]).dot(&self.normal).abs()
    }

    /// Sine of the angle to another line, whatever their sense.
    pub fn sine(&self, other: &Self) -> f64 {
        cross(&self.normal, &other.normal).abs()
    }
}

/// z component of the cross product.
pub fn cross(a: &Vector2<f64>, b: &Vector2<f64>) -> f64 {
    a.x * b.y - a.y * b.x
}
