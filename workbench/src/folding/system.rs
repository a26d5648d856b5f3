//! The equations of one step: a quadratic function of the angles with the loops closed to first
//! order.
//!
//! ```text
//! | H    J^T | | d |   |      -g       |
//! | J  -e 1  | | l | = | -gap - e l_0  |
//! ```
//!
//! The loops of a sheet depend on each other, so J has more rows than its rank. With e > 0 the matrix is
//! quasidefinite and has a factorisation L D L^T in every order (R. J. Vanderbei, "Symmetric
//! quasidefinite matrices", 1995), and since e multiplies the change of the multipliers l only
//! (R. T. Rockafellar's proximal method of multipliers, 1976), the loops still close to rounding
//! after a few steps. H is positive on the motions of the loops if and only if the matrix has as many
//! positive pivots as there are joints (N. I. M. Gould, 1985).

use std::collections::BTreeMap;

use clarabel::algebra::CscMatrix;
use clarabel::qdldl::{QDLDLFactorisation, QDLDLSettingsBuilder};
use lamc::arithmetic::larger;
use nalgebra::Vector6;

use super::chain::{Chain, Placed, bracket};

/// The e of the equations: of the order of the squares of the smallest singular values of J that count.
const PROXIMITY: f64 = 1e-11;

/// The equations of all loops, with the places of their entries in a sparse matrix.
pub struct Equations {
    /// The loops.
    pub chains: Vec<Chain>,
    joints: usize,
    rows: usize,
    /// The pattern of the upper triangle, by column.
    starts: Vec<usize>,
    places: Vec<usize>,
    /// Place of the diagonal entry of each joint.
    diagonal: Vec<usize>,
    /// For each loop: the places of the pairs of its hinges, and of its rows.
    of_loops: Vec<LoopPlaces>,
    factors: Option<QDLDLFactorisation<f64>>,
}

struct LoopPlaces {
    /// First row.
    row: usize,
    /// Places in H of the pairs i < k of hinges, in order.
    pairs: Vec<usize>,
    /// Places in J, hinge by hinge, row by row.
    entries: Vec<usize>,
}

/// The solution of the equations.
pub struct Step {
    /// Change of the angles, rad.
    pub q: Vec<f64>,
    /// The multipliers.
    pub multipliers: Vec<f64>,
}

impl Equations {
    /// Returns the equations of these loops for so many joints.
    pub fn new(chains: Vec<Chain>, joints: usize) -> Self {
        let rows = chains.iter().map(|chain| chain.rows).sum();
        let mut columns: Vec<BTreeMap<usize, usize>> = vec![BTreeMap::new(); joints + rows];
        for (index, column) in columns.iter_mut().enumerate() {
            column.insert(index, 0);
        }
        let mut row = joints;
        for chain in &chains {
            let around: Vec<usize> = chain.joints().collect();
            for (k, b) in around.iter().enumerate() {
                for a in &around[..k] {
                    columns[*a.max(b)].insert(*a.min(b), 0);
                }
                for column in &mut columns[row..row + chain.rows] {
                    column.insert(*b, 0);
                }
            }
            row += chain.rows;
        }
        let (mut starts, mut places) = (vec![0], Vec::new());
        for column in &mut columns {
            for (row, place) in column.iter_mut() {
                *place = places.len();
                places.push(*row);
            }
            starts.push(places.len());
        }
        let at = |a: usize, b: usize| columns[a.max(b)][&a.min(b)];
        let mut row = joints;
        let mut of_loops = Vec::new();
        for chain in &chains {
            let around: Vec<usize> = chain.joints().collect();
            let pairs = (0..around.len()).flat_map(|k| (0..k).map(move |i| (i, k)));
            let pairs = pairs.map(|(i, k)| at(around[i], around[k])).collect();
            let its_rows = row..row + chain.rows;
            let entries =
                around.iter().flat_map(|joint| its_rows.clone().map(|row| at(*joint, row)));
            of_loops.push(LoopPlaces { row: row - joints, pairs, entries: entries.collect() });
            row += chain.rows;
        }
        let diagonal = (0..joints).map(|joint| at(joint, joint)).collect();
        Self { chains, joints, rows, starts, places, diagonal, of_loops, factors: None }
    }

    /// Number of multipliers.
    pub fn rows(&self) -> usize {
        self.rows
    }

    /// Returns all loops at these angles.
    pub fn place(&self, q: &[f64]) -> Vec<Placed> {
        self.chains.iter().map(|chain| chain.place(q)).collect()
    }

