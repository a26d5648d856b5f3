//! Rounded drawings: hinge lines that are parallel, concurrent or in line within the drawing's
//! tolerance are moved to make this exact.
//!
//! A loop can move because its hinge lines are parallel or concurrent, and coordinates with a few
//! decimals destroy this: a planar four-bar linkage drawn at an angle to the axes would be rigid.
//! In the shortest loops ([`cycles`]) this module looks for lines that are all parallel (planar) or
//! pass through one point (spherical), else for three or more neighbours that do so (as in a Sarrus
//! linkage), or two in line. Groups that share hinges are then made exact together, with the
//! smallest movement ([`fit`]).

mod fit;
mod line;
mod place;
mod sheet;

use std::collections::BTreeSet;

use nalgebra::DVector;

use self::fit::{Bundle, Common, WITHIN};
use self::line::Line;
pub use self::sheet::Vertex;
use super::class::{self, CONCURRENT, PARALLEL};
use super::cycles;
use crate::arithmetic::largest;
use crate::laminate::{Joint, Mechanism};
use crate::source::Diagnostic;
use crate::source::codes;

/// Largest number of equations that are solved together, which takes about a second.
const MOST_EQUATIONS: usize = 1000;
/// Points that are more uncertain than this, relative to the mechanism's size, are not used.
const VAGUE: f64 = 0.1;
/// Movements below this, relative to the mechanism's size, are rounding of doubles and not
/// reported.
const UNNOTICED: f64 = 64.0 * f64::EPSILON;
/// Deviation that the classification of loops regards as exact.
const FOUND_LATER: [f64; 2] = [PARALLEL, CONCURRENT];

/// A relation of hinge lines that holds exactly or within the tolerance.
struct Found {
    bundle: Bundle,
    is_exact: bool,
    /// Smallest movement that makes it exact, relative to the tolerance.
    strain: f64,
    /// Whether it is all lines of a loop.
    is_whole: bool,
}

impl Found {
    /// Priority for leaving it out: the larger, the less important is the relation.
    fn dispensability(&self) -> (bool, bool) {
        (!self.is_whole, self.bundle.common == Common::Line)
    }
}

/// Makes relations of hinge lines that hold within the tolerance exact.
pub fn straighten(mechanism: &mut Mechanism) {
    if mechanism.tolerance <= 0.0 {
        return;
    }
    let drawing = Drawing::new(mechanism);
    let groups = connected(drawing.everything_found(mechanism), mechanism.joints.len());
    for group in groups {
        drawing.make_exact(&mut mechanism.joints, group);
    }
}

/// Returns the joints after a small movement within the tolerance with which vertices that lock each other
/// move together, if there is one that is more than rounding of doubles. `drawn` are the joints as drawn, `states` nearly closed
/// configurations, in which pivots of the closure below `small` are due to rounding.
pub fn unlocked(
    mechanism: &Mechanism,
    drawn: &[Joint],
    vertices: &[Vertex],
    states: &[DVector<f64>],
    small: f64,
) -> Option<Vec<Joint>> {
    let Mechanism { joints, tolerance, size, .. } = mechanism;
    let lines: Vec<Line> = drawn.iter().map(|joint| Line::new(joint, *tolerance)).collect();
    let moved = sheet::unlocked(joints, &lines, vertices, states, [*size, small])?;
    let farthest = largest(joints.iter().zip(&moved).map(|(a, b)| movement(a, b)));
    (farthest > UNNOTICED * size).then_some(moved)
}

/// Reports the largest movement of a hinge line from where it is drawn, and whether it lets all loops close
/// `together`.
pub fn report(mechanism: &Mechanism, drawn: &[Joint], together: bool) -> Option<Diagnostic> {
    let moved = drawn.iter().zip(&mechanism.joints).map(|(before, after)| movement(before, after));
    let (farthest, most) = moved.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    let purpose = match together {
        true => "so that all loops close together",
        false => "to be exactly parallel, concurrent or in line",
    };
    (most > UNNOTICED * mechanism.size).then(|| {
        let most = class::millimetres(most);
        let message = format!("hinge lines were moved by at most {most} {purpose}");
        let tolerance = class::millimetres(mechanism.tolerance);
        Diagnostic::note(codes::ROUNDED, drawn[farthest].span, message)
            .label("this one was moved most")
            .hint(format!(
                "they already are within the tolerance of {tolerance} per coordinate; \
                 `tolerance: 0` uses them as drawn"
            ))
    })
}

