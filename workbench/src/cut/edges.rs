//! Where plates touch: along hinge lines, and elsewhere.
//!
//! Two edges touch if both ends of one are within a given reach of the line through the other, and
//! their projections on it overlap.

use std::collections::HashMap;

use geo::{Coord, LinesIter, Polygon};

use super::{Line, MM};
use lamc::source::SourceModel;

/// Rounded coordinates move each of two edges, and a hinge line, by at most sqrt(2) tolerances.
pub const ROUNDED: f64 = 3.0;
/// The least reach, as a share of the extent of the plates: rounding errors of doubles.
const LEAST: f64 = 1e-10;
/// How far from a hinge line a gap is looked for, as a share of the line's length.
const STRIP: f64 = 0.25;
/// The shortest slit, mm: what is left over at the ends of hinge lines is shorter.
const SHORTEST: f64 = 1e-3;

/// The group of bodies that cannot move relative to each other: the ground, or one body.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Group {
    /// All fixed bodies.
    Ground,
    /// A body that moves, by its index.
    Body(usize),
}

impl Group {
    /// The group of a body.
    pub fn of(model: &SourceModel, body: usize) -> Self {
        if model.bodies[body].fixed { Self::Ground } else { Self::Body(body) }
    }
}

/// A hinge line, mm.
pub struct Joint {
    /// Its name.
    pub name: String,
    /// The groups of its two bodies.
    pub groups: [Group; 2],
    /// Its ends.
    pub line: Line,
    /// Its height, mm.
    pub height: f64,
}

/// A plate of a layer.
pub struct Plate {
    /// The group of its body.
    pub group: Group,
    /// Its shape, mm.
    pub polygon: Polygon<f64>,
}

/// How the plates of a layer touch at a hinge line.
#[derive(Clone, Default)]
pub struct Hinge {
    /// The parts of the hinge line where plates of both bodies touch: distances from its first end, mm,
    /// in ascending order.
    pub shared: Vec<[f64; 2]>,
    /// How far from the hinge line the touching edges lie at most, mm.
    pub offset: f64,
    /// The narrowest gap between edges of both bodies along the hinge line, mm; None if there are none.
    pub gap: Option<f64>,
}

/// The hinge lines of a model.
pub fn joints(model: &SourceModel) -> Vec<Joint> {
    let joint = |joint: &lamc::source::Joint| Joint {
        name: joint.name.value.clone(),
        groups: joint.bodies.each_ref().map(|body| Group::of(model, body.value.index())),
        line: joint.axis.value.map(|end| end.map(|x| x * MM)),
        height: joint.z.value * MM,
    };
    model.joints.iter().map(joint).collect()
}

/// Where a line lies beside a way.
struct Beside {
    /// The part of the way, mm, in ascending order.
    part: [f64; 2],
    /// How far to the left of the way its middle lies, mm.
    left: f64,
    /// The larger of the distances of its ends from the way, mm.
    distance: f64,
}

/// A straight line with its direction.
#[derive(Clone, Copy)]
pub struct Track {
    from: [f64; 2],
    along: [f64; 2],
    /// Its length, mm.
    pub length: f64,
}

impl Track {
    /// The way from the first point to the second; None if they are the same.
    pub fn new([from, to]: Line) -> Option<Self> {
        let way = [to[0] - from[0], to[1] - from[1]];
        let length = way[0].hypot(way[1]);
        (length > 0.0).then(|| Self { from, along: way.map(|x| x / length), length })
    }

    /// The point at a distance along the way and a distance to the left of it.
    pub fn at(&self, along: f64, left: f64) -> [f64; 2] {
        let [x, y] = self.along;
        [self.from[0] + along * x - left * y, self.from[1] + along * y + left * x]
    }

    /// How far along the way, and how far to the left of it, a point lies.
    fn place(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let [dx, dy] = [x - self.from[0], y - self.from[1]];
        let [a, b] = self.along;
        [dx * a + dy * b, dy * a - dx * b]
    }

    /// Where another line lies beside the way; None if it does not, or further away than `reach`.
    fn beside(&self, other: Line, reach: f64) -> Option<Beside> {
        let [[s, a], [t, b]] = other.map(|end| self.place(end));
        let distance = a.abs().max(b.abs());
        let part = [s.min(t).max(0.0), s.max(t).min(self.length)];
        // A line across the way is beside it for no longer than it is away from it.
        let is_along = (a - b).abs() < (t - s).abs();
        let is_beside = distance <= reach && is_along && part[1] > part[0];
        is_beside.then_some(Beside { part, left: (a + b) / 2.0, distance })
    }
}

/// The edges of a layer's plates.
pub struct Edges {
    /// By their smallest x.
    lines: Vec<(Group, Line)>,
    of_group: HashMap<Group, Vec<Line>>,
    /// Rounding errors of doubles, mm.
    rounding: f64,
}

impl Edges {
    /// All edges of some plates.
    pub fn new(plates: &[Plate]) -> Self {
        let lines = lines(plates);
        let mut of_group: HashMap<Group, Vec<Line>> = HashMap::new();
        for (group, line) in &lines {
            of_group.entry(*group).or_default().push(*line);
        }
        let rounding = LEAST * extent(&lines);
        Self { lines, of_group, rounding }
    }