    /// Writes the matrix for H = diag(weights) plus the curvature of the loops by these multipliers,
    /// and factorises it. Returns whether H is positive on the motions of the loops.
    pub fn factorise(&mut self, placed: &[Placed], weights: &[f64], multipliers: &[f64]) -> bool {
        let mut values = vec![0.0; self.places.len()];
        for (joint, place) in self.diagonal.iter().enumerate() {
            values[*place] = weights[joint];
        }
        for row in 0..self.rows {
            values[self.starts[self.joints + row + 1] - 1] = -PROXIMITY;
        }
        for ((chain, places), placed) in self.chains.iter().zip(&self.of_loops).zip(placed) {
            let multiplier = self.multiplier(chain, places, multipliers);
            let mut pairs = places.pairs.iter();
            for (k, later) in placed.twists.iter().enumerate() {
                for (earlier, place) in placed.twists[..k].iter().zip(&mut pairs) {
                    values[*place] += 0.5 * multiplier.dot(&bracket(earlier, later));
                }
            }
            let numbers = placed.twists.iter().flat_map(|twist| twist.iter().take(chain.rows));
            places.entries.iter().zip(numbers).for_each(|(place, number)| values[*place] = *number);
        }
        let factorised = match &mut self.factors {
            Some(factors) => {
                let all: Vec<usize> = (0..values.len()).collect();
                factors.update_values(&all, &values);
                factors.refactor().is_ok()
            }
            none => {
                let size = self.joints + self.rows;
                let matrix =
                    CscMatrix::new(size, size, self.starts.clone(), self.places.clone(), values);
                let settings =
                    QDLDLSettingsBuilder::default().regularize_enable(false).build().ok();
                *none = QDLDLFactorisation::new(&matrix, settings).ok();
                none.is_some()
            }
        };
        let factors = self.factors.as_ref().filter(|_| factorised);
        factors.is_some_and(|factors| factors.positive_inertia() == self.joints)
    }

    fn multiplier(&self, chain: &Chain, places: &LoopPlaces, multipliers: &[f64]) -> Vector6<f64> {
        let its = &multipliers[places.row..places.row + chain.rows];
        Vector6::from_fn(|row, _| its.get(row).copied().unwrap_or(0.0))
    }

    /// Solves the equations with the last factors for a gradient g and the loops' gaps.
    pub fn solve(
        &mut self,
        gradient: &[f64],
        gaps: &[Placed],
        multipliers: &[f64],
    ) -> Option<Step> {
        let mut right: Vec<f64> = gradient.iter().map(|g| -g).collect();
        let gaps = self
            .chains
            .iter()
            .zip(gaps)
            .flat_map(|(chain, placed)| placed.gap.iter().take(chain.rows));
        right.extend(gaps.zip(multipliers).map(|(gap, l)| -gap - PROXIMITY * l));
        self.solved(right)
    }

    /// Solves the equations with the last factors for closed loops that stay closed.
    pub fn tangent(&mut self, gradient: &[f64]) -> Option<Step> {
        let mut right: Vec<f64> = gradient.iter().map(|g| -g).collect();
        right.resize(self.joints + self.rows, 0.0);
        self.solved(right)
    }

    fn solved(&mut self, mut right: Vec<f64>) -> Option<Step> {
        self.factors.as_mut()?.solve(&mut right);
        let multipliers = right.split_off(self.joints);
        let finite = right.iter().chain(&multipliers).all(|x| x.is_finite());
        finite.then_some(Step { q: right, multipliers })
    }

    /// Returns J^T l: what the loops add to the gradient.
    pub fn pull(&self, placed: &[Placed], multipliers: &[f64]) -> Vec<f64> {
        let mut pull = vec![0.0; self.joints];
        for ((chain, places), placed) in self.chains.iter().zip(&self.of_loops).zip(placed) {
            let multiplier = self.multiplier(chain, places, multipliers);
            for (joint, twist) in chain.joints().zip(&placed.twists) {
                pull[joint] += multiplier.dot(twist);
            }
        }
        pull
    }

    /// Returns the magnitude of each loop's multipliers.
    pub fn forces(&self, multipliers: &[f64]) -> Vec<f64> {
        let each = self.chains.iter().zip(&self.of_loops);
        each.map(|(chain, places)| self.multiplier(chain, places, multipliers).norm()).collect()
    }
}

/// Returns the largest opening of a loop, over the sheet's size.
pub fn open(placed: &[Placed]) -> f64 {
    placed.iter().map(|placed| placed.open).fold(0.0, larger)
}
