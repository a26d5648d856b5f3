//! Joins ends that are near each other, and moves ends onto the lines on which they nearly end.

use std::collections::HashMap;

use super::doubles::Doubles;
use super::limits::{Tolerance, Work};
use super::network::{Index, Line, Network, Point, distance, foot, meeting};
use super::report::{Report, Sites, number};
use crate::drawing::Drawing;
use crate::fault::Fault;

/// Returns the network of all strokes, in which points within the tolerance are one point.
///
/// A group of near points takes the exact coordinates of the member at which most strokes end; among
/// equals, of the member at the end of the longest stroke, whose direction would change least visibly
/// but along which most other lines end. Each member moves by at most the tolerance.
pub(super) fn join_ends(
    drawing: &Drawing,
    tolerance: Tolerance,
    doubles: &mut Doubles,
    report: &mut Report,
) -> Network {
    let mut network = Network::default();
    let mut known: HashMap<[u64; 2], usize> = HashMap::with_capacity(drawing.strokes.len());
    for stroke in &drawing.strokes {
        let ends = stroke.ends.map(|end| {
            // Adding zero turns -0 into 0.
            let end = end.map(|coordinate| coordinate + 0.0);
            *known.entry(end.map(f64::to_bits)).or_insert_with(|| {
                network.points.push(end);
                network.points.len() - 1
            })
        });
        network.lines.push(Line::of(stroke, ends));
    }
    let mut joined = Sites::default();
    let mut short = Sites::default();
    join_points(&mut network, tolerance, &mut joined, &mut short);
    doubles.merge_all(&mut network);
    report.mended(joined, |sites| {
        let (count, was) = (sites.count("end"), sites.was());
        let farthest = number(sites.farthest);
        format!("{count} {was} joined with an end near by, at most {farthest} away")
    });
    report.mended(short, |sites| {
        let (count, was) = (sites.count("stroke"), sites.was());
        format!("{count} {was} left out: shorter than the tolerance")
    });
    network
}

/// Makes points within the tolerance one point, and removes lines that become a point.
fn join_points(network: &mut Network, tolerance: Tolerance, joined: &mut Sites, short: &mut Sites) {
    let count = network.points.len();
    let mut strokes = vec![0_usize; count];
    let mut longest = vec![0.0_f64; count];
    for line in &network.lines {
        let length = network.length(line);
        for end in line.ends {
            strokes[end] += 1;
            longest[end] = longest[end].max(length);
        }
    }
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|&a, &b| {
        strokes[b].cmp(&strokes[a]).then(longest[b].total_cmp(&longest[a])).then(a.cmp(&b))
    });
    let mut near = Near::new(tolerance.distance);
    let mut kept: Vec<usize> = (0..count).collect();
    for point in order {
        match near.nearest(&network.points, network.points[point]) {
            Some(other) => kept[point] = other,
            None => near.add(&network.points, point),
        }
    }
    let mut noted = vec![false; count];
    for line in &mut network.lines {
        for end in line.ends {
            let away = distance(network.points[end], network.points[kept[end]]);
            if away > tolerance.rounding && !std::mem::replace(&mut noted[end], true) {
                joined.moved(network.points[kept[end]], away, line.place);
            }
        }
        line.ends = line.ends.map(|end| kept[end]);
    }
    let points = &network.points;
    network.lines.retain(|line| {
        let [a, b] = line.ends;
        if a == b {
            short.note(points[a], line.place);
        }
        a != b
    });
    network.compact();
}

