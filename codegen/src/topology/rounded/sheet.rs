//! Sheets of many vertices: a small movement of hinge lines with which all loops close together.
//!
//! Every vertex of a sheet moves by itself, but coordinates with a few decimals let the vertices lock each
//! other: a sheet of Miura-ori moves only because its angles have certain ratios. Whatever these are, loops
//! that depend on each other close at any folded state. The lines are therefore moved until all loops close
//! at several states at once:
//!
//! ```text
//! min sum over ends of w (e / slack)^2   subject to   lines of a vertex pass through its point,
//!                                                    product of R(a(e), q_s) around each vertex = 1 for each s
//! e: how far each end moves across its line     points, angles q_s of the states s: free of cost
//! ```
//!
//! by Newton's method, damped: most equations nearly follow from others, and what the linear equations neglect must not be
//! divided by the little that remains beside these. With the derivatives J of the equations g, a step d of all unknowns, and its cost W, 1
//! for movements and little for the free unknowns,
//!
//! ```text
//! | W    J^T | |  d  |   |  0 |
//! | J   -c 1 | | ... | = | -g |
//! ```
//!
//! is sparse and quasidefinite, and its factor grows little with the sheet. The damping c falls where a step does not help. So the movement is small,
//! not always the least. As for other relations of lines, the result must be a drawing that rounds to the given one.

use nalgebra::{DVector, Matrix3, Rotation3, Unit, Vector2, Vector3};

use super::super::sparse::{Echelon, Row, symmetric_solution};
use super::fit::WITHIN;
use super::line::Line;
use crate::arithmetic::{larger, largest};
use crate::laminate::{Joint, direction};

/// The first damping, and the share that is left of it where a step does not help.
const DAMPING: f64 = 1e-4;
const LESS_DAMPING: f64 = 0.1;
/// What a change of a free unknown costs beside a movement: enough that states stay where the equations are nearly linear, and less where
/// that finds nothing.
const COSTS: [f64; 2] = [1e-6, LEAST_COST];
/// The same where states are looked for that need no movements.
const LEAST_COST: f64 = 1e-8;
/// Largest gap of a loop at the states from which the search begins, rad.
const NEARLY: f64 = 3e-2;
/// Loops count as closed below this gap, rad, and points as met below this distance over the size.
const CLOSED: f64 = 5e-11;
/// Lines stay as drawn where equations for them alone are met to this.
const MET_AS_DRAWN: f64 = 1e-13;
/// Below this, steps that do not help are the last.
const ENOUGH: f64 = 1e-14;
/// Largest number of Newton steps, and of rounds in which states close or weights are raised.
const STEPS: usize = 60;
const ROUNDS: usize = 8;
/// Steps in a row that do not help before the search ends.
const MOST_STALLED: usize = 12;

/// A vertex: its lines in their order around it, each with the sense in which its angle turns.
pub struct Vertex {
    /// Joints with their senses.
    pub hinges: Vec<(usize, f64)>,
    /// Its point in the drawing, m.
    pub centre: Vector2<f64>,
}

/// Entries of an equation by unknown, and its value.
type Equation = (Vec<(usize, f64)>, f64);

/// The unknowns: movements of ends, points of the vertices, angles of the states.
struct Problem<'a> {
    lines: &'a [Line],
    vertices: &'a [Vertex],
    size: f64,
    states: usize,
    /// Pivots below this, relative to the size or to 1, are due to rounding.
    small: f64,
    /// Unknowns in the drawing, at which movements are zero.
    origin: DVector<f64>,
    /// What each unknown is measured in.
    scale: DVector<f64>,
    x: DVector<f64>,
}

/// Returns the joints after a small movement that lets all vertices close at all of these states, which
/// are nearly closed. Returns nothing if the tolerance does not allow it. `drawn` are the lines as drawn.
pub fn unlocked(
    joints: &[Joint],
    drawn: &[Line],
    vertices: &[Vertex],
    states: &[DVector<f64>],
    [size, small]: [f64; 2],
) -> Option<Vec<Joint>> {
    let mut problem = Problem::new(joints, drawn, vertices, states, [size, small]);
    if states.len() < 2 || problem.largest_gap() > NEARLY {
        return None;
    }
    problem.weigh(&vec![1.0; 2 * joints.len()]);
    problem.close_states();
    if !problem.is_locked() {
        return None;
    }
    COSTS.iter().find_map(|free| problem.moved(joints, *free))
}

impl<'a> Problem<'a> {
    fn new(
        joints: &[Joint],
        lines: &'a [Line],
        vertices: &'a [Vertex],
        states: &[DVector<f64>],
        [size, small]: [f64; 2],
    ) -> Self {
        let n = joints.len();
        let points = vertices.iter().flat_map(|vertex| [vertex.centre.x, vertex.centre.y]);
        let angles = states.iter().flat_map(|state| state.iter().copied());
        let origin: Vec<f64> =
            std::iter::repeat_n(0.0, 2 * n).chain(points).chain(angles).collect();
        let origin = DVector::from_vec(origin);
        let scale = DVector::from_element(origin.len(), 1.0);
        let x = origin.clone();
        Self { lines, vertices, size, states: states.len(), small, origin, scale, x }
    }

