//! Lines that are drawn twice: which of two roles counts.

use std::collections::HashMap;
use std::collections::hash_map::Entry;

use super::network::{Line, Network, Point};
use super::report::{Report, Sites};
use crate::drawing::Role;
use crate::fault::Cause;

/// Two angles in files that differ by less are the same, rad: files have angles in degrees with few
/// digits.
const SAME_ANGLE: f64 = 1e-6;

/// Collects what is drawn twice.
#[derive(Default)]
pub(super) struct Doubles {
    same: Sites,
    other: Sites,
    contradictory: Sites,
    angles: Sites,
}

/// The lines of a network by the points that they join.
pub(super) type Known = HashMap<[usize; 2], usize>;

impl Doubles {
    /// Merges all lines of a network that join the same points.
    pub(super) fn merge_all(&mut self, network: &mut Network) {
        let lines = std::mem::take(&mut network.lines);
        let mut known = Known::with_capacity(lines.len());
        for line in lines {
            self.keep(network, &mut known, line);
        }
    }

    /// Adds a line to a network, or merges it with the line that joins the same points.
    pub(super) fn keep(&mut self, network: &mut Network, known: &mut Known, line: Line) {
        match known.entry(line.key()) {
            Entry::Vacant(entry) => {
                entry.insert(network.lines.len());
                network.lines.push(line);
            }
            Entry::Occupied(entry) => {
                let ends = network.ends(&line);
                self.merge(&mut network.lines[*entry.get()], line, ends);
            }
        }
    }

    /// Merges a line into the line that joins the same points.
    ///
    /// A cut counts more than a border, and both more than a crease: what is cut does not fold. A
    /// mountain or a valley counts more than a hinge, which only leaves its direction open, and a hinge
    /// more than a flat line, which programs add for a triangulation. Between a mountain and a valley
    /// the line that the file has first counts, and the contradiction is reported.
    fn merge(&mut self, kept: &mut Line, line: Line, [a, b]: [Point; 2]) {
        let middle = [0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])];
        let place = kept.place.max(line.place);
        let first = kept.place <= line.place;
        let sites = match rank(line.role).cmp(&rank(kept.role)) {
            _ if line.role == kept.role => {
                if differ(kept.fold, line.fold) {
                    self.angles.note(middle, place);
                }
                let later = if first {
                    line
                } else {
                    let earlier = line.between(kept.ends);
                    std::mem::replace(kept, earlier)
                };
                kept.fold = kept.fold.or(later.fold);
                kept.angle = kept.angle.or(later.angle);
                &mut self.same
            }
            std::cmp::Ordering::Equal => {
                if !first {
                    *kept = line.between(kept.ends);
                }
                &mut self.contradictory
            }
            std::cmp::Ordering::Greater => {
                *kept = line.between(kept.ends);
                &mut self.other
            }
            std::cmp::Ordering::Less => &mut self.other,
        };
        sites.note(middle, place);
    }

    /// Reports what was merged.
    pub(super) fn report(self, report: &mut Report) {
        report.mended(self.same, |sites| {
            let (count, was) = (sites.count("line"), sites.was());
            format!("{count} that {was} drawn twice {was} kept once")
        });
        report.mended(self.other, |sites| {
            let (count, was) = (sites.count("line"), sites.was());
            format!(
                "{count} that {was} drawn with two roles got the one that counts more: cut, \
                 border, mountain or valley, hinge, flat"
            )
        });
        report.doubt(
            Cause::Contradiction,
            self.contradictory,
            "keep one of the two lines",
            |sites| {
                let (count, was) = (sites.count("line"), sites.was());
                format!("{count} {was} drawn both as mountain and as valley: the first one counts")
            },
        );
        report.doubt(Cause::Contradiction, self.angles, "keep one of the two lines", |sites| {
            let (count, was) = (sites.count("line"), sites.was());
            format!("{count} {was} drawn twice with different target angles: the first one counts")
        });
    }
}

/// Whether both angles are given, and differ.
pub(super) fn differ(one: Option<f64>, two: Option<f64>) -> bool {
    one.zip(two).is_some_and(|(one, two)| (one - two).abs() > SAME_ANGLE)
}

fn rank(role: Role) -> usize {
    match role {
        Role::Flat => 0,
        Role::Hinge => 1,
        Role::Mountain | Role::Valley => 2,
        Role::Border => 3,
        Role::Cut => 4,
    }
}
