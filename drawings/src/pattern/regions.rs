//! The regions into which a planar network divides the plane, by exact predicates.
//!
//! Each line is two half-edges, one for each direction: half-edge 2 i runs from the first end of
//! line i to the second, 2 i + 1 back. The region to the left of a half-edge is the same for all
//! half-edges of a loop. Each connected component has one loop around it; all its other loops are the
//! outer boundaries of regions. The region in which a component lies is found below its leftmost point.

use std::cmp::Ordering;

use super::limits::Work;
use super::network::{Index, Network, Point, lexicographic, orientation};
use crate::fault::Fault;

/// The region around everything.
pub(super) const OUTSIDE: usize = 0;

/// The regions of a planar network.
#[derive(Debug)]
pub(super) struct Regions {
    /// The region to the left of each half-edge.
    pub(super) left: Vec<usize>,
    /// The boundaries of each region: first its outer one, counterclockwise, then those of the
    /// components inside, clockwise. [`OUTSIDE`] has no outer one.
    pub(super) loops: Vec<Vec<Vec<usize>>>,
    /// The connected component of each point; points without a line have none.
    pub(super) component: Vec<Option<usize>>,
    /// The region in which each component lies.
    pub(super) around: Vec<usize>,
}

impl Regions {
    /// Finds the regions.
    pub(super) fn of(network: &Network) -> Result<Self, Fault> {
        let fans = fans(network);
        let (loop_of, loops) = follow(&successors(network, &fans));
        let (component, leftmost) = components(network);
        // To the left of the last half-edge at its leftmost point is the outside of a component.
        let rims: Vec<usize> = leftmost
            .iter()
            .filter_map(|&point| fans[point].last().map(|&half_edge| loop_of[half_edge]))
            .collect();
        let mut is_rim = vec![false; loops.len()];
        for &rim in &rims {
            is_rim[rim] = true;
        }
        // Each other loop is the outer boundary of a region.
        let mut region_of = vec![OUTSIDE; loops.len()];
        let mut count = OUTSIDE + 1;
        for index in (0..loops.len()).filter(|&index| !is_rim[index]) {
            region_of[index] = count;
            count += 1;
        }
        let below = below(network, &leftmost, &component)?;
        let mut around = vec![OUTSIDE; leftmost.len()];
        // What lies below a component is farther left, and settled before it.
        let mut order: Vec<usize> = (0..leftmost.len()).collect();
        order.sort_by(|&a, &b| {
            let [a, b] = [a, b].map(|component| network.points[leftmost[component]]);
            lexicographic(a, b)
        });
        for own in order {
            let Some(half_edge) = below[own] else { continue };
            let other = component[network.lines[half_edge / 2].ends[0]];
            around[own] = match other {
                Some(other) if is_rim[loop_of[half_edge]] => around[other],
                _ => region_of[loop_of[half_edge]],
            };
        }
        for (own, &rim) in rims.iter().enumerate() {
            region_of[rim] = around[own];
        }
        let left = loop_of.iter().map(|&index| region_of[index]).collect();
        let mut by_region = vec![Vec::new(); count];
        let (outer, inner): (Vec<_>, Vec<_>) =
            loops.into_iter().enumerate().partition(|(index, _)| !is_rim[*index]);
        for (index, half_edges) in outer.into_iter().chain(inner) {
            by_region[region_of[index]].push(half_edges);
        }
        Ok(Self { left, loops: by_region, component, around })
    }

    /// Returns the regions to the left and to the right of a line.
    pub(super) fn beside(&self, line: usize) -> [usize; 2] {
        [self.left[2 * line], self.left[2 * line + 1]]
    }
}

/// Returns the point at which a half-edge starts.
pub(super) fn origin(network: &Network, half_edge: usize) -> usize {
    network.lines[half_edge / 2].ends[half_edge % 2]
}

/// Returns the half-edges that start at each point, counterclockwise, from the direction straight
/// down (not included) on.
fn fans(network: &Network) -> Vec<Vec<usize>> {
    let mut fans = vec![Vec::new(); network.points.len()];
    for half_edge in 0..2 * network.lines.len() {
        fans[origin(network, half_edge)].push(half_edge);
    }
    for (point, fan) in fans.iter_mut().enumerate() {
        let center = network.points[point];
        let tip = |half_edge: usize| network.points[origin(network, half_edge ^ 1)];
        fan.sort_by(|&a, &b| turn(center, tip(a), tip(b)));
    }
    fans
}

/// Compares two directions from a point by their angle from -90 deg (not included) to 270 deg. Exact.
fn turn(center: Point, a: Point, b: Point) -> Ordering {
    // On the right are the directions from -90 deg (not included) to 90 deg.
    let right = |tip: Point| tip[0] > center[0] || (tip[0] == center[0] && tip[1] > center[1]);
    match (right(a), right(b)) {
        (true, false) => Ordering::Less,
        (false, true) => Ordering::Greater,
        _ => 0.0_f64.total_cmp(&(orientation(center, a, b) + 0.0)),
    }
}

