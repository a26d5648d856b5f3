//! Divides lines where they cross and where points lie on them, until the network is planar.
//!
//! Each pass divides lines at the points near them, and lines that no point is near to where they
//! cross. Lines that a pass made are compared again in the next one: a line that is divided at a point
//! beside it bends, and may come near others. The passes end, since points stay farther apart than
//! the tolerance and a point counts as near within half of it: then each part is shorter than the
//! line that was divided.

use std::collections::HashMap;

use super::doubles::{Doubles, Known};
use super::limits::{Tolerance, Work, fault};
use super::network::{Index, Line, Network, foot, meeting, orientation};
use super::report::{Report, Sites};
use super::snap::Near;
use crate::fault::{Cause, Fault};

/// A point counts as on a line within this part of the tolerance. Below 1 / sqrt 2, no two sides of a
/// triangle divide each other in turn.
const ON_LINE: f64 = 0.5;

/// Real drawings take three passes.
const MOST_PASSES: usize = 64;

/// Makes a network planar: lines meet only at points, and no two lines join the same points.
pub(super) fn divide(
    network: Network,
    tolerance: Tolerance,
    work: Work,
    doubles: &mut Doubles,
    report: &mut Report,
) -> Result<Network, Fault> {
    let mut state = Division::new(network, tolerance, work);
    let mut crossings = Sites::default();
    for _ in 0..MOST_PASSES {
        let cuts = state.cuts(&mut crossings)?;
        if cuts.is_empty() {
            report.mended(crossings, |sites| {
                let (count, was) = (sites.count("crossing"), sites.was());
                format!("{count} without a vertex {was} given one")
            });
            return Ok(state.network);
        }
        state.apply(cuts, doubles);
        state.work.edges(state.network.lines.len())?;
    }
    Err(fault(
        Cause::Limit,
        "the lines of the drawing are too close to each other for its tolerance".to_owned(),
        "give a smaller tolerance",
    ))
}

struct Division {
    network: Network,
    /// Whether a line was made by the last pass.
    fresh: Vec<bool>,
    points: Near,
    tolerance: Tolerance,
    work: Work,
}

/// The points at which each line is divided.
type Cuts = HashMap<usize, Vec<usize>>;

impl Division {
    fn new(network: Network, tolerance: Tolerance, work: Work) -> Self {
        let mut points = Near::new(tolerance.distance);
        for point in 0..network.points.len() {
            points.add(&network.points, point);
        }
        let fresh = vec![true; network.lines.len()];
        Self { network, fresh, points, tolerance, work }
    }

    /// Returns where the lines must be divided.
    fn cuts(&mut self, sites: &mut Sites) -> Result<Cuts, Fault> {
        let mut cuts = Cuts::new();
        let mut crossing = Vec::new();
        if self.network.lines.is_empty() {
            return Ok(cuts);
        }
        let index = Index::new(&self.network);
        let mut found = Vec::new();
        for line in (0..self.network.lines.len()).filter(|&line| self.fresh[line]) {
            let ends = self.network.ends(&self.network.lines[line]);
            index.near(ends, self.tolerance.distance, &mut found);
            self.work.pairs(found.len(), ends[0])?;
            for &other in &found {
                if other != line && !(self.fresh[other] && other < line) {
                    let near = self.cut_at_ends(line, other, &mut cuts)
                        | self.cut_at_ends(other, line, &mut cuts);
                    if !near && self.cross(line, other) {
                        crossing.push([line, other]);
                    }
                }
            }
        }
        // A line that is divided at a point bends: its crossings are computed in the next pass.
        crossing.retain(|pair| !pair.iter().any(|line| cuts.contains_key(line)));
        for pair in crossing {
            self.cut_at_crossing(pair, &mut cuts, sites);
        }
        Ok(cuts)
    }

    /// Divides a line at those ends of another one that lie on it.
    fn cut_at_ends(&self, line: usize, other: usize, cuts: &mut Cuts) -> bool {
        let [line_ends, other_ends] = [line, other].map(|line| self.network.lines[line].ends);
        let ends = line_ends.map(|end| self.network.points[end]);
        let mut found = false;
        for end in other_ends.into_iter().filter(|end| !line_ends.contains(end)) {
            let away = foot(self.network.points[end], ends).map(|(_, away)| away);
            if away.is_some_and(|away| away <= ON_LINE * self.tolerance.distance) {
                cuts.entry(line).or_default().push(end);
                found = true;
            }
        }
        found
    }

    /// Whether two lines cross between their ends. Exact.
    fn cross(&self, line: usize, other: usize) -> bool {
        let [first, second] = [line, other].map(|line| &self.network.lines[line]);
        if first.ends.iter().any(|end| second.ends.contains(end)) {
            return false;
        }
        let ([a, b], [c, d]) = (self.network.ends(first), self.network.ends(second));
        let opposite = |one: f64, two: f64| (one < 0.0 && two > 0.0) || (one > 0.0 && two < 0.0);
        opposite(orientation(a, b, c), orientation(a, b, d))
            && opposite(orientation(c, d, a), orientation(c, d, b))
    }

    /// Divides two lines where they cross: at a point near by, or at a new one.
    fn cut_at_crossing(&mut self, pair: [usize; 2], cuts: &mut Cuts, sites: &mut Sites) {
        let [first, second] = pair.map(|line| self.network.ends(&self.network.lines[line]));
        let at = meeting(first, second);
        let point = self.points.nearest(&self.network.points, at).unwrap_or_else(|| {
            self.network.points.push(at);
            let point = self.network.points.len() - 1;
            self.points.add(&self.network.points, point);
            sites.note(at, self.network.lines[pair[0]].place);
            point
        });
        for line in pair {
            if !self.network.lines[line].ends.contains(&point) {
                cuts.entry(line).or_default().push(point);
            }
        }
    }

    /// Replaces each line by its parts.
    fn apply(&mut self, mut cuts: Cuts, doubles: &mut Doubles) {
        let lines = std::mem::take(&mut self.network.lines);
        let mut known = Known::with_capacity(lines.len() + cuts.len());
        let mut parts = Vec::new();
        for (index, line) in lines.into_iter().enumerate() {
            match cuts.remove(&index) {
                Some(points) => parts.extend(self.parts(&line, points)),
                None => doubles.keep(&mut self.network, &mut known, line),
            }
        }
        self.fresh = vec![false; self.network.lines.len()];
        for part in parts {
            doubles.keep(&mut self.network, &mut known, part);
        }
        self.fresh.resize(self.network.lines.len(), true);
    }

    /// Returns the parts of a line that is divided at points.
    fn parts(&self, line: &Line, mut points: Vec<usize>) -> Vec<Line> {
        let [a, b] = self.network.ends(line);
        let along = |point: usize| {
            let [x, y] = self.network.points[point];
            (x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])
        };
        points.sort_by(|&one, &two| along(one).total_cmp(&along(two)).then(one.cmp(&two)));
        points.dedup();
        let chain: Vec<usize> = std::iter::once(line.ends[0])
            .chain(points)
            .chain(std::iter::once(line.ends[1]))
            .collect();
        chain.windows(2).map(|pair| line.between([pair[0], pair[1]])).collect()
    }
}
