//! A fit as hinges: lines of one direction share its very bits, lines through a point are laid
//! through it, whatever the digits of their ends.

use nalgebra::{Vector2, Vector3};

use super::Sets;
use super::fit::{Bundle, Common, Fit};
use super::line::Line;
use crate::laminate::{Joint, direction};

/// All joints, those of the fit where it puts them.
pub fn placed(joints: &[Joint], lines: &[Line], bundles: &[&Bundle], fit: &Fit) -> Vec<Joint> {
    let mut parallel = Sets::new(joints.len());
    let mut in_line = Sets::new(joints.len());
    let mut level = Sets::new(joints.len());
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
    let ends = |joint: usize| {
        let moves = fit.joints.binary_search(&joint).map_or([0.0; 2], |i| fit.moves[i]);
        let (from, along) = lines[joint].moved(moves);
        [from, from + along]
    };
    let with = |sets: &Sets, joint: usize| -> Vec<usize> {
        let set = sets.of(joint);
        fit.joints.iter().copied().filter(|other| sets.of(*other) == set).collect()
    };
    let mut placed = joints.to_vec();
    for &joint in &fit.joints {
        let line = with(&in_line, joint);
        // Points the line goes through, exactly.
        let through: Vec<Vector2<f64>> = bundles
            .iter()
            .zip(&fit.common)
            .filter(|(bundle, _)| bundle.common == Common::Point)
            .filter(|(bundle, _)| bundle.joints.iter().any(|joint| line.contains(joint)))
            .map(|(_, point)| *point)
            .collect();
        let pieces: Vec<Vector2<f64>> = line.iter().flat_map(|piece| ends(*piece)).collect();
        let base = through.first().copied().unwrap_or(pieces[0]);
        let group = with(&parallel, joint);
        let shared = bundles.iter().zip(&fit.common).find(|(bundle, _)| {
            bundle.common == Common::Direction && group.contains(&bundle.joints[0])
        });
        let along = match shared {
            Some((_, direction)) => *direction,
            // The longest arm has the most digits.
            None => {
                let far = if through.len() > 1 { &through } else { &pieces };
                let arms = far.iter().map(|point| point - base);
                arms.max_by(|a, b| a.norm().total_cmp(&b.norm())).unwrap_or_default()
            }
        };
        let drawn = &joints[joint];
        let mut along = direction(along.x, along.y);
        if along.dot(&drawn.direction) < 0.0 {
            along = -along;
        }
        let [from, to] = ends(joint).map(|end| base + along.xy() * (end - base).dot(&along.xy()));
        let heights = with(&level, joint);
        let low = heights.iter().map(|joint| lines[*joint].z).fold(f64::INFINITY, f64::min);
        let high = heights.iter().map(|joint| lines[*joint].z).fold(f64::NEG_INFINITY, f64::max);
        placed[joint] = Joint {
            point: Vector3::new(from.x, from.y, low + 0.5 * (high - low)),
            direction: along,
            length: (to - from).norm(),
            ..drawn.clone()
        };
    }
    placed
}