/// Returns the half-edge after each one on the boundary of the region to its left: at its end, the
/// one before its reverse.
fn successors(network: &Network, fans: &[Vec<usize>]) -> Vec<usize> {
    let mut next = vec![0; 2 * network.lines.len()];
    for fan in fans {
        for (position, &half_edge) in fan.iter().enumerate() {
            let before = fan[(position + fan.len() - 1) % fan.len()];
            next[half_edge ^ 1] = before;
        }
    }
    next
}

/// Returns the loop of each half-edge, and the loops.
fn follow(next: &[usize]) -> (Vec<usize>, Vec<Vec<usize>>) {
    let mut loop_of = vec![usize::MAX; next.len()];
    let mut loops = Vec::new();
    for start in 0..next.len() {
        if loop_of[start] == usize::MAX {
            let mut members = Vec::new();
            let mut at = start;
            while loop_of[at] == usize::MAX {
                loop_of[at] = loops.len();
                members.push(at);
                at = next[at];
            }
            loops.push(members);
        }
    }
    (loop_of, loops)
}

/// Returns the connected component of each point, and the leftmost point of each component, of equal
/// ones the lowest.
fn components(network: &Network) -> (Vec<Option<usize>>, Vec<usize>) {
    let mut parent: Vec<usize> = (0..network.points.len()).collect();
    fn root(parent: &mut [usize], mut point: usize) -> usize {
        while parent[point] != point {
            parent[point] = parent[parent[point]];
            point = parent[point];
        }
        point
    }
    let mut used = vec![false; network.points.len()];
    for line in &network.lines {
        let [a, b] = line.ends.map(|end| root(&mut parent, end));
        parent[a.max(b)] = a.min(b);
        line.ends.into_iter().for_each(|end| used[end] = true);
    }
    let mut component = vec![None; network.points.len()];
    let mut leftmost = Vec::new();
    for point in (0..network.points.len()).filter(|&point| used[point]) {
        // The root of a component is its point with the smallest index, so it comes first.
        let root = root(&mut parent, point);
        let index = *component[root].get_or_insert_with(|| {
            leftmost.push(root);
            leftmost.len() - 1
        });
        component[point] = Some(index);
        let best = &mut leftmost[index];
        if lexicographic(network.points[point], network.points[*best]).is_lt() {
            *best = point;
        }
    }
    (component, leftmost)
}

/// Returns for each component the half-edge just below its leftmost point, directed to the right.
fn below(
    network: &Network,
    leftmost: &[usize],
    component: &[Option<usize>],
) -> Result<Vec<Option<usize>>, Fault> {
    if leftmost.len() < 2 {
        return Ok(vec![None; leftmost.len()]);
    }
    let index = Index::new(network);
    let (low, high) = super::limits::bounds(network.points.iter().copied());
    let height = high[1] - low[1];
    let mut work = Work::default();
    let mut found = Vec::new();
    let mut result = Vec::with_capacity(leftmost.len());
    for (own, &point) in leftmost.iter().enumerate() {
        let at = network.points[point];
        let mut reach = height / (network.lines.len() as f64).sqrt();
        let mut best: Option<usize> = None;
        loop {
            let bottom = [at[0], at[1] - reach];
            index.near([at, bottom], 0.0, &mut found);
            work.pairs(found.len(), at)?;
            let ours = |line: usize| component[network.lines[line].ends[0]] == Some(own);
            for half_edge in found
                .iter()
                .filter(|&&line| !ours(line))
                .filter_map(|&line| passes_below(network, line, at))
            {
                if best.is_none_or(|best| is_above(network, half_edge, best)) {
                    best = Some(half_edge);
                }
            }
            // A line found here may pass below the bottom, and one that is not found above it.
            let reached =
                best.is_some_and(|best| passes_below(network, best / 2, bottom).is_none());
            // Nothing passes below the lowest point.
            if reached || bottom[1] <= low[1] {
                break;
            }
            reach *= 2.0;
        }
        result.push(best);
    }
    Ok(result)
}

/// Returns the half-edge of a line to the right, if it passes below a point: at x of the point, its
/// left end included and its right one not.
fn passes_below(network: &Network, line: usize, point: Point) -> Option<usize> {
    let [a, b] = network.ends(&network.lines[line]);
    let (half_edge, [left, right]) =
        if a[0] < b[0] { (2 * line, [a, b]) } else { (2 * line + 1, [b, a]) };
    let spans = left[0] <= point[0] && point[0] < right[0];
    (spans && orientation(left, right, point) > 0.0).then_some(half_edge)
}

/// Whether a half-edge is above another one at an x that both span; they do not cross.
fn is_above(network: &Network, half_edge: usize, other: usize) -> bool {
    let ends = |half_edge: usize| {
        [half_edge, half_edge ^ 1].map(|half_edge| network.points[origin(network, half_edge)])
    };
    let ([a, b], [c, d]) = (ends(half_edge), ends(other));
    if a[0] >= c[0] {
        let side = orientation(c, d, a);
        if side != 0.0 { side > 0.0 } else { orientation(c, d, b) > 0.0 }
    } else {
        let side = orientation(a, b, c);
        if side != 0.0 { side < 0.0 } else { orientation(a, b, d) < 0.0 }
    }
}