/// Moves each point that is within the tolerance of a line onto this line, so that the line stays
/// straight when it is divided there. Near two lines, the point moves to where they meet.
pub(super) fn land_ends(
    network: &mut Network,
    tolerance: Tolerance,
    work: &mut Work,
    doubles: &mut Doubles,
    report: &mut Report,
) -> Result<(), Fault> {
    if network.lines.is_empty() {
        return Ok(());
    }
    let near_lines = near_lines(network, tolerance, work)?;
    if near_lines.is_empty() {
        return Ok(());
    }
    let drawn = network.points.clone();
    // A line whose own end moves takes along what ends on it: the second round follows.
    const ROUNDS: usize = 3;
    for _ in 0..ROUNDS {
        for (point, lines) in &near_lines {
            let target = landing(network, drawn[*point], lines, tolerance);
            network.points[*point] = target.unwrap_or(network.points[*point]);
        }
    }
    let mut landed = Sites::default();
    for (point, lines) in &near_lines {
        let away = distance(drawn[*point], network.points[*point]);
        if away > tolerance.rounding {
            landed.moved(network.points[*point], away, network.lines[lines[0]].place);
        }
    }
    report.mended(landed, |sites| {
        let (count, was) = (sites.count("end"), sites.was());
        let farthest = number(sites.farthest);
        let ends = if sites.at.len() == 1 { "it ends" } else { "they end" };
        format!("{count} {was} moved onto the line on which {ends}, by at most {farthest}")
    });
    join_points(network, tolerance, &mut Sites::default(), &mut Sites::default());
    doubles.merge_all(network);
    Ok(())
}

/// Returns the points that are beside a line, farther than rounding and within the tolerance, each
/// with all lines that it is near to, the longest first.
fn near_lines(
    network: &Network,
    tolerance: Tolerance,
    work: &mut Work,
) -> Result<Vec<(usize, Vec<usize>)>, Fault> {
    let index = Index::new(network);
    let mut result = Vec::new();
    let mut found = Vec::new();
    for (point, &at) in network.points.iter().enumerate() {
        index.near([at, at], tolerance.distance, &mut found);
        work.pairs(found.len(), at)?;
        let mut farthest = 0.0_f64;
        found.retain(|&line| {
            let line = &network.lines[line];
            let away = foot(at, network.ends(line)).map(|(_, away)| away);
            let away =
                away.filter(|&away| away <= tolerance.distance && !line.ends.contains(&point));
            farthest = farthest.max(away.unwrap_or(0.0));
            away.is_some()
        });
        if farthest > tolerance.rounding {
            found.sort_by(|&a, &b| {
                let [a, b] = [a, b].map(|line| network.length(&network.lines[line]));
                b.total_cmp(&a)
            });
            result.push((point, found.clone()));
        }
    }
    Ok(result)
}

/// Returns the place on the lines that a point moves to, if one is within the tolerance.
fn landing(
    network: &Network,
    drawn: Point,
    lines: &[usize],
    tolerance: Tolerance,
) -> Option<Point> {
    let ends = |line: usize| network.ends(&network.lines[line]);
    let within = |target: &Point| distance(*target, drawn) <= tolerance.distance;
    let first = ends(lines[0]);
    let crossing = lines[1..].iter().map(|&line| meeting(first, ends(line))).find(within);
    crossing.or_else(|| {
        let (position, _) = foot(drawn, first)?;
        let [a, b] = first;
        let target = [a[0] + position * (b[0] - a[0]), a[1] + position * (b[1] - a[1])];
        Some(target).filter(within)
    })
}

/// Finds points within a distance of a place, on a grid of squares of this size.
pub(super) struct Near {
    distance: f64,
    squares: HashMap<[i64; 2], Vec<usize>>,
}

impl Near {
    /// Creates an empty grid.
    pub(super) fn new(distance: f64) -> Self {
        Self { distance, squares: HashMap::new() }
    }

    /// Adds a point.
    pub(super) fn add(&mut self, points: &[Point], point: usize) {
        self.squares.entry(self.square(points[point])).or_default().push(point);
    }

    /// Returns the point that is nearest to a place, if one is within the distance.
    pub(super) fn nearest(&self, points: &[Point], place: Point) -> Option<usize> {
        let [column, row] = self.square(place);
        let mut best = (self.distance, None);
        for square in (-1..=1).flat_map(|x| (-1..=1).map(move |y| [column + x, row + y])) {
            for &point in self.squares.get(&square).map_or(&[][..], Vec::as_slice) {
                let away = distance(points[point], place);
                if away < best.0 || (away == best.0 && best.1.is_none()) {
                    best = (away, Some(point));
                }
            }
        }
        best.1
    }

    fn square(&self, place: Point) -> [i64; 2] {
        place.map(|coordinate| (coordinate / self.distance).floor() as i64)
    }
}
