//! Numeric closure of loops: the positions of the ghost's three points minus those of the original.
//!
//! ```text
//! r   = P_ghost - P_original,     nine numbers per loop, over the loop's length
//! J_j = +- a_j x (P - c_j),       a_j: direction of joint j, c_j: a point of its line
//! ```
//!
//! Both chains start at the body at which they meet, whose own motion cancels.

use nalgebra::{DVector, Matrix3, Rotation3, SVector, Unit, Vector3};

use super::graph::{self, Loop, Node, NodeId};
use super::sparse::Row;
use crate::arithmetic::{larger, largest};
use crate::laminate::{Joint, Mechanism};
use crate::source::JointId;

/// Number of components: points P1 P2 P3, each x y z.
type Nine = SVector<f64, 9>;

/// Some loops of a mechanism as functions of some of its joint angles; all other joints stay at 0.
pub struct Closure<'a> {
    mechanism: &'a Mechanism,
    loops: Vec<Chains>,
    /// The joints that move, in order: the columns of the Jacobian.
    pub joints: Vec<JointId>,
    /// Column of each joint of the mechanism.
    columns: Vec<Option<usize>>,
}

/// A loop as two chains of hinges.
struct Chains {
    rows: Vec<graph::Row>,
    ghost: Vec<(JointId, f64)>,
    original: Vec<(JointId, f64)>,
    /// The points of the hinge lines are relative to this point, to keep digits.
    near: Vector3<f64>,
    points: [Vector3<f64>; 3],
    length: f64,
}

impl<'a> Closure<'a> {
    /// Creates the closure of these loops as a function of these joints.
    pub fn new<'b>(
        mechanism: &'a Mechanism,
        nodes: &[Node],
        loops: impl IntoIterator<Item = &'b Loop>,
        joints: Vec<JointId>,
    ) -> Self {
        let hinges = |path: &[NodeId]| {
            let hinge = |node: &NodeId| {
                let node = &nodes[node.index()];
                Some((node.joint()?, node.sense))
            };
            path.iter().filter_map(hinge).collect()
        };
        let chains = |closed: &Loop| Chains {
            rows: closed.rows.clone(),
            ghost: hinges(&closed.sides[0]),
            original: hinges(&closed.sides[1]),
            near: closed.points[0],
            points: closed.points.map(|point| point - closed.points[0]),
            length: (closed.points[1] - closed.points[0]).norm(),
        };
        let mut columns = vec![None; mechanism.joints.len()];
        for (column, joint) in joints.iter().enumerate() {
            columns[joint.index()] = Some(column);
        }
        let loops = loops.into_iter().map(chains).collect();
        Self { mechanism, loops, joints, columns }
    }

    /// Returns the number of loops.
    pub fn loops(&self) -> usize {
        self.loops.len()
    }

    /// Returns the allowed angles of the joint of a column, rad.
    pub fn limits(&self, column: usize) -> [f64; 2] {
        self.joint(self.joints[column]).limits
    }

    /// Returns whether the angle of the joint of a column is prescribed.
    pub fn is_driven(&self, column: usize) -> bool {
        self.joint(self.joints[column]).drive.is_some()
    }

    fn joint(&self, joint: JointId) -> &Joint {
        &self.mechanism.joints[joint.index()]
    }

    /// Returns a loop's hinges and the points of its ghost and its original at these angles.
    fn place(&self, chains: &Chains, q: &DVector<f64>) -> Placed {
        let mut hinges = Vec::new();
        let [ghost, original] =
            [(&chains.ghost, 1.0), (&chains.original, -1.0)].map(|(chain, side)| {
                let (mut turn, mut shift) = (Matrix3::identity(), Vector3::zeros());
                for (id, sense) in chain {
                    let joint = self.joint(*id);
                    let column = self.columns[id.index()];
                    let angle = sense * column.map_or(0.0, |column| q[column]);
                    let point = joint.point - chains.near;
                    let line = turn * point + shift;
                    if let Some(column) = column {
                        let axis = turn * joint.direction * (*sense * side);
                        hinges.push(PlacedHinge { column, of_ghost: side > 0.0, axis, line });
                    }
                    let axis = Unit::new_unchecked(joint.direction);
                    turn *= Rotation3::from_axis_angle(&axis, angle).into_inner();
                    shift = line - turn * point;
                }
                chains.points.map(|point| turn * point + shift)
            });
        Placed { hinges, ghost, original, length: chains.length }
    }

    /// Returns J^T J as the columns of its upper triangle, J^T r and the largest residual, relative to the loops' lengths.
    pub fn normal_equations(&self, q: &DVector<f64>) -> (Vec<Row>, DVector<f64>, f64) {
        let n = self.joints.len();
        let (mut matrix, mut right) = (vec![Row::new(); n], DVector::zeros(n));
        let mut open = 0.0;
        for chains in &self.loops {
            let placed = self.place(chains, q);
            let (residual, columns) = (placed.residual(), placed.columns());
            open = larger(open, largest(&residual));
            for (i, a) in &columns {
                right[*i] += a.dot(&residual);
                for (j, b) in columns.iter().filter(|(j, _)| i <= j) {
                    *matrix[*j].entry(*i).or_default() += a.dot(b);
                }
            }
        }
        (matrix, right, open)
    }

    /// Returns the largest residual.
    pub fn largest_residual(&self, q: &DVector<f64>) -> f64 {
        let each = self.loops.iter().map(|chains| largest(&self.place(chains, q).residual()));
        each.fold(0.0, larger)
    }

    /// Returns the sum of the squares of all residuals.
    pub fn squared_residual(&self, q: &DVector<f64>) -> f64 {
        self.loops.iter().map(|chains| self.place(chains, q).residual().norm_squared()).sum()
    }

    /// Returns six rows per loop: the twist of the ghost relative to the original at the ghost's
    /// P1, per radian of each joint. If the loop is closed, they have the same rank as the nine
    /// closure rows; otherwise they have the rank of the hinges' twists.
    pub fn twists(&self, q: &DVector<f64>) -> Vec<Row> {
        self.loops.iter().flat_map(|chains| self.place(chains, q).twists()).collect()
    }

    /// Returns the same rows with one more column: the twist that leads from the original to the ghost,
    /// for loops that are nearly closed.
    pub fn gaps(&self, q: &DVector<f64>) -> Vec<Row> {
        let mut gaps = Vec::new();
        for chains in &self.loops {
            let placed = self.place(chains, q);
            let mut rows = placed.twists();
            for (row, gap) in rows.iter_mut().zip(&placed.gap()) {
                row.insert(self.joints.len(), *gap);
            }
            gaps.extend(rows);
        }
        gaps
    }
}

