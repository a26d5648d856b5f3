//! Initial states of a motion: states with closed loops, described by as many independent coordinates and
//! speeds as the mechanism has degrees of freedom.
//!
//! With the coordinates split into independent and dependent ones, J = [J_i J_d],
//!
//! ```text
//! r(q_i, q_d) = 0,   u = T u_i,   T = [1; -J_d^+ J_i]
//! dq/dq_i = T,   du/du_i = T,   du/dq_i along v: [0; -J_d^+ (dJ/dq . T v) u]
//! ```
//!
//! Free bodies are not part of loops, so their coordinates and speeds are independent. The coordinates are the step
//! of [`Mechanism::advance`] from a given configuration. What was not recorded of a free body stays as it is given.
//!
//! Prescribed angles add rows to J, as closure equations do. (J. Garcia de Jalon, E. Bayo,
//! "Kinematic and Dynamic Simulation of Multibody Systems", 1994, section 3.5, coordinate
//! partitioning.)

use lamc::arithmetic::largest;
use lamc_runtime::plumbing::{Dimensions, Drive};
use lamc_runtime::{Error, Mechanism};
use nalgebra::{DMatrix, DVector};

use super::tangent::step_rate;

/// Pivots less than this fraction of the largest count as zero.
const RANK: f64 = 1e-7;
/// The largest number of steps of Newton's method, which converges quadratically.
const ITERATIONS: usize = 20;
/// The step of finite differences of J, rad: the cube root of the rounding error.
const DIFFERENCE: f64 = 6e-6;

/// Independent coordinates of a mechanism near a closed state.
pub struct Start {
    /// The joints whose coordinates are independent, then those components of the steps of free bodies that may
    /// change: indices of u.
    pub independent: Vec<usize>,
    dependent: Vec<usize>,
    /// Components of the speeds of free bodies that stay as they are given, with their values: indices of u, SI.
    kept: Vec<(usize, f64)>,
}

/// An initial state with its derivatives.
pub struct Begun {
    /// rad; m and quaternions of free bodies.
    pub q: Vec<f64>,
    /// rad/s; m/s of free bodies.
    pub u: Vec<f64>,
    /// dq and du by each independent coordinate, then by each independent speed.
    pub directions: Vec<(Vec<f64>, Vec<f64>)>,
}

impl Start {
    /// Selects the joints that determine the others best near q (rad, closed), by pivoting.
    ///
    /// # Errors
    /// If `q` does not have the length that the mechanism requires.
    pub fn near<Y: Mechanism<Scalar = f64>>(system: &Y, t: f64, q: &[f64]) -> Result<Self, Error> {
        let (_, jacobian) = constraint(system, t, q)?;
        let (n, joints) = (jacobian.ncols(), system.dimensions().joints);
        let mut left = jacobian;
        let mut dependent = Vec::new();
        // Gaussian elimination with full pivoting; the columns without a pivot are independent.
        let mut rows: Vec<usize> = (0..left.nrows()).collect();
        let largest = left.amax();
        loop {
            let mut best = (0, 0, 0.0);
            for (place, &row) in rows.iter().enumerate() {
                for column in (0..joints).filter(|column| !dependent.contains(column)) {
                    if left[(row, column)].abs() > best.2 {
                        best = (place, column, left[(row, column)].abs());
                    }
                }
            }
            let (place, column, pivot) = best;
            if pivot <= RANK * largest {
                break;
            }
            let row = rows.swap_remove(place);
            dependent.push(column);
            let pivot_row = left.row(row).clone_owned();
            for &other in &rows {
                let factor = left[(other, column)] / pivot_row[column];
                let reduced = left.row(other) - &pivot_row * factor;
                left.set_row(other, &reduced);
            }
        }
        let independent = (0..n).filter(|joint| !dependent.contains(joint)).collect();
        Ok(Self { independent, dependent, kept: Vec::new() })
    }

    /// Keeps components of free bodies, indices of u, where they are given, with these speeds (SI).
    pub fn keep(&mut self, kept: &[(usize, f64)]) {
        self.independent.retain(|k| kept.iter().all(|(other, _)| other != k));
        self.kept = kept.to_vec();
    }

    /// The state with these independent coordinates (rad) and speeds (rad/s); the search for the others starts
    /// at `near`. Those of free bodies are steps from `near` (m, rad) and speeds (m/s, rad/s).
    ///
    /// # Errors
    /// [`Error::NotClosed`] if the loops do not close.
    pub fn at<Y: Mechanism<Scalar = f64>>(
        &self,
        system: &Y,
        t: f64,
        near: &[f64],
        coordinates: &[f64],
        speeds: &[f64],
    ) -> Result<Begun, Error> {
        let q = self.closed(system, t, near, coordinates)?;
        let (_, jacobian) = constraint(system, t, &q)?;
        let free = jacobian.select_columns(&self.independent);
        let follow = self.solve(&jacobian, &free);
        let tangent = |weights: &DVector<f64>| {
            let carried = &follow * weights;
            self.spread(weights.iter().copied(), carried.iter().map(|x| -x))
        };
        let unit =
            |k: usize| DVector::from_fn(self.independent.len(), |i, _| f64::from(u8::from(i == k)));
        let speeds = DVector::from_column_slice(speeds);
        let drift = drive_rates(system, t, jacobian.nrows());
        let dragged = self.solve(&jacobian, &DMatrix::from_columns(&[drift]));
        let mut u = tangent(&speeds);
        for (place, &joint) in self.dependent.iter().enumerate() {
            u[joint] += dragged[(place, 0)];
        }
        self.kept.iter().for_each(|&(k, speed)| u[k] = speed);
        let mut directions = Vec::new();
        for k in 0..self.independent.len() {
            let v = tangent(&self.independent_rate(system, coordinates, k));
            let moved = |h: f64| {
                let mut q = q.clone();
                system.advance(&mut q, &v.iter().map(|v| h * v).collect::<Vec<f64>>());
                constraint(system, t, &q).map(|(_, rows)| rows * DVector::from_column_slice(&u))
            };
            let turning = (moved(DIFFERENCE)? - moved(-DIFFERENCE)?) / (2.0 * DIFFERENCE);
            let change = self.solve(&jacobian, &DMatrix::from_columns(&[turning]));
            let none = vec![0.0; self.independent.len()];
            directions.push((v, self.spread(none.into_iter(), change.iter().map(|x| -x))));
        }
        for k in 0..self.independent.len() {
            directions.push((vec![0.0; u.len()], tangent(&unit(k))));
        }
        Ok(Begun { q, u, directions })
    }

