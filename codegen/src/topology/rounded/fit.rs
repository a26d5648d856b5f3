//! Smallest movement of hinge lines that makes them exactly parallel, concurrent or in line.
//!
//! ```text
//! min sum over ends of w (e / slack)^2   subject to   g(e, f) = 0
//! e: how far each end moves across its line     f: common directions and points, free of cost
//! ```
//!
//! by Newton steps on g, each the minimum-norm solution of the linear equations. The result must be
//! a drawing that rounds to the given one: every |e| within its slack. Where least squares exceed
//! the slack, weights are raised until the largest |e| / slack is smallest (C. L. Lawson, 1961).

use nalgebra::{DMatrix, DVector, Matrix2, Vector2};

use crate::arithmetic::{asin, atan2, larger, largest, powi, sin_cos};

use super::line::{Line, cross};

/// Ratio of the cost of moving a common point or direction to that of moving a line.
const FREE: f64 = 1e3;
/// Regularisation for equations of norm 1, which makes redundant equations solvable.
const RIDGE: f64 = 1e-13;
/// Largest number of Newton steps; they converge quadratically.
const STEPS: usize = 12;
/// Largest number of rounds in which weights are raised.
const ROUNDS: usize = 40;
/// Smallest weight of an end, which may matter again in a later round.
const LEAST_WEIGHT: f64 = 1e-4;
/// Movements up to this, relative to the slack, are within the tolerance: the rounds end before the
/// minimum is reached.
pub const WITHIN: f64 = 1.05;
/// Distance from a common point, relative to the slack, above which lines are not tried.
const HOPELESS: f64 = 4.0;

/// Relation between the lines of a bundle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Common {
    /// The lines are parallel.
    Direction,
    /// The lines pass through one point.
    Point,
    /// The lines are two pieces of one line.
    Line,
}

/// Lines, by their joints' indices, that should be parallel, concurrent or in line.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Bundle {
    pub common: Common,
    pub joints: Vec<usize>,
}

/// Result of the fit.
#[derive(Clone, Debug)]
pub struct Fit {
    /// Joints of the fit, in ascending order.
    pub joints: Vec<usize>,
    /// Movement of the two ends of each joint perpendicular to its line, m.
    pub moves: Vec<[f64; 2]>,
    /// For each bundle its common direction (unit), or point (m); zero if it has neither.
    pub common: Vec<Vector2<f64>>,
    /// Largest movement, relative to the slack.
    pub strain: f64,
}

/// Returns the smallest strain at which lines can be parallel: their ranges of directions must
/// overlap.
pub fn strain_of_direction(lines: &[&Line]) -> f64 {
    let mut strain = 0.0_f64;
    for (i, a) in lines.iter().enumerate() {
        for b in &lines[..i] {
            let turn = asin(a.sine(b).min(1.0));
            strain = larger(strain, turn / (a.angle_slack() + b.angle_slack()));
        }
    }
    strain
}

/// Returns the point nearest to all lines, with distances relative to the lines' slack there;
/// `None` if the lines are parallel or too far from any point.
pub fn common_point(lines: &[&Line]) -> Option<Vector2<f64>> {
    const ROUNDS: usize = 4;
    // Positions are relative to one of the lines to keep digits.
    let near = lines[0].ends[0];
    let mut point = None;
    for _ in 0..ROUNDS {
        let (mut matrix, mut right) = (Matrix2::zeros(), Vector2::zeros());
        for line in lines {
            let slack = point.map_or(line.slack, |point| line.slack_at(&point));
            let normal = line.normal * (lines[0].slack / slack);
            matrix += normal * normal.transpose();
            right += normal * normal.dot(&(line.ends[0] - near));
        }
        if matrix.determinant() <= 1e-20 * powi(matrix.trace(), 2) {
            return None;
        }
        point = Some(near + matrix.try_inverse()? * right);
    }
    let close = |line: &&Line, point: &Vector2<f64>| {
        line.distance(point) <= HOPELESS * line.slack_at(point)
    };
    point.filter(|point| lines.iter().all(|line| close(line, point)))
}

/// Moves lines so that each bundle is exact. Returns `None` if no movement within the slack was
/// found.
pub fn fit(lines: &[Line], bundles: &[&Bundle]) -> Option<Fit> {
    let mut problem = Problem::new(lines, bundles)?;
    let ends = 2 * problem.joints.len();
    let mut best: Option<Fit> = None;
    for round in 0..ROUNDS {
        problem.solve()?;
        let strains: Vec<f64> =
            (0..ends).map(|i| (problem.x[i] / problem.slack[i]).abs()).collect();
        let strain = largest(&strains);
        if best.as_ref().is_none_or(|best| strain < best.strain) {
            best = Some(problem.result(strain));
        }
        // The mean of squares is minimal now, so no solution has all strains below its root.
        let mean = strains.iter().map(|strain| strain * strain).sum::<f64>() / ends as f64;
        if strain <= 1.0 || (round == 0 && mean > WITHIN * WITHIN) {
            break;
        }
        problem.raise_weights(&strains);
    }
    best.filter(|best| best.strain <= WITHIN)
}

