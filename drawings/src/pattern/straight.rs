//! Removes points that divide a straight line into two of the same kind.
//!
//! Drawings have such points where a line was drawn in pieces, or where a line was that is gone. Two
//! pieces of a crease are one joint, and readers of crease patterns count them once (Origami Simulator
//! removes these points too, up to a bend of 8 deg; here they go if no point of the line moves by more
//! than a quarter of the tolerance, within which no other point can be).

use super::doubles::differ;
use super::limits::Tolerance;
use super::network::{Line, Network, Point, distance, foot, lexicographic};

/// A line counts as straight if it bends by less than this part of the tolerance. Points and lines are
/// at least half a tolerance apart (`crossings`), so two lines made straight cannot meet.
const STRAIGHT: f64 = 0.25;

/// Removes all points of degree two on straight lines of one role and one angle.
pub(super) fn merge_straight(network: &mut Network, tolerance: Tolerance) {
    let mut lines_at: Vec<Vec<usize>> = vec![Vec::new(); network.points.len()];
    for (index, line) in network.lines.iter().enumerate() {
        line.ends.into_iter().for_each(|end| lines_at[end].push(index));
    }
    // A point inside a chain: two lines alike meet there and no other.
    let inner: Vec<bool> = lines_at
        .iter()
        .map(|lines| match lines[..] {
            [a, b] => alike(&network.lines[a], &network.lines[b]),
            _ => false,
        })
        .collect();
    let mut used = vec![false; network.lines.len()];
    let mut merged = Vec::with_capacity(network.lines.len());
    // What is left after the chains with ends are rings, which begin at a corner: the leftmost point.
    let (mut starts, ends): (Vec<usize>, Vec<usize>) =
        (0..network.points.len()).partition(|&point| inner[point]);
    starts.sort_by(|&a, &b| lexicographic(network.points[a], network.points[b]));
    for start in ends.into_iter().chain(starts) {
        for &first in &lines_at[start] {
            if !used[first] {
                let chain = follow(network, &lines_at, &inner, &mut used, start, first);
                merge_chain(network, &chain, tolerance, &mut merged);
            }
        }
    }
    // The order of the file.
    merged.sort_by_key(|&(index, _)| index);
    network.lines = merged.into_iter().map(|(_, line)| line).collect();
}

/// Whether two lines may be one.
fn alike(a: &Line, b: &Line) -> bool {
    a.role == b.role
        && a.fold.is_some() == b.fold.is_some()
        && a.angle.is_some() == b.angle.is_some()
        && !differ(a.fold, b.fold)
        && !differ(a.angle, b.angle)
}

/// A line through points of degree two.
struct Chain {
    /// Its points, one more than lines.
    points: Vec<usize>,
    lines: Vec<usize>,
}

/// Returns the chain that begins with a line.
fn follow(
    network: &Network,
    lines_at: &[Vec<usize>],
    inner: &[bool],
    used: &mut [bool],
    start: usize,
    first: usize,
) -> Chain {
    let mut points = vec![start];
    let mut lines = Vec::new();
    let mut line = first;
    loop {
        used[line] = true;
        lines.push(line);
        let [a, b] = network.lines[line].ends;
        let end = if points.last() == Some(&a) { b } else { a };
        points.push(end);
        let next = lines_at[end].iter().copied().find(|&next| !used[next]);
        match next {
            Some(next) if inner[end] => line = next,
            _ => return Chain { points, lines },
        }
    }
}

/// Keeps of a chain the points at which it bends (D. Douglas and T. Peucker, 1973).
///
/// The corners that bend visibly against their neighbours divide the chain first, so that a zigzag
/// takes linear time.
fn merge_chain(
    network: &Network,
    chain: &Chain,
    tolerance: Tolerance,
    merged: &mut Vec<(usize, Line)>,
) {
    let at = |position: usize| network.points[chain.points[position]];
    let limit = STRAIGHT * tolerance.distance;
    let visible = (1..chain.lines.len())
        .filter(|&middle| away(at(middle), [at(middle - 1), at(middle + 1)]) > limit);
    let ends: Vec<usize> =
        std::iter::once(0).chain(visible).chain(std::iter::once(chain.lines.len())).collect();
    let mut corners = vec![0];
    let mut open: Vec<(usize, usize)> = ends.windows(2).map(|pair| (pair[0], pair[1])).collect();
    open.reverse();
    while let Some((from, to)) = open.pop() {
        let away = |position: &usize| away(at(*position), [at(from), at(to)]);
        let farthest = (from + 1..to).max_by(|a, b| away(a).total_cmp(&away(b)));
        match farthest {
            Some(corner) if away(&corner) > limit => {
                open.extend([(corner, to), (from, corner)]);
            }
            _ => corners.push(to),
        }
    }
    for pair in corners.windows(2) {
        let [from, to] = [pair[0], pair[1]];
        // The first of them in the file counts, with its direction.
        let Some(first) = (from..to).min_by_key(|&position| chain.lines[position]) else {
            continue;
        };
        let line = &network.lines[chain.lines[first]];
        let forward = line.ends[0] == chain.points[first];
        let [a, b] = if forward { [from, to] } else { [to, from] };
        merged.push((chain.lines[first], line.between([chain.points[a], chain.points[b]])));
    }
}

/// Returns the distance of a point from the line between two points.
fn away(point: Point, ends: [Point; 2]) -> f64 {
    let from_ends = distance(point, ends[0]).min(distance(point, ends[1]));
    match foot(point, ends) {
        Some((_, away)) => away,
        None => from_ends,
    }
}
