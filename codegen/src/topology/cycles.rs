//! The shortest loops of a mechanism: a minimum cycle basis of the graph of its bodies and joints
//! (J. D. Horton, "A polynomial-time algorithm to find the shortest cycle basis of a graph", 1987).
//!
//! The loops of the spanning tree may enclose several shorter loops. Whether hinge lines are parallel or
//! concurrent is visible in the shortest loops, and their closure has the fewest terms.

use std::collections::VecDeque;

use crate::laminate::Mechanism;
use crate::source::JointId;

/// Largest number of joints. The number of candidates is the number of roots times that of edges,
/// so more joints would need too much memory.
const MOST_JOINTS: usize = 5000;

/// Bodies as nodes, all fixed ones as node 0; joints as edges.
struct Graph {
    edges: Vec<[usize; 2]>,
    /// Edges at each node, with the node at the other end.
    neighbours: Vec<Vec<(usize, usize)>>,
}

/// Shortest paths from one node to all others.
struct Paths {
    /// The edge to each node and the node before it; `None` for the root and for nodes that are not
    /// connected with it.
    before: Vec<Option<(usize, usize)>>,
    /// Number of edges to each node.
    length: Vec<usize>,
    /// The first edge of each path.
    branch: Vec<usize>,
}

/// A path from a root to one end of an edge, the edge, and a path back from its other end.
struct Candidate {
    length: usize,
    root: usize,
    edge: usize,
}

/// Returns the joints around each loop of a minimum cycle basis, in their order around it; no loops
/// for mechanisms with more joints than [`MOST_JOINTS`].
pub fn shortest(mechanism: &Mechanism) -> Vec<Vec<JointId>> {
    if mechanism.joints.len() > MOST_JOINTS {
        return Vec::new();
    }
    let graph = Graph::new(mechanism);
    let nodes = graph.neighbours.iter().filter(|edges| !edges.is_empty()).count();
    // The ground and each free body have a tree of their own.
    let trees =
        mechanism.free.iter().filter(|free| !graph.neighbours[1 + free.body.index()].is_empty());
    let trees = trees.count() + usize::from(!graph.neighbours[0].is_empty());
    let independent = (graph.edges.len() + trees).saturating_sub(nodes);
    if independent == 0 {
        return Vec::new();
    }
    let mut candidates: Vec<Candidate> = Vec::new();
    for root in 0..graph.neighbours.len() {
        candidates.extend(graph.candidates(root, &graph.paths(root)));
    }
    candidates.sort_by_key(|candidate| (candidate.length, candidate.root, candidate.edge));
    let mut basis = Basis::new(graph.edges.len());
    let mut cycles = Vec::new();
    for Candidate { root, edge, .. } in candidates {
        // The paths are computed again, because the paths from all roots together would need too
        // much memory.
        let cycle = graph.paths(root).cycle(edge, graph.edges[edge]);
        if basis.insert(&cycle) {
            cycles.push(cycle.into_iter().map(JointId).collect());
            if cycles.len() == independent {
                break;
            }
        }
    }
    cycles
}

impl Graph {
    fn new(mechanism: &Mechanism) -> Self {
        let node = |body: crate::source::BodyId| match mechanism.bodies[body.index()].fixed {
            true => 0,
            false => 1 + body.index(),
        };
        let edges: Vec<_> = mechanism.joints.iter().map(|joint| joint.bodies.map(node)).collect();
        let mut neighbours = vec![Vec::new(); 1 + mechanism.bodies.len()];
        for (edge, [first, second]) in edges.iter().enumerate() {
            neighbours[*first].push((edge, *second));
            neighbours[*second].push((edge, *first));
        }
        Self { edges, neighbours }
    }

    fn paths(&self, root: usize) -> Paths {
        const NO_EDGE: usize = usize::MAX;
        let n = self.neighbours.len();
        let mut paths =
            Paths { before: vec![None; n], length: vec![0; n], branch: vec![NO_EDGE; n] };
        let mut queue = VecDeque::from([root]);
        while let Some(node) = queue.pop_front() {
            for &(edge, next) in &self.neighbours[node] {
                if next == root || paths.before[next].is_some() {
                    continue;
                }
                paths.before[next] = Some((edge, node));
                paths.length[next] = paths.length[node] + 1;
                paths.branch[next] = if node == root { edge } else { paths.branch[node] };
                queue.push_back(next);
            }
        }
        paths
    }

