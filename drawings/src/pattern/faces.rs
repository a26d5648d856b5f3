//! The faces of a graph that is planar as it is drawn, for files that list no faces.

use super::limits::Work;
use super::network::{Index, Line, Network, Point, orientation};
use super::regions::{OUTSIDE, Regions, origin};
use crate::drawing::{Place, Role};
use crate::fault::Fault;

/// Returns the vertices around each bounded region of a graph, counterclockwise; None if two of its edges cross
/// or touch other than at their ends.
///
/// # Errors
///
/// The edges are too many, or too close to each other, to be compared.
pub(crate) fn faces(
    points: &[Point],
    edges: &[[usize; 2]],
) -> Result<Option<Vec<Vec<usize>>>, Fault> {
    let mut work = Work::default();
    work.edges(edges.len())?;
    let line =
        |ends| Line { ends, role: Role::Hinge, fold: None, angle: None, place: Place::default() };
    let lines = edges.iter().map(|ends| line(*ends)).collect();
    let network = Network { points: points.to_vec(), lines };
    if !is_planar(&network, &mut work)? {
        return Ok(None);
    }
    let regions = Regions::of(&network)?;
    let bounded = regions.loops.iter().enumerate().filter(|(region, _)| *region != OUTSIDE);
    let outlines = bounded.filter_map(|(_, loops)| loops.first());
    let vertices = |outline: &Vec<usize>| outline.iter().map(|it| origin(&network, *it)).collect();
    Ok(Some(outlines.map(vertices).collect()))
}

/// Whether lines meet at their ends only.
fn is_planar(network: &Network, work: &mut Work) -> Result<bool, Fault> {
    let index = Index::new(network);
    let mut near = Vec::new();
    for (number, line) in network.lines.iter().enumerate() {
        let ends @ [a, b] = network.ends(line);
        if a == b {
            return Ok(false);
        }
        index.near(ends, 0.0, &mut near);
        work.pairs(near.len(), a)?;
        let others = near.iter().filter(|&&other| other > number);
        if others.into_iter().any(|&other| meet(network, line, &network.lines[other])) {
            return Ok(false);
        }
    }
    Ok(true)
}

/// Whether two lines have a point in common that is not an end of both.
fn meet(network: &Network, one: &Line, other: &Line) -> bool {
    let ([a, b], [c, d]) = (network.ends(one), network.ends(other));
    let common = one.ends.iter().filter(|end| other.ends.contains(end)).count();
    match common {
        0 => {
            let sides = |p, q, r, s| orientation(p, q, r) * orientation(p, q, s);
            let (across, along) = (sides(a, b, c, d), sides(c, d, a, b));
            let touches =
                |p, [q, r]: [Point; 2]| orientation(q, r, p) == 0.0 && is_within(p, [q, r]);
            (across < 0.0 && along < 0.0)
                || [c, d].into_iter().any(|end| touches(end, [a, b]))
                || [a, b].into_iter().any(|end| touches(end, [c, d]))
        }
        1 => {
            // They go on from the common end in one direction.
            let shared = if other.ends.contains(&one.ends[0]) { a } else { b };
            let [p, q] = [if shared == a { b } else { a }, if shared == c { d } else { c }];
            let ahead =
                (p[0] - shared[0]) * (q[0] - shared[0]) + (p[1] - shared[1]) * (q[1] - shared[1]);
            orientation(shared, p, q) == 0.0 && ahead > 0.0
        }
        _ => true,
    }
}

/// Whether a point on the line through two points is within the box of both.
fn is_within(point: Point, [a, b]: [Point; 2]) -> bool {
    (0..2).all(|axis| (a[axis].min(b[axis])..=a[axis].max(b[axis])).contains(&point[axis]))
}