/// The equations of some bundles.
struct Problem<'a> {
    lines: Vec<&'a Line>,
    joints: Vec<usize>,
    /// For each bundle the positions of its lines and the index of its first unknown.
    bundles: Vec<(Common, Vec<usize>, usize)>,
    /// By end, m.
    slack: Vec<f64>,
    /// By end.
    weights: Vec<f64>,
    /// Scale of the unknowns that have little cost.
    free: Vec<f64>,
    /// Movements of ends, m, then angles and points, absolute.
    x: DVector<f64>,
    /// Angles and points at the start, from which their cost is measured.
    begin: DVector<f64>,
}

impl<'a> Problem<'a> {
    fn new(lines: &'a [Line], bundles: &[&Bundle]) -> Option<Self> {
        let mut joints: Vec<usize> =
            bundles.iter().flat_map(|b| b.joints.iter().copied()).collect();
        joints.sort_unstable();
        joints.dedup();
        let slack = joints.iter().flat_map(|joint| [lines[*joint].slack; 2]).collect();
        let mut x = vec![0.0; 2 * joints.len()];
        let mut free = Vec::new();
        let mut placed = Vec::new();
        for bundle in bundles {
            let members: Vec<&Line> = bundle.joints.iter().map(|joint| &lines[*joint]).collect();
            let start = x.len();
            match bundle.common {
                Common::Direction => {
                    x.push(mean_angle(&members));
                    let vague = members.iter().map(|line| line.angle_slack());
                    free.push(FREE * largest(vague));
                }
                Common::Point => {
                    let point = common_point(&members)?;
                    x.extend([point.x, point.y]);
                    let vague = members.iter().map(|line| line.slack_at(&point));
                    free.extend([FREE * largest(vague); 2]);
                }
                Common::Line => {}
            }
            let position = |joint: &usize| joints.binary_search(joint).ok();
            let positions = bundle.joints.iter().filter_map(position).collect();
            placed.push((bundle.common, positions, start));
        }
        let x = DVector::from_vec(x);
        Some(Self {
            lines: joints.iter().map(|joint| &lines[*joint]).collect(),
            weights: vec![1.0; 2 * joints.len()],
            joints,
            bundles: placed,
            slack,
            free,
            begin: x.clone(),
            x,
        })
    }

    /// Takes Newton steps from x; `None` if they fail.
    fn solve(&mut self) -> Option<()> {
        let ends = self.slack.len();
        let scale = DVector::from_fn(self.x.len(), |i, _| match i.checked_sub(ends) {
            Some(free) => self.free[free],
            None => self.slack[i] / self.weights[i].sqrt(),
        });
        // Movements are measured from the drawing.
        let mut origin = self.begin.clone();
        origin.rows_mut(0, ends).fill(0.0);
        let mut open = f64::INFINITY;
        for step in 0..STEPS {
            let (mut matrix, mut right) = self.equations();
            let remaining = largest(&right);
            if step > 1 && remaining >= 0.5 * open {
                break;
            }
            open = remaining;
            right = &matrix * (&self.x - &origin) - right;
            for (column, scale) in scale.iter().enumerate() {
                matrix.column_mut(column).scale_mut(*scale);
            }
            for (row, right) in right.iter_mut().enumerate() {
                let norm = matrix.row(row).norm();
                matrix.row_mut(row).unscale_mut(norm);
                *right /= norm;
            }
            let mut square = &matrix * matrix.transpose();
            (0..square.nrows()).for_each(|i| square[(i, i)] += RIDGE);
            let multipliers = square.cholesky()?.solve(&right);
            let step = matrix.tr_mul(&multipliers).component_mul(&scale);
            self.x = &origin + step;
        }
        self.x.iter().all(|x| x.is_finite()).then_some(())
    }

    /// Returns the equations g, m, and their derivatives by x.
    fn equations(&self) -> (DMatrix<f64>, DVector<f64>) {
        let mut rows: Vec<(Vec<(usize, f64)>, f64)> = Vec::new();
        let moved = |i: usize| self.lines[i].moved([self.x[2 * i], self.x[2 * i + 1]]);
        for (common, members, start) in &self.bundles {
            match common {
                Common::Direction => {
                    let (sine, cosine) = sin_cos(self.x[*start]);
                    let (direction, across) =
                        (Vector2::new(cosine, sine), Vector2::new(-sine, cosine));
                    for &i in members {
                        let along = moved(i).1;
                        let turn = cross(&self.lines[i].normal, &direction);
                        let row = vec![
                            (2 * i, -turn),
                            (2 * i + 1, turn),
                            (*start, cross(&along, &across)),
                        ];
                        rows.push((row, cross(&along, &direction)));
                    }
                }
                Common::Point => {
                    let point = Vector2::new(self.x[*start], self.x[start + 1]);
                    for &i in members {
                        let (mut row, by_point, value) = self.through(i, &point);
                        row.extend([(*start, by_point.x), (start + 1, by_point.y)]);
                        rows.push((row, value));
                    }
                }
                Common::Line => {
                    let [i, j] = [members[0], members[1]];
                    let (from, to) = moved(j);
                    let along = moved(i).1 / self.lines[i].length;
                    let shift = cross(&along, &self.lines[j].normal);
                    for (end, point) in [from, from + to].into_iter().enumerate() {
                        let (mut row, _, value) = self.through(i, &point);
                        row.push((2 * j + end, shift));
                        rows.push((row, value));
                    }
                }
            }
        }
        let mut matrix = DMatrix::zeros(rows.len(), self.x.len());
        let mut values = DVector::zeros(rows.len());
        for (r, (row, value)) in rows.into_iter().enumerate() {
            row.into_iter().for_each(|(column, entry)| matrix[(r, column)] += entry);
            values[r] = value;
        }
        (matrix, values)
    }