/// Returns the distance of a hinge line from its previous ends, m.
fn movement(before: &Joint, after: &Joint) -> f64 {
    largest(class::ends(before).iter().map(|end| class::distance(after, end)))
}

/// Returns the hinge lines as drawn.
struct Drawing {
    lines: Vec<Line>,
    tolerance: f64,
    size: f64,
}

impl Drawing {
    fn new(mechanism: &Mechanism) -> Self {
        let Mechanism { joints, tolerance, size, .. } = mechanism;
        let lines = joints.iter().map(|joint| Line::new(joint, *tolerance)).collect();
        Self { lines, tolerance: *tolerance, size: *size }
    }

    fn everything_found(&self, mechanism: &Mechanism) -> Vec<Found> {
        let mut seen = BTreeSet::new();
        let mut found = Vec::new();
        for cycle in cycles::shortest(mechanism) {
            let cycle: Vec<usize> = cycle.iter().map(|joint| joint.index()).collect();
            let new = self.around(&cycle, &mechanism.joints).into_iter();
            found.extend(new.filter(|found| seen.insert(found.bundle.clone())));
        }
        found
    }

    /// Returns the relations of the lines around one loop.
    fn around(&self, cycle: &[usize], joints: &[Joint]) -> Vec<Found> {
        let n = cycle.len();
        let whole = |common| {
            let found = self.judge(common, cycle.to_vec(), joints)?;
            Some(Found { is_whole: true, ..found })
        };
        if n == 2 {
            return whole(Common::Line).into_iter().collect();
        }
        if let Some(found) = whole(Common::Direction).or_else(|| whole(Common::Point)) {
            return vec![found];
        }
        let mut found: Vec<Found> = Vec::new();
        // Three parallel or concurrent lines allow three motions, like any three lines: only a
        // fourth line, or another such group, makes the loop mobile because of it.
        let least = if n < 6 { 4 } else { 3 };
        for (common, least) in
            [(Common::Direction, least), (Common::Point, least), (Common::Line, 2)]
        {
            for start in 0..n {
                let most = if common == Common::Line { 2 } else { n - 1 };
                let row = |length: usize| (0..length).map(|i| cycle[(start + i) % n]).collect();
                let judged =
                    (least..=most).map_while(|length| self.judge(common, row(length), joints));
                found.extend(judged.last());
            }
        }
        // A row that begins within another row is part of that row.
        let is_part = |a: &Bundle, b: &Bundle| {
            a != b && a.common == b.common && a.joints.iter().all(|joint| b.joints.contains(joint))
        };
        let bundles: Vec<Bundle> = found.iter().map(|found| found.bundle.clone()).collect();
        found.retain(|found| !bundles.iter().any(|other| is_part(&found.bundle, other)));
        found
    }

    /// Returns whether this relation holds for these lines, exactly or within the tolerance.
    fn judge(&self, common: Common, mut joints: Vec<usize>, all: &[Joint]) -> Option<Found> {
        joints.sort_unstable();
        let bundle = Bundle { common, joints };
        if self.agree(&bundle, all, [UNNOTICED; 2]) {
            return Some(Found { bundle, is_exact: true, strain: 0.0, is_whole: false });
        }
        let lines: Vec<&Line> = bundle.joints.iter().map(|joint| &self.lines[*joint]).collect();
        let close =
            || lines[0].sine(lines[1]) <= 2.0 * (lines[0].angle_slack() + lines[1].angle_slack());
        let possible = lines.iter().all(|line| line.is_certain())
            && match common {
                Common::Direction => fit::strain_of_direction(&lines) <= WITHIN,
                Common::Point => self.are_level(&lines) && self.meet(&lines),
                Common::Line => self.are_level(&lines) && close(),
            };
        if let Some(fit) = possible.then(|| fit::fit(&self.lines, &[&bundle])).flatten() {
            return Some(Found { bundle, is_exact: false, strain: fit.strain, is_whole: false });
        }
        // The relation is exact up to rounding, more exactly than the digits of the drawing
        // require.
        let is_exact = self.agree(&bundle, all, FOUND_LATER);
        is_exact.then_some(Found { bundle, is_exact, strain: 0.0, is_whole: false })
    }