    /// Closes the loops for given independent coordinates, by Newton's method on the dependent ones from a nearby
    /// configuration.
    fn closed<Y: Mechanism<Scalar = f64>>(
        &self,
        system: &Y,
        t: f64,
        near: &[f64],
        coordinates: &[f64],
    ) -> Result<Vec<f64>, Error> {
        let mut q = near.to_vec();
        let joints = system.dimensions().joints;
        if system.dimensions().speeds > joints {
            system.advance(&mut q, &self.step(system, coordinates));
        }
        for (&joint, value) in
            self.independent.iter().zip(coordinates).filter(|(k, _)| **k < joints)
        {
            q[joint] = *value;
        }
        let mut residual = f64::INFINITY;
        for _ in 0..ITERATIONS {
            let (open, jacobian) = constraint(system, t, &q)?;
            let before = residual;
            residual = largest(&open);
            if residual == 0.0 || (residual < 1e-12 * system.size() && residual >= before) {
                break;
            }
            let step = self.solve(&jacobian, &DMatrix::from_columns(&[open]));
            for (place, &joint) in self.dependent.iter().enumerate() {
                q[joint] -= step[(place, 0)];
            }
        }
        if !self.dependent.is_empty() && !residual.le(&(1e-9 * system.size())) {
            return Err(Error::NotClosed { loop_index: 0, residual: residual as f32, joint: None });
        }
        Ok(q)
    }

    /// The steps of the free bodies, NU.
    fn step<Y: Mechanism<Scalar = f64>>(&self, system: &Y, coordinates: &[f64]) -> Vec<f64> {
        let Dimensions { joints, speeds, .. } = system.dimensions();
        let mut step = vec![0.0; speeds];
        for (&k, value) in self.independent.iter().zip(coordinates).filter(|(k, _)| **k >= joints) {
            step[k] = *value;
        }
        step
    }

    /// How the independent part of a direction along q changes with the independent coordinate at `place`.
    fn independent_rate<Y: Mechanism<Scalar = f64>>(
        &self,
        system: &Y,
        coordinates: &[f64],
        place: usize,
    ) -> DVector<f64> {
        let rate = step_rate(system, &self.step(system, coordinates), self.independent[place]);
        DVector::from_iterator(self.independent.len(), self.independent.iter().map(|&k| rate[k]))
    }

    /// J_d^+ times a matrix.
    fn solve(&self, jacobian: &DMatrix<f64>, right: &DMatrix<f64>) -> DMatrix<f64> {
        if self.dependent.is_empty() {
            return DMatrix::zeros(0, right.ncols());
        }
        let columns = jacobian.select_columns(&self.dependent);
        let svd = columns.svd(true, true);
        let cut = RANK * svd.singular_values.amax();
        svd.solve(right, cut)
            .unwrap_or_else(|_| DMatrix::zeros(self.dependent.len(), right.ncols()))
    }

    /// Independent and dependent values as one vector along u; zero where a speed is kept.
    fn spread(
        &self,
        independent: impl Iterator<Item = f64>,
        dependent: impl Iterator<Item = f64>,
    ) -> Vec<f64> {
        let mut all = vec![0.0; self.independent.len() + self.dependent.len() + self.kept.len()];
        for (&joint, value) in self.independent.iter().zip(independent) {
            all[joint] = value;
        }
        for (&joint, value) in self.dependent.iter().zip(dependent) {
            all[joint] = value;
        }
        all
    }
}

/// Residuals of closure and prescribed angles, m (these times the size), and their Jacobian.
fn constraint<Y: Mechanism<Scalar = f64>>(
    system: &Y,
    t: f64,
    q: &[f64],
) -> Result<(DVector<f64>, DMatrix<f64>), Error> {
    let (n, loops) = (system.dimensions().speeds, 9 * system.dimensions().loops);
    let (mut residual, mut rows) = (vec![0.0; loops], vec![0.0; loops * n]);
    system.write_closure(q, &mut residual, &mut rows)?;
    let size = system.size();
    system.drives(t, |Drive { joint, position, .. }| {
        residual.push(size * (q[joint] - position));
        rows.extend((0..n).map(|k| if k == joint { size } else { 0.0 }));
    });
    let jacobian = DMatrix::from_row_slice(residual.len(), n, &rows);
    Ok((DVector::from_vec(residual), jacobian))
}

/// J u of prescribed angles: zeros for the loops, speeds times the size for the drives.
fn drive_rates<Y: Mechanism<Scalar = f64>>(system: &Y, t: f64, rows: usize) -> DVector<f64> {
    let mut rates = vec![0.0; 9 * system.dimensions().loops];
    let size = system.size();
    system.drives(t, |drive| rates.push(size * drive.speed));
    rates.resize(rows, 0.0);
    DVector::from_vec(rates)
}