    /// How the plates touch at a hinge, within `reach`.
    pub fn hinge(&self, joint: &Joint, reach: f64) -> Hinge {
        hinge(&self.of_group, joint, reach.max(self.rounding))
    }

    /// Where plates of different groups touch within `reach` and none of these joints lies.
    pub fn slits<'a>(&self, joints: impl Iterator<Item = &'a Joint>, reach: f64) -> Vec<Line> {
        slits(&self.lines, joints, reach.max(self.rounding))
    }
}

/// All edges of the plates, by their smallest x.
fn lines(plates: &[Plate]) -> Vec<(Group, Line)> {
    let point = |c: Coord<f64>| [c.x, c.y];
    let mut lines: Vec<(Group, Line)> = Vec::new();
    for Plate { group, polygon } in plates {
        lines.extend(
            polygon.lines_iter().map(|line| (*group, [point(line.start), point(line.end)])),
        );
    }
    lines.sort_by(|(_, a), (_, b)| range(a, 0)[0].total_cmp(&range(b, 0)[0]));
    lines
}

/// The largest coordinate, mm.
fn extent(lines: &[(Group, Line)]) -> f64 {
    let coordinates = lines.iter().flat_map(|(_, line)| line.as_flattened());
    coordinates.fold(0.0, |most, x| most.max(x.abs()))
}

/// The smallest and the largest of a coordinate.
fn range(line: &Line, axis: usize) -> [f64; 2] {
    let [a, b] = line.map(|end| end[axis]);
    [a.min(b), a.max(b)]
}

/// Finds where plates of a joint's bodies touch along its line.
fn hinge(lines: &HashMap<Group, Vec<Line>>, joint: &Joint, reach: f64) -> Hinge {
    let mut found = Hinge::default();
    let Some(track) = Track::new(joint.line) else { return found };
    let strip = reach.max(STRIP * track.length);
    let near = joint.groups.map(|group| {
        let lines = lines.get(&group).map_or(&[][..], Vec::as_slice);
        lines.iter().filter_map(|line| track.beside(*line, strip)).collect::<Vec<_>>()
    });
    let [first, second] = near;
    for a in &first {
        for b in &second {
            let part = [a.part[0].max(b.part[0]), a.part[1].min(b.part[1])];
            let gap = (a.left - b.left).abs();
            if part[1] - part[0] <= 2.0 * gap.min(strip) {
                continue;
            }
            found.gap = Some(found.gap.map_or(gap, |narrowest| narrowest.min(gap)));
            let offset = a.distance.max(b.distance);
            if gap <= reach && offset <= reach {
                found.shared.push(part);
                found.offset = found.offset.max(offset);
            }
        }
    }
    found.shared = merged(found.shared);
    found
}

/// Intervals in ascending order, those that overlap or touch as one.
fn merged(mut parts: Vec<[f64; 2]>) -> Vec<[f64; 2]> {
    parts.sort_by(|a, b| a[0].total_cmp(&b[0]));
    let mut merged: Vec<[f64; 2]> = Vec::with_capacity(parts.len());
    for [from, to] in parts {
        match merged.last_mut() {
            Some(last) if from <= last[1] => last[1] = last[1].max(to),
            _ => merged.push([from, to]),
        }
    }
    merged
}

/// What is left of an interval without others, which are in ascending order.
fn without([from, to]: [f64; 2], others: &[[f64; 2]]) -> Vec<[f64; 2]> {
    let (mut left, mut at) = (Vec::new(), from);
    for other in others {
        if other[0] > at {
            left.push([at, other[0].min(to)]);
        }
        at = at.max(other[1]);
    }
    left.push([at, to]);
    left.retain(|[from, to]| to > from);
    left
}

/// Finds where plates of different groups touch and have no hinge.
fn slits<'a>(
    lines: &[(Group, Line)],
    joints: impl Iterator<Item = &'a Joint>,
    reach: f64,
) -> Vec<Line> {
    let mut hinges: HashMap<[Group; 2], Vec<Line>> = HashMap::new();
    for joint in joints {
        let mut groups = joint.groups;
        groups.sort();
        hinges.entry(groups).or_default().push(joint.line);
    }
    let mut slits = Vec::new();
    for (number, (group, line)) in lines.iter().enumerate() {
        let Some(track) = Track::new(*line) else { continue };
        let [[_, right], [low, high]] = [0, 1].map(|axis| range(line, axis));
        for (other, edge) in &lines[number + 1..] {
            if range(edge, 0)[0] > right + reach {
                break;
            }
            let [bottom, top] = range(edge, 1);
            if group == other || bottom > high + reach || top < low - reach {
                continue;
            }
            let Some(contact) = track.beside(*edge, reach) else { continue };
            let mut groups = [*group, *other];
            groups.sort();
            let covers = |hinge: &Line| track.beside(*hinge, reach).map(|hinge| hinge.part);
            let of_pair = hinges.get(&groups).into_iter().flatten();
            let covered = merged(of_pair.filter_map(covers).collect());
            for [from, to] in without(contact.part, &covered) {
                // What rounding leaves over at the end of a hinge line is no slit.
                if to - from > SHORTEST.max(4.0 * reach) {
                    slits.push([track.at(from, 0.0), track.at(to, 0.0)]);
                }
            }
        }
    }
    slits
}