    /// Sets what unknowns are measured in: movements in their slack, less for ends with more weight; points in the size.
    fn weigh(&mut self, weights: &[f64]) {
        let ends = 2 * self.lines.len();
        let points = ends + 2 * self.vertices.len();
        for (i, scale) in self.scale.iter_mut().enumerate() {
            *scale = match i {
                _ if i < ends => self.lines[i / 2].slack / weights[i].sqrt(),
                _ if i < points => self.size,
                _ => 1.0,
            };
        }
    }

    /// Returns the joints after a movement within the tolerance, if the search finds one at this cost of the free unknowns.
    fn moved(&mut self, joints: &[Joint], free: f64) -> Option<Vec<Joint>> {
        let mut weights = vec![1.0; 2 * joints.len()];
        for _ in 0..ROUNDS {
            self.weigh(&weights);
            self.solve(free)?;
            let moved = self.placed(joints);
            let strains = self.strains(&moved);
            if largest(&strains) <= WITHIN {
                return Some(moved);
            }
            let mean = strains.iter().sum::<f64>() / strains.len() as f64;
            for (weight, strain) in weights.iter_mut().zip(&strains) {
                *weight = (*weight * strain / mean).max(1e-4);
            }
        }
        None
    }

    /// Takes Newton steps with less and less damping where they do not help, at this cost of the free unknowns, and keeps the best of the
    /// states; `None` if the equations are not met there.
    fn solve(&mut self, free: f64) -> Option<()> {
        self.x.clone_from(&self.origin);
        let (mut first, mut best) = (None, (f64::INFINITY, self.x.clone()));
        let (mut damping, mut stalled) = (DAMPING, 0);
        for _ in 0..STEPS {
            let equations = self.equations();
            let open = equations.iter().map(|(_, value)| value.abs()).fold(0.0, larger);
            first.get_or_insert(open);
            // NaN is no progress.
            let helps = 2.0 * open < best.0;
            (stalled, damping) =
                if helps { (0, damping) } else { (stalled + 1, LESS_DAMPING * damping) };
            if open < best.0 {
                best = (open, self.x.clone());
            }
            if stalled > MOST_STALLED || (stalled > 0 && best.0 <= ENOUGH) {
                break;
            }
            let Some(step) = self.step(&equations, [damping, free]) else { break };
            self.x += step;
        }
        self.x = best.1;
        // Rounding alone is no gain.
        (best.0 <= CLOSED && first.is_some_and(|first| 2.0 * best.0 < first)).then_some(())
    }

    /// Searches begin at states that are nearly closed with the lines as drawn: lines that moved while the states closed need not have
    /// moved so far.
    fn close_states(&mut self) {
        let ends = 2 * self.lines.len();
        let mut before = f64::INFINITY;
        for _ in 0..ROUNDS {
            if self.solve(LEAST_COST).is_none() {
                break;
            }
            let moved = self.x.rows(0, ends).amax();
            self.origin.clone_from(&self.x);
            self.origin.rows_mut(0, ends).fill(0.0);
            if 2.0 * moved > before {
                break;
            }
            before = moved;
        }
        self.x.clone_from(&self.origin);
    }

    /// Whether lines as drawn keep the vertices from closing: without the free unknowns, there are equations that they do not meet.
    fn is_locked(&self) -> bool {
        let (ends, unknowns) = (2 * self.lines.len(), self.x.len());
        let right = unknowns - ends;
        let rows = self.equations().into_iter().map(|(entries, value)| {
            let mut row = Row::from([(right, value)]);
            for (unknown, entry) in entries.into_iter().filter(|(unknown, _)| *unknown >= ends) {
                *row.entry(unknown - ends).or_default() += entry * self.scale[unknown];
            }
            row
        });
        let rest = Echelon::new(rows.collect(), right, self.small).rest;
        rest.iter().any(|row| row.get(&right).is_some_and(|value| value.abs() > MET_AS_DRAWN))
    }

    /// Returns a step of the unknowns that solves the linearised equations but for the damping.
    fn step(&self, equations: &[Equation], [damping, free]: [f64; 2]) -> Option<DVector<f64>> {
        let (ends, unknowns) = (2 * self.lines.len(), self.x.len());
        // A movement of one slack, and the free unknowns that belong to it, have about this effect.
        let slack = self.lines.iter().map(|line| line.slack).fold(0.0, larger);
        let unit = slack / self.size;
        let scale = |unknown: usize| {
            let scale = self.scale[unknown];
            if unknown < ends { scale } else { scale * unit }
        };
        let mut columns: Vec<Row> = Vec::new();
        for unknown in 0..unknowns {
            let cost = if unknown < ends { 1.0 } else { free };
            columns.push(Row::from([(unknown, cost)]));
        }
        let mut right = vec![0.0; unknowns];
        for (row, (entries, value)) in equations.iter().enumerate() {
            let mut column = Row::from([(unknowns + row, -damping)]);
            for &(unknown, entry) in entries {
                *column.entry(unknown).or_default() += entry * scale(unknown) / unit;
            }
            columns.push(column);
            right.push(-value / unit);
        }
        let (solution, _) = symmetric_solution(&columns, right)?;
        let steps = solution.iter().take(unknowns).enumerate();
        Some(DVector::from_iterator(unknowns, steps.map(|(unknown, x)| x * scale(unknown))))
    }

