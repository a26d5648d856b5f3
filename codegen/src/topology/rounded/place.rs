//! Applies a fit to the hinges: parallel lines get exactly the same direction, and concurrent lines
//! pass exactly through their common point.

use nalgebra::{Vector2, Vector3};

use super::Sets;
use super::fit::{Bundle, Common, Fit};
use super::line::Line;
use crate::laminate::{Joint, direction};

/// Returns all joints, with those of the fit moved.
pub fn placed(joints: &[Joint], lines: &[Line], bundles: &[&Bundle], fit: &Fit) -> Vec<Joint> {
    let placement = Placement { lines, bundles, fit, sets: SharedSets::new(joints.len(), bundles) };
    let mut placed = joints.to_vec();
    for &joint in &fit.joints {
        placed[joint] = placement.place(joint, &joints[joint]);
    }
    placed
}

/// Sets of joints that share a direction, a line or a height above the sheet.
struct SharedSets {
    parallel: Sets,
    in_line: Sets,
    level: Sets,
}

impl SharedSets {
    fn new(joints: usize, bundles: &[&Bundle]) -> Self {
        let [mut parallel, mut in_line, mut level] = [(); 3].map(|()| Sets::new(joints));
        for bundle in bundles {
            for &joint in &bundle.joints {
                let first = bundle.joints[0];
                if bundle.common != Common::Point {
                    parallel.join(first, joint);
                }
                if bundle.common == Common::Line {
                    in_line.join(first, joint);
                }
                if bundle.common != Common::Direction {
                    level.join(first, joint);
                }
            }
        }
        Self { parallel, in_line, level }
    }
}

struct Placement<'a> {
    lines: &'a [Line],
    bundles: &'a [&'a Bundle],
    fit: &'a Fit,
    sets: SharedSets,
}

impl Placement<'_> {
    /// Moves a joint of the fit; `drawn` is the joint as it was.
    fn place(&self, joint: usize, drawn: &Joint) -> Joint {
        let line = self.with(&self.sets.in_line, joint);
        let through = self.points_of(&line);
        let pieces: Vec<Vector2<f64>> = line.iter().flat_map(|piece| self.ends(*piece)).collect();
        let base = through.first().copied().unwrap_or(pieces[0]);
        let along = self.shared_direction(joint).unwrap_or_else(|| {
            // The point farthest away gives the most accurate direction.
            let far = if through.len() > 1 { &through } else { &pieces };
            let arms = far.iter().map(|point| point - base);
            arms.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default()
        });
        let mut along = direction(along.x, along.y);
        if along.dot(&drawn.direction) < 0.0 {
            along = -along;
        }
        let on_line = |end: Vector2<f64>| base + along.xy() * (end - base).dot(&along.xy());
        let [from, to] = self.ends(joint).map(on_line);
        let heights = self.with(&self.sets.level, joint);
        let heights = || heights.iter().map(|joint| self.lines[*joint].z);
        let low = heights().fold(f64::INFINITY, f64::min);
        let high = heights().fold(f64::NEG_INFINITY, f64::max);
        Joint {
            point: Vector3::new(from.x, from.y, low + 0.5 * (high - low)),
            direction: along,
            length: (to - from).norm(),
            ..drawn.clone()
        }
    }

    /// Returns the ends of a hinge after the fit.
    fn ends(&self, joint: usize) -> [Vector2<f64>; 2] {
        let place = self.fit.joints.binary_search(&joint);
        let moves = place.map_or([0.0; 2], |place| self.fit.moves[place]);
        let (from, along) = self.lines[joint].moved(moves);
        [from, from + along]
    }

    /// Returns the joints of the fit that are in the same set as a joint.
    fn with(&self, sets: &Sets, joint: usize) -> Vec<usize> {
        let set = sets.of(joint);
        self.fit.joints.iter().copied().filter(|other| sets.of(*other) == set).collect()
    }

    /// Returns the points through which a line of hinges passes exactly.
    fn points_of(&self, line: &[usize]) -> Vec<Vector2<f64>> {
        let bundles = self.bundles.iter().zip(&self.fit.common);
        bundles
            .filter(|(bundle, _)| bundle.common == Common::Point)
            .filter(|(bundle, _)| bundle.joints.iter().any(|joint| line.contains(joint)))
            .map(|(_, point)| *point)
            .collect()
    }

    /// Returns the direction that a joint shares with others.
    fn shared_direction(&self, joint: usize) -> Option<Vector2<f64>> {
        let group = self.with(&self.sets.parallel, joint);
        let mut bundles = self.bundles.iter().zip(&self.fit.common);
        let shared = bundles.find(|(bundle, _)| {
            bundle.common == Common::Direction && group.contains(&bundle.joints[0])
        });
        shared.map(|(_, direction)| *direction)
    }
}