    /// Returns whether lines may meet at a point that can be distinguished from infinity, where
    /// parallel lines meet.
    fn meet(&self, lines: &[&Line]) -> bool {
        let is_known = |point| lines.iter().all(|line| line.slack_at(&point) <= VAGUE * self.size);
        fit::strain_of_direction(lines) > WITHIN && fit::common_point(lines).is_some_and(is_known)
    }

    /// Returns whether lines may have the same height.
    fn are_level(&self, lines: &[&Line]) -> bool {
        let low = lines.iter().map(|line| line.z).fold(f64::INFINITY, f64::min);
        let high = lines.iter().map(|line| line.z).fold(f64::NEG_INFINITY, f64::max);
        high - low <= 2.0 * WITHIN * self.tolerance
    }

    /// Returns whether the relation holds up to a sine and a distance relative to the mechanism's
    /// size.
    fn agree(&self, bundle: &Bundle, joints: &[Joint], [sine, distance]: [f64; 2]) -> bool {
        let distance = distance * self.size;
        let hinges: Vec<&Joint> = bundle.joints.iter().map(|joint| &joints[*joint]).collect();
        let first = hinges[0];
        let parallel = || hinges.iter().all(|h| class::angle(h.direction, first.direction) <= sine);
        match bundle.common {
            Common::Direction => parallel(),
            Common::Point => class::nearest_point(&hinges)
                .is_some_and(|point| class::miss(&hinges, &point) <= distance),
            Common::Line => parallel() && movement(hinges[1], first) <= distance,
        }
    }

    /// Moves the hinges of a group of bundles that share lines. Bundles that cannot be exact
    /// together with the others are left out: first the least important, and among these the one
    /// that needs the largest movement.
    fn make_exact(&self, joints: &mut [Joint], mut group: Vec<Found>) {
        while group.iter().any(|found| !found.is_exact) {
            let bundles: Vec<&Bundle> = group.iter().map(|found| &found.bundle).collect();
            let equations: usize = bundles.iter().map(|bundle| bundle.joints.len()).sum();
            if equations > MOST_EQUATIONS {
                return;
            }
            if let Some(moved) = self.moved(joints, &bundles) {
                joints.clone_from_slice(&moved);
                return;
            }
            let worst = (0..group.len()).max_by(|a, b| {
                let [a, b] = [a, b].map(|i| &group[*i]);
                let order = a.dispensability().cmp(&b.dispensability());
                order.then(a.strain.total_cmp(&b.strain))
            });
            worst.map(|worst| group.remove(worst));
        }
    }

    /// Returns all joints after the bundles are moved; `None` if the tolerance does not allow it.
    fn moved(&self, joints: &[Joint], bundles: &[&Bundle]) -> Option<Vec<Joint>> {
        let fit = fit::fit(&self.lines, bundles)?;
        let moved = place::placed(joints, &self.lines, bundles, &fit);
        let level = fit.joints.iter().all(|joint| {
            (moved[*joint].point.z - self.lines[*joint].z).abs() <= WITHIN * self.tolerance
        });
        let exact = bundles.iter().all(|bundle| self.agree(bundle, &moved, FOUND_LATER));
        (level && exact).then_some(moved)
    }
}

/// Returns groups of bundles that share lines, directly or through others.
fn connected(found: Vec<Found>, joints: usize) -> Vec<Vec<Found>> {
    let mut sets = Sets::new(joints);
    for found in &found {
        found.bundle.joints.iter().for_each(|joint| sets.join(found.bundle.joints[0], *joint));
    }
    let mut groups: Vec<Vec<Found>> = (0..joints).map(|_| Vec::new()).collect();
    for found in found {
        groups[sets.of(found.bundle.joints[0])].push(found);
    }
    groups.retain(|group| !group.is_empty());
    groups
}

/// Disjoint sets of indices.
struct Sets(Vec<usize>);

impl Sets {
    fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    /// Returns the representative of the set of an index.
    fn of(&self, mut number: usize) -> usize {
        while self.0[number] != number {
            number = self.0[number];
        }
        number
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.of(a), self.of(b));
        self.0[a.max(b)] = a.min(b);
    }
}
