//! Rounded drawings: hinge lines that are parallel, concurrent or in line within the drawing's
//! tolerance are made exactly so.
//!
//! A loop moves because of what its hinge lines have in common, and coordinates of a few decimals
//! destroy that: a planar four-bar drawn at an angle to the axes would be rigid. On the shortest
//! loops ([`cycles`]) are looked for: all lines parallel (planar) or through one point (spherical),
//! else neighbours in a row that are, three or more (as in a Sarrus linkage), or two in line.
//! Whatever shares hinges is then made exact together, with the least movement ([`fit`]).

mod cycles;
mod fit;
mod line;
mod place;

use std::collections::BTreeSet;

use self::fit::{Bundle, Common, WITHIN};
use self::line::Line;
use super::class::{self, CONCURRENT, PARALLEL};
use crate::laminate::{Joint, Mechanism};
use crate::source::Diagnostic;
use crate::source::codes;

/// Largest number of equations solved together, in a second or so.
const MOST_EQUATIONS: usize = 1000;
/// Points that are uncertain by more than this, over the mechanism's size, are none.
const VAGUE: f64 = 0.1;
/// Movements below this, over the mechanism's size, are rounding of doubles: not worth a word.
const UNNOTICED: f64 = 64.0 * f64::EPSILON;
/// What the classification of loops takes for exact.
const FOUND_LATER: [f64; 2] = [PARALLEL, CONCURRENT];

/// Something that hinge lines have in common, exactly or within the tolerance.
struct Found {
    bundle: Bundle,
    is_exact: bool,
    /// Least movement that makes it exact, over what the tolerance allows.
    strain: f64,
    /// Whether it is all lines of a loop.
    is_whole: bool,
}

impl Found {
    /// How well a mechanism does without it: the larger, the better.
    fn dispensability(&self) -> (bool, bool) {
        (!self.is_whole, self.bundle.common == Common::Line)
    }
}

/// Makes exact what the hinge lines have in common within the tolerance; says how far the one
/// moved that moved the farthest.
pub fn straighten(mechanism: &mut Mechanism) -> Option<Diagnostic> {
    if mechanism.tolerance <= 0.0 {
        return None;
    }
    let drawn = mechanism.joints.clone();
    let drawing = Drawing::new(mechanism);
    for group in connected(drawing.everything_found(mechanism), drawn.len()) {
        drawing.make_exact(&mut mechanism.joints, group);
    }
    let moved = drawn.iter().zip(&mechanism.joints).map(|(before, after)| movement(before, after));
    let (farthest, most) = moved.enumerate().max_by(|a, b| a.1.total_cmp(&b.1))?;
    (most > UNNOTICED * mechanism.size).then(|| {
        let message = format!(
            "hinge lines were moved by at most {} to be exactly parallel, concurrent or in line",
            class::millimetres(most)
        );
        let tolerance = class::millimetres(mechanism.tolerance);
        Diagnostic::note(codes::ROUNDED, drawn[farthest].span, message)
            .label("this one the farthest")
            .hint(format!(
                "they are so within the tolerance of {tolerance} per coordinate; `tolerance: 0` \
                 takes them as drawn"
            ))
    })
}

/// How far a hinge line is from the ends it had before, m.
fn movement(before: &Joint, after: &Joint) -> f64 {
    class::ends(before).iter().map(|end| class::distance(after, end)).fold(0.0, f64::max)
}

/// The hinge lines as drawn.
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

    /// What the lines around one loop have in common.
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
        // Three lines of one direction, or through one point, leave three motions, as any three
        // would: it takes a fourth, or another such group, to be mobile by it.
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
        // A row that begins within another is a part of it.
        let is_part = |a: &Bundle, b: &Bundle| {
            a != b && a.common == b.common && a.joints.iter().all(|joint| b.joints.contains(joint))
        };
        let bundles: Vec<Bundle> = found.iter().map(|found| found.bundle.clone()).collect();
        found.retain(|found| !bundles.iter().any(|other| is_part(&found.bundle, other)));
        found
    }

    /// Whether these lines have this in common, exactly or within the tolerance.
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
        // What is as good as exact, but finer than the drawing's own digits say.
        let is_exact = self.agree(&bundle, all, FOUND_LATER);
        is_exact.then_some(Found { bundle, is_exact, strain: 0.0, is_whole: false })
    }

    /// Whether lines may meet at a point that can be told from infinity, where parallel ones do.
    fn meet(&self, lines: &[&Line]) -> bool {
        let is_known = |point| lines.iter().all(|line| line.slack_at(&point) <= VAGUE * self.size);
        fit::strain_of_direction(lines) > WITHIN && fit::common_point(lines).is_some_and(is_known)
    }

    /// Whether lines may be at one height.
    fn are_level(&self, lines: &[&Line]) -> bool {
        let low = lines.iter().map(|line| line.z).fold(f64::INFINITY, f64::min);
        let high = lines.iter().map(|line| line.z).fold(f64::NEG_INFINITY, f64::max);
        high - low <= 2.0 * WITHIN * self.tolerance
    }

    /// Whether the lines have it in common up to a sine, and a distance over the mechanism's size.
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

    /// Moves the hinges of a group of bundles that share lines; leaves out what cannot be exact
    /// together with the rest: what matters least, and of that what strains the drawing most.
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

    /// All joints, those of the bundles moved; `None` where the tolerance does not allow it.
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

/// Bundles that share lines, directly or through others, together.
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

/// Disjoint sets of numbers.
struct Sets(Vec<usize>);

impl Sets {
    fn new(n: usize) -> Self {
        Self((0..n).collect())
    }

    /// The number that stands for the set of another.
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