    /// Returns the distance of a point from the moved line i, with its derivatives by the ends of i and by
    /// the point.
    fn through(&self, i: usize, point: &Vector2<f64>) -> (Vec<(usize, f64)>, Vector2<f64>, f64) {
        let moves = [self.x[2 * i], self.x[2 * i + 1]];
        let ([from, to], by_point, value) = self.lines[i].through(moves, point);
        (vec![(2 * i, from), (2 * i + 1, to)], by_point, value)
    }

    fn raise_weights(&mut self, strains: &[f64]) {
        let mean = strains.iter().sum::<f64>() / strains.len() as f64;
        for (weight, strain) in self.weights.iter_mut().zip(strains) {
            *weight *= strain / mean;
        }
        let most = largest(&self.weights);
        for weight in &mut self.weights {
            *weight = (*weight / most).max(LEAST_WEIGHT);
        }
    }

    fn result(&self, strain: f64) -> Fit {
        let common = |(common, _, start): &(Common, Vec<usize>, usize)| match common {
            Common::Direction => {
                let (sine, cosine) = sin_cos(self.x[*start]);
                Vector2::new(cosine, sine)
            }
            Common::Point => Vector2::new(self.x[*start], self.x[start + 1]),
            Common::Line => Vector2::zeros(),
        };
        Fit {
            joints: self.joints.clone(),
            moves: (0..self.joints.len()).map(|i| [self.x[2 * i], self.x[2 * i + 1]]).collect(),
            common: self.bundles.iter().map(common).collect(),
            strain,
        }
    }
}

/// Returns the mean direction of lines whatever their sense, weighted by length: half the angle of
/// the sum of the squares of their directions as complex numbers.
fn mean_angle(lines: &[&Line]) -> f64 {
    let along = |line: &&Line| line.ends[1] - line.ends[0];
    let squares =
        lines.iter().map(along).map(|d| Vector2::new(d.x * d.x - d.y * d.y, 2.0 * d.x * d.y));
    let sum: Vector2<f64> = squares.sum();
    0.5 * atan2(sum.y, sum.x)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(from: [f64; 2], to: [f64; 2]) -> Line {
        let ends = [from, to].map(Vector2::from);
        let along = (ends[1] - ends[0]).normalize();
        let normal = Vector2::new(-along.y, along.x);
        Line { ends, normal, length: (ends[1] - ends[0]).norm(), slack: 1.0, z: 0.0 }
    }

    /// Against central differences, with every kind of bundle, at lines that have moved.
    #[test]
    fn equations_have_the_derivatives_that_they_state() {
        let lines = [
            line([0.0, 0.0], [1.0, 0.1]),
            line([0.2, 1.0], [1.3, 1.2]),
            line([2.0, 0.0], [2.1, 1.5]),
            line([-0.5, 2.0], [-0.2, 0.7]),
            line([2.2, 2.0], [2.3, 3.1]),
        ];
        let bundle = |common, joints: &[usize]| Bundle { common, joints: joints.to_vec() };
        let bundles = [
            bundle(Common::Direction, &[0, 1, 3]),
            bundle(Common::Point, &[1, 2, 3]),
            bundle(Common::Line, &[2, 4]),
        ];
        let mut problem = Problem::new(&lines, &bundles.each_ref()).unwrap();
        for (index, x) in problem.x.iter_mut().enumerate() {
            *x += 0.05 * (index as f64).sin();
        }
        let (matrix, _) = problem.equations();
        let step = 1e-5;
        for column in 0..problem.x.len() {
            let mut at = |by: f64| {
                problem.x[column] += by;
                let (_, values) = problem.equations();
                problem.x[column] -= by;
                values
            };
            let slope = (at(step) - at(-step)) / (2.0 * step);
            let error = (&slope - matrix.column(column)).amax();
            assert!(
                error < 1e-9,
                "by x[{column}]: {error:e}, {slope} is not {}",
                matrix.column(column)
            );
        }
    }
}