    fn moves(&self, joint: usize) -> [f64; 2] {
        [self.x[2 * joint], self.x[2 * joint + 1]]
    }

    fn point(&self, vertex: usize) -> Vector2<f64> {
        let start = 2 * self.lines.len() + 2 * vertex;
        Vector2::new(self.x[start], self.x[start + 1])
    }

    fn angle(&self, state: usize, joint: usize) -> usize {
        2 * (self.lines.len() + self.vertices.len()) + state * self.lines.len() + joint
    }

    /// Returns the largest gap of a vertex at its states.
    fn largest_gap(&self) -> f64 {
        let states = 0..self.states;
        let gaps = states.flat_map(|state| self.vertices.iter().map(move |v| (state, v)));
        let gaps = gaps.flat_map(|(state, vertex)| self.closure(state, vertex)).map(|e| e.1.abs());
        gaps.fold(0.0, larger)
    }

    fn equations(&self) -> Vec<Equation> {
        let mut equations = Vec::new();
        for (index, vertex) in self.vertices.iter().enumerate() {
            let point = self.point(index);
            let at = 2 * self.lines.len() + 2 * index;
            for &(joint, _) in &vertex.hinges {
                let ([from, to], by_point, value) =
                    self.lines[joint].through(self.moves(joint), &point);
                let row = vec![
                    (2 * joint, from / self.size),
                    (2 * joint + 1, to / self.size),
                    (at, by_point.x / self.size),
                    (at + 1, by_point.y / self.size),
                ];
                equations.push((row, value / self.size));
            }
            for state in 0..self.states {
                equations.extend(self.closure(state, vertex));
            }
        }
        equations
    }

    /// Returns the rotation around a vertex at a state, which should be none.
    fn closure(&self, state: usize, vertex: &Vertex) -> [Equation; 3] {
        let mut turn: Matrix3<f64> = Matrix3::identity();
        let mut rows: [Vec<(usize, f64)>; 3] = Default::default();
        let mut add = |unknown: usize, by: Vector3<f64>| {
            for (row, entry) in rows.iter_mut().zip(&by) {
                row.push((unknown, *entry));
            }
        };
        for &(joint, sense) in &vertex.hinges {
            let along = self.lines[joint].moved(self.moves(joint)).1;
            let axis = Unit::new_normalize(Vector3::new(along.x, along.y, 0.0));
            let angle = self.angle(state, joint);
            let rotation = Rotation3::from_axis_angle(&axis, sense * self.x[angle]).into_inner();
            add(angle, turn * axis.into_inner() * sense);
            // A line that turns about z by an angle takes its rotation with it.
            let by_turn = turn * (Vector3::z() - rotation * Vector3::z()) / along.norm();
            add(2 * joint, -by_turn);
            add(2 * joint + 1, by_turn);
            turn *= rotation;
        }
        let gap = [turn.m32 - turn.m23, turn.m13 - turn.m31, turn.m21 - turn.m12];
        let [x, y, z] = rows;
        [(x, 0.5 * gap[0]), (y, 0.5 * gap[1]), (z, 0.5 * gap[2])]
    }

    /// Returns the joints along the moved lines, exactly through the points of their vertices.
    fn placed(&self, joints: &[Joint]) -> Vec<Joint> {
        let mut through: Vec<Vec<Vector2<f64>>> = vec![Vec::new(); joints.len()];
        for (index, vertex) in self.vertices.iter().enumerate() {
            for &(joint, _) in &vertex.hinges {
                through[joint].push(self.point(index));
            }
        }
        let place = |(index, joint): (usize, &Joint)| {
            let (from, along) = self.lines[index].moved(self.moves(index));
            let (base, along) = match through[index][..] {
                [first, second, ..] => (first, second - first),
                [first] => (first, along),
                [] => (from, along),
            };
            let mut along = direction(along.x, along.y);
            if along.dot(&joint.direction) < 0.0 {
                along = -along;
            }
            let at = base + along.xy() * (joint.point.xy() - base).dot(&along.xy());
            Joint {
                point: Vector3::new(at.x, at.y, joint.point.z),
                direction: along,
                ..joint.clone()
            }
        };
        joints.iter().enumerate().map(place).collect()
    }

    /// Returns how far the drawn ends are from the moved lines, over their slack.
    fn strains(&self, moved: &[Joint]) -> Vec<f64> {
        let ends = self.lines.iter().zip(moved).flat_map(|(line, joint)| {
            line.ends.map(|end| {
                let normal = Vector2::new(-joint.direction.y, joint.direction.x);
                ((end - joint.point.xy()).dot(&normal) / line.slack).abs()
            })
        });
        ends.collect()
    }
}