    /// Returns the cycles through a root whose two paths meet at the root only.
    fn candidates<'a>(
        &'a self,
        root: usize,
        paths: &'a Paths,
    ) -> impl Iterator<Item = Candidate> + 'a {
        let reached = move |node: usize| node == root || paths.before[node].is_some();
        self.edges.iter().enumerate().filter_map(move |(edge, &[a, b])| {
            let of_tree =
                [a, b].iter().any(|node| paths.before[*node].is_some_and(|e| e.0 == edge));
            let apart = paths.branch[a] != paths.branch[b];
            let is_cycle = !of_tree && apart && reached(a) && reached(b);
            is_cycle.then(|| Candidate {
                length: paths.length[a] + paths.length[b] + 1,
                root,
                edge,
            })
        })
    }
}

impl Paths {
    fn cycle(&self, edge: usize, [first, second]: [usize; 2]) -> Vec<usize> {
        let mut cycle: Vec<usize> = self.back_from(first).collect();
        cycle.reverse();
        cycle.push(edge);
        cycle.extend(self.back_from(second));
        cycle
    }

    /// Returns the edges from a node back to the root.
    fn back_from(&self, node: usize) -> impl Iterator<Item = usize> {
        let step = |&(_, node): &(usize, usize)| self.before[node];
        std::iter::successors(self.before[node], step).map(|(edge, _)| edge)
    }
}

/// Cycles as sets of edges modulo two, in echelon form.
struct Basis {
    words: usize,
    /// Rows by their lowest edge.
    rows: Vec<Option<Vec<u64>>>,
}

impl Basis {
    fn new(edges: usize) -> Self {
        Self { words: edges.div_ceil(64), rows: vec![None; edges] }
    }

    /// Adds a cycle; returns false if it is a sum of the cycles already present.
    fn insert(&mut self, cycle: &[usize]) -> bool {
        let mut set = vec![0_u64; self.words];
        for edge in cycle {
            set[edge / 64] ^= 1 << (edge % 64);
        }
        while let Some(word) = set.iter().position(|word| *word != 0) {
            let lowest = 64 * word + set[word].trailing_zeros() as usize;
            let Some(row) = &self.rows[lowest] else {
                self.rows[lowest] = Some(set);
                return true;
            };
            set.iter_mut().zip(row).for_each(|(a, b)| *a ^= b);
        }
        false
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::topology::tests::{hinge, mechanism};

    /// How many joints each loop has; each is checked to be one.
    fn lengths(joints: &[[usize; 2]]) -> Vec<usize> {
        let hinges: Vec<_> = joints.iter().map(|b| hinge(*b, [0.0, 0.0], [1.0, 0.0])).collect();
        let cycles = shortest(&mechanism(&hinges));
        for cycle in &cycles {
            let bodies = |i: usize| joints[cycle[i % cycle.len()].index()];
            for i in 0..cycle.len() {
                let meets = bodies(i).iter().any(|body| bodies(i + 1).contains(body));
                assert!(meets, "{cycle:?} is not in order");
            }
        }
        cycles.iter().map(Vec::len).collect()
    }

    #[test]
    fn loops_are_the_shortest() {
        assert_eq!(lengths(&[[0, 1], [1, 2]]), [0; 0]);
        assert_eq!(lengths(&[[0, 1], [1, 0]]), [2]);
        assert_eq!(lengths(&[[0, 1], [0, 1], [1, 0], [1, 2]]), [2, 2]);
        // Two squares with an edge in common, entered at a corner: never the six around both.
        let squares = [[0, 1], [1, 2], [2, 3], [3, 0], [2, 4], [4, 5], [5, 3]];
        assert_eq!(lengths(&squares), [4, 4]);
        // A sheet of three by three bodies: four loops about its inner vertices.
        let at = |row: usize, column: usize| 3 * row + column;
        let mut sheet = Vec::new();
        for row in 0..3 {
            for column in 0..3 {
                if column < 2 {
                    sheet.push([at(row, column), at(row, column + 1)]);
                }
                if row < 2 {
                    sheet.push([at(row, column), at(row + 1, column)]);
                }
            }
        }
        assert_eq!(lengths(&sheet), [4; 4]);
        // A cube's graph: five of its six faces.
        let cube: Vec<[usize; 2]> = (0..8_usize)
            .flat_map(|a| [1, 2, 4].map(|bit| [a, a ^ bit]))
            .filter(|[a, b]| a < b)
            .collect();
        assert_eq!(lengths(&cube), [4; 5]);
    }
}