impl Closure<'_> {
    /// Returns the place of the loop of each of the [`rows`](Self::rows).
    pub fn loops_of_rows(&self) -> Vec<usize> {
        let loops = self.loops.iter().enumerate();
        loops.flat_map(|(index, chains)| chains.rows.iter().map(move |_| index)).collect()
    }

    /// Returns the rows of all loops that the acceleration uses, with their columns, over the loops'
    /// lengths.
    pub fn rows(&self, q: &DVector<f64>) -> Vec<Vec<(usize, f64)>> {
        let mut rows = Vec::new();
        for chains in &self.loops {
            let placed = self.place(chains, q);
            let [origin, x, y] = placed.ghost;
            let [x, y] = [x, y].map(|point| (point - origin) / placed.length);
            let frame = [x, y, x.cross(&y)];
            let columns = placed.columns();
            for graph::Row { point, axis } in &chains.rows {
                let along = |entry: &Nine| frame[*axis].dot(&entry.fixed_rows::<3>(3 * point));
                rows.push(columns.iter().map(|(column, entry)| (*column, along(entry))).collect());
            }
        }
        rows
    }
}

/// A loop at given angles, relative to the body at which its sides meet.
struct Placed {
    hinges: Vec<PlacedHinge>,
    ghost: [Vector3<f64>; 3],
    original: [Vector3<f64>; 3],
    length: f64,
}

struct PlacedHinge {
    column: usize,
    of_ghost: bool,
    /// Unit vector; reversed on the side of the original, which enters with a minus sign.
    axis: Vector3<f64>,
    /// A point of the hinge line.
    line: Vector3<f64>,
}

impl Placed {
    /// Returns the rows of [`Closure::twists`].
    fn twists(&self) -> [Row; 6] {
        let mut rows: [Row; 6] = Default::default();
        for hinge in &self.hinges {
            let moment = hinge.axis.cross(&(self.ghost[0] - hinge.line)) / self.length;
            let entries = hinge.axis.iter().chain(&moment);
            for (row, entry) in rows.iter_mut().zip(entries) {
                row.insert(hinge.column, *entry);
            }
        }
        rows
    }

    /// Returns the rotation and the translation from the original to the ghost, to first order.
    fn gap(&self) -> [f64; 6] {
        let axes = |[origin, x, y]: &[Vector3<f64>; 3]| {
            let [x, y] = [x, y].map(|point| (point - origin) / self.length);
            [x, y, x.cross(&y)]
        };
        let pairs = axes(&self.original).into_iter().zip(axes(&self.ghost));
        let turn: Vector3<f64> =
            pairs.map(|(from, to)| from.cross(&to)).sum::<Vector3<f64>>() / 2.0;
        let shift = (self.ghost[0] - self.original[0]) / self.length;
        [turn.x, turn.y, turn.z, shift.x, shift.y, shift.z]
    }

    fn residual(&self) -> Nine {
        let mut residual = Nine::zeros();
        for (i, (ghost, original)) in self.ghost.iter().zip(&self.original).enumerate() {
            residual.fixed_rows_mut::<3>(3 * i).copy_from(&((ghost - original) / self.length));
        }
        residual
    }

    /// Velocities of the three points per radian, for every hinge.
    fn columns(&self) -> Vec<(usize, Nine)> {
        let column = |hinge: &PlacedHinge| {
            let points = if hinge.of_ghost { &self.ghost } else { &self.original };
            let mut entry = Nine::zeros();
            for (i, point) in points.iter().enumerate() {
                let velocity = hinge.axis.cross(&(point - hinge.line)) / self.length;
                entry.fixed_rows_mut::<3>(3 * i).copy_from(&velocity);
            }
            (hinge.column, entry)
        };
        self.hinges.iter().map(column).collect()
    }
}
